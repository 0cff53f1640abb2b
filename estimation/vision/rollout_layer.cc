// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/rollout_layer.h"

#include <torch/csrc/autograd/custom_function.h>

#include <algorithm>
#include <mutex>
#include <utility>

namespace tangible {

// The state that calls share. Batches keep the memory of their tapes from call to call, because
// allocating it costs three times a forward pass of ten steps. A batch in use belongs to one graph.
struct RolloutLayer::Shared {
  RolloutFunction function;
  int threads = 0;

  std::unique_ptr<RolloutBatch> Take() {
    const std::lock_guard<std::mutex> lock(mutex);
    if (free.empty()) return std::make_unique<RolloutBatch>(function, threads);
    std::unique_ptr<RolloutBatch> batch = std::move(free.back());
    free.pop_back();
    return batch;
  }
  void Keep(std::unique_ptr<RolloutBatch> batch) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (free.size() < kMostKept) free.push_back(std::move(batch));
  }

 private:
  static constexpr size_t kMostKept = 4;  // a training step has few graphs at a time
  std::mutex mutex;
  std::vector<std::unique_ptr<RolloutBatch>> free;
};

struct RolloutAutograd : torch::autograd::Function<RolloutAutograd> {
  using SharedLayer = std::shared_ptr<RolloutLayer::Shared>;

  // A forward pass with its tapes.
  struct Recorded : torch::CustomClassHolder {
    explicit Recorded(SharedLayer layer) : shared(std::move(layer)), batch(shared->Take()) {}
    Recorded(const Recorded&) = delete;
    Recorded& operator=(const Recorded&) = delete;
    ~Recorded() override { shared->Keep(std::move(batch)); }

    SharedLayer shared;
    std::unique_ptr<RolloutBatch> batch;
    std::vector<bool> done;
  };

  // All tensors are contiguous, of doubles and with the batch's axis; `state` may have no columns.
  static at::Tensor forward(torch::autograd::AutogradContext* context, const at::Tensor& parameters,
                            const at::Tensor& state, const at::Tensor& controls,
                            const SharedLayer& shared, bool record,
                            std::vector<std::string>* messages) {
    std::vector<RolloutInput> inputs = Read(shared->function, parameters, state, controls);
    const auto rows = static_cast<int64_t>(inputs.size());
    std::vector<RolloutOutput> outputs;
    if (record) {
      auto recorded = c10::make_intrusive<Recorded>(shared);
      outputs = recorded->batch->Record(std::move(inputs));
      for (const RolloutOutput& output : outputs) {
        recorded->done.push_back(output.status == RolloutStatus::kDone);
      }
      context->saved_data["recorded"] = c10::IValue::make_capsule(std::move(recorded));
      context->saved_data["with_state"] = state.size(1) > 0;
    } else {
      outputs = RolloutBatch(shared->function, shared->threads).Run(inputs);
    }
    const RolloutFunction& function = shared->function;
    at::Tensor states =
        torch::empty({rows, function.num_records(), function.num_states()}, at::kDouble);
    for (int64_t r = 0; r < rows; ++r) {
      RolloutOutput& output = outputs[static_cast<size_t>(r)];
      std::copy_n(output.states.data(), output.states.size(),
                  states.data_ptr<double>() + r * output.states.size());
      messages->push_back(output.status == RolloutStatus::kDone ? "" : output.message);
    }
    return states;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list bars) {
    TORCH_CHECK(!at::GradMode::is_enabled(),
                "rollout: expected a backward pass without create_graph: its derivative is not "
                "available");
    const auto holder = context->saved_data["recorded"].toCapsule();
    auto* const recorded = static_cast<Recorded*>(holder.get());
    const RolloutFunction& function = recorded->shared->function;
    const at::Tensor bar = bars[0].to(at::kDouble).contiguous();
    const auto rows = static_cast<size_t>(bar.size(0));
    std::vector<RowMatrixXd> row_bars(rows);
    const auto size = static_cast<Eigen::Index>(function.num_records()) * function.num_states();
    for (size_t r = 0; r < rows; ++r) {
      row_bars[r] = Eigen::Map<const RowMatrixXd>(
          bar.data_ptr<double>() + static_cast<Eigen::Index>(r) * size, function.num_records(),
          function.num_states());
    }
    std::vector<InputDirection> found = recorded->batch->Adjoint(row_bars);
    for (size_t r = 0; r < rows; ++r) {
      if (recorded->done[r] || !row_bars[r].isZero(0.0)) continue;
      found[r].parameters.setZero();
      found[r].state.setZero();
      found[r].controls.setZero();
    }
    torch::autograd::variable_list gradients = Write(function, found);
    if (!context->saved_data["with_state"].toBool()) {
      gradients[1] = torch::empty({bar.size(0), 0}, at::kDouble);
    }
    gradients.resize(6);  // those of what is no tensor are undefined
    return gradients;
  }

 private:
  static std::vector<RolloutInput> Read(const RolloutFunction& function,
                                        const at::Tensor& parameters, const at::Tensor& state,
                                        const at::Tensor& controls) {
    std::vector<RolloutInput> inputs(static_cast<size_t>(parameters.size(0)));
    for (size_t r = 0; r < inputs.size(); ++r) {
      const auto row = static_cast<Eigen::Index>(r);
      inputs[r].parameters = Eigen::Map<const VectorX<double>>(
          parameters.data_ptr<double>() + row * parameters.size(1), parameters.size(1));
      inputs[r].state = Eigen::Map<const VectorX<double>>(
          state.data_ptr<double>() + row * state.size(1), state.size(1));
      inputs[r].controls = Eigen::Map<const RowMatrixXd>(
          controls.data_ptr<double>() + row * controls.size(1) * controls.size(2), controls.size(1),
          function.num_controls());
    }
    return inputs;
  }

  static torch::autograd::variable_list Write(const RolloutFunction& function,
                                              const std::vector<InputDirection>& values) {
    const auto rows = static_cast<int64_t>(values.size());
    const int64_t steps = function.num_controls() == 0 ? 0 : function.num_steps();
    at::Tensor parameters = torch::empty({rows, function.num_parameters()}, at::kDouble);
    at::Tensor state = torch::empty({rows, function.num_states()}, at::kDouble);
    at::Tensor controls = torch::empty({rows, steps, function.num_controls()}, at::kDouble);
    for (int64_t r = 0; r < rows; ++r) {
      const InputDirection& value = values[static_cast<size_t>(r)];
      std::copy_n(value.parameters.data(), value.parameters.size(),
                  parameters.data_ptr<double>() + r * value.parameters.size());
      std::copy_n(value.state.data(), value.state.size(),
                  state.data_ptr<double>() + r * value.state.size());
      std::copy_n(value.controls.data(), value.controls.size(),
                  controls.data_ptr<double>() + r * value.controls.size());
    }
    return {parameters, state, controls};
  }
};

namespace {

std::string ShapeText(const at::Tensor& tensor) { return c10::str(tensor.sizes()); }

// `tensor` in double precision with a row for each input of the batch.
at::Tensor Spread(const char* name, const at::Tensor& tensor, std::vector<int64_t> shape,
                  int64_t rows) {
  const auto axes = static_cast<int64_t>(shape.size());
  const bool batched = tensor.dim() == axes + 1;
  if (batched) shape.insert(shape.begin(), rows);
  TORCH_CHECK(tensor.is_floating_point(), name, ": expected floating-point numbers, got ",
              tensor.scalar_type());
  TORCH_CHECK(tensor.sizes() == at::IntArrayRef(shape), name, ": expected shape ",
              at::IntArrayRef(shape), batched ? "" : ", or one more axis for a batch", ", got ",
              ShapeText(tensor));
  if (!batched) shape.insert(shape.begin(), rows);
  return tensor.to(at::kCPU, at::kDouble).expand(shape).contiguous();
}

at::Tensor FromEigen(const double* values, const std::vector<int64_t>& shape) {
  at::Tensor tensor = torch::empty(shape, at::kDouble);
  std::copy_n(values, tensor.numel(), tensor.data_ptr<double>());
  return tensor;
}

}  // namespace

std::string RolloutLayer::Create(const Scene& scene, const RolloutLayerOptions& options) {
  auto shared = std::make_shared<Shared>();
  shared->threads = options.threads;
  std::string error =
      shared->function.Create(scene, options.parameters, options.controls, options.records);
  if (error.empty()) shared_ = std::move(shared);
  return error;
}

const RolloutFunction& RolloutLayer::function() const { return shared_->function; }

RolledOut RolloutLayer::operator()(const RolloutTensors& inputs) const {
  TORCH_CHECK(shared_ != nullptr, "rollout layer: expected a call of Create before the first one");
  const RolloutFunction& f = shared_->function;
  const int64_t steps = f.num_controls() == 0 ? 0 : f.num_steps();
  const RolloutInput own = f.Defaults();
  const at::Tensor parameters = inputs.parameters.defined()
                                    ? inputs.parameters
                                    : FromEigen(own.parameters.data(), {f.num_parameters()});
  const at::Tensor state = inputs.state.defined() ? inputs.state : torch::empty({0}, at::kDouble);
  const at::Tensor controls = inputs.controls.defined()
                                  ? inputs.controls
                                  : FromEigen(own.controls.data(), {steps, f.num_controls()});
  const bool batched = parameters.dim() == 2 || state.dim() == 2 || controls.dim() == 3;
  const int64_t rows = parameters.dim() == 2 ? parameters.size(0)
                       : state.dim() == 2    ? state.size(0)
                       : controls.dim() == 3 ? controls.size(0)
                                             : 1;
  const int64_t states = inputs.state.defined() ? f.num_states() : 0;
  const at::Tensor p = Spread("parameters", parameters, {f.num_parameters()}, rows);
  const at::Tensor x = Spread("state", state, {states}, rows);
  const at::Tensor u = Spread("controls", controls, {steps, f.num_controls()}, rows);
  const bool record =
      at::GradMode::is_enabled() && (p.requires_grad() || x.requires_grad() || u.requires_grad());
  RolledOut result;
  at::Tensor all = RolloutAutograd::apply(p, x, u, shared_, record, &result.messages);
  if (!batched) all = all[0];
  for (const at::Tensor& given : {inputs.parameters, inputs.state, inputs.controls}) {
    if (!given.defined()) continue;
    all = all.to(given.device(), given.scalar_type());
    break;
  }
  result.states = all;
  return result;
}

}  // namespace tangible
