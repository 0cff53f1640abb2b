// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/jacobian/force_gradient.h"

#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/dynamics/jacobian/local_entries_inl.h"

namespace tangible {
namespace {

using Component = ConstraintForce::Component;
using internal::Locals;

class ForceVisitor : private internal::LocalEntries<EntryListSink> {
 public:
  ForceVisitor(const Model<double>& model, const SolvedEquations& solved,
               const ConstraintForce& force, LocalJacobianScratch* scratch, double* by_unknowns,
               const EntryListSink& sink)
      : LocalEntries(model, *solved.state, scratch, sink),
        solved_(solved),
        force_(force),
        by_unknowns_(by_unknowns) {}

  double Joint() {
    if (IsReleased(state_, force_.joint)) return 0.0;
    {
      Evaluated at;
      EvaluateOn(&at);
      const double* y = &solved_.solution->joint_impulse[3 * static_cast<size_t>(force_.joint)];
      for (int k = 0; k < at.rows.rows; ++k) {
        Add(at, at.rows.row_a[k], y[k], JointRow(force_.joint) + k);
      }
      AddLimits(force_.joint, at);
      Emit(at.locals, 0, at.sum);
      value_ += at.sum.a;
    }
    for (int c = 0; c < static_cast<int>(s_.joints.size()); ++c) {
      const JointIndex& coupling = s_.joints[c];
      for (int k = 0; k < 2 && coupling.IsCoupling() && !IsReleased(state_, c); ++k) {
        if (coupling.coupled[k] == force_.joint) Coupling(c, k);
      }
    }
    return value_;
  }

  double Contact() {
    for (size_t i = 0; i < solved_.contacts->size(); ++i) {
      const ActiveContact& contact = (*solved_.contacts)[i];
      const ContactMode mode = solved_.solution->modes[i];
      const bool is_of_pair = (contact.a == force_.a && contact.b == force_.b) ||
                              (contact.a == force_.b && contact.b == force_.a);
      if (!contact.IsOfShapes() || !is_of_pair || mode == ContactMode::kOpen) continue;
      if (force_.component == Component::kNormal) {
        value_ += solved_.solution->normal_impulse[i];
        Seed(RowOf(i), 1.0);
      } else if (mode == ContactMode::kSticking) {
        value_ += solved_.solution->tangent_impulse[i];
        Seed(RowOf(i) + 1, 1.0);
      } else if (const double sign = SlidingSign(mode); sign != 0.0) {
        value_ += solved_.solution->tangent_impulse[i];
        Seed(RowOf(i), -sign * solved_.problem->contacts[i].friction);
        Sliding(i, contact, -sign * solved_.solution->normal_impulse[i]);
      }
    }
    return value_;
  }

 private:
  // The joint in Jets of its variables, and what has been summed of the force.
  struct Evaluated {
    Locals locals;
    JointRows<LocalJet> rows;
    Vector2<LocalJet> arm{LocalJet(0.0), LocalJet(0.0)};
    LocalJet factor{1.0};
    LocalJet sum{0.0};
  };

  void EvaluateOn(Evaluated* at) {
    const JointIndex& joint = s_.joints[force_.joint];
    const Pose<LocalJet> pose_a = LocalPose(joint.a, &at->locals);
    const Pose<LocalJet> pose_b = LocalPose(joint.b, &at->locals);
    LocalJet numbers[7];
    LocalGeometry(joint, &at->locals, numbers);
    EvaluateJoint(joint.type, pose_a, pose_b, numbers, &at->rows);
    if (HasAnchors(joint.type)) {
      at->arm = pose_a.rotation * Vector2<LocalJet>(numbers[0], numbers[1]);
    }
  }

  // The component of a unit force along a row.
  LocalJet Along(const Evaluated& at, const RowPart<LocalJet>& row) const {
    const LocalJet along = force_.component == Component::kX ? row[0]
                           : force_.component == Component::kY
                               ? row[1]
                               : row[2] - (at.arm.x() * row[1] - at.arm.y() * row[0]);
    return along * at.factor;
  }

  void Add(Evaluated& at, const RowPart<LocalJet>& row, double multiplier, int unknown) {
    const LocalJet along = Along(at, row);
    at.sum += along * multiplier;
    Seed(unknown, along.a);
  }

  // Limits, friction and motor of a joint or coupling, along the coordinate of this joint.
  void AddLimits(int joint, Evaluated& at) {
    for (size_t i = 0; i < solved_.contacts->size(); ++i) {
      const ActiveContact& contact = (*solved_.contacts)[i];
      const ContactMode mode = solved_.solution->modes[i];
      if (contact.joint != joint || mode == ContactMode::kOpen) continue;
      const LocalJet along = Along(at, at.rows.coordinate_a);
      if (!contact.IsJointFriction()) {
        at.sum += along * (contact.side * solved_.solution->normal_impulse[i]);
        Seed(RowOf(i), contact.side * along.a);
        continue;
      }
      at.sum += along * solved_.solution->tangent_impulse[i];
      if (mode == ContactMode::kSticking) {
        Seed(RowOf(i) + 1, along.a);
        continue;
      }
      const ContactBlock<double>& block = solved_.problem->contacts[i];
      EmitCoefficient((*solved_.friction)[i], -SlidingSign(mode) * block.offset * along.a);
    }
  }

  void Coupling(int coupling, int k) {
    const JointIndex& index = s_.joints[coupling];
    Evaluated at;
    EvaluateOn(&at);
    if (k == 1) at.factor = LocalNumber(index.geometry, &at.locals);
    if (index.type == JointType::kCoupling) {
      Add(at, at.rows.coordinate_a,
          solved_.solution->joint_impulse[3 * static_cast<size_t>(coupling)], JointRow(coupling));
    }
    AddLimits(coupling, at);
    Emit(at.locals, 0, at.sum);
    value_ += at.sum.a;
  }

  // The derivatives of the coefficient of a contact that slides, which may decay, times a factor.
  void Sliding(size_t i, const ActiveContact& contact, double factor) {
    const CoefficientSource& rest = (*solved_.friction)[i];
    DecaySource decay;
    if (solved_.level != Level::kAcceleration ||
        !MixedDecay(model_, contact.a, contact.b, &decay)) {
      EmitCoefficient(rest, factor);
      return;
    }
    const double slip = SpeedsOf(model_, state_, contact).slip;
    const double side = slip < 0.0 ? -1.0 : 1.0;
    const LocalJet numbers[3] = {LocalJet(rest.value, 0), LocalJet(decay.kinetic.value, 1),
                                 LocalJet(decay.speed.value, 2)};
    const LocalJet lost = FrictionDecay(numbers, LocalJet(slip, 3));
    EmitCoefficient(rest, factor * (1.0 - side * lost.v[0]));
    EmitCoefficient(decay.kinetic, -factor * side * lost.v[1]);
    EmitCoefficient(decay.speed, -factor * side * lost.v[2]);
    std::vector<JacobianEntry> by_slip;
    AddSlipGradient(model_, state_, contact, &scratch_, &by_slip);
    for (const JacobianEntry& entry : by_slip) {
      sink_(0, entry.variable, -factor * side * lost.v[3] * entry.value);
    }
  }

  void EmitCoefficient(const CoefficientSource& source, double factor) {
    for (int k = 0; k < 2; ++k) {
      if (source.numbers[k] < 0) continue;
      sink_(0, s_.ParameterVariable(source.numbers[k]), factor * source.derivatives[k]);
    }
  }

  int RowOf(size_t contact) const {
    return by_unknowns_ == nullptr ? 0 : 3 * (*solved_.contact_block)[contact];
  }
  void Seed(int unknown, double value) {
    if (by_unknowns_ != nullptr) by_unknowns_[unknown] += value;
  }

  const SolvedEquations& solved_;
  const ConstraintForce& force_;
  double* by_unknowns_;
  double value_ = 0.0;
};

}  // namespace

double EvaluateForce(const Model<double>& model, const SolvedEquations& solved,
                     const ConstraintForce& force, LocalJacobianScratch* scratch,
                     double* by_unknowns, std::vector<JacobianEntry>* by_variables) {
  std::vector<JacobianEntry> unused;
  const EntryListSink sink{by_variables == nullptr ? &unused : by_variables};
  ForceVisitor visitor(model, solved, force, scratch, by_unknowns, sink);
  return force.joint >= 0 ? visitor.Joint() : visitor.Contact();
}

}  // namespace tangible
