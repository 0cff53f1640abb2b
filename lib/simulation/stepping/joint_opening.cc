// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/joint_opening.h"

#include <cmath>
#include <cstdio>

#include "tangible/dynamics/elements/joint.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/math/scalar.h"
#include "tangible/scene/scene_names.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

// The size of a body, m; infinite for bodies that do not move.
double SizeOf(const Model<double>& model, int body) {
  const BodyIndex& index = model.structure->bodies[body];
  if (index.block < 0) return kInfinity;
  const double radius = RadiusOf(model, body);
  if (radius > 0.0) return 2.0 * radius;
  return std::sqrt(12.0 * model.parameters[index.inertia] / model.parameters[index.mass]);
}

// The error of a joint in m, and in rad.
struct JointError {
  double distance = 0.0;
  double angle = 0.0;
};

JointError ErrorOf(const JointIndex& joint, const JointRows<double>& rows) {
  const double* c = rows.error;
  switch (joint.type) {
    case JointType::kCoupling:
      return joint.is_angular ? JointError{0.0, std::abs(c[0])} : JointError{std::abs(c[0]), 0.0};
    case JointType::kRevolute:
      return {std::hypot(c[0], c[1]), 0.0};
    case JointType::kWeld:
      return {std::hypot(c[0], c[1]), std::abs(c[2])};
    case JointType::kPrismatic:
      return {std::abs(c[0]), std::abs(c[1])};
    case JointType::kDistance:
      return {std::abs(c[0]), 0.0};
    case JointType::kFixedAngle:
      return {0.0, std::abs(c[0])};
    case JointType::kRope:
    case JointType::kLimitedCoupling:
      break;
  }
  return {};
}

}  // namespace

JointWatch::JointWatch(const Model<double>& model) {
  const ModelStructure& s = *model.structure;
  if (JointCorrectionOf(s.settings) == JointCorrection::kProjection) return;
  for (const JointIndex& joint : s.joints) {
    const double a = SizeOf(model, joint.a);
    const double b = SizeOf(model, joint.b);
    sizes_.push_back(std::fmin(a, b));
    bodies_.push_back(a <= b ? joint.a : joint.b);
  }
}

void JointWatch::Look(const Model<double>& model, const State<double>& state, double time) {
  const std::vector<JointIndex>& joints = model.structure->joints;
  for (size_t j = 0; j < sizes_.size(); ++j) {
    JointRows<double> rows;
    EvaluateJoint(model, state, joints[j], &rows);
    if (rows.rows == 0) continue;
    const JointError error = ErrorOf(joints[j], rows);
    const double opening = std::fmax(error.distance / sizes_[j], error.angle);
    if (!(opening > opening_ && std::isfinite(opening))) continue;
    opening_ = opening;
    turned_ = error.angle == opening;
    error_ = turned_ ? error.angle : error.distance;
    joint_ = static_cast<int>(j);
    time_ = time;
  }
}

std::string JointWatch::Message(const Model<double>& model) const {
  if (!(opening_ > kOpenJoint)) return "";
  const ModelStructure& s = *model.structure;
  char where[128];
  std::snprintf(where, sizeof where, turned_ ? "%.2g rad at t = %.4g s" : "%.2g m at t = %.4g s",
                error_, time_);
  char beside[64];
  std::snprintf(beside, sizeof beside, " (%.2g m)", sizes_[joint_]);
  return "joint " + s.joints[joint_].name + " is open by " + where + ", more than a hundredth of " +
         (turned_ ? "a radian" : "body " + s.bodies[bodies_[joint_]].name + beside) +
         R"(: expected "joint_correction": "projection" in "simulation", which keeps joints )" +
         "closed, got \"" + NameOf(JointCorrectionOf(s.settings), kJointCorrectionNames) + "\"";
}

std::string OpenJointOf(const Model<double>& model, const State<double>& state, double time) {
  JointWatch watch(model);
  watch.Look(model, state, time);
  return watch.Message(model);
}

}  // namespace tangible
