// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_inner_impulses.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_residual.h"

namespace tangible {
namespace {

// Solves of the short way, each with further contacts pinned.
constexpr int kMostRounds = 6;
// With more contacts the short way pins friction near its limit alone.
constexpr size_t kFewToPin = 24;

}  // namespace

void InnerImpulses::AddRays(const ContactProblem<double>& problem, double tolerance,
                            const ContactSolution<double>& solution) {
  const double* v = solution.motion.data();
  const ContactScales scales(problem, solution);
  by_rays_ = problem;
  by_rays_.contacts.clear();
  by_rays_.has_rolling = false;
  rays_.clear();
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    const ContactValues values = Evaluate(problem, scales, contact, v);
    if (contact.limit_given) {
      by_rays_.contacts.push_back(contact);
      by_rays_.contacts.back().rolls = false;
      if (solution.modes[i] == ContactMode::kOpen) by_rays_.contacts.back().has_friction = false;
      rays_.push_back({static_cast<int>(i), 0.0});
      continue;
    }
    const bool touches = std::abs(values.s_n) <= tolerance * values.scale_n;
    if (solution.modes[i] == ContactMode::kOpen && !touches) continue;
    const bool slips = std::abs(values.slip) > tolerance * values.scale_t;
    for (const double side : {1.0, -1.0}) {
      // Friction acts against the slip; without friction there is one ray, the normal.
      const bool along = contact.has_friction ? !slips || side * values.slip < 0.0 : side > 0.0;
      if (!along) continue;
      const double slope = contact.has_friction ? side * contact.friction : 0.0;
      ContactBlock<double> ray = contact;
      ray.normal_a = Combine(contact.normal_a, slope, contact.tangent_a);
      ray.normal_b = Combine(contact.normal_b, slope, contact.tangent_b);
      ray.c_n = -RowDot(ray.a, ray.normal_a, ray.b, ray.normal_b, v);
      ray.has_friction = false;
      by_rays_.contacts.push_back(ray);
      rays_.push_back({static_cast<int>(i), side});
    }
  }
}

// Sums the rays' impulses. A contact without any keeps its mode.
void InnerImpulses::TakeRays(const ContactProblem<double>& problem) {
  chosen_.joint_impulse = shares_.joint_impulse;
  chosen_.normal_impulse.assign(problem.contacts.size(), 0.0);
  chosen_.tangent_impulse.assign(problem.contacts.size(), 0.0);
  for (size_t k = 0; k < rays_.size(); ++k) {
    const auto [i, side] = rays_[k];
    const ContactBlock<double>& contact = problem.contacts[i];
    if (contact.limit_given) {
      chosen_.normal_impulse[i] = shares_.normal_impulse[k];
      chosen_.tangent_impulse[i] = shares_.tangent_impulse[k];
      chosen_.modes[i] = shares_.modes[k];
      continue;
    }
    if (shares_.modes[k] == ContactMode::kOpen) continue;
    const bool has_other = chosen_.normal_impulse[i] != 0.0;
    chosen_.normal_impulse[i] += shares_.normal_impulse[k];
    if (contact.has_friction) {
      chosen_.tangent_impulse[i] += side * contact.friction * shares_.normal_impulse[k];
    }
    chosen_.modes[i] = !contact.has_friction ? ContactMode::kClosed
                       : has_other           ? ContactMode::kSticking
                       : side > 0.0          ? ContactMode::kSlidingNegative
                                             : ContactMode::kSlidingPositive;
  }
}

bool InnerImpulses::IsSolution(const ContactProblem<double>& problem, double tolerance) {
  int worst;
  if (!(NaturalResidual(problem, chosen_, &worst) <= ContactSolverOptions().tolerance)) {
    return false;
  }
  FindDegenerateContacts(problem, chosen_, tolerance, &degenerate_);
  return true;
}

namespace {

/// The mode of a contact that touches with this slip and is inside its cone where it may be.
ContactMode InnerMode(const ContactBlock<double>& contact, const ContactValues& values,
                      double tolerance) {
  const bool slips = std::abs(values.slip) > tolerance * values.scale_t;
  return !contact.has_friction ? ContactMode::kClosed
         : !slips              ? ContactMode::kSticking
         : values.slip > 0.0   ? ContactMode::kSlidingPositive
                               : ContactMode::kSlidingNegative;
}

}  // namespace

void InnerImpulses::TakeInnerModes(const ContactProblem<double>& problem, double tolerance,
                                   const ContactSolution<double>& solution) {
  const ContactScales scales(problem, solution);
  impulse_scale_ = scales.impulse;
  chosen_ = solution;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    if (contact.limit_given || contact.driven) continue;
    const ContactValues values = Evaluate(problem, scales, contact, solution.motion.data());
    const bool touches = std::abs(values.s_n) <= tolerance * values.scale_n;
    if (touches || chosen_.modes[i] != ContactMode::kOpen) {
      chosen_.modes[i] = InnerMode(contact, values, tolerance);
    }
  }
  inner_modes_ = chosen_.modes;
  pinned_ = problem;
}

bool InnerImpulses::PinAtLimits(const ContactProblem<double>& problem, double share) {
  bool any = false;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    if (chosen_.modes[i] == ContactMode::kOpen || contact.limit_given || contact.driven) continue;
    ContactBlock<double>& pinned = pinned_.contacts[i];
    if (!pinned.driven && chosen_.normal_impulse[i] < kLeastShare * impulse_scale_) {
      pinned.driven = any = true;
      pinned.offset = kPinnedShare * impulse_scale_;
    }
    if (chosen_.modes[i] != ContactMode::kSticking) continue;
    const double limit = contact.friction * chosen_.normal_impulse[i];
    if (std::abs(chosen_.tangent_impulse[i]) > (1.0 - kAtLimit) * limit) {
      pinned.friction = share * contact.friction;
      chosen_.modes[i] = chosen_.tangent_impulse[i] > 0.0 ? ContactMode::kSlidingNegative
                                                          : ContactMode::kSlidingPositive;
      any = true;
    }
  }
  return any;
}

bool InnerImpulses::ChooseNearby(const ContactProblem<double>& problem, double tolerance,
                                 double share, const ContactSolution<double>& solution) {
  TakeInnerModes(problem, tolerance, solution);
  for (int round = 0; PinAtLimits(problem, share); ++round) {
    if (round == kMostRounds ||
        !mode_solve_.Solve(pinned_, &chosen_, &solver_.system(), &chosen_)) {
      return false;
    }
  }
  chosen_.motion = solution.motion;
  chosen_.modes = inner_modes_;
  return IsSolution(problem, tolerance) && degenerate_.empty();
}

bool InnerImpulses::Choose(const ContactProblem<double>& problem, double tolerance,
                           ContactSolution<double>* solution) {
  FindDegenerateContacts(problem, *solution, tolerance, &degenerate_);
  if (degenerate_.empty()) return false;
  const size_t before = degenerate_.size();
  for (const double share : kPinnedFriction) {
    // Of many contacts some are not inside by far.
    const bool is_far = share < kPinnedFriction[1] && problem.contacts.size() > kFewToPin;
    if (problem.has_rolling || is_far) continue;
    if (ChooseNearby(problem, tolerance, share, *solution)) {
      std::swap(*solution, chosen_);
      return true;
    }
  }
  AddRays(problem, tolerance, *solution);
  shares_ = ContactSolution<double>();
  shares_.joint_impulse.assign(solution->joint_impulse.size(), 0.0);
  shares_.normal_impulse.assign(rays_.size(), 0.0);
  shares_.tangent_impulse.assign(rays_.size(), 0.0);
  shares_.modes.assign(rays_.size(), ContactMode::kOpen);
  ContactSolverOptions options;
  options.choice = SolverChoice::kInteriorPoint;
  if (!solver_.Solve(by_rays_, options, &shares_).solved) return false;
  chosen_ = *solution;
  TakeRays(problem);
  if (!IsSolution(problem, tolerance) || degenerate_.size() >= before) return false;
  std::swap(*solution, chosen_);
  return true;
}

}  // namespace tangible
