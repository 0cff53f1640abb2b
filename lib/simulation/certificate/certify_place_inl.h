// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where in a rollout a certificate's figure was taken. Included by certify*.cc alone.

#include <cstdio>
#include <string>

#include "tangible/simulation/certificate/certify.h"

namespace tangible {

inline std::string Short(double x) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", x);
  return text;
}

struct RolloutCertifier::Place {
  const ModelStructure* structure;
  long step;
  double time;
  size_t contact;
  const ActiveContact* active;
  ContactMode mode;

  std::string Text() const {
    return "step " + std::to_string(step) + ", t = " + Short(time) +
           " s: " + ContactName(*structure, *active);
  }
};

}  // namespace tangible
