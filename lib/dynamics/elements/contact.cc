// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contact.h"

#include <cmath>

namespace tangible {
namespace {

// The vertices of a part of a body that may touch a spline: all of a convex shape, of a concave
// polygon the corner at which a run starts.
PlacedVertices VerticesOf(const Model<double>& model, int body, int part,
                          const ShapeView<double>& shape, const Pose<double>& pose) {
  const Outline* const outline = model.OutlineOf(body, part);
  if (outline == nullptr) return {shape, pose, 0, NumVertices(shape.type, shape.num_numbers)};
  const OutlineRun& run = outline->run(model.structure->bodies[body].RunOfPart(part));
  return {shape, pose, run.first, run.before == OutlineJoint::kConvex ? 1 : 0};
}

}  // namespace

int FindFeaturesAtCurve(const Model<double>& model, const PairAtCurve& pair, double max_gap,
                        ContactFeature features[2]) {
  const ShapeView<double> shape = model.Shape(pair.other, pair.part);
  return FindCurveFeatures({*pair.curve, pair.curve_pose},
                           VerticesOf(model, pair.other, pair.part, shape, pair.other_pose),
                           pair.side, max_gap, features);
}

double DistanceAtCurve(const Model<double>& model, const PairAtCurve& pair,
                       ContactFeature* nearest) {
  const ShapeView<double> shape = model.Shape(pair.other, pair.part);
  return DistanceOfCurve({*pair.curve, pair.curve_pose},
                         VerticesOf(model, pair.other, pair.part, shape, pair.other_pose),
                         pair.side, nearest);
}

int FindFeaturesAtSeams(const Model<double>& model, int a, const Pose<double>& pose_a, int b,
                        const Pose<double>& pose_b, PartPair parts, double max_gap,
                        ContactFeature features[2]) {
  const ShapeView<double> shape_a = model.Shape(a, parts.a);
  const ShapeView<double> shape_b = model.Shape(b, parts.b);
  if (const Curve* curve = model.CurveOf(a, parts.a); curve != nullptr) {
    return FindFeaturesAtCurve(model, {curve, pose_a, b, parts.b, pose_b, SeamSide::kFirst},
                               max_gap, features);
  }
  if (const Curve* curve = model.CurveOf(b, parts.b); curve != nullptr) {
    return FindFeaturesAtCurve(model, {curve, pose_b, a, parts.a, pose_a, SeamSide::kSecond},
                               max_gap, features);
  }
  const Outline* const outline_a = model.OutlineOf(a, parts.a);
  const Outline* const outline_b = model.OutlineOf(b, parts.b);
  if (outline_a != nullptr || outline_b != nullptr) {
    const int run_a = outline_a == nullptr ? 0 : model.structure->bodies[a].RunOfPart(parts.a);
    const int run_b = outline_b == nullptr ? 0 : model.structure->bodies[b].RunOfPart(parts.b);
    if (outline_a != nullptr && outline_b != nullptr) {
      return FindFeaturesOfRuns({*outline_a, run_a, pose_a}, {*outline_b, run_b, pose_b}, max_gap,
                                features);
    }
    const SeamSide side = outline_a != nullptr ? SeamSide::kFirst : SeamSide::kSecond;
    const Outline& outline = outline_a != nullptr ? *outline_a : *outline_b;
    const ShapeView<double>& other = outline_a != nullptr ? shape_b : shape_a;
    if (other.type == ShapeType::kHalfPlane) {
      return FindPlaneFeature(outline, outline_a != nullptr ? run_a : run_b, other, pose_a, pose_b,
                              side, max_gap, features);
    }
    const ShapeSeams* const seams =
        outline_a != nullptr ? model.SeamsOf(b, parts.b) : model.SeamsOf(a, parts.a);
    return FindOutlineFeatures(outline, outline_a != nullptr ? run_a : run_b, shape_a, pose_a,
                               shape_b, pose_b, side, seams, max_gap, features);
  }
  if (const ShapeSeams* seams = model.SeamsOf(a, parts.a); seams != nullptr) {
    return FindContactFeaturesAtSeams(shape_a, pose_a, shape_b, pose_b, *seams, SeamSide::kFirst,
                                      max_gap, features);
  }
  if (const ShapeSeams* seams = model.SeamsOf(b, parts.b); seams != nullptr) {
    return FindContactFeaturesAtSeams(shape_a, pose_a, shape_b, pose_b, *seams, SeamSide::kSecond,
                                      max_gap, features);
  }
  return FindContactFeatures(shape_a, pose_a, shape_b, pose_b, max_gap, features);
}

CoefficientSource MixedFriction(const Model<double>& model, int a, int b) {
  const ModelStructure& structure = *model.structure;
  const PairIndex* pair = structure.FindPair(a, b);
  if (pair != nullptr && pair->friction >= 0) {
    return OwnCoefficient(model, pair->friction);
  }
  return MixedCoefficient(model, structure.bodies[a].friction, structure.bodies[b].friction,
                          structure.settings.friction_mixing);
}

CoefficientSource FrictionOf(const Model<double>& model, const ActiveContact& contact) {
  if (contact.is_rolling) {
    CoefficientSource rolling;
    MixedRolling(model, contact.a, contact.b, &rolling);
    return rolling;
  }
  if (contact.joint < 0) {
    return MixedFriction(model, contact.a, contact.b);
  }
  const JointIndex& joint = model.structure->joints[contact.joint];
  if (contact.is_motor) return OwnCoefficient(model, joint.motor + 1);
  return contact.IsJointFriction() ? OwnCoefficient(model, joint.friction) : CoefficientSource();
}

bool MixedRolling(const Model<double>& model, int a, int b, CoefficientSource* rolling) {
  const ModelStructure& structure = *model.structure;
  if (!structure.has_rolling_friction) return false;
  const PairIndex* pair = structure.FindPair(a, b);
  if (pair != nullptr && pair->rolling_friction >= 0) {
    *rolling = OwnCoefficient(model, pair->rolling_friction);
    return true;
  }
  const int of_a = structure.bodies[a].rolling_friction;
  const int of_b = structure.bodies[b].rolling_friction;
  if (of_a < 0 && of_b < 0) return false;
  if (of_a >= 0 && of_b >= 0) {
    *rolling = MixedCoefficient(model, of_a, of_b, structure.settings.friction_mixing);
    return true;
  }
  if (structure.settings.friction_mixing != Mixing::kAverage) return false;
  *rolling = OwnCoefficient(model, std::max(of_a, of_b));
  rolling->derivatives[0] = 0.5;
  rolling->value *= 0.5;
  return true;
}

bool AppendRolling(const Model<double>& model, std::vector<ActiveContact>* contacts) {
  CoefficientSource rolling;
  if (contacts->empty() || !contacts->back().IsOfShapes() ||
      !MixedRolling(model, contacts->back().a, contacts->back().b, &rolling)) {
    return false;
  }
  ActiveContact friction = contacts->back();
  friction.is_rolling = true;
  friction.law = ContactLaw::kInelastic;
  friction.gap = 0.0;
  contacts->push_back(friction);
  return true;
}

void AppendLimits(const Model<double>& model, const State<double>& state,
                  std::vector<ActiveContact>* contacts) {
  if (!model.structure->has_limits) return;
  const std::vector<JointIndex>& joints = model.structure->joints;
  for (size_t j = 0; j < joints.size(); ++j) {
    for (const double side : {1.0, -1.0}) {
      if (!HasLimit(model, state, joints[j], side)) continue;
      ActiveContact& limit = contacts->emplace_back();
      limit.a = joints[j].a;
      limit.b = joints[j].b;
      limit.joint = static_cast<int>(j);
      limit.side = side;
      limit.law = ContactLaw::kInelastic;
    }
  }
}

void AppendJointFriction(const Model<double>& model, const State<double>& state,
                         std::vector<ActiveContact>* contacts) {
  if (!model.structure->has_joint_friction) return;
  const std::vector<JointIndex>& joints = model.structure->joints;
  for (size_t j = 0; j < joints.size(); ++j) {
    if (IsReleased(state, static_cast<int>(j))) continue;
    for (const bool is_motor : {false, true}) {
      if ((is_motor ? joints[j].motor : joints[j].friction) < 0) continue;
      ActiveContact& contact = contacts->emplace_back();
      contact.a = joints[j].a;
      contact.b = joints[j].b;
      contact.joint = static_cast<int>(j);
      contact.is_motor = is_motor;
      contact.law = ContactLaw::kInelastic;
    }
  }
}

CoefficientSource RestitutionOf(const Model<double>& model, const ActiveContact& contact) {
  if (contact.is_rolling) return CoefficientSource();
  if (contact.joint < 0) return MixedRestitution(model, contact.a, contact.b);
  const int restitution = model.structure->joints[contact.joint].limit_restitution;
  return restitution < 0 || contact.IsJointFriction() ? CoefficientSource()
                                                      : OwnCoefficient(model, restitution);
}

CoefficientSource MixedRestitution(const Model<double>& model, int a, int b) {
  const ModelStructure& structure = *model.structure;
  const PairIndex* pair = structure.FindPair(a, b);
  if (pair != nullptr && pair->restitution >= 0) {
    return OwnCoefficient(model, pair->restitution);
  }
  return MixedCoefficient(model, structure.bodies[a].restitution, structure.bodies[b].restitution,
                          structure.settings.restitution_mixing);
}

}  // namespace tangible
