// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a run's joints stay closed, beside the bodies that they join. A joint's error C(q)
// (dynamics/joint.h) grows with the run where nothing corrects it: `none` is the default with fixed
// stepping.
//
//   opening = |C| / size       for errors in m; for an angle |C| itself, in rad: the body's far end
//                              is displaced by that fraction of its size
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

  /// Examines a state of the run, at the cost of the joints' rows. Values that are not finite are
  /// ignored.
  void Look(const Model<double>& model, const State<double>& state, double time);

  /// The largest opening so far, 0 without one.
  double opening() const { return opening_; }
  /// Empty, or one line on the joint that was widest open, with the remedy: "joint pin9 is open by
  /// 0.042 m at t = 8 s, more than a hundredth of body link9 (0.31 m): expected ...".
  std::string Message(const Model<double>& model) const;

 private:
  std::vector<double> sizes_;  ///< for each joint, m
  std::vector<int> bodies_;    ///< whose size that is
  double opening_ = 0.0;
  double error_ = 0.0;  ///< |C| there, m or rad
  double time_ = 0.0;
  int joint_ = -1;
  bool turned_ = false;  ///< whether that is an angle
};

/// The message for a single state, for example that at the end of a run.
std::string OpenJointOf(const Model<double>& model, const State<double>& state, double time);

}  // namespace tangible
