// SPDX-License-Identifier: Apache-2.0
//
// What the user asks for as a problem.
#include <utility>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/fit/noise_intensity.h"

namespace tangible {

FitInput InputOf(FitProblem problem) {
  FitInput input;
  input.scopes.resize(problem.parameters.size());
  input.recordings.push_back({"", 1.0, std::move(problem)});
  return input;
}

std::optional<RolloutResiduals> MakeRun(const FitProblem& problem, ParameterError* error) {
  ParameterizedScene scene;
  const bool noise = !problem.process_noise.empty();
  if (const std::optional<NoiseFault> fault = CheckNoise(problem.process_noise, problem.scene)) {
    *error = {-1, -1, "", "process_noise: " + fault->what};
    return std::nullopt;
  }
  if (!scene.Create(noise ? WithNoiseForces(problem.process_noise, problem.scene) : problem.scene,
                    problem.points, problem.parameters, error, problem.instruments)) {
    return std::nullopt;
  }
  RolloutResiduals run(std::move(scene), problem.observations, problem.channels);
  run.SetFiles(problem.files);
  if (!noise) return run;
  std::string wrong = WhyNoNoise(run);
  if (wrong.empty()) {
    run.SetNoise(problem.process_noise);
    return run;
  }
  *error = {-1, -1, "", wrong};
  return std::nullopt;
}

std::unique_ptr<RecordingsProblem> MakeProblem(const FitInput& input, ParameterError* error,
                                               int* fault) {
  std::vector<RecordedRun> runs;
  for (const RecordingInput& recording : input.recordings) {
    const FitProblem& problem = recording.problem;
    std::optional<RolloutResiduals> run = MakeRun(problem, error);
    if (!run) {
      *fault = static_cast<int>(runs.size());
      return nullptr;
    }
    runs.push_back({recording.name, recording.weight, std::move(*run)});
  }
  auto problem = std::make_unique<RecordingsProblem>(std::move(runs), input.scopes);
  if (problem->HasNoise()) BeginIntensities(problem.get());
  return problem;
}

}  // namespace tangible
