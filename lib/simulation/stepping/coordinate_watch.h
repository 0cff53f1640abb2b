// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a run's coordinates are too large for its bodies. For two bodies that may touch or are
// joined
//
//   ρ / r      the rounding of their coordinates over the size of the smaller (lengths.h)
//
// is the smallest fraction of a body that a gap or a joint's error can resolve. Details that must
// be distinguished (a corner from the one beside it, a seam from a step) have a size of 1e-6 of a
// body; contacts are determined by rounding where ρ / r approaches that, although the results look
// plausible.

#include <string>
#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/model/lengths.h"

namespace tangible {

class CoordinateWatch {
 public:
  explicit CoordinateWatch(const Model<double>& model) : lengths_(model) {}

  /// Examines the pairs of a step's contacts and limits, which touch or are within reach.
  void LookAtContacts(const State<double>& state, double time,
                      const std::vector<ActiveContact>& contacts);
  /// Examines the pairs that joints connect.
  void LookAtJoints(const Model<double>& model, const State<double>& state, double time);

  /// Examines each moving body by itself, whether or not it may touch another.
  void LookAtBodies(const Model<double>& model, const State<double>& state, double time);

  /// The largest ρ / r so far, 0 where there was no pair.
  double rounding() const { return rounding_; }
  /// Empty, or one line with the remedy: "coordinates are too large: body box is 1e+09 m from the
  /// origin at t = 0.5 s, where gaps and joints round to 1.4e-05 m, more than 1e-7 of the smaller
  /// body's size (0.35 m): ...".
  std::string Message(const Model<double>& model) const;

 private:
  void Look(const State<double>& state, double time, int a, int b);

  Lengths lengths_;
  double rounding_ = 0.0;
  // At that largest ratio: the body whose coordinate is the largest, and the pair's size.
  int body_ = -1;
  double size_ = 0.0;
  double distance_ = 0.0;  ///< m from the origin
  double angle_ = 0.0;     ///< rad
  double time_ = 0.0;
};

}  // namespace tangible
