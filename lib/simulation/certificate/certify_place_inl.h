// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where in a rollout a certificate's figure was taken. Included by certify*.cc, discrete_map.cc and
// segment_share.cc alone.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "tangible/dynamics/model/tolerances.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {

inline std::string Short(double x) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", x);
  return text;
}

// A speed that is rounding, m/s.
inline double Negligible(const Model<double>& model, double speed) {
  return kNoApproach *
         (std::abs(speed) + model.structure->settings.dt * std::hypot(model.parameters[kGravityX],
                                                                      model.parameters[kGravityY]));
}

inline bool Has(const std::vector<ActiveContact>& contacts, const ActiveContact& contact) {
  return std::any_of(contacts.begin(), contacts.end(),
                     [&](const ActiveContact& other) { return other.SameAs(contact); });
}

// Whether one of the contacts is between the shapes of the same two bodies.
inline bool HasPair(const std::vector<ActiveContact>& contacts, const ActiveContact& contact) {
  return std::any_of(contacts.begin(), contacts.end(), [&](const ActiveContact& other) {
    return other.IsOfShapes() && other.a == contact.a && other.b == contact.b;
  });
}

inline std::string PlaceText(const ModelStructure& structure, long step, double time,
                             const ActiveContact& contact) {
  return "step " + std::to_string(step) + ", t = " + Short(time) +
         " s: " + ContactName(structure, contact);
}

struct RolloutCertifier::Place {
  const ModelStructure* structure;
  long step;
  double time;
  size_t contact;
  const ActiveContact* active;
  ContactMode mode;

  std::string Text() const { return PlaceText(*structure, step, time, *active); }
};

}  // namespace tangible
