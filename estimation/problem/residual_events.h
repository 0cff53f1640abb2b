// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The parts of the residuals of a run that concern times of events:
//
//   r = (recorded − observed) / σ,   recorded = gain (t + delay − offset) / rate + bias
//
// with the event's time t in the run (event_times.h), by sensor and clock.

#include <algorithm>
#include <vector>

#include "tangible/estimation/problem/residual.h"

namespace tangible {

/// Derivatives of the losses of a reverse sweep with respect to the times of events.
struct RolloutResiduals::EventBars {
  struct AtEvent {
    EventTimes::Source at;
    int loss;
    double value;
  };
  struct AtEnd {
    int variable, loss;
    double value;
  };
  std::vector<AtEvent> at_events;
  std::vector<AtEnd> at_end;  ///< of variables of the run's last state

  /// The step from whose end the sweep has to begin; `end` is that of the run.
  long LastStep(long end) const {
    long last = at_end.empty() ? 0 : end;
    for (const AtEvent& one : at_events) last = std::max(last, one.at.step + 1);
    return last;
  }
  void AddAtEnd(RowMatrixXd* w_bar) const {
    for (const AtEnd& one : at_end) (*w_bar)(one.variable, one.loss) += one.value;
  }
  /// Adds those in a step to the record of its parts.
  void AddIn(long step, int losses, IslandRecords* parts) const {
    for (const AtEvent& one : at_events) {
      if (one.at.step != step) continue;
      EventRecord& events = parts->islands[one.at.island]->events;
      Eigen::RowVectorXd& bar = events.parts[one.at.part]->segment.end_bar;
      if (bar.size() == 0) bar.setZero(losses);
      bar[one.loss] += one.value;
    }
  }
};

template <typename VariableDot>
void RolloutResiduals::FinishEventDerivatives(Eigen::Index first, Eigen::Index count,
                                              const VariableDot& dot, RowMatrixXd* rows) const {
  const Eigen::Index used = std::min(count, rows->cols() - first);
  for (int row = 0; row < event_times_.num_rows(); ++row) {
    rows->row(EventRow(row)).segment(first, used) = event_times_.Dot(row, count, dot).head(used);
  }
}

}  // namespace tangible
