// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Trajectories and contacts as tables (README.md of this folder has their columns).

#include <string>

#include "tangible/simulation/stepping/step.h"

namespace tangible {

/// Rows time,body,x,y,angle,vx,vy,omega of moving and kinematic bodies, every `every` steps; the
/// first and the last state are always included.
class TrajectoryCsv {
 public:
  TrajectoryCsv(const ModelStructure& structure, long every);
  void Add(long k, double t, const State<double>& state);
  /// Whether the state after k steps is written at once; the last one is written by Finish.
  bool Writes(long k) const { return k % every_ == 0; }
  /// The table, up to the last state that was added.
  std::string Finish();

 private:
  void Write(double t, const State<double>& state);

  const ModelStructure& structure_;
  long every_;
  std::string text_;
  bool pending_ = false;  ///< the last state has not been written
  double last_time_ = 0.0;
  State<double> last_;
};

/// Contacts, limits and joints of each step with their impulses.
class ContactsCsv {
 public:
  ContactsCsv();
  /// `t`: the step's end.
  void Add(const ModelStructure& structure, double t, const StepRecord& record);
  std::string Finish() { return std::move(text_); }

 private:
  std::string text_;
};

/// Sets the poses and twists of the bodies for which a trajectory has rows, to the last row of
/// each. On failure sets one line "file: line 3: what, expected, got".
bool ReadInitialState(const std::string& file, const ModelStructure& structure,
                      State<double>* state, std::string* error);

/// Empty, or the part of the first state that is not finite, for example joints' rates on arms of
/// 1e308 m.
std::string CheckInitialState(const ModelStructure& structure, const State<double>& state);

}  // namespace tangible
