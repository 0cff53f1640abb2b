// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/step_report.h"

#include <algorithm>

namespace tangible {

void StepCounts::Add(const StepCounts& other) {
  rung = std::max(rung, other.rung);
  contacts += other.contacts;
  lcp_rows += other.lcp_rows;
  single_rows += other.single_rows;
  angles_left_out += other.angles_left_out;
  pairs_compared += other.pairs_compared;
  pairs_near += other.pairs_near;
  beyond_reach += other.beyond_reach;
  factorisations += other.factorisations;
  iterations += other.iterations;
  events += other.events;
  bounces_ended += other.bounces_ended;
  given_up.Add(other.given_up);
  solver.Add(other.solver);
  newton_stages += other.newton_stages;
  halved_motions += other.halved_motions;
  ellipse_motions += other.ellipse_motions;
  damped_projections += other.damped_projections;
  mode_switches += other.mode_switches;
  residual = std::max(residual, other.residual);
  impact_energy_gain = std::max(impact_energy_gain, other.impact_energy_gain);
}

const char* NameOf(StepStatus status) {
  switch (status) {
    case StepStatus::kDone:
      return "done";
    case StepStatus::kUnsolved:
      return "unsolved";
    case StepStatus::kDiverged:
      return "diverged";
    case StepStatus::kRefused:
      return "refused";
  }
  return "";
}

}  // namespace tangible
