// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/segment_share.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/events/load_speed.h"

namespace tangible {

ContactSolution<double> ShareAtStart(const Model<double>& model, const Segment& segment,
                                     InnerImpulses* inner_impulses) {
  const ContactProblem<double>& problem = segment.stages[0].problem;
  ContactSolution<double> share = segment.stages[0].solution;
  ContactProblem<double> sliding;
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const double sign = SlidingSign(segment.modes[i]);
    if (sign == 0.0) continue;
    const double slip = SpeedsOf(model, segment.before, segment.contacts[i]).slip;
    if (std::abs(slip) <= Negligible(model, slip)) continue;
    if (sliding.contacts.empty()) sliding = problem;
    // The problem's slips are rates, among which a contact that slides evenly would look at rest.
    sliding.contacts[i].c_t += sign * std::max(1.0, LoadAcceleration(problem));
  }
  inner_impulses->Choose(sliding.contacts.empty() ? problem : sliding, kDegenerateTolerance,
                         &share);
  return share;
}

bool SupportsHoldBoth(const ModelStructure& structure, const State<double>& state,
                      const ActiveContact& contact) {
  if (state.supports.empty()) return false;
  const auto is_held = [&](int body) {
    if (structure.bodies[body].block < 0) return true;
    for (size_t k = 0; k < state.supports.size(); ++k) {
      if (structure.supports[k].body == body) {
        return state.supports[k].holds == SupportState::kBody;
      }
    }
    return false;
  };
  return is_held(contact.a) && is_held(contact.b);
}

double SureNormal(const ModelStructure& structure, const Segment& segment, size_t contact,
                  const ContactSolution<double>& share) {
  return SupportsHoldBoth(structure, segment.before, segment.contacts[contact])
             ? segment.stages[0].solution.normal_impulse[contact]
             : share.normal_impulse[contact];
}

}  // namespace tangible
