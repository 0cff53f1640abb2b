// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/jacobian/contact_gradient.h"

#include "tangible/dynamics/elements/support.h"
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

  void Passing(const ActiveContact& lost, const ActiveContact& next) {
    Locals of_lost, of_next;
    ContactRows<LocalJet> rows_of_lost, rows_of_next;
    LocalContactRows(lost, &of_lost, &rows_of_lost);
    LocalContactRows(next, &of_next, &rows_of_next);
    const ContactGeometry<LocalJet>& x = rows_of_lost.geometry;
    const ContactGeometry<LocalJet>& y = rows_of_next.geometry;
    // The variables of one contact at a time: the other one's values alone.
    const auto values = [](ContactGeometry<LocalJet> geometry) {
      geometry.normal = {LocalJet(geometry.normal.x().a), LocalJet(geometry.normal.y().a)};
      return geometry;
    };
    Emit(of_lost, 0, SineBetween(x, values(y)));
    Emit(of_next, 0, SineBetween(values(x), y));
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

  void SupportProgress(int k, const SupportState& at) {
    const SupportIndex& support = s_.supports[k];
    if (support.kind == SupportIndex::kDisc) {
      Locals locals;
      const LocalJet radius = LocalNumber(support.numbers + SupportIndex::kRadius, &locals);
      LocalJet twist[3];
      LocalTwist(support.body, &locals, twist);
      const LocalJet turn = radius * radius * twist[2] * at.twist[2];
      return Emit(locals, 0, twist[0] * at.twist[0] + twist[1] * at.twist[1] + turn);
    }
    for (int i = 0; i < support.num_points; ++i) {
      if (!at.IsSlow(i)) continue;
      Locals locals;
      const Vector2<LocalJet> arm = LocalArm(support, i, &locals);
      LocalJet twist[3];
      LocalTwist(support.body, &locals, twist);
      Emit(locals, 0, VelocityAtArm(arm, twist).dot(VelocityAtArm(arm, at.twist.data())));
    }
  }

  void SupportReserve(int k, int holds, const SupportState& at, const double* wrench,
                      double by_wrench[3]) {
    const SupportIndex& support = s_.supports[k];
    const double* u = at.twist.data();
    std::copy_n(u, 3, by_wrench);
    if (support.kind == SupportIndex::kDisc) {
      Locals locals;
      const LocalJet limit = LocalLimit(support, &locals);
      const LocalJet radius = LocalNumber(support.numbers + SupportIndex::kRadius, &locals);
      const LocalJet twist[3] = {LocalJet(u[0]), LocalJet(u[1]), LocalJet(u[2])};
      LocalJet friction[3];
      DiscFriction(radius, twist, friction);
      return Emit(locals, 0,
                  -limit * (friction[0] * u[0] + friction[1] * u[1] + friction[2] * u[2]));
    }
    for (int i = 0; i < support.num_points; ++i) {
      if (holds >= 0 && holds != i) continue;
      Locals locals;
      const Vector2<LocalJet> arm = LocalArm(support, i, &locals);
      LocalJet limit = LocalLimit(support, &locals);
      if (support.kind == SupportIndex::kPoints) {
        limit *= LocalNumber(support.Point(i) + 2, &locals);
      }
      LocalJet left = limit * SpeedAtArm(arm, u);
      if (holds == i) {
        const Vector2<LocalJet> velocity = VelocityAtArm(arm, u);
        for (int r = 0; r < 2; ++r) {
          left += wrench[r] * velocity[r];
          by_wrench[r] = velocity[r].a;
        }
        by_wrench[2] = 0.0;
      }
      Emit(locals, 0, left);
    }
  }

 private:
  LocalJet LocalLimit(const SupportIndex& support, Locals* locals) {
    return LocalNumber(support.numbers + SupportIndex::kFriction, locals) *
           LocalNumber(support.numbers + SupportIndex::kLoad, locals);
  }

  // The arm of a point of a support.
  Vector2<LocalJet> LocalArm(const SupportIndex& support, int point, Locals* locals) {
    if (support.kind != SupportIndex::kPoints) {
      return Vector2<LocalJet>(LocalJet(0.0), LocalJet(0.0));
    }
    const Pose<LocalJet> pose = LocalPose(support.body, locals);
    const LocalJet x = LocalNumber(support.Point(point), locals);
    const LocalJet y = LocalNumber(support.Point(point) + 1, locals);
    return pose.rotation * Vector2<LocalJet>(x, y);
  }

  void LocalTwist(int body, Locals* locals, LocalJet twist[3]) {
    for (int i = 0; i < 3; ++i) {
      twist[i] = locals->Add(state_.twist[3 * body + i], s_.TwistVariable(body, i));
    }
  }

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

void AddPassingGradient(const Model<double>& model, const State<double>& state,
                        const ActiveContact& lost, const ActiveContact& next,
                        LocalJacobianScratch* scratch, std::vector<JacobianEntry>* entries) {
  const EntryListSink sink{entries};
  GradientVisitor(model, state, scratch, sink).Passing(lost, next);
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

void AddSupportProgressGradient(const Model<double>& model, const State<double>& state, int k,
                                const SupportState& at, LocalJacobianScratch* scratch,
                                std::vector<JacobianEntry>* entries) {
  const EntryListSink sink{entries};
  GradientVisitor(model, state, scratch, sink).SupportProgress(k, at);
}

void AddSupportReserveGradient(const Model<double>& model, const State<double>& state, int k,
                               int holds, const SupportState& at, const double* wrench,
                               LocalJacobianScratch* scratch, double by_wrench[3],
                               std::vector<JacobianEntry>* entries) {
  const EntryListSink sink{entries};
  GradientVisitor(model, state, scratch, sink).SupportReserve(k, holds, at, wrench, by_wrench);
}

}  // namespace tangible
