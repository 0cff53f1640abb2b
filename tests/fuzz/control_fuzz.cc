// SPDX-License-Identifier: Apache-2.0
// Any bytes as a control problem beside the data folder's scenes: refused with one line, or planned
// in a few iterations over a few steps, and followed over a receding horizon. A plan that is not
// said to have failed has finite numbers.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "expect.h"
#include "run_scene.h"
#include "tangible/app/control_problem.h"
#include "tangible/control/model_predictive.h"

namespace {

using tangible::testing::Expect;
using tangible::testing::ExpectOneLine;

using tangible::ControlFile;
using tangible::IlqrStatus;

constexpr int kSteps = 4;
constexpr int kIterations = 2;

void Shorten(ControlFile* file) {
  tangible::SimulationSettings& settings = file->scene.simulation;
  settings.duration = std::min(settings.duration, kSteps * settings.dt);
  settings.max_events_per_step = std::min(settings.max_events_per_step, 5);
  file->options.max_iterations = std::min(file->options.max_iterations, kIterations);
  file->options.surrogate.samples = std::min(file->options.surrogate.samples, 4);
  file->starts.count = std::min(file->starts.count, 2);
  file->sampling.samples = std::min(file->sampling.samples, 4);
  file->sampling.iterations = std::min(file->sampling.iterations, 2);
}

void Plan(const ControlFile& file) {
  tangible::RolloutFunction function;
  const std::string error = function.Create(file.scene, {}, file.paths, {});
  if (!error.empty()) return ExpectOneLine(error);
  tangible::EngineStep map(function);
  const double dt = file.scene.simulation.dt;
  const tangible::Cost cost(map.num_states(), map.num_controls(), dt, file.terms);
  const tangible::ControlProblem problem{&map, &cost, map.initial(), file.low, file.high, 0};
  const tangible::RowMatrixXd start = file.InitialControls(function.num_steps());
  const tangible::SearchOptions search{file.starts, file.sampling, file.options, 1};
  const tangible::IlqrResult result =
      SearchPlan({&function, &cost, file.low, file.high}, start, search).best;
  if (result.status == IlqrStatus::kFailed) {
    ExpectOneLine(result.message);
  } else {
    Expect(std::isfinite(result.plan.cost) && result.plan.controls.allFinite() &&
               result.plan.states.allFinite(),
           "finite numbers of a plan", result.message);
  }
  tangible::PredictiveController controller(problem, start.topRows(std::min(2L, start.rows())),
                                            {file.options, 0.0});
  tangible::VectorX<double> x = map.initial(), next;
  for (long k = 0; k < 2; ++k) {
    const tangible::VectorX<double> u = controller.Control(k, x);
    std::string why;
    if (controller.last().status != IlqrStatus::kFailed) {
      Expect(u.allFinite(), "finite controls", controller.last().message);
    }
    if (!map.Step(k, x, u, &next, &why)) return ExpectOneLine(why);
    x = next;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string name = TANGIBLE_SOURCE_DIR "/data/control/fuzzed.json";
  ControlFile file;
  std::string error;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (!tangible::ParseControlFile(text, name, &file, &error)) {
    ExpectOneLine(error);
    return 0;
  }
  constexpr std::size_t kMostTerms = 64;
  if (!tangible::testing::FitToRun(file.scene) || file.terms.size() > kMostTerms) return 0;
  Shorten(&file);
  Plan(file);
  return 0;
}
