// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/jacobian/contact_gradient.h"

#include "tangible/dynamics/jacobian/local_entries_inl.h"

namespace tangible {
namespace {

using internal::Locals;

class GradientVisitor : private internal::LocalEntries<EntryListSink> {
 public:
  using LocalEntries::LocalEntries;

  void Gap(const ActiveContact& contact) {
    Locals locals;
    if (contact.joint >= 0) {
      const JointIndex& joint = s_.joints[contact.joint];
      JointRows<LocalJet> rows;
      LocalJointRows(joint, &locals, &rows);
      Emit(locals, 0, contact.side * rows.coordinate);
      sink_(0, s_.ParameterVariable(contact.side > 0.0 ? joint.low : joint.high), -contact.side);
      return;
    }
    ContactRows<LocalJet> rows;
    LocalContactRows(contact, &locals, &rows);
    Emit(locals, 0, rows.geometry.gap);
  }

  void Slip(const ActiveContact& contact) {
    Locals locals;
    if (contact.joint >= 0) {
      JointRows<LocalJet> rows;
      LocalJointRows(s_.joints[contact.joint], &locals, &rows);
      Speed(contact, locals, rows.coordinate_a, rows.coordinate_b);
      if (contact.is_motor) {
        sink_(0, s_.ParameterVariable(s_.joints[contact.joint].motor), -1.0);
      }
      return;
    }
    ContactRows<LocalJet> rows;
    LocalContactRows(contact, &locals, &rows);
    Speed(contact, locals, rows.tangent_a, rows.tangent_b);
  }

  void Approach(const ActiveContact& contact) {
    Locals locals;
    if (contact.joint >= 0) {
      JointRows<LocalJet> rows;
      LocalJointRows(s_.joints[contact.joint], &locals, &rows);
      RowPart<LocalJet> opens_a, opens_b;
      for (int i = 0; i < 3; ++i) {
        opens_a[i] = contact.side * rows.coordinate_a[i];
        opens_b[i] = contact.side * rows.coordinate_b[i];
      }
      Speed(contact, locals, opens_a, opens_b);
      return;
    }
    ContactRows<LocalJet> rows;
    LocalContactRows(contact, &locals, &rows);
    Speed(contact, locals, rows.normal_a, rows.normal_b);
  }

 private:
  void Speed(const ActiveContact& contact, const Locals& locals, const RowPart<LocalJet>& row_a,
             const RowPart<LocalJet>& row_b) {
    LocalJet speed(0.0);
    for (int i = 0; i < 3; ++i) {
      speed +=
          row_a[i] * state_.twist[3 * contact.a + i] + row_b[i] * state_.twist[3 * contact.b + i];
    }
    Emit(locals, 0, speed);
    for (int i = 0; i < 3; ++i) {
      EmitTwist(contact.a, i, row_a[i].a);
      EmitTwist(contact.b, i, row_b[i].a);
    }
  }

  void EmitTwist(int body, int i, double value) {
    if (s_.bodies[body].motion != Motion::kStatic && value != 0.0) {
      sink_(0, s_.TwistVariable(body, i), value);
    }
  }
};

}  // namespace

void AddGapGradient(const Model<double>& model, const State<double>& state,
                    const ActiveContact& contact, LocalJacobianScratch* scratch,
                    std::vector<JacobianEntry>* entries) {
  const EntryListSink sink{entries};
  GradientVisitor(model, state, scratch, sink).Gap(contact);
}

void AddSlipGradient(const Model<double>& model, const State<double>& state,
                     const ActiveContact& contact, LocalJacobianScratch* scratch,
                     std::vector<JacobianEntry>* entries) {
  const EntryListSink sink{entries};
  GradientVisitor(model, state, scratch, sink).Slip(contact);
}

void AddApproachGradient(const Model<double>& model, const State<double>& state,
                         const ActiveContact& contact, LocalJacobianScratch* scratch,
                         std::vector<JacobianEntry>* entries) {
  const EntryListSink sink{entries};
  GradientVisitor(model, state, scratch, sink).Approach(contact);
}

}  // namespace tangible
