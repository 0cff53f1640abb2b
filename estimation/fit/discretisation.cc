// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/discretisation.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace tangible {

int OrderOf(Integrator integrator) {
  switch (integrator) {
    case Integrator::kSemiImplicitEuler:
      return 1;
    case Integrator::kTrapezoidal:
      return 2;
    case Integrator::kRungeKutta4:
      return 4;
  }
  return 1;
}

const char* OrderName(int order) { return order == 1 ? "first" : order == 2 ? "second" : "fourth"; }

double BiasFactor(int order) {
  const double ratio = std::exp2(order);
  return ratio / (ratio - 1.0);
}

namespace {

/// The input with half the step, without the tests that judge an estimate; false, with a message,
/// where orders differ.
bool HalveSteps(FitInput* input, DiscretisationCheck* check) {
  check->order = OrderOf(IntegratorOf(input->recordings.front().problem.scene.simulation));
  for (RecordingInput& recording : input->recordings) {
    SimulationSettings& simulation = recording.problem.scene.simulation;
    if (OrderOf(IntegratorOf(simulation)) != check->order) {
      check->message = "the scenes' steps are of different orders";
      return false;
    }
    check->dt = std::max(check->dt, simulation.dt);
    simulation.dt *= 0.5;
    FitOptions& options = recording.problem.options;
    options.starts = 1;
    options.approach = FitApproach::kPlain;
    options.certificate = CertificatePass::kSkip;
    options.held_test = HeldTest::kSkip;
    options.profile_pass = ProfilePass::kSkip;
    options.profiles.clear();
  }
  return true;
}

}  // namespace

DiscretisationCheck CheckDiscretisation(const FitInput& input, const std::vector<double>& spreads,
                                        const FitResult& result, FitLog* log) {
  DiscretisationCheck check;
  FitInput half = input;
  if (!HalveSteps(&half, &check)) {
    return check;
  }
  ParameterError error;
  int fault = 0;
  std::unique_ptr<RecordingsProblem> problem = MakeProblem(half, &error, &fault);
  for (size_t b = 0; b < half.recordings.size() && problem != nullptr; ++b) {
    const Eigen::VectorXd p = problem->ParametersOf(static_cast<int>(b), result.estimate);
    for (Eigen::Index i = 0; i < p.size(); ++i) {
      half.recordings[b].problem.parameters[static_cast<size_t>(i)].initial = p[i];
    }
  }
  if (problem != nullptr) {
    problem = MakeProblem(half, &error, &fault);
  }
  if (problem == nullptr) {
    check.message = error.what;
    return check;
  }
  for (size_t e = 0; e < spreads.size(); ++e) {
    problem->SetSpread(static_cast<int>(e), spreads[e]);
  }
  if (!spreads.empty()) {
    problem->SetInitial(result.estimate);
  }
  const FitResult fine = Fit(half.options(), problem.get(), {}, log);
  check.status = fine.status;
  check.message = fine.message;
  check.rollouts = fine.rollouts;
  check.seconds = fine.seconds;
  if (fine.status == FitStatus::kConverged) {
    check.estimate_half_step = fine.estimate;
    check.difference = result.estimate - fine.estimate;
    check.bias = BiasFactor(check.order) * check.difference;
    check.extrapolated = result.estimate - check.bias;
  }
  return check;
}

}  // namespace tangible
