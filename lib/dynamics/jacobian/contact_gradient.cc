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
    if (contact.joint >= 0) {
      const JointIndex& joint = s_.joints[contact.joint];
      ForEachShare(joint, [&](const JointIndex&, const Locals& of_share, const auto& rows) {
        Emit(of_share, 0, contact.side * rows.coordinate);
      });
      sink_(0, s_.ParameterVariable(contact.side > 0.0 ? joint.low : joint.high), -contact.side);
      return;
    }
    Locals locals;
    ContactRows<LocalJet> rows;
    LocalContactRows(contact, &locals, &rows);
    Emit(locals, 0, rows.geometry.gap);
  }

  void Slip(const ActiveContact& contact) {
    Locals locals;
    if (contact.is_rolling) {
      ContactRows<LocalJet> spin;
      SetRollingRows(&spin);
      return Speed(contact.a, contact.b, locals, spin.tangent_a, spin.tangent_b);
    }
    if (contact.joint >= 0) {
      JointRows<LocalJet> rows;
      LocalJointRows(s_.joints[contact.joint], &locals, &rows);
      Speed(contact.a, contact.b, locals, rows.coordinate_a, rows.coordinate_b);
      if (contact.is_motor) {
        sink_(0, s_.ParameterVariable(s_.joints[contact.joint].motor), -1.0);
      }
      return;
    }
    ContactRows<LocalJet> rows;
    LocalContactRows(contact, &locals, &rows);
    Speed(contact.a, contact.b, locals, rows.tangent_a, rows.tangent_b);
  }

  void Approach(const ActiveContact& contact) {
    if (contact.joint >= 0) {
      const auto add = [&](const JointIndex& of, const Locals& of_share, const auto& rows) {
        RowPart<LocalJet> opens_a, opens_b;
        for (int i = 0; i < 3; ++i) {
          opens_a[i] = contact.side * rows.coordinate_a[i];
          opens_b[i] = contact.side * rows.coordinate_b[i];
        }
        Speed(of.a, of.b, of_share, opens_a, opens_b);
      };
      ForEachShare(s_.joints[contact.joint], add);
      return;
    }
    Locals locals;
    ContactRows<LocalJet> rows;
    LocalContactRows(contact, &locals, &rows);
    Speed(contact.a, contact.b, locals, rows.normal_a, rows.normal_b);
  }

  void Servo(int k, double sign, double time, double middle) {
    const ServoIndex& servo = s_.servos[k];
    ServoRows<LocalJet> rows;
    Locals spring;
    EvaluateServo(servo, &spring, &rows);
    const LocalJet number =
        servo.signal < 0 ? LocalNumber(servo.numbers, &spring) : LocalJet(x_[servo.numbers]);
    const LocalJet now = servo.signal < 0 ? LocalJet(time) : spring.Add(time, TimeVariable(s_));
    const ServoTarget<LocalJet> target = TargetOf(s_, servo, number, {now, middle, 0.0});
    const LocalJet stiffness = LocalNumber(servo.Number(ServoIndex::kStiffness), &spring);
    Emit(spring, 0, sign * stiffness * (rows.coordinate - target.value));
    Locals damper;
    EvaluateServo(servo, &damper, &rows);
    const LocalJet damping = LocalNumber(servo.Number(ServoIndex::kDamping), &damper);
    LocalJet rate(-target.rate);
    for (int i = 0; i < 3; ++i) {
      rate += rows.row_a[i] * state_.twist[3 * rows.a + i] +
              rows.row_b[i] * state_.twist[3 * rows.b + i];
      EmitTwist(rows.a, i, sign * damping.a * rows.row_a[i].a);
      EmitTwist(rows.b, i, sign * damping.a * rows.row_b[i].a);
    }
    Emit(damper, 0, sign * damping * rate);
    sink_(0, s_.ParameterVariable(servo.Number(ServoIndex::kLimit)), 1.0);
  }

 private:
  void EvaluateServo(const ServoIndex& servo, Locals* locals, ServoRows<LocalJet>* out) {
    if (servo.joint < 0) {
      const ForceIndex& force = s_.forces[servo.force];
      const Pose<LocalJet> pose = LocalPose(force.body, locals);
      const LocalJet at[2] = {LocalNumber(force.numbers, locals),
                              LocalNumber(force.numbers + 1, locals)};
      EvaluateForceServo(servo, force.body, s_.world(), pose, at, out);
      return;
    }
    const JointIndex& joint = s_.joints[servo.joint];
    JointRows<LocalJet> rows;
    LocalJointRows(joint, locals, &rows);
    *out = {joint.a, joint.b, rows.coordinate_a, rows.coordinate_b, rows.coordinate};
  }

  void Speed(int a, int b, const Locals& locals, const RowPart<LocalJet>& row_a,
             const RowPart<LocalJet>& row_b) {
    LocalJet speed(0.0);
    for (int i = 0; i < 3; ++i) {
      speed += row_a[i] * state_.twist[3 * a + i] + row_b[i] * state_.twist[3 * b + i];
    }
    Emit(locals, 0, speed);
    for (int i = 0; i < 3; ++i) {
      EmitTwist(a, i, row_a[i].a);
      EmitTwist(b, i, row_b[i].a);
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

void AddServoGradient(const Model<double>& model, const State<double>& state, int servo,
                      double sign, double time, double middle, LocalJacobianScratch* scratch,
                      std::vector<JacobianEntry>* entries) {
  const EntryListSink sink{entries};
  GradientVisitor(model, state, scratch, sink).Servo(servo, sign, time, middle);
}

}  // namespace tangible
