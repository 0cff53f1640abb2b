// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/held_out.h"

#include <cmath>
#include <deque>
#include <memory>
#include <utility>

#include "tangible/estimation/fit/observed_state.h"
#include "tangible/estimation/fit/profile.h"
#include "tangible/estimation/fit/variance_components.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

/// The problem of one recording in which only some parameters are free.
class StateFit {
 public:
  /// `values`: of all parameters; `free`: which of them are to be found.
  StateFit(RolloutResiduals&& residuals, const Eigen::VectorXd& values,
           const std::vector<bool>& free)
      : run_(std::move(residuals)), with_priors_(&run_, {}) {
    top_ = &with_priors_;
    // From the last on, so that the indices of those before stay the same.
    for (size_t k = free.size(); k-- > 0;) {
      if (free[k]) continue;
      top_ = &held_.emplace_back(static_cast<int>(k), values[static_cast<Eigen::Index>(k)], top_);
    }
  }
  StateFit(const StateFit&) = delete;
  StateFit& operator=(const StateFit&) = delete;

  LeastSquaresProblem* problem() { return top_; }
  RecordingsProblem* run() { return &run_; }
  RolloutResiduals* residuals() { return run_.run(0); }

  Eigen::VectorXd All(Eigen::VectorXd found) const {
    for (auto held = held_.rbegin(); held != held_.rend(); ++held) found = held->All(found);
    return found;
  }

 private:
  RecordingsProblem run_;
  ProblemWithPriors with_priors_;
  std::deque<ProblemWithHeld> held_;  // each is the problem of the next
  LeastSquaresProblem* top_;
};

/// The options of a start's fit: what is certified, profiled and tested are the parameters of all.
FitOptions OptionsOfStart(FitOptions options) {
  if (options.approach == FitApproach::kSegments) options.approach = FitApproach::kAuto;
  options.segments = 1;
  options.certificate = CertificatePass::kSkip;
  options.held_test = HeldTest::kSkip;
  options.profile_pass = ProfilePass::kSkip;
  options.profiles.clear();
  return options;
}

/// The values of a recording's parameters before its start is fitted.
Eigen::VectorXd KnownValues(const std::vector<ParameterEntry>& entries,
                            const RecordingsProblem& problem, const Eigen::VectorXd& estimate) {
  Eigen::VectorXd values = InitialOf(entries);
  for (int k = 0; k < problem.num_shared(); ++k) {
    values[problem.IndexInRecording(k)] = estimate[k];
  }
  return values;
}

/// Fits the start; false with a message in `run` where there is none.
bool FitTheStart(const FitOptions& options, bool from_observations, const std::vector<bool>& free,
                 HeldOutRun* run) {
  if (from_observations) {
    run->first_part->SetInitial(run->parameters);
    run->parameters = ParametersFromObservations(*run->first_part, free);
  }
  run->first_part->SetInitial(run->parameters);
  StateFit state(std::move(*run->first_part), run->parameters, free);
  const FitOptions how = OptionsFor(OptionsOfStart(options), *state.run());
  const FitResult result = Fit(how, state.problem(), {});
  *run->first_part = std::move(*state.residuals());
  run->status = result.status;
  if (result.status != FitStatus::kConverged) {
    run->message =
        std::string("the fit of its start: ") + NameOf(result.status) + ": " + result.message;
    if (run->first_part->num_residuals() == 0) {
      run->message +=
          ": it has no observation until \"state_from\", " + CompactNumber(run->state_from) + " s";
    }
  }
  if (result.estimate.size() == 0) return false;
  run->parameters = state.All(result.estimate);
  run->deviations = result.uncertainty.standard_deviation;
  return true;
}

/// A line, or nothing where no window was looked for.
std::string DescribeWindow(const StateWindow& window) {
  if (window.tried.empty()) return "";
  std::string text = "states are fitted to ";
  text += window.seconds > 0.0 ? "the last " + CompactNumber(window.seconds, 4) + " s"
                               : std::string("all observations");
  text += " before what is predicted; held-out parts of them are predicted with";
  for (const WindowError& one : window.tried) {
    text += (one.seconds > 0.0 ? ", " : " ") + CompactNumber(one.error, 4) + " sigma by " +
            (one.seconds > 0.0 ? CompactNumber(one.seconds, 4) + " s" : std::string("all"));
  }
  return text + "\n";
}

std::string DescribeErrors(const HorizonError& error) {
  std::string text = "rms " + CompactNumber(error.rms_in_sigma, 4) + " sigma";
  const auto add = [&text](double rms, double max, const char* unit) {
    if (!std::isfinite(rms)) return;
    text += ", " + CompactNumber(rms, 4) + " " + unit + " (largest " + CompactNumber(max, 4) + ")";
  };
  add(error.rms_length, error.max_length, "m");
  add(error.rms_angle, error.max_angle, "rad");
  return text;
}

}  // namespace

std::vector<bool> OwnStates(const FitProblem& problem, const std::vector<ParameterScope>& scopes) {
  const std::vector<FitParameter>& parameters = problem.parameters;
  std::vector<bool> own;
  own.reserve(parameters.size());
  for (size_t i = 0; i < parameters.size(); ++i) {
    own.push_back(scopes[i].kind != ParameterScope::Kind::kShared &&
                  IsOfInitialState(problem.scene, parameters[i]));
  }
  return own;
}

HeldOutRun PredictOne(const FitInput& input, const FitOptions& options,
                      const RecordingsProblem& problem, const Eigen::VectorXd& estimate,
                      HeldOutRecording of, double seconds) {
  LateStart late = BeginLate(of.recording.problem, of.state_from, seconds);
  FitProblem& one = late.problem;
  HeldOutRun run;
  run.begins = late.begins;
  run.used = one.observations;
  for (Observation& observation : run.used) observation.time += late.begins;
  run.unused = std::move(late.before);
  run.name = of.recording.name;
  run.state_from = of.state_from;
  run.place = of.place;
  ParameterError fault;
  // Without observations there are no random forces to be found.
  if (one.observations.empty()) one.process_noise.clear();
  run.first_part = MakeRun(one, &fault);
  if (!run.first_part) {
    run.status = FitStatus::kFailed;
    run.message = fault.what;
    return run;
  }
  if (run.first_part->noise() != nullptr) {
    run.first_part->noise()->SetIntensities(
        problem.recordings().front().residuals.noise()->intensities());
    run.first_part->SetHuber(input.options().huber);
  }
  run.entries = run.first_part->entries();
  run.parameters = KnownValues(run.entries, problem, estimate);
  const std::vector<bool> free = OwnStates(one, input.scopes);
  for (size_t k = 0; k < free.size(); ++k) {
    if (free[k]) run.fitted.push_back(static_cast<int>(k));
  }
  if (!run.fitted.empty() &&
      !FitTheStart(options, of.from_observations || late.begins > 0.0, free, &run)) {
    run.parameters.resize(0);
    run.later.observations = std::move(of.later);
    return run;
  }
  if (run.first_part->num_residuals() > 0 &&
      run.first_part->Evaluate(run.parameters, input.options().derivatives, &run.residuals,
                               nullptr)) {
    const auto count = static_cast<double>(run.residuals.size());
    run.residual_rms = std::sqrt(run.residuals.squaredNorm() / count);
  }
  std::vector<Observation> later = of.later;
  for (Observation& observation : later) observation.time -= late.begins;
  run.later = PredictLater(one, run.parameters, of.state_from - late.begins, std::move(later),
                           &*run.first_part);
  run.later.observations = std::move(of.later);
  run.later.score.from = of.state_from;
  if (run.message.empty() && !run.later.score.message.empty()) {
    run.status = FitStatus::kFailed;
    run.message =
        "the run after " + CompactNumber(of.state_from) + " s fails: " + run.later.score.message;
  }
  return run;
}

namespace {

/// Fits the starts again, to the last observations before T.
void PredictFromWindow(const FitInput& input, const RecordingsProblem& problem,
                       const Eigen::VectorXd& estimate,
                       const std::vector<HeldOutRecording>& recordings, HeldOutRuns* all) {
  for (size_t i = 0; i < recordings.size(); ++i) {
    if (!MayBeginLate(recordings[i], all->runs[i])) continue;
    HeldOutRun late =
        PredictOne(input, input.options(), problem, estimate, recordings[i], all->window.seconds);
    if (late.message.empty()) all->runs[i] = std::move(late);
  }
}

}  // namespace

HeldOutRuns PredictHeldOut(const FitInput& input, const RecordingsProblem& problem,
                           const Eigen::VectorXd& estimate, const std::vector<SensorNoise>& noise,
                           std::vector<HeldOutRecording> recordings) {
  HeldOutRuns all;
  all.runs.reserve(recordings.size());
  std::vector<PredictedRun> predicted;
  for (HeldOutRecording& recording : recordings) {
    FitProblem& one = recording.recording.problem;
    ScaleSigma(noise, one.instruments, one.channels, &one.observations);
    ScaleSigma(noise, one.instruments, one.channels, &recording.later);
    all.runs.push_back(PredictOne(input, input.options(), problem, estimate, recording, 0.0));
  }
  all.window = ChooseStateWindow(input, problem, estimate, recordings, all.runs);
  if (all.window.seconds > 0.0) PredictFromWindow(input, problem, estimate, recordings, &all);
  for (size_t i = 0; i < recordings.size(); ++i) {
    const LaterObservations& later = all.runs[i].later;
    if (later.residuals.size() == 0) continue;
    predicted.push_back({recordings[i].state_from, later.observations,
                         recordings[i].recording.problem.channels, later.residuals});
  }
  all.score = ScorePrediction(predicted);
  all.score.message = FirstFailure(all);
  return all;
}

std::string FirstFailure(const HeldOutRuns& held_out) {
  for (const HeldOutRun& run : held_out.runs) {
    if (!run.message.empty()) return "recording '" + run.name + "': " + run.message;
  }
  return "";
}

std::string Describe(const HeldOutRuns& held_out) {
  std::string text;
  for (const HeldOutRun& run : held_out.runs) {
    text += "recording '" + run.name + "', held out: ";
    if (std::isfinite(run.residual_rms)) {
      text += std::to_string(run.residuals.size()) + " observations " +
              (run.begins > 0.0 ? "from " + CompactNumber(run.begins) + " " : "") + "up to " +
              CompactNumber(run.state_from) + " s with rms " + CompactNumber(run.residual_rms, 4) +
              " sigma; ";
    }
    const HorizonError& error = run.later.score.all;
    text += error.count == 0
                ? "no prediction: " + run.message
                : std::to_string(error.count) + " after " + CompactNumber(run.state_from) +
                      " s predicted with " + DescribeErrors(error);
    text += "\n";
  }
  const HorizonError& error = held_out.score.all;
  if (error.count > 0) {
    text += "prediction of " + std::to_string(error.count) +
            " held-out observations: " + DescribeErrors(error) + "\n";
  }
  return text + DescribeWindow(held_out.window);
}

}  // namespace tangible
