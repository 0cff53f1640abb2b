// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Observed forces of joints and contacts in a run, with their derivatives: rows beside those of the
// samples and of events, one for each observation.
//
// By fixed steps a force at t is the impulse of the step that ends at t, or that t is within, over
// its length, and a function of the state before that step. By events steps end at t, and the force
// is that of the motion up to there, a function of the state at t. At the start of the run it is
// that of the first step. step_forces.h has the equations.

#include <span>
#include <vector>

#include "tangible/estimation/problem/observation.h"
#include "tangible/simulation/stepping/step_forces.h"

namespace tangible {

class ForceRows {
 public:
  ForceRows() = default;
  /// `times` in the run of all observations; `settings` with the ends of steps.
  ForceRows(const std::vector<Observation>& observations, const std::vector<double>& times,
            const SimulationSettings& settings);

  int num_rows() const { return static_cast<int>(rows_.size()); }
  /// −1: the observation is of no force.
  int RowOf(int observation) const { return rows_.empty() ? -1 : row_of_[observation]; }
  /// The last step of the run that is needed.
  long last_step() const { return last_step_; }

  /// Adds what the step that led to the state after k steps tells; the arguments are those of an
  /// observer of the run.
  void Add(long k, const Model<double>& model, Stepper* stepper);

  double Value(int row) const { return rows_[row].force.value; }
  /// The derivatives of a row by the variables of the state after StateOf(row) steps.
  const std::vector<JacobianEntry>& ByState(int row) const { return rows_[row].force.by_variables; }
  long StateOf(int row) const { return rows_[row].state; }

  /// Calls set(row, derivative) for the rows that Add has read last, which is of step k.
  /// `before(variable)` and `after(variable)` are the derivatives of a variable of the states
  /// before and after that step.
  template <typename Before, typename After, typename Set>
  void ForEachDot(long k, Eigen::Index columns, const Before& before, const After& after,
                  const Set& set) const {
    for (const int row : ReadAt(k)) {
      Eigen::RowVectorXd dot = Eigen::RowVectorXd::Zero(columns);
      for (const JacobianEntry& entry : rows_[row].force.by_variables) {
        if (rows_[row].state < k) {
          dot += entry.value * before(entry.variable);
        } else {
          dot += entry.value * after(entry.variable);
        }
      }
      set(row, dot);
    }
  }
  /// The rows that are read when the state after k steps is known.
  std::span<const int> ReadAt(long k) const;

 private:
  struct Row {
    ConstraintForce force_of;
    long read_at = 1;  ///< the step after which it is read
    long state = 0;    ///< the state whose variables it is a function of
    ForceInstant instant = ForceInstant::kEnd;
    StepForce force;
  };

  std::vector<Row> rows_;
  std::vector<int> row_of_;
  std::vector<int> order_;  ///< of the rows, by the step after which they are read
  long last_step_ = 0;
  StepForces forces_;
};

}  // namespace tangible
