// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The times of observed events in a run by events, with their derivatives: rows beside those of the
// samples (sampling.h), one for each observed event.
//
//   state of a pair   open | closed and sliding (or without friction) | sticking
//   touch             a gap closes while the pair is open                 each bounce
//   rest              open -> closed: the contact stays
//   lift_off          closed -> open; a rebound is a touch alone
//   stick, slip       sliding -> sticking, sticking -> sliding            while closed
//
// The state of a pair is that of its contacts in a segment of the motion. It changes at the event
// between two segments, whose time and its derivative the engine has (Segment::end_dot). Several
// contacts of a pair that close at one instant are one touch.
//
// An event that the run does not have gets the time
//   T + T d / (d + L)     with the gap d at the run's end T where the pair is open there, or, of a
//                         `stick` that is awaited while it slides, d = |sliding speed| T
//   t of the last one     of the same name otherwise; T, without a derivative, where there is none
// with the radius L of the smaller body. It is bounded by 2 T. It continues the time of an event
// that moves beyond the end of the run, and of bounces that come to rest before the observed one,
// whose times accumulate at the last; its derivative leads back to the event.

#include <Eigen/Core>
#include <vector>

#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/estimation/problem/observation.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

class EventTimes {
 public:
  EventTimes() = default;
  EventTimes(std::vector<ObservedEvent> events, const std::vector<Observation>& observations);

  int num_rows() const { return static_cast<int>(rows_.size()); }
  /// −1: the observation is of no event.
  int RowOf(int observation) const { return rows_.empty() ? -1 : row_of_[observation]; }

  /// Begins a run.
  void Start();
  /// Adds what happened in the step that led to the state after k steps; the arguments are those of
  /// an observer of the run.
  void Add(long k, const Stepper* stepper);
  /// Ends the run: the rows have their values.
  void Finish(const Model<double>& model, const State<double>& final);

  double Value(int row) const { return rows_[row].value; }
  bool IsMissing(int row) const { return rows_[row].missing; }
  /// Whether the time of a missing event has a derivative, which leads towards it.
  bool LeadsTowards(int row) const { return rows_[row].found >= 0 || !rows_[row].by_end.empty(); }

  /// The derivative of a row; `variable_dot` gives that of a variable of the final state, or of a
  /// number of the model. Valid after a run with tangents or Jets.
  template <typename VariableDot>
  Eigen::RowVectorXd Dot(int row, Eigen::Index columns, const VariableDot& variable_dot) const {
    Eigen::RowVectorXd dot = Eigen::RowVectorXd::Zero(columns);
    const Row& one = rows_[row];
    if (one.found >= 0 && FoundOf(one).dot.size() == columns) dot = FoundOf(one).dot;
    for (const JacobianEntry& entry : one.by_end) dot += entry.value * variable_dot(entry.variable);
    return dot;
  }

  /// Where the time of a row comes from: an event at the end of a segment, whose part is −1 where
  /// it is given, and variables of the final state.
  struct Source {
    long step = 0;
    int island = 0, part = -1;
  };
  Source SourceOf(int row) const {
    return rows_[row].found < 0 ? Source() : FoundOf(rows_[row]).at;
  }
  const std::vector<JacobianEntry>& ByEnd(int row) const { return rows_[row].by_end; }

 private:
  enum class PairState : unsigned char { kUnknown, kOpen, kClosed, kSticking };
  struct Found {
    double time = 0.0;
    Source at;
    Eigen::RowVectorXd dot;
  };
  struct Row {
    int event = 0;
    int number = 1;
    double value = 0.0;
    bool missing = false;
    int found = -1;  ///< index among those of its event
    std::vector<JacobianEntry> by_end;
  };
  /// One observed event in the run so far.
  struct Watch {
    PairState state = PairState::kUnknown;
    ActiveContact contact;  ///< the last that was closed
    Found last;             ///< the last event of its island
    std::vector<Found> found;
  };

  const Found& FoundOf(const Row& row) const { return watches_[row.event].found[row.found]; }
  void AddPart(const ObservedEvent& event, const IslandRecord& island, const Segment& segment,
               const Found& at, Watch* watch) const;
  void AddTransition(ObservedEventKind kind, PairState next, double time, Watch* watch) const;
  void FinishMissing(const Model<double>& model, const State<double>& final, Row* row) const;

  std::vector<ObservedEvent> events_;
  std::vector<Row> rows_;
  std::vector<int> row_of_;
  std::vector<Watch> watches_;
  double h_ = 0.0;  ///< s, the length of the last step
};

}  // namespace tangible
