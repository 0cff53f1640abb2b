// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/state_window.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/results/held_out.h"
#include "tangible/estimation/results/tolerances.h"
#include "tangible/estimation/uncertainty/residual_quality.h"
#include "tangible/math/decompositions.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

// Parts of T: up to where the state is fitted, and the windows.
constexpr double kCuts[] = {0.5, 0.75};
constexpr int kMostHalvings = 6;
// Recordings that are asked, and observations that each number of a state needs.
constexpr size_t kMostAsked = 8;
constexpr size_t kLeastRows = 5;
// What counts where a window's state cannot be fitted, or not be followed: ten times the error.
constexpr double kFailed = 2.302585092994046;

bool IsConstant(const BasicBody<double>& body) {
  const bool moves_by_itself =
      body.motion == Motion::kKinematic &&
      (body.velocity[0] != 0.0 || body.velocity[1] != 0.0 || body.angular_velocity != 0.0);
  return !body.driven && !moves_by_itself;
}

bool IsConstant(const BasicForce<double>& force) {
  bool constant = !force.start && !force.end && !force.force_signal && !force.torque_signal;
  for (const auto& servo : force.force_servos) {
    constant = constant && !(servo && servo->target_signal);
  }
  return constant && !(force.torque_servo && force.torque_servo->target_signal);
}

bool IsConstant(const BasicJoint<double>& joint) {
  return !joint.effort_signal && !joint.until &&
         !(joint.effort_servo && joint.effort_servo->target_signal);
}

/// Whether a run is the same whenever it begins.
bool IsConstant(const Scene& scene) {
  const auto all = [](const auto& list) {
    return std::all_of(list.begin(), list.end(), [](const auto& one) { return IsConstant(one); });
  };
  return all(scene.bodies) && all(scene.forces) && all(scene.joints) &&
         scene.simulation.step_times.empty();
}

/// The numbers of a pose and a twist that joints leave, if none of them repeats another.
int FreedomOf(const ModelStructure& structure) {
  int freedom = 3 * static_cast<int>(structure.moving.size());
  for (const JointIndex& joint : structure.joints) {
    switch (joint.type) {
      case JointType::kRevolute:
      case JointType::kPrismatic:
        freedom -= 2;
        break;
      case JointType::kWeld:
        freedom -= 3;
        break;
      case JointType::kDistance:
      case JointType::kFixedAngle:
      case JointType::kCoupling:
        freedom -= 1;
        break;
      case JointType::kRope:
      case JointType::kLimitedCoupling:
        break;
    }
  }
  return 2 * freedom;
}

/// Whether the parameters of the start make every motion.
bool AreAll(const HeldOutRun& run) {
  const ParameterizedScene& scene = run.first_part->scene();
  const ModelStructure& structure = *scene.model().structure;
  const RowMatrixXd derivatives = scene.VariableDerivatives();
  const std::vector<int> variables = OutputVariables(structure);
  Eigen::MatrixXd start(static_cast<Eigen::Index>(variables.size()),
                        static_cast<Eigen::Index>(run.fitted.size()));
  for (Eigen::Index i = 0; i < start.rows(); ++i) {
    for (Eigen::Index k = 0; k < start.cols(); ++k) {
      start(i, k) = derivatives(variables[static_cast<size_t>(i)], run.fitted[k]);
    }
  }
  OrthogonalDecomposition factor;
  factor.SetThreshold(kStateRank);
  factor.Compute(start);
  return factor.rank() == FreedomOf(structure);
}

/// Whether another pose at the start would be another machine: anchors are points of the world at
/// the start, which coordinates of joints take along and poses of bodies do not.
bool MovesAnchors(const FitProblem& problem, const HeldOutRun& run) {
  if (!problem.scene.springs.empty()) return true;
  return !problem.scene.joints.empty() &&
         std::any_of(run.fitted.begin(), run.fitted.end(), [&](int k) {
           const std::vector<ParameterSet>& sets = problem.parameters[static_cast<size_t>(k)].sets;
           return std::any_of(sets.begin(), sets.end(), [](const ParameterSet& set) {
             return set.path.rfind("bodies/", 0) == 0;
           });
         });
}

bool DoesNotFit(const HeldOutRun& run) {
  if (run.residuals.size() == 0) return true;
  BlockEvaluation evaluation;
  evaluation.residuals = run.residuals;
  return JudgeResiduals(*run.first_part, {evaluation}, static_cast<int>(run.fitted.size()))
      .DoesNotFit();
}

/// The recording as if it ended at T, and its first part at `cut`.
HeldOutRecording CutAt(const HeldOutRecording& recording, double cut) {
  HeldOutRecording early = recording;
  early.state_from = cut;
  early.later = TakeLater(cut, &early.recording.problem.observations);
  return early;
}

/// ln of the errors of one recording and cut, by window; the first is that of all observations.
/// Empty: there are too few observations, or they say nothing.
std::vector<double> ErrorsOf(const FitInput& input, const RecordingsProblem& problem,
                             const Eigen::VectorXd& estimate, const HeldOutRecording& early,
                             const std::vector<double>& windows, size_t least) {
  std::vector<double> errors;
  if (early.later.empty()) return errors;
  FitOptions options = input.options();
  options.threads = 1;  // others are asked at the same time
  options.starts = 1;
  options.approach = FitApproach::kPlain;
  for (const double seconds : windows) {
    const LateStart late = BeginLate(early.recording.problem, early.state_from, seconds);
    if (late.problem.observations.size() < least) return {};
    const HeldOutRun run = PredictOne(input, options, problem, estimate, early, seconds);
    const double error = run.later.score.all.rms_in_sigma;
    const bool done = run.status == FitStatus::kConverged && error > 0.0 && std::isfinite(error);
    if (!done && errors.empty()) return {};
    errors.push_back(done ? std::log(error) : errors.front() + kFailed);
  }
  return errors;
}

}  // namespace

LateStart BeginLate(const FitProblem& problem, double from, double seconds) {
  LateStart late{0.0, problem, {}};
  if (seconds == 0.0) return late;
  std::vector<Observation>& kept = late.problem.observations;
  kept.clear();
  double begins = HUGE_VAL;
  for (const Observation& one : problem.observations) {
    const bool within = one.time >= from - seconds * (1.0 + kEdgeRounding);
    (within ? kept : late.before).push_back(one);
    if (within) begins = std::min(begins, one.time);
  }
  if (kept.empty()) return late;
  late.begins = begins;
  for (Observation& one : kept) one.time -= begins;
  return late;
}

bool MayBeginLate(const HeldOutRecording& recording, const HeldOutRun& run) {
  const FitProblem& one = recording.recording.problem;
  const auto counts = [](const Observation& o) { return o.event >= 0; };
  const bool events = std::any_of(one.observations.begin(), one.observations.end(), counts) ||
                      std::any_of(recording.later.begin(), recording.later.end(), counts);
  return one.process_noise.empty() && one.instruments.clocks.empty() && !events &&
         !run.fitted.empty() && run.first_part && run.parameters.size() > 0 &&
         IsConstant(one.scene) && !MovesAnchors(one, run) && AreAll(run);
}

StateWindow ChooseStateWindow(const FitInput& input, const RecordingsProblem& problem,
                              const Eigen::VectorXd& estimate,
                              const std::vector<HeldOutRecording>& recordings,
                              const std::vector<HeldOutRun>& runs) {
  StateWindow window;
  std::vector<size_t> able;
  bool fits = true;
  double longest = 0.0;
  for (size_t i = 0; i < recordings.size(); ++i) {
    if (!MayBeginLate(recordings[i], runs[i])) continue;
    able.push_back(i);
    longest = std::max(longest, recordings[i].state_from);
    fits = fits && !DoesNotFit(runs[i]);
  }
  if (fits || able.empty()) return window;
  // As many as are asked, from all over the list.
  const size_t asked = std::min(able.size(), kMostAsked);
  std::vector<double> windows = {0.0};
  for (int k = 2; k <= kMostHalvings; ++k) windows.push_back(std::ldexp(longest, -k));
  std::vector<std::vector<double>> errors(asked * std::size(kCuts));
  const auto ask = [&](int k) {
    const size_t i = able[static_cast<size_t>(k) / std::size(kCuts) * able.size() / asked];
    const double cut = kCuts[static_cast<size_t>(k) % std::size(kCuts)] * recordings[i].state_from;
    errors[static_cast<size_t>(k)] = ErrorsOf(input, problem, estimate, CutAt(recordings[i], cut),
                                              windows, kLeastRows * runs[i].fitted.size());
  };
  // A window that some recording has too few observations for is none.
  for (; windows.size() > 1; windows.pop_back()) {
    const bool all = std::all_of(able.begin(), able.end(), [&](size_t i) {
      const LateStart late =
          BeginLate(CutAt(recordings[i], kCuts[0] * recordings[i].state_from).recording.problem,
                    kCuts[0] * recordings[i].state_from, windows.back());
      return late.problem.observations.size() >= kLeastRows * runs[i].fitted.size();
    });
    if (all) break;
  }
  ForEachOnThreads(input.options().threads, static_cast<int>(errors.size()), ask);
  std::erase_if(errors, [&](const auto& one) { return one.size() != windows.size(); });
  const auto count = static_cast<double>(errors.size());
  if (windows.size() < 2 || errors.size() < 2) return window;
  double best = 0.0;
  for (size_t k = 0; k < windows.size(); ++k) {
    double sum = 0.0;
    double gain = 0.0;
    double squares = 0.0;
    for (const std::vector<double>& one : errors) {
      sum += one[k];
      gain += one[0] - one[k];
      squares += (one[0] - one[k]) * (one[0] - one[k]);
    }
    gain /= count;
    const double spread = std::sqrt(std::max(0.0, squares / count - gain * gain) / (count - 1.0));
    window.tried.push_back({windows[k], std::exp(sum / count)});
    if (gain > std::max(best, spread)) {
      best = gain;
      window.seconds = windows[k];
    }
  }
  return window;
}

}  // namespace tangible
