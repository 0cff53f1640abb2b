// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a run's joints stay closed, beside the bodies that they join. A joint's error C(q)
// (dynamics/joint.h) grows with the run where nothing corrects it: `none` is the default with fixed
// stepping.
//
//   opening = |C| / size       of what is in m; of an angle |C| itself, in rad: by that share of
//                              its size the body's far end is off
//   size                       of the smaller of the joint's moving bodies: twice its shape's
//                              largest distance from the centre of mass; without a shape the length
//                              of a uniform rod of its mass and inertia, √(12 I / m)

#include <string>
#include <vector>

#include "tangible/dynamics/model/model.h"

namespace tangible {

class JointWatch {
 public:
  /// Watches nothing where there are no joints, or `projection` keeps them closed.
  explicit JointWatch(const Model<double>& model);
  bool watches() const { return !sizes_.empty(); }

  /// Looks at a state of the run; as dear as the joints' rows. What is not finite is passed over.
  void Look(const Model<double>& model, const State<double>& state, double time);

  /// The largest opening so far, 0 without one.
  double opening() const { return opening_; }
  /// Empty, or one line on the joint that was widest open, with the remedy: "joint pin9 is open by
  /// 0.042 m at t = 8 s, more than a hundredth of body link9 (0.31 m): expected ...".
  std::string Message(const Model<double>& model) const;

 private:
  std::vector<double> sizes_;  ///< a joint, m
  std::vector<int> bodies_;    ///< whose size that is
  double opening_ = 0.0;
  double error_ = 0.0;  ///< |C| there, m or rad
  double time_ = 0.0;
  int joint_ = -1;
  bool turned_ = false;  ///< whether that is an angle
};

/// The message of a single state, that of a run's end say.
std::string OpenJointOf(const Model<double>& model, const State<double>& state, double time);

}  // namespace tangible
