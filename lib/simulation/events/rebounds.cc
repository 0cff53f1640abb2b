// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/rebounds.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/events/tolerances.h"

namespace tangible {

bool Rebounds::End(const ActiveContact& contact, double time, double speed, double restitution,
                   double height, double duration) const {
  const auto last = std::find_if(last_.begin(), last_.end(),
                                 [&](const Rebound& one) { return one.contact.SameAs(contact); });
  if (last == last_.end() || !(time > last->time) || !(speed < last->speed)) return false;
  if (!(std::abs(speed - last->leaves) <= kReturnsAsFast * last->leaves)) return false;
  const double acceleration = (last->leaves + speed) / (time - last->time);
  const double leaves = restitution * speed;
  return leaves * leaves < 2.0 * acceleration * height &&
         2.0 * leaves < acceleration * (1.0 - restitution) * duration;
}

void Rebounds::Add(const ActiveContact& contact, double time, double speed, double restitution) {
  const Rebound rebound{contact, time, speed, restitution * speed};
  for (Rebound& one : last_) {
    if (one.contact.SameAs(contact)) {
      one = rebound;
      return;
    }
  }
  last_.push_back(rebound);
}

}  // namespace tangible
