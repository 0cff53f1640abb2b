// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_inner_impulses.h"

#include <cmath>

#include "tangible/lcp/system/contact_residual.h"

namespace tangible {

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

bool InnerImpulses::Choose(const ContactProblem<double>& problem, double tolerance,
                           ContactSolution<double>* solution) {
  FindDegenerateContacts(problem, *solution, tolerance, &degenerate_);
  if (degenerate_.empty()) return false;
  const size_t before = degenerate_.size();
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
  int worst;
  if (!(NaturalResidual(problem, chosen_, &worst) <= options.tolerance)) return false;
  FindDegenerateContacts(problem, chosen_, tolerance, &degenerate_);
  if (degenerate_.size() >= before) return false;
  std::swap(*solution, chosen_);
  return true;
}

}  // namespace tangible
