// SPDX-License-Identifier: Apache-2.0
//
// Simulations that go on a step at a time, as many as there are rows: each row has its own
// parameters, state and stepper, and the steps are those of a long run, bit for bit.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/python/binding.h"
#include "tangible/scene/set_parameters.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible::python {
namespace {

// Steps of a run without an end. A double still tells the times of such steps apart.
constexpr double kEndlessSteps = 5e8;

class Simulation {
 public:
  Simulation(const Scene& scene, const std::vector<std::string>& parameters,
             const std::vector<std::string>& controls, py::ssize_t rows, int threads)
      : scene_(scene),
        threads_(NumThreads(threads)),
        pool_(std::make_unique<WorkerPool>(threads_)),
        rows_(static_cast<size_t>(rows)) {
    SimulationSettings& settings = scene_.simulation;
    settings.duration = std::max(settings.duration, settings.dt * kEndlessSteps);
    // Of one record: the endless run must not be counted step by step.
    const std::string error = function_.Create(scene_, parameters, controls, {0});
    if (!error.empty()) throw Error((scene.path.empty() ? "" : scene.path + ": ") + error);
    structure_ = BuildStructure(scene_);
  }

  ~Simulation() {
    if (getpid() != process_) static_cast<void>(pool_.release());
  }
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const RolloutFunction& function() const { return function_; }

  // Starts rows anew: `parameters` (rows x P), and `states` (rows x S), or none for the scene's
  // own. Returns what is wrong for each row, or empty.
  std::vector<std::string> Reset(const std::vector<int>& rows, const Array& parameters,
                                 const std::optional<Array>& states) {
    const auto count = static_cast<py::ssize_t>(rows.size());
    Expect("parameters", parameters, count, function_.num_parameters());
    if (states) Expect("state", *states, count, function_.num_states());
    std::vector<std::string> messages(rows.size());
    const double* const p = parameters.data();
    const double* const x = states ? states->data() : nullptr;
    WithoutLock([&] {
      return turns_.Take([&] {
        ForEach(rows.size(), [&](size_t i) {
          messages[i] =
              ResetRow(&rows_.at(static_cast<size_t>(rows[i])), p + i * function_.num_parameters(),
                       x == nullptr ? nullptr : x + i * function_.num_states());
        });
        return 0;
      });
    });
    return messages;
  }

  // Each row goes on for `steps` steps with its controls (rows x C) held. Returns what is wrong.
  std::vector<std::string> Step(const Array& controls, long steps) {
    Expect("action", controls, static_cast<py::ssize_t>(rows_.size()), function_.num_controls());
    std::vector<std::string> messages(rows_.size());
    const double* const u = controls.data();
    WithoutLock([&] {
      return turns_.Take([&] {
        ForEach(rows_.size(), [&](size_t i) {
          messages[i] = StepRow(&rows_[i], u + i * function_.num_controls(), steps);
        });
        return 0;
      });
    });
    return messages;
  }

  // The states of all rows (rows x S); NaN where a row has not been started or has failed.
  Array States() {
    return Alone([&] { return StatesNow(); });
  }
  // Of each row the contacts that carried an impulse in its last step: both bodies, and the normal
  // impulse (N s).
  std::vector<std::vector<std::tuple<int, int, double>>> Touches() {
    return Alone([&] { return TouchesNow(); });
  }
  std::vector<long> StepsDone() {
    return Alone([&] {
      std::vector<long> steps;
      for (const Row& row : rows_) steps.push_back(row.steps);
      return steps;
    });
  }

 private:
  // While no other thread steps or resets.
  template <typename Read>
  auto Alone(const Read& read) -> decltype(read()) {
    py::gil_scoped_release unlocked;
    return turns_.Take([&] {
      py::gil_scoped_acquire locked;
      return read();
    });
  }

  Array StatesNow() const {
    const py::ssize_t size = function_.num_states();
    Array array({static_cast<py::ssize_t>(rows_.size()), size});
    for (size_t i = 0; i < rows_.size(); ++i) {
      double* const out = array.mutable_data() + static_cast<py::ssize_t>(i) * size;
      if (rows_[i].stepper == nullptr || rows_[i].failed) {
        std::fill_n(out, size, std::nan(""));
      } else {
        const VectorX<double> state = function_.StateOf(rows_[i].state);
        std::copy_n(state.data(), size, out);
      }
    }
    return array;
  }

  std::vector<std::vector<std::tuple<int, int, double>>> TouchesNow() const {
    std::vector<std::vector<std::tuple<int, int, double>>> touches(rows_.size());
    for (size_t i = 0; i < rows_.size(); ++i) {
      if (rows_[i].stepper == nullptr || rows_[i].failed || rows_[i].steps == 0) continue;
      const StepRecord& record = rows_[i].stepper->record();
      for (size_t c = 0; c < record.contacts.size(); ++c) {
        const double impulse = record.solution.normal_impulse[c];
        const ActiveContact& contact = record.contacts[c];
        if (contact.IsOfShapes() && impulse > 0.0)
          touches[i].emplace_back(contact.a, contact.b, impulse);
      }
    }
    return touches;
  }

  struct Row {
    Model<double> model;
    State<double> state;
    std::unique_ptr<Stepper> stepper;
    std::vector<double> controls;  ///< the scene's own, of each number of a control
    long steps = 0;
    bool failed = false;
  };

  static void Expect(const char* name, const Array& array, py::ssize_t rows, py::ssize_t columns) {
    if (array.ndim() == 2 && array.shape(0) == rows && array.shape(1) == columns) return;
    throw py::value_error(std::string(name) + ": expected shape (" + std::to_string(rows) + ", " +
                          std::to_string(columns) + ")");
  }

  void ForEach(size_t count, const std::function<void(size_t)>& work) {
    // A process that has been forked off has no threads of its parent's, nor can it end them.
    if (getpid() != process_) {
      process_ = getpid();
      static_cast<void>(pool_.release());
      pool_ = std::make_unique<WorkerPool>(threads_);
    }
    pool_->Run(count, count < 2 ? 1 : pool_->threads(), [&](size_t i, int) { work(i); });
  }

  std::string ResetRow(Row* row, const double* parameters, const double* state) const {
    Scene scene = scene_;
    if (function_.num_parameters() > 0) {
      const Eigen::Map<const VectorX<double>> values(parameters, function_.num_parameters());
      std::string error = function_.SetOn(values, &scene);
      if (!error.empty()) {
        row->failed = true;
        return error;
      }
    }
    State<double> own;
    BuildModelWithStructure(scene, structure_, &row->model, &own);
    row->state = own;
    row->controls.clear();
    for (const int number : function_.control_numbers()) {
      row->controls.push_back(row->model.parameters[static_cast<size_t>(number)]);
    }
    row->steps = 0;
    row->failed = false;
    if (state != nullptr) {
      const VectorX<double> values =
          Eigen::Map<const VectorX<double>>(state, function_.num_states());
      if (!values.allFinite()) {
        row->failed = true;
        return "state: expected finite numbers";
      }
      function_.SetState(values, &row->state);
    }
    row->stepper = std::make_unique<Stepper>(row->model);
    return "";
  }

  std::string StepRow(Row* row, const double* controls, long steps) const {
    if (row->stepper == nullptr || row->failed) return "expected a reset before a step";
    const std::vector<int>& numbers = function_.control_numbers();
    for (size_t j = 0; j < numbers.size(); ++j) {
      const int control = function_.control_of_number()[j];
      const bool is_left = std::isnan(controls[control]) && function_.LeavesControl(control);
      const double value = is_left ? row->controls[j] : controls[control];
      if (!std::isfinite(value)) {
        row->failed = true;
        return "action: expected finite numbers";
      }
      row->model.parameters[static_cast<size_t>(numbers[j])] = value;
    }
    const SimulationSettings& settings = scene_.simulation;
    for (long i = 0; i < steps; ++i) {
      const double t = StepTime(settings, row->steps);
      const StepReport report =
          row->stepper->Step(row->model, t, StepLength(settings, row->steps), &row->state);
      if (report.status != StepStatus::kDone) {
        row->failed = true;
        return FailureMessage(report, t, row->steps);
      }
      ++row->steps;
    }
    return "";
  }

  Scene scene_;
  RolloutFunction function_;
  std::shared_ptr<const ModelStructure> structure_;
  int threads_;
  pid_t process_ = getpid();
  std::unique_ptr<WorkerPool> pool_;
  Turns turns_;
  std::vector<Row> rows_;
};

}  // namespace

void BindSimulation(py::module_* module) {
  py::class_<Simulation>(*module, "Simulation")
      .def(py::init<const Scene&, const std::vector<std::string>&, const std::vector<std::string>&,
                    py::ssize_t, int>())
      .def_property_readonly(
          "outputs", [](const Simulation& s) { return OutputNames(s.function().structure()); })
      .def("reset", &Simulation::Reset)
      .def("step", &Simulation::Step)
      .def("states", &Simulation::States)
      .def("touches", &Simulation::Touches)
      .def("steps_done", &Simulation::StepsDone);
}

}  // namespace tangible::python
