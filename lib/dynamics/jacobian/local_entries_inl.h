// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Shared by equation_jacobian.cc and contact_gradient.cc: the variables of one element as
// LocalJets, and the entries of its equations.

#include <algorithm>
#include <cmath>
#include <vector>

#include "tangible/dynamics/elements/joint_coupling_inl.h"
#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/dynamics/model/driven_bodies.h"

namespace tangible::internal {

/// The variables of one element, each a component of a LocalJet.
class Locals {
 public:
  LocalJet Add(double value, int variable) {
    variables_[count_] = variable;
    return LocalJet(value, count_++);
  }
  int count() const { return count_; }
  int variable(int i) const { return variables_[i]; }

 private:
  int variables_[kLocalJetWidth];
  int count_ = 0;
};

/// Rows of the momentum equation that belong to a body; −1 where it does not move.
inline int BodyRow(const ModelStructure& structure, int body) {
  const int block = structure.bodies[body].block;
  return block < 0 ? -1 : 3 * block;
}

template <typename Sink>
class LocalEntries {
 public:
  LocalEntries(const Model<double>& model, const State<double>& state,
               LocalJacobianScratch* scratch, const Sink& sink)
      : model_(model),
        s_(*model.structure),
        x_(model.parameters),
        state_(state),
        scratch_(*scratch),
        sink_(sink) {}

  /// Of a support, or null.
  const SupportState* SupportAt(int k) const {
    return state_.supports.empty() ? nullptr : &state_.supports[k];
  }

 protected:
  /// row · x of two bodies.
  template <typename T>
  static T RowTimes(const double* x, int a, const RowPart<T>& row_a, int b,
                    const RowPart<T>& row_b) {
    T sum(0.0);
    for (int i = 0; i < 3; ++i) {
      sum += row_a[i] * x[3 * a + i] + row_b[i] * x[3 * b + i];
    }
    return sum;
  }

  /// The rows by which a support holds its body, at the motion of all bodies.
  struct HeldRows {
    const RowPart<LocalJet>* rows;
    const LocalJet* rhs;
    int count;
  };
  void EmitHeld(const Locals& locals, int support, const HeldRows& held, const double* motion,
                const ContactSolution<double>& solution) {
    const int body = s_.supports[support].body;
    const int joint = static_cast<int>(s_.joints.size()) + support;
    const RowPart<LocalJet> none{LocalJet(0.0), LocalJet(0.0), LocalJet(0.0)};
    for (int r = 0; r < held.count; ++r) {
      LocalJet speed = -held.rhs[r];
      for (int i = 0; i < 3; ++i) speed += held.rows[r][i] * motion[3 * body + i];
      Emit(locals, JointRow(joint) + r, speed);
      EmitMomentum(locals, body, held.rows[r], s_.world(), none,
                   -solution.joint_impulse[3 * static_cast<size_t>(joint) + r]);
    }
  }

  /// The accelerations or displacements of all bodies: the solved ones of moving bodies, the given
  /// accelerations of driven ones, else 0.
  const double* SpreadSolved(const SolvedEquations& solved) {
    std::vector<double>& all = scratch_.unknowns;
    if (solved.level == Level::kAcceleration) {
      GivenAccelerations(model_, solved.instant.time, solved.instant.middle, &all);
    } else {
      all.assign(3 * static_cast<size_t>(s_.num_bodies()), 0.0);
    }
    for (int k = 0; k < s_.num_blocks(); ++k) {
      std::copy_n(&solved.solution->motion[3 * static_cast<size_t>(k)], 3, &all[3 * s_.moving[k]]);
    }
    return all.data();
  }

  LocalJet LocalNumber(int number, Locals* locals) {
    return locals->Add(x_[number], s_.ParameterVariable(number));
  }

  Pose<LocalJet> LocalPose(int body, Locals* locals) {
    if (body == s_.world()) {
      return Pose<LocalJet>();
    }
    const double* q = &state_.pose[3 * body];
    Pose<LocalJet> pose;
    pose.position.x() = locals->Add(q[0], s_.PoseVariable(body, 0));
    pose.position.y() = locals->Add(q[1], s_.PoseVariable(body, 1));
    pose.angle = locals->Add(q[2], s_.PoseVariable(body, 2));
    // The angle is a variable; its sine and cosine have one derivative each and are computed once.
    const int angle = locals->count() - 1;
    const double cosine = std::cos(q[2]);
    const double sine = std::sin(q[2]);
    pose.rotation.cosine = LocalJet(cosine);
    pose.rotation.cosine.v[angle] = -sine;
    pose.rotation.sine = LocalJet(sine);
    pose.rotation.sine.v[angle] = cosine;
    return pose;
  }

  /// The parameters of a joint, up to seven.
  void LocalGeometry(const JointIndex& joint, Locals* locals, LocalJet numbers[7]) {
    for (int i = 0; i < joint.num_geometry; ++i) {
      numbers[i] = LocalNumber(joint.geometry + i, locals);
    }
  }

  /// Of a joint other than a coupling.
  void LocalJointRows(const JointIndex& joint, Locals* locals, JointRows<LocalJet>* rows) {
    const Pose<LocalJet> pose_a = LocalPose(joint.a, locals);
    const Pose<LocalJet> pose_b = LocalPose(joint.b, locals);
    LocalJet numbers[7];
    LocalGeometry(joint, locals, numbers);
    EvaluateJoint(joint.type, pose_a, pose_b, numbers, rows);
  }

  /// Calls visit(joint, locals, rows) with the rows of a joint on its bodies, or with each share of
  /// a coupling on those of the coupled joint.
  template <typename Visit>
  void ForEachShare(const JointIndex& joint, const Visit& visit) {
    for (int k = 0; k < (joint.IsCoupling() ? 2 : 1); ++k) {
      const JointIndex& of = joint.IsCoupling() ? s_.joints[joint.coupled[k]] : joint;
      Locals locals;
      JointRows<LocalJet> rows;
      LocalJointRows(of, &locals, &rows);
      if (joint.IsCoupling()) {
        const LocalJet number = LocalNumber(joint.geometry + (k == 0 ? 1 : 0), &locals);
        const LocalJet numbers[2] = {number, number};
        ScaleToShare(joint.type, k, numbers, &rows);
      }
      visit(of, locals, rows);
    }
  }

  /// A pose in double, with its twist as variables.
  MovingPose<LocalJet> ByTwist(int body, Locals* twists) {
    Locals constants;
    MovingPose<LocalJet> moving{LocalPose(body, &constants), {}};
    moving.pose.rotation.cosine.v.setZero();
    moving.pose.rotation.sine.v.setZero();
    moving.pose.position.x().v.setZero();
    moving.pose.position.y().v.setZero();
    moving.pose.angle.v.setZero();
    for (int i = 0; i < 3; ++i) {
      const double speed = state_.twist[3 * body + i];
      moving.twist[i] = s_.bodies[body].motion == Motion::kStatic
                            ? LocalJet(speed)
                            : twists->Add(speed, s_.TwistVariable(body, i));
    }
    return moving;
  }

  void RatesByTwist(const JointIndex& joint, Locals* twists, JointRates<LocalJet>* rates) {
    const MovingPose<LocalJet> a = ByTwist(joint.a, twists);
    const MovingPose<LocalJet> b = ByTwist(joint.b, twists);
    LocalJet numbers[7];
    for (int i = 0; i < joint.num_geometry; ++i) {
      numbers[i] = LocalJet(x_[joint.geometry + i]);
    }
    JointRows<LocalJet> rows;
    EvaluateJointRates(joint.type, a, b, numbers, joint.num_geometry, &rows, rates);
  }

  /// The rate of coordinate k of a coupling, times its factor.
  void ShareRatesByTwist(const JointIndex& coupling, int k, Locals* twists,
                         JointRates<LocalJet>* rates) {
    RatesByTwist(s_.joints[coupling.coupled[k]], twists, rates);
    if (k == 1) rates->coordinate *= LocalJet(x_[coupling.geometry]);
  }

  /// `share`: of a limit of a coupling, whose coordinate.
  void RatesByTwist(const ActiveContact& contact, int share, Locals* twists,
                    ContactRates<LocalJet>* rates) {
    if (contact.is_rolling) return;  // whose rows do not change
    if (contact.joint >= 0) {
      const JointIndex& joint = s_.joints[contact.joint];
      JointRates<LocalJet> of_joint;
      if (joint.IsCoupling()) {
        ShareRatesByTwist(joint, share, twists, &of_joint);
      } else {
        RatesByTwist(joint, twists, &of_joint);
      }
      SetLimitRates(contact, of_joint, rates);
      return;
    }
    const MovingPose<LocalJet> a = ByTwist(contact.a, twists);
    const MovingPose<LocalJet> b = ByTwist(contact.b, twists);
    // Rates by shapes' numbers are emitted with the poses.
    const ContactFeature feature = FeatureNow(contact);
    const ShapeView<LocalJet> shape_a = LocalShapeOfA(contact, feature, nullptr);
    const ShapeView<LocalJet> shape_b = LocalShapeOfB(contact, feature, nullptr);
    ContactRows<LocalJet> rows;
    EvaluateContactRates(feature, shape_a, a, shape_b, b, &scratch_.rates, &rows, rates);
  }

  /// The feature at the state.
  ContactFeature FeatureNow(const ActiveContact& contact) const {
    if (contact.feature.places == 0) return contact.feature;
    return FeatureAt(contact.feature, ShapeOfA(model_, contact), state_.PoseOf(contact.a),
                     ShapeOfB(model_, contact), state_.PoseOf(contact.b));
  }

  /// The shape parameters that the feature reads, as LocalJets in their places; as constants
  /// without `locals`.
  ShapeView<LocalJet> LocalShape(const PartIndex& index, bool is_edge, int feature, Locals* locals,
                                 std::vector<LocalJet>* numbers) {
    if (static_cast<int>(numbers->size()) < index.num_numbers) {
      numbers->resize(index.num_numbers);
    }
    int used[kMostFeatureNumbers];
    const int count = FeatureNumbers(index.type, index.num_numbers, is_edge, feature, used);
    for (int i = 0; i < count; ++i) {
      const int number = index.numbers + used[i];
      (*numbers)[used[i]] = locals == nullptr ? LocalJet(x_[number]) : LocalNumber(number, locals);
    }
    return {index.type, numbers->data(), index.num_numbers};
  }
  ShapeView<LocalJet> LocalShapeOfA(const ActiveContact& contact, const ContactFeature& feature,
                                    Locals* locals) {
    return LocalShape(s_.bodies[contact.a].Part(feature.part_a),
                      feature.kind == FeatureKind::kEdgeVertex, feature.a, locals,
                      &scratch_.numbers_a);
  }
  ShapeView<LocalJet> LocalShapeOfB(const ActiveContact& contact, const ContactFeature& feature,
                                    Locals* locals) {
    return LocalShape(s_.bodies[contact.b].Part(feature.part_b),
                      feature.kind == FeatureKind::kVertexEdge, feature.b, locals,
                      &scratch_.numbers_b);
  }

  void LocalContactRows(const ActiveContact& contact, Locals* locals, ContactRows<LocalJet>* rows) {
    const Pose<LocalJet> pose_a = LocalPose(contact.a, locals);
    const Pose<LocalJet> pose_b = LocalPose(contact.b, locals);
    const ContactFeature feature = FeatureNow(contact);
    const ShapeView<LocalJet> shape_a = LocalShapeOfA(contact, feature, locals);
    const ShapeView<LocalJet> shape_b = LocalShapeOfB(contact, feature, locals);
    rows->geometry = EvaluateContact(feature, shape_a, pose_a, shape_b, pose_b);
    RowsFromGeometry(shape_a.type, pose_a.position, shape_b.type, pose_b.position, rows);
  }

  bool FollowsPath(int body) const { return PathOfBody(s_, body) >= 0; }

  /// A row of accelerations reads that of a driven body.
  template <typename T>
  void EmitGiven(int row, int body, const RowPart<T>& part, const Instant<double>& instant) {
    if (s_.paths.empty()) return;
    AccelerationEntries(model_, body, instant.time, instant.middle, &scratch_.given);
    for (const GivenEntry& entry : scratch_.given) {
      sink_(row, entry.variable, ValueOf(part[entry.component]) * entry.value);
    }
  }

  void Emit(const Locals& locals, int row, const LocalJet& value) {
    for (int i = 0; i < locals.count(); ++i) {
      if (value.v[i] != 0.0) {
        sink_(row, locals.variable(i), value.v[i]);
      }
    }
  }

  /// The same of value · factor.
  void Emit(const Locals& locals, int row, const LocalJet& value, double factor) {
    for (int i = 0; i < locals.count(); ++i) {
      if (value.v[i] != 0.0) {
        sink_(row, locals.variable(i), value.v[i] * factor);
      }
    }
  }

  /// Momentum rows += rowᵀ amount on both bodies.
  void EmitMomentum(const Locals& locals, int a, const RowPart<LocalJet>& row_a, int b,
                    const RowPart<LocalJet>& row_b, const LocalJet& amount) {
    const int at_a = BodyRow(s_, a);
    const int at_b = BodyRow(s_, b);
    for (int i = 0; i < 3; ++i) {
      if (at_a >= 0) {
        Emit(locals, at_a + i, row_a[i] * amount);
      }
      if (at_b >= 0) {
        Emit(locals, at_b + i, row_b[i] * amount);
      }
    }
  }

  /// The same with an amount that no local variable changes.
  void EmitMomentum(const Locals& locals, int a, const RowPart<LocalJet>& row_a, int b,
                    const RowPart<LocalJet>& row_b, double amount) {
    if (amount == 0.0) {
      return;
    }
    const int at_a = BodyRow(s_, a);
    const int at_b = BodyRow(s_, b);
    for (int i = 0; i < 3; ++i) {
      if (at_a >= 0) {
        Emit(locals, at_a + i, row_a[i], amount);
      }
      if (at_b >= 0) {
        Emit(locals, at_b + i, row_b[i], amount);
      }
    }
  }

  /// Momentum rows += rowᵀ value of a row in double, for the derivative with respect to one
  /// variable.
  template <typename Row>
  void EmitRowTimesVariable(int a, const Row& row_a, int b, const Row& row_b, int variable,
                            double value) {
    const int at_a = BodyRow(s_, a);
    const int at_b = BodyRow(s_, b);
    for (int i = 0; i < 3; ++i) {
      if (at_a >= 0) {
        sink_(at_a + i, variable, ValueOf(row_a[i]) * value);
      }
      if (at_b >= 0) {
        sink_(at_b + i, variable, ValueOf(row_b[i]) * value);
      }
    }
  }

  /// The entries of a sliding contact's friction by a coefficient, times a factor.
  template <typename T>
  void EmitFriction(const ActiveContact& contact, const ContactRows<T>& rows,
                    const CoefficientSource& source, double factor) {
    for (int k = 0; k < 2 && factor != 0.0; ++k) {
      if (source.numbers[k] < 0) continue;
      EmitRowTimesVariable(contact.a, rows.tangent_a, contact.b, rows.tangent_b,
                           s_.ParameterVariable(source.numbers[k]), factor * source.derivatives[k]);
    }
  }

  /// The entries of a coefficient that decays with the sliding speed (DecaySource), times a factor,
  /// but for those of the friction at rest, whose share is returned.
  double EmitDecay(const ActiveContact& contact, const ContactRows<LocalJet>& rows, double rest,
                   const LocalJet& slip, const Locals& locals, double factor) {
    DecaySource decay;
    // Without friction at rest there is none that slides, whatever the kinetic one is.
    if (!contact.IsOfShapes() || rest == 0.0 || !MixedDecay(model_, contact.a, contact.b, &decay)) {
      return 1.0;
    }
    const LocalJet numbers[3] = {LocalJet(rest, 0), LocalJet(decay.kinetic.value, 1),
                                 LocalJet(decay.speed.value, 2)};
    const LocalJet lost = FrictionDecay(numbers, LocalJet(slip.a, 3));
    const double side = slip.a < 0.0 ? -1.0 : 1.0;
    EmitFriction(contact, rows, decay.kinetic, -side * factor * lost.v[1]);
    EmitFriction(contact, rows, decay.speed, -side * factor * lost.v[2]);
    const auto emit = [&](int variable, double value) {
      EmitRowTimesVariable(contact.a, rows.tangent_a, contact.b, rows.tangent_b, variable,
                           -side * factor * lost.v[3] * value);
    };
    for (int k = 0; k < locals.count(); ++k) emit(locals.variable(k), slip.v[k]);
    for (int k = 0; k < 3; ++k) {
      if (s_.bodies[contact.a].motion != Motion::kStatic) {
        emit(s_.TwistVariable(contact.a, k), rows.tangent_a[k].a);
      }
      if (s_.bodies[contact.b].motion != Motion::kStatic) {
        emit(s_.TwistVariable(contact.b, k), rows.tangent_b[k].a);
      }
    }
    return 1.0 - side * lost.v[0];
  }

  int JointRow(int joint) const { return 3 * (s_.num_blocks() + joint); }

  const Model<double>& model_;
  const ModelStructure& s_;
  const std::vector<double>& x_;
  const State<double>& state_;
  LocalJacobianScratch& scratch_;
  const Sink& sink_;
};

}  // namespace tangible::internal
