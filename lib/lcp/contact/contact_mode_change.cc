// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_mode_change.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact/tolerances.h"

namespace tangible {
namespace {

constexpr double kMaxExtrapolation = 1e6;

}  // namespace

ContactMode ModeOfClosing(const ContactBlock<double>& contact, const ContactValues& values) {
  if (!contact.has_friction) {
    return ContactMode::kClosed;
  }
  const double needed = std::abs(values.slip) / values.mobility_t;
  const double available = contact.limit_given ? contact.friction * contact.offset
                                               : contact.friction * -values.s_n / values.mobility_n;
  return needed <= available ? ContactMode::kSticking
         : values.slip > 0.0 ? ContactMode::kSlidingPositive
                             : ContactMode::kSlidingNegative;
}

ModeChange Contradiction(const ContactBlock<double>& contact, const ContactValues& values,
                         ContactMode mode, double normal, double tangent, double impulse_scale,
                         double tolerance) {
  const double zeta = NormalScale(contact, values, impulse_scale);
  ModeChange change{mode};
  if (mode == ContactMode::kOpen && contact.limit_given) {
    return {ModeOfClosing(contact, values), 1.0};
  }
  if (mode == ContactMode::kOpen) {
    if (values.s_n < -kModeTolerance * values.scale_n) {
      change.violation = -values.s_n / values.scale_n;
      change.mode = ModeOfClosing(contact, values);
    }
    return change;
  }
  if (normal < -kModeTolerance * zeta) {
    return {ContactMode::kOpen, -normal / zeta};
  }
  if (mode == ContactMode::kSticking) {
    // The sliding speed of a sticking contact is only the effect of δ; where it should be more (two
    // points of a body that turns cannot both stick) the impulse exceeds the friction limit.
    const double excess = std::abs(tangent) - contact.friction * normal;
    const double scale = std::max(zeta * std::max(1.0, contact.friction), std::abs(tangent));
    if (excess > kModeTolerance * scale) {
      change.violation = excess / scale;
      change.mode = tangent < 0.0 ? ContactMode::kSlidingPositive : ContactMode::kSlidingNegative;
    }
  } else if (mode != ContactMode::kClosed) {
    const double along = SlidingSign(mode) * values.slip;
    const double rounding =
        std::min(contact.rounding, kSlipOfTolerance * tolerance * values.scale_t);
    if (along < -std::max(kModeTolerance * values.scale_t, rounding)) {
      change = {ContactMode::kSticking, -along / values.scale_t};
    }
  }
  return change;
}

void ExtrapolateImpulses(const ContactProblem<double>& problem,
                         const ContactSolution<double>& before, ContactSolution<double>* solution) {
  double factor = kMaxExtrapolation;
  const auto limit = [&](double value, double last) {
    if (value > 0.0 && value < last) {
      factor = std::min(factor, value / (last - value));
    }
  };
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const double normal = solution->normal_impulse[i];
    const double last_normal = before.normal_impulse[i];
    if (solution->modes[i] == ContactMode::kSticking) {
      const double mu = problem.contacts[i].friction;
      const double tangent = solution->tangent_impulse[i];
      const double last_tangent = before.tangent_impulse[i];
      limit(mu * normal - tangent, mu * last_normal - last_tangent);
      limit(mu * normal + tangent, mu * last_normal + last_tangent);
    } else if (solution->modes[i] != ContactMode::kOpen) {
      limit(normal, last_normal);
    }
  }
  factor *= 1.0 + kBeyondLimit;
  const auto move = [&](const std::vector<double>& from, std::vector<double>* to) {
    for (size_t i = 0; i < to->size(); ++i) {
      (*to)[i] += factor * ((*to)[i] - from[i]);
    }
  };
  move(before.normal_impulse, &solution->normal_impulse);
  move(before.tangent_impulse, &solution->tangent_impulse);
  move(before.joint_impulse, &solution->joint_impulse);
}

}  // namespace tangible
