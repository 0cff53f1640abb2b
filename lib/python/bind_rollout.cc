// SPDX-License-Identifier: Apache-2.0
//
// Rollouts as functions of arrays in double precision and C order, with a leading axis for the rows
// of a batch.
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/python/binding.h"
#include "tangible/simulation/gradient/rollout_function.h"
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace tangible::python {
namespace {

// Arrays of inputs: parameters (rows x P), states (rows x S, or none), controls (rows x steps x C).
struct Inputs {
  Array parameters;
  std::optional<Array> states;
  Array controls;
};

std::string ShapeOf(const Array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    text += (i == 0 ? "" : ", ") + std::to_string(array.shape(i));
  }
  return text + ")";
}

void ExpectShape(const char* name, const Array& array, const std::vector<py::ssize_t>& shape) {
  bool same = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (size_t i = 0; same && i < shape.size(); ++i) same = array.shape(i) == shape[i];
  if (same) return;
  std::string expected = "(";
  for (size_t i = 0; i < shape.size(); ++i) {
    expected += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  }
  throw py::value_error(std::string(name) + ": expected shape " + expected + "), got " +
                        ShapeOf(array));
}

// Memory of single runs, from call to call: to make it costs more than a short run. Results do not
// depend on it; calls from several threads have one each.
class Workers {
 public:
  std::unique_ptr<RolloutWorker> Take(const RolloutFunction& function) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (free_.empty()) return std::make_unique<RolloutWorker>(function);
    std::unique_ptr<RolloutWorker> worker = std::move(free_.back());
    free_.pop_back();
    return worker;
  }
  void Keep(std::unique_ptr<RolloutWorker> worker) {
    const std::lock_guard<std::mutex> lock(mutex_);
    free_.push_back(std::move(worker));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<RolloutWorker>> free_;
};

// Gives freed memory back to the system after a call of many rows or steps: the C library keeps
// what threads have freed, gigabytes after large batches. It takes 2 to 8 % of a
// call with its tapes.
void ReturnMemory(size_t rows, long steps) {
#ifdef __GLIBC__
  constexpr size_t kManySteps = 200'000;
  if (rows * static_cast<size_t>(steps) >= kManySteps) malloc_trim(0);
#else
  (void)rows;
  (void)steps;
#endif
}

class Rollout {
 public:
  Rollout(const Scene& scene, const std::vector<std::string>& parameters,
          const std::vector<std::string>& controls, const std::vector<long>& records) {
    const std::string error = function_.Create(scene, parameters, controls, records);
    if (!error.empty()) throw Error((scene.path.empty() ? "" : scene.path + ": ") + error);
  }

  const RolloutFunction& function() const { return function_; }

  std::vector<RolloutInput> Read(const Inputs& in, const char* prefix = "") const {
    const py::ssize_t rows = in.parameters.shape(0);
    const py::ssize_t states = function_.num_states();
    const py::ssize_t steps = function_.num_controls() == 0 ? 0 : function_.num_steps();
    const py::ssize_t controls = function_.num_controls();
    const std::string name(prefix);
    ExpectShape((name + "parameters").c_str(), in.parameters, {rows, function_.num_parameters()});
    if (in.states) ExpectShape((name + "initial_state").c_str(), *in.states, {rows, states});
    ExpectShape((name + "controls").c_str(), in.controls, {rows, steps, controls});
    std::vector<RolloutInput> inputs(static_cast<size_t>(rows));
    for (py::ssize_t r = 0; r < rows; ++r) {
      RolloutInput& input = inputs[static_cast<size_t>(r)];
      input.parameters = Eigen::Map<const VectorX<double>>(
          in.parameters.data() + r * function_.num_parameters(), function_.num_parameters());
      if (in.states) {
        input.state = Eigen::Map<const VectorX<double>>(in.states->data() + r * states, states);
      }
      input.controls =
          Eigen::Map<const RowMatrixXd>(in.controls.data() + r * steps * controls, steps, controls);
    }
    return inputs;
  }

  Inputs Write(const std::vector<RolloutInput>& values) const {
    const auto rows = static_cast<py::ssize_t>(values.size());
    const py::ssize_t steps = function_.num_controls() == 0 ? 0 : function_.num_steps();
    Inputs out{Array({rows, static_cast<py::ssize_t>(function_.num_parameters())}),
               Array({rows, static_cast<py::ssize_t>(function_.num_states())}),
               Array({rows, steps, static_cast<py::ssize_t>(function_.num_controls())})};
    for (py::ssize_t r = 0; r < rows; ++r) {
      const RolloutInput& value = values[static_cast<size_t>(r)];
      std::copy_n(value.parameters.data(), value.parameters.size(),
                  out.parameters.mutable_data() + r * value.parameters.size());
      std::copy_n(value.state.data(), value.state.size(),
                  out.states->mutable_data() + r * value.state.size());
      std::copy_n(value.controls.data(), value.controls.size(),
                  out.controls.mutable_data() + r * value.controls.size());
    }
    return out;
  }

  // A row each: states (rows x records x S).
  Array States(const std::vector<RowMatrixXd>& rows) const {
    const py::ssize_t size =
        static_cast<py::ssize_t>(function_.num_records()) * function_.num_states();
    Array array({static_cast<py::ssize_t>(rows.size()),
                 static_cast<py::ssize_t>(function_.num_records()),
                 static_cast<py::ssize_t>(function_.num_states())});
    for (size_t r = 0; r < rows.size(); ++r) {
      std::copy_n(rows[r].data(), size, array.mutable_data() + static_cast<py::ssize_t>(r) * size);
    }
    return array;
  }

  std::vector<RowMatrixXd> ReadStates(const char* name, const Array& array, size_t rows) const {
    ExpectShape(name, array,
                {static_cast<py::ssize_t>(rows), function_.num_records(), function_.num_states()});
    std::vector<RowMatrixXd> states(rows);
    const py::ssize_t size =
        static_cast<py::ssize_t>(function_.num_records()) * function_.num_states();
    for (size_t r = 0; r < rows; ++r) {
      states[r] = Eigen::Map<const RowMatrixXd>(array.data() + static_cast<py::ssize_t>(r) * size,
                                                function_.num_records(), function_.num_states());
    }
    return states;
  }

  // (states, statuses, messages)
  py::tuple Outputs(std::vector<RolloutOutput> outputs) const {
    std::vector<RowMatrixXd> states;
    py::list statuses;
    py::list messages;
    for (RolloutOutput& output : outputs) {
      states.push_back(std::move(output.states));
      statuses.append(NameOf(output.status));
      messages.append(output.message);
    }
    return py::make_tuple(States(states), statuses, messages);
  }

  py::tuple Run(const Inputs& in, int threads) const {
    const std::vector<RolloutInput> inputs = Read(in);
    py::tuple outputs = Outputs(WithoutLock([&] {
      if (inputs.size() == 1) {
        std::unique_ptr<RolloutWorker> worker = workers_.Take(function_);
        std::vector<RolloutOutput> outputs;
        outputs.push_back(worker->Run(inputs[0]));
        workers_.Keep(std::move(worker));
        return outputs;
      }
      RolloutBatch batch(function_, threads);
      return batch.Run(inputs);
    }));
    ReturnMemory(inputs.size(), function_.num_steps());
    return outputs;
  }

  py::tuple Tangent(const Inputs& in, const Inputs& direction, int threads) const {
    const std::vector<RolloutInput> inputs = Read(in);
    const std::vector<InputDirection> directions = Read(direction, "tangent of ");
    std::vector<RowMatrixXd> tangents;
    py::tuple outputs = Outputs(WithoutLock([&] {
      RolloutBatch batch(function_, threads);
      return batch.Tangent(inputs, directions, &tangents);
    }));
    return py::make_tuple(outputs[0], outputs[1], outputs[2], States(tangents));
  }

  // Of one input: (states, status, message, method, jacobian with all columns).
  py::tuple Jacobian(const Inputs& in, const std::string& method) const {
    const std::vector<RolloutInput> inputs = Read(in);
    GradientMethod wanted = GradientMethod::kAuto;
    if (!FindMethod(method, &wanted)) {
      throw py::value_error(
          "method: expected auto, adjoint, tangent, jet, jet_implicit or "
          "finite_difference, got " +
          method);
    }
    RowMatrixXd jacobian;
    GradientMethod used = GradientMethod::kAuto;
    const RolloutOutput output = WithoutLock([&] {
      RolloutWorker worker(function_);
      return worker.Jacobian(inputs.at(0), wanted, RolloutWorker::Inputs::kAll, &jacobian, &used);
    });
    return py::make_tuple(
        ToArray(output.states, {function_.num_records(), function_.num_states()}),
        NameOf(output.status), output.message, NameOf(used),
        ToArray(jacobian, {function_.num_records(), function_.num_states(), jacobian.cols()}));
  }

  // A row each, as JSON.
  std::vector<std::string> Certify(const Inputs& in, int threads) const {
    const std::vector<RolloutInput> inputs = Read(in);
    const std::vector<Certificate> certificates =
        WithoutLock([&] { return RolloutBatch(function_, threads).Certify(inputs); });
    std::vector<std::string> texts;
    texts.reserve(certificates.size());
    for (const Certificate& certificate : certificates) {
      texts.push_back(ToJson(certificate).dump());
    }
    return texts;
  }

  // The radius and the growth of a certificate of one input, as JSON.
  std::string Radii(const Inputs& in) const {
    const std::vector<RolloutInput> inputs = Read(in);
    Certificate certificate;
    WithoutLock([&] {
      RolloutWorker worker(function_);
      certificate.radius = worker.Radii(inputs.at(0));
      certificate.growth = worker.Growth(inputs.at(0));
      return 0;
    });
    return ToJson(certificate).dump();
  }

 private:
  RolloutFunction function_;
  mutable Workers workers_;
};

// A forward pass with its tapes; the tapes belong to it, and so to the call that made it.
class Recorded {
 public:
  Recorded(const std::shared_ptr<Rollout>& rollout, const Inputs& in, int threads)
      : rollout_(rollout) {
    std::vector<RolloutInput> inputs = rollout->Read(in);
    rows_ = inputs.size();
    batch_ = std::make_unique<RolloutBatch>(rollout->function(), threads);
    outputs_ = rollout->Outputs(WithoutLock([&] { return batch_->Record(std::move(inputs)); }));
  }

  Recorded(const Recorded&) = delete;
  Recorded& operator=(const Recorded&) = delete;
  ~Recorded() {
    batch_.reset();
    ReturnMemory(rows_, rollout_->function().num_steps());
  }

  const py::tuple& outputs() const { return outputs_; }

  // The sweeps of several calls would share the tapes' memory.
  py::tuple Adjoint(const Array& bars) {
    const std::vector<RowMatrixXd> rows = rollout_->ReadStates("cotangent", bars, rows_);
    const std::vector<InputDirection> adjoints =
        WithoutLock([&] { return turns_.Take([&] { return batch_->Adjoint(rows); }); });
    const Inputs out = rollout_->Write(adjoints);
    return py::make_tuple(out.parameters, *out.states, out.controls);
  }

 private:
  std::shared_ptr<Rollout> rollout_;
  std::unique_ptr<RolloutBatch> batch_;
  Turns turns_;
  size_t rows_ = 0;
  py::tuple outputs_;
};

}  // namespace

void BindRollout(py::module_* module) {
  const auto paths = [](const std::vector<ParameterPath>& parameters) {
    std::vector<std::string> names;
    names.reserve(parameters.size());
    for (const ParameterPath& parameter : parameters) names.push_back(parameter.path);
    return names;
  };
  py::class_<Rollout, std::shared_ptr<Rollout>>(*module, "Rollout")
      .def(py::init<const Scene&, const std::vector<std::string>&, const std::vector<std::string>&,
                    const std::vector<long>&>())
      .def_property_readonly("num_states",
                             [](const Rollout& r) { return r.function().num_states(); })
      .def_property_readonly("num_steps", [](const Rollout& r) { return r.function().num_steps(); })
      .def_property_readonly("outputs",
                             [](const Rollout& r) { return OutputNames(r.function().structure()); })
      .def_property_readonly("parameters",
                             [paths](const Rollout& r) { return paths(r.function().parameters()); })
      .def_property_readonly("controls",
                             [paths](const Rollout& r) { return paths(r.function().controls()); })
      .def_property_readonly("records", [](const Rollout& r) { return r.function().records(); })
      .def_property_readonly("times", [](const Rollout& r) { return r.function().record_times(); })
      .def(py::pickle(
          [paths](const Rollout& r) {
            const RolloutFunction& f = r.function();
            return py::make_tuple(py::cast(f.scene()), paths(f.parameters()), paths(f.controls()),
                                  f.records());
          },
          [](const py::tuple& state) {
            return std::make_shared<Rollout>(
                state[0].cast<const Scene&>(), state[1].cast<std::vector<std::string>>(),
                state[2].cast<std::vector<std::string>>(), state[3].cast<std::vector<long>>());
          }))
      .def("defaults",
           [](const Rollout& r) {
             const Inputs in = r.Write({r.function().Defaults()});
             return py::make_tuple(in.parameters, *in.states, in.controls);
           })
      .def("run",
           [](const Rollout& r, const Array& p, const std::optional<Array>& x, const Array& u,
              int threads) {
             return r.Run({p, x, u}, threads);
           })
      .def("tangent",
           [](const Rollout& r, const Array& p, const std::optional<Array>& x, const Array& u,
              const Array& p_dot, const Array& x_dot, const Array& u_dot, int threads) {
             return r.Tangent({p, x, u}, {p_dot, x_dot, u_dot}, threads);
           })
      .def("jacobian",
           [](const Rollout& r, const Array& p, const std::optional<Array>& x, const Array& u,
              const std::string& method) {
             return r.Jacobian({p, x, u}, method);
           })
      .def("radii",
           [](const Rollout& r, const Array& p, const std::optional<Array>& x, const Array& u) {
             return r.Radii({p, x, u});
           })
      .def("certify", [](const Rollout& r, const Array& p, const std::optional<Array>& x,
                         const Array& u, int threads) {
        return r.Certify({p, x, u}, threads);
      });
  py::class_<Recorded>(*module, "Recorded")
      .def(py::init([](const std::shared_ptr<Rollout>& r, const Array& p,
                       const std::optional<Array>& x, const Array& u, int threads) {
        return std::make_unique<Recorded>(r, Inputs{p, x, u}, threads);
      }))
      .def_property_readonly("outputs", &Recorded::outputs)
      .def("adjoint", &Recorded::Adjoint);
}

}  // namespace tangible::python
