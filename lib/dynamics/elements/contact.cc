// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contact.h"

#include <cmath>

namespace tangible {
namespace {

CoefficientSource Own(const Model<double>& model, int number) {
  CoefficientSource source;
  source.numbers[0] = number;
  source.derivatives[0] = 1.0;
  source.value = model.parameters[number];
  return source;
}

CoefficientSource Mix(const Model<double>& model, int first, int second, Mixing mixing) {
  CoefficientSource source;
  source.numbers[0] = first;
  source.numbers[1] = second;
  const double x = model.parameters[first];
  const double y = model.parameters[second];
  double* d = source.derivatives;
  switch (mixing) {
    case Mixing::kAverage:
      source.value = 0.5 * (x + y);
      d[0] = d[1] = 0.5;
      break;
    case Mixing::kGeometricMean:
      source.value = std::sqrt(x * y);
      // The derivative of the geometric mean is infinite where one coefficient is 0 and the other
      // is not.
      source.tie = source.value == 0.0;
      d[0] = source.tie ? 0.0 : 0.5 * y / source.value;
      d[1] = source.tie ? 0.0 : 0.5 * x / source.value;
      break;
  }
  return source;
}

}  // namespace

int FindFeaturesAtSeams(const Model<double>& model, int a, const Pose<double>& pose_a, int b,
                        const Pose<double>& pose_b, PartPair parts, double max_gap,
                        ContactFeature features[2]) {
  const ShapeView<double> shape_a = model.Shape(a, parts.a);
  const ShapeView<double> shape_b = model.Shape(b, parts.b);
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
    return Own(model, pair->friction);
  }
  return Mix(model, structure.bodies[a].friction, structure.bodies[b].friction,
             structure.settings.friction_mixing);
}

CoefficientSource FrictionOf(const Model<double>& model, const ActiveContact& contact) {
  if (contact.joint < 0) {
    return MixedFriction(model, contact.a, contact.b);
  }
  const JointIndex& joint = model.structure->joints[contact.joint];
  if (contact.is_motor) return Own(model, joint.motor + 1);
  return contact.IsJointFriction() ? Own(model, joint.friction) : CoefficientSource();
}

void AppendLimits(const Model<double>& model, std::vector<ActiveContact>* contacts) {
  const std::vector<JointIndex>& joints = model.structure->joints;
  for (size_t j = 0; j < joints.size(); ++j) {
    for (const double side : {1.0, -1.0}) {
      if ((side > 0.0 ? joints[j].low : joints[j].high) < 0) continue;
      ActiveContact& limit = contacts->emplace_back();
      limit.a = joints[j].a;
      limit.b = joints[j].b;
      limit.joint = static_cast<int>(j);
      limit.side = side;
      limit.law = ContactLaw::kInelastic;
    }
  }
}

void AppendJointFriction(const Model<double>& model, std::vector<ActiveContact>* contacts) {
  const std::vector<JointIndex>& joints = model.structure->joints;
  for (size_t j = 0; j < joints.size(); ++j) {
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
  if (contact.joint < 0) return MixedRestitution(model, contact.a, contact.b);
  const int restitution = model.structure->joints[contact.joint].limit_restitution;
  return restitution < 0 || contact.IsJointFriction() ? CoefficientSource()
                                                      : Own(model, restitution);
}

CoefficientSource MixedRestitution(const Model<double>& model, int a, int b) {
  const ModelStructure& structure = *model.structure;
  const PairIndex* pair = structure.FindPair(a, b);
  if (pair != nullptr && pair->restitution >= 0) {
    return Own(model, pair->restitution);
  }
  return Mix(model, structure.bodies[a].restitution, structure.bodies[b].restitution,
             structure.settings.restitution_mixing);
}

}  // namespace tangible
