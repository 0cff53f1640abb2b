// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/motion_check.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "tangible/simulation/gradient/compare_motion.h"

namespace tangible {
namespace {

// Of one block; false with a message.
bool Differentiate(const BlockLayout& layout, int block, const Eigen::VectorXd& p,
                   GradientMethod method, RecordingsProblem* problem, BlockEvaluation* evaluation,
                   std::string* message) {
  if (problem->EvaluateBlock(block, layout.Local(block, p), method, BlockDerivatives::kCompute,
                             evaluation)) {
    return true;
  }
  *message = problem->BlockName(block) + evaluation->message;
  return false;
}

}  // namespace

bool HasFixedSteps(const FitInput& input) {
  return std::any_of(input.recordings.begin(), input.recordings.end(),
                     [](const RecordingInput& recording) {
                       return recording.problem.scene.simulation.stepping == Stepping::kFixed;
                     });
}

MotionCheck CheckMotion(const FitInput& input, const Eigen::VectorXd& estimate,
                        RecordingsProblem* problem) {
  MotionCheck check;
  FitInput by_events = input;
  for (RecordingInput& recording : by_events.recordings) {
    Scene& scene = recording.problem.scene;
    if (scene.simulation.stepping == Stepping::kFixed) scene = ByEvents(scene);
  }
  ParameterError error;
  int fault = 0;
  const std::unique_ptr<RecordingsProblem> motion = MakeProblem(by_events, &error, &fault);
  if (motion == nullptr) {
    check.message = error.what;
    return check;
  }
  const BlockLayout layout(*problem);
  const GradientMethod method = input.options().derivatives;
  Eigen::VectorXd apart = Eigen::VectorXd::Zero(layout.num_parameters());
  Eigen::VectorXd of_map = apart, of_motion = apart;
  for (int b = 0; b < layout.num_blocks(); ++b) {
    BlockEvaluation one, other;
    if (!Differentiate(layout, b, estimate, method, problem, &one, &check.message) ||
        !Differentiate(layout, b, estimate, method, motion.get(), &other, &check.message)) {
      return check;
    }
    const double weight = problem->weight(b);
    for (int k = 0; k < layout.num_local(b); ++k) {
      const int i = layout.ParameterOf(b, k);
      apart[i] += weight * (one.jacobian.col(k) - other.jacobian.col(k)).squaredNorm();
      of_map[i] += weight * one.jacobian.col(k).squaredNorm();
      of_motion[i] += weight * other.jacobian.col(k).squaredNorm();
    }
  }
  const Eigen::ArrayXd size = of_map.cwiseMax(of_motion).array();
  check.difference = (size > 0.0).select((apart.array() / size).sqrt(), 0.0);
  const std::optional<Certificate> certificate = motion->Certify(estimate);
  if (certificate) check.verdict = certificate->verdict;
  return check;
}

}  // namespace tangible
