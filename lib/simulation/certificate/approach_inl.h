// SPDX-License-Identifier: Apache-2.0
#pragma once
// The speed with which a contact of a fixed step closes, and what its law depends on. Included by
// files of this folder alone.

#include <algorithm>
#include <cmath>

#include "tangible/simulation/stepping/step.h"

namespace tangible {

// The speed n·v before the step, and after a free motion without contacts and joints, m/s.
struct Approach {
  double before = 0.0;
  double free = 0.0;
  double terms = 0.0;  // the sum of the magnitudes of the terms of `before`
};

inline Approach ApproachOf(const ModelStructure& s, const StepRecord& r, size_t i) {
  const ActiveContact& contact = r.contacts[i];
  const ContactBlock<double>& block = r.problem.contacts[i];
  Approach approach;
  const auto add = [&](int body, const RowPart<double>& row) {
    const int moving = s.bodies[body].block;
    for (int k = 0; k < 3; ++k) {
      const double twist = r.before.twist[3 * body + k];
      approach.before += row[k] * twist;
      approach.terms += std::abs(row[k] * twist);
      approach.free +=
          row[k] *
          (moving < 0 ? twist : r.problem.load[3 * moving + k] / r.problem.mass[3 * moving + k]);
    }
  };
  add(contact.a, block.normal_a);
  add(contact.b, block.normal_b);
  return approach;
}

// A difference and the size of its terms.
struct Distance {
  double value = 0.0;
  double scale = 0.0;
  double relative() const { return value / scale; }
};

// On what the law of a contact depends (contact.h).
struct LawDistances {
  Approach approach;
  double reach = 0.0;         // m, of a free motion over the step
  bool has_recovery = false;  // in penetration, without an impact
  Distance recovery;          // gap / h above −recovery_speed, m/s
  // Both are above 0 where a contact with restitution rebounds: the speed above the threshold, and
  // the surface above the end of a free motion.
  Distance fast, near;
  bool has_restitution = false;
};

inline LawDistances LawDistancesOf(const Model<double>& model, const StepRecord& record, size_t i) {
  const SimulationSettings& settings = model.structure->settings;
  const ActiveContact& contact = record.contacts[i];
  const double gap_speed = contact.gap / record.h;
  const double recovery = settings.recovery_speed;
  LawDistances law;
  law.has_recovery = contact.gap < 0.0 && recovery > 0.0 && contact.law != ContactLaw::kRestitution;
  law.recovery = {gap_speed + recovery, std::max(recovery, -gap_speed)};
  law.has_restitution = !contact.IsPureFriction();
  if (!law.has_restitution) return law;
  law.approach = ApproachOf(*model.structure, record, i);
  law.reach = record.h * law.approach.free;
  const double threshold = settings.restitution_threshold;
  law.fast = {-law.approach.before - threshold,
              std::max({threshold, std::abs(law.approach.before), kNoScale})};
  law.near = {settings.contact_margin - contact.gap - law.reach,
              settings.contact_margin + std::abs(contact.gap) + std::abs(law.reach)};
  return law;
}

}  // namespace tangible
