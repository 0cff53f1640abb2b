// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/discretisation.h"

#include <cmath>

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

DiscretisationCheck CheckDiscretisation(const FitProblem& problem, const FitResult& result,
                                        FitLog* log) {
  DiscretisationCheck check;
  check.dt = problem.scene.simulation.dt;
  check.order = OrderOf(IntegratorOf(problem.scene.simulation));
  FitProblem half = problem;
  half.scene.simulation.dt = 0.5 * check.dt;
  half.options.starts = 1;
  half.options.approach = FitApproach::kPlain;
  half.options.certificate = CertificatePass::kSkip;
  half.options.held_test = HeldTest::kSkip;
  for (size_t k = 0; k < half.parameters.size(); ++k) {
    half.parameters[k].initial = result.estimate[static_cast<Eigen::Index>(k)];
  }
  ParameterizedScene scene;
  ParameterError error;
  if (!scene.Create(half.scene, half.points, half.parameters, &error, half.instruments)) {
    check.message = error.what;
    return check;
  }
  RolloutResiduals residuals(scene, half.observations, half.channels);
  const FitResult fine = Fit(half.options, &residuals, {}, log);
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
