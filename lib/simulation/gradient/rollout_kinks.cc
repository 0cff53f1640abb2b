// SPDX-License-Identifier: Apache-2.0
//
// Kinks of runs by events that do not matter: a contact without load that nothing presses or lifts,
// a force at its limit on which no parameter acts. By fixed steps the certificate compares exact
// derivatives for both sides; here the derivatives beside the parameters are extrapolated to them,
// as one-sided derivatives are (gradient_sides.cc).
#include <algorithm>
#include <cmath>

#include "tangible/simulation/gradient/rollout_function.h"
#include "tangible/simulation/gradient/tolerances.h"

namespace tangible {
namespace {

// Parameters more than these are not looked at: each costs five runs with a tangent.
constexpr int kMostLookedAt = 10;

VectorX<double> ValuesOf(const RolloutOutput& output) {
  VectorX<double> values(output.states.size());
  for (Eigen::Index row = 0; row < output.states.rows(); ++row) {
    values.segment(row * output.states.cols(), output.states.cols()) =
        output.states.row(row).transpose();
  }
  return values;
}

}  // namespace

bool RolloutWorker::BothSidesAgree(const RolloutInput& input) {
  if (own_state_ || f_.num_controls() > 0 || f_.num_parameters() > kMostLookedAt) return false;
  for (int k = 0; k < f_.num_parameters(); ++k) {
    const ParameterPath& parameter = f_.parameters_[static_cast<size_t>(k)];
    const double way = kSideWay * std::max(std::abs(parameter.value), parameter.scale);
    VectorX<double> here;
    const RolloutOutput output = TangentBeside(input, k, 0.0, &here);
    if (output.status != RolloutStatus::kDone) return false;
    const VectorX<double> values = ValuesOf(output);
    const double largest = std::max(1.0, values.cwiseAbs().maxCoeff());
    const double rounding = kValueRounding * kSideWay * largest / way;
    const double size =
        std::max(here.cwiseAbs().maxCoeff(), kNoDerivative * kSideWay * largest / way);
    for (const double shift : {way, -way}) {
      VectorX<double> beside, nearer;
      const RolloutOutput far = TangentBeside(input, k, shift, &beside);
      const RolloutOutput near = TangentBeside(input, k, 0.5 * shift, &nearer);
      // Also where the parameter's range ends, beside which nothing is known.
      if (far.status != RolloutStatus::kDone || near.status != RolloutStatus::kDone) return false;
      const double apart = (2.0 * nearer - beside - here).cwiseAbs().maxCoeff();
      // Simpson's rule: the values do not jump either.
      const double missed = (ValuesOf(far) - values - shift / 6.0 * (here + 4.0 * nearer + beside))
                                .cwiseAbs()
                                .maxCoeff();
      if (!(apart <= kSidesConverged * size + rounding) ||
          !(missed <= kContinuous * way * size + kValueRounding * largest)) {
        return false;
      }
    }
  }
  return true;
}

Certificate RolloutWorker::WithoutIdleKinks(const RolloutInput& input, Certificate certificate) {
  if (f_.structure_->settings.stepping != Stepping::kEvent || IsTrustworthyMap(certificate)) {
    return certificate;
  }
  Certificate smooth = certificate;
  smooth.degenerate_rows = 0;
  smooth.margin_min = std::max(smooth.margin_min, kNearKinkMargin);
  smooth.margin_where += ", where both sides have the same derivative";
  SetVerdict(smooth);
  return IsTrustworthyMap(smooth) && BothSidesAgree(input) ? smooth : certificate;
}

}  // namespace tangible
