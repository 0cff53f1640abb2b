// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Contacts and joint limits of a step: their rows, and the constant c_n of each row.
//
//   s_n = n·v⁺ + c_n ≥ 0
//   kGap          c_n = gap / h: lands on the surface and rests there without drift
//   kRecovery     c_n = −recovery_speed: where gap / h is below that, so that a body leaves
//                 penetration no faster
//   kRestitution  c_n = e (n·v): an impact
//   kInelastic    c_n = 0: an impact without rebound (event stepping alone)
//   kPoisson      c_n = 0, λn ≥ e λ¹n: the decompression that follows a compression with impulse
//                 λ¹n (event stepping alone)
//
// A contact has an impact where e > 0, n·v < −threshold and gap + h n·v_free < margin; in
// penetration the smaller of both constants is taken. A joint limit is a row like a contact without
// friction, its gap the coordinate's distance from the limit. Dry friction in a joint is a contact
// without a normal row that is always closed: its tangent row is that of the coordinate, and the
// force or torque at which it slides takes the place of μ (contact_problem.h). A motor is friction
// about the speed that it keeps. Rolling friction of a contact is one too: its tangent row is the
// relative angular velocity, and ρ λn of the contact, which stands before it in all lists, takes
// the place of the force at which it slides.
//
// The law is a discrete choice that is made in double, and the derivative is that of the chosen
// law. The map from states to states jumps between kGap and kRestitution; the margins say how near
// that jump is.

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/joint.h"
#include "tangible/geometry/collide.h"

namespace tangible {

enum class ContactLaw : unsigned char { kGap, kRecovery, kRestitution, kInelastic, kPoisson };

/// The discrete part of a contact of a step. A limit of a joint, or friction in it, has joint ≥ 0
/// and no feature.
struct ActiveContact {
  int a = -1, b = -1;  ///< bodies; a < b for contacts of shapes
  ContactFeature feature;
  int joint = -1;     ///< of a limit or friction in a joint
  double side = 0.0;  ///< of a limit: +1 low, −1 high; 0 of friction in a joint
  /// Of the motor of a joint, which is friction about its speed (IsJointFriction holds).
  bool is_motor = false;
  bool is_servo = false;    ///< names the event of a servo, of a joint or on body a; no contact
  bool is_support = false;  ///< names the support of body a; no contact
  /// Rolling friction of the contact before it in the list, whose feature it has.
  bool is_rolling = false;
  ContactLaw law = ContactLaw::kGap;
  double gap = 0.0;  ///< m (rad for the limit of an angle), at the step's start
  bool IsJointFriction() const { return joint >= 0 && side == 0.0; }
  /// Friction without a normal row of its own.
  bool IsPureFriction() const { return is_rolling || IsJointFriction(); }
  /// A contact of two shapes.
  bool IsOfShapes() const { return joint < 0 && !is_rolling; }
  /// Whether `next` is the rolling friction of this contact.
  bool RollsBy(const ActiveContact& next) const {
    return next.is_rolling && !is_rolling && joint < 0 && a == next.a && b == next.b &&
           feature == next.feature;
  }
  /// Whether both contacts are between the same bodies, as those at the two ends of a face, or of
  /// the same joint.
  bool IsBetweenTheSame(const ActiveContact& other) const {
    return a == other.a && b == other.b && joint == other.joint && is_motor == other.is_motor &&
           is_rolling == other.is_rolling;
  }
  /// Whether both contacts are between the same two shapes.
  bool IsOfTheSameShapes(const ActiveContact& other) const {
    return IsOfShapes() && other.IsOfShapes() && a == other.a && b == other.b &&
           feature.part_a == other.feature.part_a && feature.part_b == other.feature.part_b;
  }
  PartPair Parts() const { return {feature.part_a, feature.part_b}; }
  /// Whether contacts of two steps are the same.
  bool SameAs(const ActiveContact& other) const {
    return a == other.a && b == other.b && feature == other.feature && joint == other.joint &&
           side == other.side && is_motor == other.is_motor && is_rolling == other.is_rolling;
  }
};

/// A spline and a part of another body. `side`: which one of the pair the spline is.
struct PairAtCurve {
  const Curve* curve = nullptr;
  const Pose<double>& curve_pose;
  int other = -1, part = 0;
  const Pose<double>& other_pose;
  SeamSide side = SeamSide::kFirst;
};
/// FindCurveFeatures and DistanceOfCurve of such a pair.
int FindFeaturesAtCurve(const Model<double>& model, const PairAtCurve& pair, double max_gap,
                        ContactFeature features[2]);
double DistanceAtCurve(const Model<double>& model, const PairAtCurve& pair,
                       ContactFeature* nearest);

/// FindFeatures where one of the shapes has seams, an outline or a curve.
int FindFeaturesAtSeams(const Model<double>& model, int a, const Pose<double>& pose_a, int b,
                        const Pose<double>& pose_b, PartPair parts, double max_gap,
                        ContactFeature features[2]);

/// FindContactFeatures for one part of each of two bodies, without what seams hide.
inline int FindFeatures(const Model<double>& model, int a, const Pose<double>& pose_a, int b,
                        const Pose<double>& pose_b, PartPair parts, double max_gap,
                        ContactFeature features[2]) {
  const int count = model.seams != nullptr
                        ? FindFeaturesAtSeams(model, a, pose_a, b, pose_b, parts, max_gap, features)
                        : FindContactFeatures(model.Shape(a, parts.a), pose_a,
                                              model.Shape(b, parts.b), pose_b, max_gap, features);
  for (int k = 0; k < count; ++k) {
    features[k].part_a = parts.a;
    features[k].part_b = parts.b;
  }
  return count;
}

/// The shapes of a contact.
template <typename T>
ShapeView<T> ShapeOfA(const Model<T>& model, const ActiveContact& contact) {
  return model.Shape(contact.a, contact.feature.part_a);
}
template <typename T>
ShapeView<T> ShapeOfB(const Model<T>& model, const ActiveContact& contact) {
  return model.Shape(contact.b, contact.feature.part_b);
}

/// A coefficient of a contact and its derivatives with respect to the parameters that determine it.
struct CoefficientSource {
  int numbers[2] = {-1, -1};  ///< places in the model's numbers, −1: none
  double derivatives[2] = {0, 0};
  double value = 0.0;
  bool tie = false;  ///< a kink of the mixing rule: min/max of equal values, geometric mean at 0
};

/// The coefficient that one number of the model is.
template <typename T>
CoefficientSource OwnCoefficient(const Model<T>& model, int number) {
  CoefficientSource source;
  source.numbers[0] = number;
  source.derivatives[0] = 1.0;
  source.value = ValueOf(model.parameters[number]);
  return source;
}

/// The coefficient that two numbers of the model mix to.
template <typename T>
CoefficientSource MixedCoefficient(const Model<T>& model, int first, int second, Mixing mixing) {
  CoefficientSource source;
  source.numbers[0] = first;
  source.numbers[1] = second;
  const double x = ValueOf(model.parameters[first]);
  const double y = ValueOf(model.parameters[second]);
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

/// How the friction of a contact decays with its sliding speed w (Stribeck), by events, with μk =
/// `kinetic` and vs = `speed`, m/s:
///   |λt| = (μk + (μ − μk) exp(−(w / vs)²)) λn
struct DecaySource {
  CoefficientSource kinetic, speed;
};

/// False where the friction of the two bodies does not decay. A body without a kinetic friction
/// counts with its friction at rest; a pair that has a friction of its own decays only if it has a
/// kinetic one too.
template <typename T>
bool MixedDecay(const Model<T>& model, int a, int b, DecaySource* decay) {
  const ModelStructure& structure = *model.structure;
  if (!structure.friction_decays) return false;
  const PairIndex* pair = structure.FindPair(a, b);
  if (pair != nullptr && pair->kinetic_friction >= 0) {
    decay->kinetic = OwnCoefficient(model, pair->kinetic_friction);
    decay->speed = OwnCoefficient(model, pair->kinetic_friction + 1);
    return true;
  }
  const BodyIndex& first = structure.bodies[a];
  const BodyIndex& second = structure.bodies[b];
  const int of_a = first.kinetic_friction;
  const int of_b = second.kinetic_friction;
  if ((pair != nullptr && pair->friction >= 0) || (of_a < 0 && of_b < 0)) return false;
  const Mixing mixing = structure.settings.friction_mixing;
  decay->kinetic = MixedCoefficient(model, of_a < 0 ? first.friction : of_a,
                                    of_b < 0 ? second.friction : of_b, mixing);
  decay->speed = of_a < 0 || of_b < 0 ? OwnCoefficient(model, std::max(of_a, of_b) + 1)
                                      : MixedCoefficient(model, of_a + 1, of_b + 1, mixing);
  return true;
}

/// The friction (or restitution) of two bodies, by the entry of their pair or by the mixing rule:
/// average, minimum, maximum (at a tie the derivative is the mean of both), geometric mean (at 0
/// the derivative is 0).
CoefficientSource MixedFriction(const Model<double>& model, int a, int b);
CoefficientSource MixedRestitution(const Model<double>& model, int a, int b);
/// Their rolling friction, m, mixed by the rule of friction, where a body without it has 0; false
/// where neither has it, and where the geometric mean is 0 because one of them has none.
bool MixedRolling(const Model<double>& model, int a, int b, CoefficientSource* rolling);
/// Appends to a list the rolling friction of its last contact, if that has it; whether it did.
bool AppendRolling(const Model<double>& model, std::vector<ActiveContact>* contacts);
/// The restitution of any active contact: mixed between shapes, or that of a joint's limits;
/// friction has none.
CoefficientSource RestitutionOf(const Model<double>& model, const ActiveContact& contact);
/// The coefficient of any active contact: mixed between shapes, or that of a joint's friction; a
/// limit has none.
CoefficientSource FrictionOf(const Model<double>& model, const ActiveContact& contact);

/// Whether a joint that has not been released has a limit on a side (+1 low, −1 high) that it can
/// reach: the distance of a rope's ends is never below 0, and at 0 it has no direction.
inline bool HasLimit(const Model<double>& model, const State<double>& state,
                     const JointIndex& joint, double side) {
  const int limit = side > 0.0 ? joint.low : joint.high;
  return limit >= 0 && !IsReleased(*model.structure, state, joint) &&
         (joint.type != JointType::kRope || side < 0.0 || model.parameters[limit] > 0.0);
}

/// The limits of all joints (HasLimit), of a joint the low one first; gaps are not set.
void AppendLimits(const Model<double>& model, const State<double>& state,
                  std::vector<ActiveContact>* contacts);

/// The friction and motor of each joint that has them, which are active until it is released.
void AppendJointFriction(const Model<double>& model, const State<double>& state,
                         std::vector<ActiveContact>* contacts);

/// The coefficient as a T, by the chain rule.
template <typename T>
T EvaluateCoefficient(const CoefficientSource& source, const std::vector<T>& numbers) {
  T value(source.value);
  for (int k = 0; k < 2; ++k) {
    if (source.numbers[k] >= 0) {
      const T& number = numbers[source.numbers[k]];
      value += source.derivatives[k] * (number - ValueOf(number));
    }
  }
  return value;
}

/// Geometry of a contact at a state, and its rows on the twists of both bodies.
template <typename T>
struct ContactRows {
  ContactGeometry<T> geometry;
  RowPart<T> normal_a, normal_b, tangent_a, tangent_b;
  /// Of a motor: minus the speed that it keeps. The sliding speed is t·v + slide.
  T slide{0.0};
};

/// Rows of a contact of two shapes from its geometry, with the tangent t = (n_y, −n_x). The normal
/// passes through the centre of a disc, so the angular entry of the disc's normal row is exactly 0.
template <typename T>
void RowsFromGeometry(ShapeType shape_a, const Vector2<T>& position_a, ShapeType shape_b,
                      const Vector2<T>& position_b, ContactRows<T>* rows) {
  const Vector2<T>& n = rows->geometry.normal;
  const Vector2<T> t(n.y(), -n.x());
  const Vector2<T> arm_a = rows->geometry.point - position_a;
  const Vector2<T> arm_b = rows->geometry.point - position_b;
  rows->normal_a = PointRow(n, arm_a);
  rows->normal_b = Negative(PointRow(n, arm_b));
  if (shape_a == ShapeType::kCircle) {
    rows->normal_a[2] = T(0.0);
  }
  if (shape_b == ShapeType::kCircle) {
    rows->normal_b[2] = T(0.0);
  }
  rows->tangent_a = PointRow(t, arm_a);
  rows->tangent_b = Negative(PointRow(t, arm_b));
}

/// row_a · twist_a + row_b · twist_b, whether the bodies move freely or as prescribed.
template <typename T>
T RelativeSpeed(const State<T>& state, int a, const RowPart<T>& row_a, int b,
                const RowPart<T>& row_b) {
  T speed(0.0);
  for (int i = 0; i < 3; ++i) {
    speed += row_a[i] * state.twist[3 * a + i] + row_b[i] * state.twist[3 * b + i];
  }
  return speed;
}

/// The sliding speed of a contact, m/s; rad/s of a joint that turns.
template <typename T>
T SlipOf(const State<T>& state, const ActiveContact& contact, const ContactRows<T>& rows) {
  return RelativeSpeed(state, contact.a, rows.tangent_a, contact.b, rows.tangent_b) + rows.slide;
}

/// The sign of the sliding speed of a contact; 0 where the speed is rounding of its terms.
template <typename T>
double SlipSign(const State<double>& state, const ActiveContact& contact,
                const ContactRows<T>& rows) {
  double slip = 0.0;
  double terms = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double on_a = ValueOf(rows.tangent_a[i]) * state.twist[3 * contact.a + i];
    const double on_b = ValueOf(rows.tangent_b[i]) * state.twist[3 * contact.b + i];
    slip += on_a + on_b;
    terms += std::abs(on_a) + std::abs(on_b);
  }
  slip += ValueOf(rows.slide);
  terms += std::abs(ValueOf(rows.slide));
  return std::abs(slip) <= kSlipRounding * terms ? 0.0 : slip > 0.0 ? 1.0 : -1.0;
}

/// Evaluates a contact between the shapes of two bodies at given poses.
template <typename T>
void EvaluateContactRows(const Model<T>& model, const Pose<T>& pose_a, const Pose<T>& pose_b,
                         const ActiveContact& contact, ContactRows<T>* rows) {
  const ShapeView<T> shape_a = ShapeOfA(model, contact);
  const ShapeView<T> shape_b = ShapeOfB(model, contact);
  rows->geometry = EvaluateContact(FeatureAt(contact.feature, shape_a, pose_a, shape_b, pose_b),
                                   shape_a, pose_a, shape_b, pose_b);
  RowsFromGeometry(shape_a.type, pose_a.position, shape_b.type, pose_b.position, rows);
}

/// The rows of rolling friction: ω_a − ω_b.
template <typename T>
void SetRollingRows(ContactRows<T>* rows) {
  const RowPart<T> none{T(0.0), T(0.0), T(0.0)};
  rows->geometry.gap = T(0.0);
  rows->geometry.normal = rows->geometry.point = Vector2<T>(T(0.0), T(0.0));
  rows->normal_a = rows->normal_b = none;
  rows->tangent_a = {T(0.0), T(0.0), T(1.0)};
  rows->tangent_b = {T(0.0), T(0.0), T(-1.0)};
}

/// The same at a state, with the poses of all bodies.
template <typename T>
void EvaluateContactRows(const Model<T>& model, const State<T>& state, const ActiveContact& contact,
                         ContactRows<T>* rows) {
  EvaluateContactRows(model, state.PoseOf(contact.a), state.PoseOf(contact.b), contact, rows);
}
template <typename T>
void EvaluateContactRows(const Model<T>& model, const std::vector<Pose<T>>& poses,
                         const ActiveContact& contact, ContactRows<T>* rows) {
  EvaluateContactRows(model, poses[contact.a], poses[contact.b], contact, rows);
}

/// Evaluates a joint limit (the normal row is that of the coordinate times its side, the gap is
/// side (coordinate − limit), and there is no tangent) or friction in a joint (the tangent row is
/// that of the coordinate, there is no normal row, and the gap is 0). `number` is the limit, or the
/// speed of a motor; it is not read for friction.
template <typename T>
void EvaluateLimitRows(const T& number, const JointRows<T>& joint_rows,
                       const ActiveContact& contact, ContactRows<T>* rows) {
  const bool slides = contact.IsJointFriction();
  rows->geometry.gap = slides ? T(0.0) : T(contact.side * (joint_rows.coordinate - number));
  rows->slide = contact.is_motor ? T(-number) : T(0.0);
  rows->geometry.normal = Vector2<T>(T(0.0), T(0.0));
  rows->geometry.point = Vector2<T>(T(0.0), T(0.0));
  for (int i = 0; i < 3; ++i) {
    rows->normal_a[i] = slides ? T(0.0) : T(contact.side * joint_rows.coordinate_a[i]);
    rows->normal_b[i] = slides ? T(0.0) : T(contact.side * joint_rows.coordinate_b[i]);
    rows->tangent_a[i] = slides ? joint_rows.coordinate_a[i] : T(0.0);
    rows->tangent_b[i] = slides ? joint_rows.coordinate_b[i] : T(0.0);
  }
}

/// The parameter of the model that EvaluateLimitRows reads: a limit, or the speed of a motor; of
/// friction the friction itself.
inline int LimitNumber(const JointIndex& joint, const ActiveContact& contact) {
  if (contact.is_motor) return joint.motor;
  return contact.IsJointFriction() ? joint.friction : contact.side > 0.0 ? joint.low : joint.high;
}

/// Evaluates any active contact at a state.
template <typename T>
void EvaluateActiveRows(const Model<T>& model, const State<T>& state, const ActiveContact& contact,
                        ContactRows<T>* rows) {
  if (contact.is_rolling) return SetRollingRows(rows);
  if (contact.joint < 0) {
    EvaluateContactRows(model, state, contact, rows);
    return;
  }
  const JointIndex& joint = model.structure->joints[contact.joint];
  JointRows<T> joint_rows;
  EvaluateJoint(model, state, joint, &joint_rows);
  EvaluateLimitRows(model.parameters[LimitNumber(joint, contact)], joint_rows, contact, rows);
}

/// The speeds at which the points of a contact separate (n v) and slide (t v), m/s; rad/s for a
/// joint that turns.
struct ContactSpeeds {
  double normal, slip;
};
inline ContactSpeeds SpeedsOf(const Model<double>& model, const State<double>& state,
                              const ActiveContact& contact) {
  ContactRows<double> rows;
  EvaluateActiveRows(model, state, contact, &rows);
  return {RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b),
          SlipOf(state, contact, rows)};
}

}  // namespace tangible
