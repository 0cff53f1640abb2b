// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/jacobian/acceleration_jacobian.h"

#include <cmath>

#include "tangible/dynamics/jacobian/local_entries_inl.h"

namespace tangible {
namespace {

using internal::BodyRow;
using internal::Locals;

template <typename Sink>
class AccelerationVisitor : private internal::LocalEntries<Sink> {
 public:
  AccelerationVisitor(const Model<double>& model, const SolvedAcceleration& solved,
                      LocalJacobianScratch* scratch, const Sink& sink)
      : internal::LocalEntries<Sink>(model, *solved.state, scratch, sink),
        r_(solved),
        v_(solved.state->twist.data()),
        a_(3 * static_cast<size_t>(s_.num_bodies()), 0.0) {
    for (int k = 0; k < s_.num_blocks(); ++k) {
      std::copy_n(&solved.solution->v[3 * k], 3, &a_[3 * s_.moving[k]]);
    }
  }

  void Masses() {
    for (int k = 0; k < s_.num_blocks(); ++k) {
      const int body = s_.moving[k];
      const BodyIndex& index = s_.bodies[body];
      for (int i = 0; i < 2; ++i) {
        const double gravity = r_.correction ? 0.0 : x_[kGravityX + i];
        sink_(3 * k + i, s_.NumberVariable(index.mass), a_[3 * body + i] - gravity);
      }
      sink_(3 * k + 2, s_.NumberVariable(index.inertia), a_[3 * body + 2]);
    }
  }

  void Forces() {
    for (int k = 0; k < s_.num_blocks(); ++k) {
      const int body = s_.moving[k];
      const BodyIndex& index = s_.bodies[body];
      for (int i = 0; i < 3; ++i) {
        const int damping = i < 2 ? index.linear_damping : index.angular_damping;
        sink_(3 * k + i, s_.NumberVariable(damping), v_[3 * body + i]);
        sink_(3 * k + i, s_.TwistVariable(body, i), x_[damping]);
        if (i < 2) {
          sink_(3 * k + i, s_.NumberVariable(kGravityX + i), -x_[index.mass]);
        }
      }
    }
    for (const SpringIndex& spring : s_.springs) {
      Spring(spring);
    }
    for (const ForceIndex& force : s_.forces) {
      Force(force);
    }
  }

  void Joints() {
    for (size_t j = 0; j < s_.joints.size(); ++j) {
      if (s_.joints[j].type == JointType::kRevolute) {
        RevoluteByHand(static_cast<int>(j));
      } else if (r_.correction) {
        CorrectedJoint(static_cast<int>(j));
      } else {
        Joint(static_cast<int>(j));
      }
    }
  }

  void Contacts() {
    for (size_t i = 0; i < r_.contacts->size(); ++i) {
      if ((*r_.contact_block)[i] < 0) {
        continue;
      }
      if ((*r_.contacts)[i].joint >= 0) {
        Limit(static_cast<int>(i));
      } else {
        ShapeContact(static_cast<int>(i));
      }
    }
  }

 private:
  using Base = internal::LocalEntries<Sink>;
  using Base::Emit;
  using Base::EmitMomentum;
  using Base::EmitRowTimesVariable;
  using Base::JointRow;
  using Base::LocalContactRows;
  using Base::LocalGeometry;
  using Base::LocalJointRows;
  using Base::LocalNumber;
  using Base::LocalPose;
  using Base::LocalShapeOfA;
  using Base::LocalShapeOfB;
  using Base::s_;
  using Base::sink_;
  using Base::state_;
  using Base::x_;

  template <typename T>
  T RowTimes(const double* x, int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b) {
    T sum(0.0);
    for (int i = 0; i < 3; ++i) {
      sum += row_a[i] * x[3 * a + i] + row_b[i] * x[3 * b + i];
    }
    return sum;
  }

  // A damper of coefficient c along a row: momentum rows += c rowᵀ (row v), by the twists.
  template <typename Row>
  void EmitDamperByTwist(int a, const Row& row_a, int b, const Row& row_b, double c) {
    if (c == 0.0) {
      return;
    }
    const auto by = [&](int body, const Row& part) {
      for (int i = 0; i < 3 && s_.bodies[body].motion != Motion::kStatic; ++i) {
        EmitRowTimesVariable(a, row_a, b, row_b, s_.TwistVariable(body, i), c * ValueOf(part[i]));
      }
    };
    by(a, row_a);
    by(b, row_b);
  }

  void Spring(const SpringIndex& spring) {
    Locals locals;
    const Pose<LocalJet> pose_a = LocalPose(spring.a, &locals);
    const Pose<LocalJet> pose_b = LocalPose(spring.b, &locals);
    LocalJet numbers[7];
    for (int i = 0; i < 7; ++i) {
      numbers[i] = LocalNumber(spring.numbers + i, &locals);
    }
    SpringRow<LocalJet> row;
    EvaluateSpring(pose_a, pose_b, numbers, &row);
    const LocalJet speed = RowTimes(v_, spring.a, row.row_a, spring.b, row.row_b);
    EmitMomentum(locals, spring.a, row.pull_a, spring.b, row.pull_b, LocalJet(1.0));
    EmitMomentum(locals, spring.a, row.row_a, spring.b, row.row_b, numbers[5] * speed);
    EmitDamperByTwist(spring.a, row.row_a, spring.b, row.row_b, numbers[5].a);
  }

  void Force(const ForceIndex& force) {
    const int row = BodyRow(s_, force.body);
    if (row < 0) {
      return;
    }
    const double angle = state_.pose[3 * force.body + 2];
    double value[3];
    ForceAt(s_, force, x_, angle, r_.time, r_.middle, value);
    const bool acts = (force.start < 0 || x_[force.start] <= r_.middle) &&
                      (force.end < 0 || r_.middle <= x_[force.end]);
    if (!acts) {
      return;
    }
    const double* x = &x_[force.numbers];
    const Rotation<double> rotation(angle);
    const Vector2<double> arm = rotation * Vector2<double>(x[0], x[1]);
    // Torque arm × F: by the angle, by the point, by the force.
    sink_(row + 2, s_.PoseVariable(force.body, 2), arm.y() * value[1] + arm.x() * value[0]);
    sink_(row + 2, s_.NumberVariable(force.numbers),
          -(rotation.cosine * value[1] - rotation.sine * value[0]));
    sink_(row + 2, s_.NumberVariable(force.numbers + 1),
          rotation.sine * value[1] + rotation.cosine * value[0]);
    const double lever[2] = {-arm.y(), arm.x()};
    const int time = TimeVariable(s_);
    for (int i = 0; i < 2; ++i) {
      int variable = s_.NumberVariable(force.numbers + 2 + i);
      double rate = 1.0;
      if (force.force_signal >= 0) {
        const Signal& signal = s_.signals[force.force_signal];
        variable = time;
        SignalAt(signal, i == 0 ? signal.x : signal.y, r_.time, r_.middle, &rate);
      }
      sink_(row + i, variable, -rate);
      sink_(row + 2, variable, -rate * lever[i]);
    }
    double rate = 1.0;
    if (force.torque_signal >= 0) {
      const Signal& signal = s_.signals[force.torque_signal];
      SignalAt(signal, signal.value, r_.time, r_.middle, &rate);
    }
    sink_(row + 2, force.torque_signal >= 0 ? time : s_.NumberVariable(force.numbers + 4), -rate);
  }

  static MovingPose<LocalJet> Constant(const State<double>& state, int body) {
    MovingPose<LocalJet> moving;
    for (int i = 0; i < 3; ++i) {
      moving.pose[i] = LocalJet(state.pose[3 * body + i]);
      moving.twist[i] = LocalJet(state.twist[3 * body + i]);
    }
    return moving;
  }

  // Poses as variables, twists as they are.
  MovingPose<LocalJet> ByPose(int body, Locals* locals) {
    MovingPose<LocalJet> moving = Constant(state_, body);
    for (int i = 0; i < 3 && body != s_.world(); ++i) {
      moving.pose[i] = locals->Add(state_.pose[3 * body + i], s_.PoseVariable(body, i));
    }
    return moving;
  }

  // The other way round.
  MovingPose<LocalJet> ByTwist(int body, Locals* locals) {
    MovingPose<LocalJet> moving = Constant(state_, body);
    for (int i = 0; i < 3 && s_.bodies[body].motion != Motion::kStatic; ++i) {
      moving.twist[i] = locals->Add(v_[3 * body + i], s_.TwistVariable(body, i));
    }
    return moving;
  }

  // Two rows of points with arms r = R(θ) anchor, only which depend on poses and numbers:
  //   row = ± (a + α r⊥ − ω² r),  of a correction ± (Δ + δ r⊥) + share · C;   ∂r/∂θ = r⊥
  void RevoluteByHand(int j) {
    const JointIndex& joint = s_.joints[j];
    const double* y = &r_.solution->joint_impulse[3 * j];
    const double share = r_.correction ? JointCorrectionShare(s_.settings) : 0.0;
    const auto side = [&](int body, int anchor, double sign) {
      const double c = std::cos(state_.pose[3 * body + 2]);
      const double s = std::sin(state_.pose[3 * body + 2]);
      const double ax = x_[anchor];
      const double ay = x_[anchor + 1];
      const double arm[2] = {c * ax - s * ay, s * ax + c * ay};
      // Columns: the arm's change with θ and with the anchor's two components.
      const double dx[3] = {-arm[1], c, -s};
      const double dy[3] = {arm[0], s, c};
      const int variables[3] = {s_.PoseVariable(body, 2), s_.NumberVariable(anchor),
                                s_.NumberVariable(anchor + 1)};
      const double alpha = a_[3 * body + 2];
      const double omega = r_.correction ? 0.0 : v_[3 * body + 2];
      const double along = share - omega * omega;
      const int row = BodyRow(s_, body);
      for (int k = 0; k < 3; ++k) {
        sink_(JointRow(j), variables[k], sign * (along * dx[k] - alpha * dy[k]));
        sink_(JointRow(j) + 1, variables[k], sign * (along * dy[k] + alpha * dx[k]));
        if (row >= 0) {
          sink_(row + 2, variables[k], -sign * (-dy[k] * y[0] + dx[k] * y[1]));
        }
      }
      for (int i = 0; i < 2; ++i) {
        if (r_.correction) {
          sink_(JointRow(j) + i, s_.PoseVariable(body, i), sign * share);
        } else if (s_.bodies[body].motion != Motion::kStatic) {
          sink_(JointRow(j) + i, s_.TwistVariable(body, 2), -2.0 * sign * omega * arm[i]);
        }
      }
    };
    side(joint.a, joint.geometry, 1.0);
    side(joint.b, joint.geometry + 2, -1.0);
    if (!r_.correction) {
      const RowPart<double> row_a = {0.0, 0.0, 1.0};
      const RowPart<double> row_b = {0.0, 0.0, -1.0};
      EmitDrive(joint, row_a, row_b);
    }
  }

  void Joint(int j) {
    const JointIndex& joint = s_.joints[j];
    const double* y = &r_.solution->joint_impulse[3 * j];
    JointRows<LocalJet> rows;
    {
      Locals locals;
      const MovingPose<LocalJet> a = ByPose(joint.a, &locals);
      const MovingPose<LocalJet> b = ByPose(joint.b, &locals);
      LocalJet numbers[7];
      LocalGeometry(joint, &locals, numbers);
      JointRates<LocalJet> rates;
      EvaluateJointRates(joint.type, a, b, numbers, joint.num_geometry, &rows, &rates);
      for (int k = 0; k < rows.rows; ++k) {
        Emit(locals, JointRow(j) + k,
             RowTimes(a_.data(), joint.a, rows.row_a[k], joint.b, rows.row_b[k]) + rates.row[k]);
        EmitMomentum(locals, joint.a, rows.row_a[k], joint.b, rows.row_b[k], -y[k]);
      }
      Drive(joint, locals, rows);
    }
    Locals locals;
    const MovingPose<LocalJet> a = ByTwist(joint.a, &locals);
    const MovingPose<LocalJet> b = ByTwist(joint.b, &locals);
    LocalJet numbers[7];
    for (int i = 0; i < joint.num_geometry; ++i) {
      numbers[i] = LocalJet(x_[joint.geometry + i]);
    }
    JointRates<LocalJet> rates;
    EvaluateJointRates(joint.type, a, b, numbers, joint.num_geometry, &rows, &rates);
    for (int k = 0; k < rows.rows; ++k) {
      Emit(locals, JointRow(j) + k, rates.row[k]);
    }
  }

  // Damping and effort along the coordinate.
  void Drive(const JointIndex& joint, const Locals& locals, const JointRows<LocalJet>& rows) {
    if (joint.damping < 0) {
      return;
    }
    const RowPart<LocalJet>& a = rows.coordinate_a;
    const RowPart<LocalJet>& b = rows.coordinate_b;
    const LocalJet speed = RowTimes(v_, joint.a, a, joint.b, b);
    const double effort = EmitDrive(joint, a, b);
    EmitMomentum(locals, joint.a, a, joint.b, b, x_[joint.damping] * speed - effort);
  }

  // The same along a row, but for what changes the row itself; returns the effort.
  template <typename Row>
  double EmitDrive(const JointIndex& joint, const Row& a, const Row& b) {
    double effort = x_[joint.effort];
    if (joint.effort_signal >= 0) {
      const Signal& signal = s_.signals[joint.effort_signal];
      double slope;
      effort = SignalAt(signal, signal.value, r_.time, r_.middle, &slope);
      EmitRowTimesVariable(joint.a, a, joint.b, b, TimeVariable(s_), -slope);
    } else {
      EmitRowTimesVariable(joint.a, a, joint.b, b, s_.NumberVariable(joint.effort), -1.0);
    }
    EmitRowTimesVariable(joint.a, a, joint.b, b, s_.NumberVariable(joint.damping),
                         ValueOf(RowTimes(v_, joint.a, a, joint.b, b)));
    EmitDamperByTwist(joint.a, a, joint.b, b, x_[joint.damping]);
    return effort;
  }

  void CorrectedJoint(int j) {
    const JointIndex& joint = s_.joints[j];
    const double* y = &r_.solution->joint_impulse[3 * j];
    const double share = JointCorrectionShare(s_.settings);
    Locals locals;
    JointRows<LocalJet> rows;
    LocalJointRows(joint, &locals, &rows);
    for (int k = 0; k < rows.rows; ++k) {
      Emit(locals, JointRow(j) + k,
           RowTimes(a_.data(), joint.a, rows.row_a[k], joint.b, rows.row_b[k]) +
               share * rows.error[k]);
      EmitMomentum(locals, joint.a, rows.row_a[k], joint.b, rows.row_b[k], -y[k]);
    }
  }

  void Limit(int i) {
    const ActiveContact& contact = (*r_.contacts)[i];
    const JointIndex& joint = s_.joints[contact.joint];
    const int row = 3 * (*r_.contact_block)[i];
    const bool held = contact.law == ContactLaw::kRecovery;
    Locals locals;
    JointRows<LocalJet> rows;
    LocalJet value;
    if (r_.correction) {
      LocalJointRows(joint, &locals, &rows);
      value = held ? LocalJet(0.0) : rows.coordinate;
      if (!held)
        sink_(row, s_.NumberVariable(contact.side > 0.0 ? joint.low : joint.high), -contact.side);
    } else {
      const MovingPose<LocalJet> a = ByPose(joint.a, &locals);
      const MovingPose<LocalJet> b = ByPose(joint.b, &locals);
      LocalJet numbers[7];
      LocalGeometry(joint, &locals, numbers);
      JointRates<LocalJet> rates;
      EvaluateJointRates(joint.type, a, b, numbers, joint.num_geometry, &rows, &rates);
      value = rates.coordinate;
    }
    value += RowTimes(a_.data(), joint.a, rows.coordinate_a, joint.b, rows.coordinate_b);
    Emit(locals, row, contact.side * value);
    EmitMomentum(locals, joint.a, rows.coordinate_a, joint.b, rows.coordinate_b,
                 -contact.side * r_.solution->normal_impulse[i]);
    if (r_.correction) {
      return;
    }
    Locals twists;
    const MovingPose<LocalJet> a = ByTwist(joint.a, &twists);
    const MovingPose<LocalJet> b = ByTwist(joint.b, &twists);
    LocalJet numbers[7];
    for (int k = 0; k < joint.num_geometry; ++k) {
      numbers[k] = LocalJet(x_[joint.geometry + k]);
    }
    JointRates<LocalJet> rates;
    EvaluateJointRates(joint.type, a, b, numbers, joint.num_geometry, &rows, &rates);
    Emit(twists, row, contact.side * rates.coordinate);
  }

  void ShapeContact(int i) {
    const ActiveContact& contact = (*r_.contacts)[i];
    const int row = 3 * (*r_.contact_block)[i];
    const bool sticks = r_.solution->modes[i] == ContactMode::kSticking;
    Locals locals;
    ContactRows<LocalJet> rows;
    ContactRates<LocalJet> rates;
    if (r_.correction) {
      LocalContactRows(contact, &locals, &rows);
      rates.normal = contact.law == ContactLaw::kRecovery ? LocalJet(0.0) : rows.geometry.gap;
    } else {
      const MovingPose<LocalJet> a = ByPose(contact.a, &locals);
      const MovingPose<LocalJet> b = ByPose(contact.b, &locals);
      const ShapeView<LocalJet> shape_a = LocalShapeOfA(contact, &locals);
      const ShapeView<LocalJet> shape_b = LocalShapeOfB(contact, &locals);
      EvaluateContactRates(contact.feature, shape_a, a, shape_b, b, &rates_scratch_, &rows, &rates);
    }
    Emit(locals, row,
         rates.normal + RowTimes(a_.data(), contact.a, rows.normal_a, contact.b, rows.normal_b));
    EmitMomentum(locals, contact.a, rows.normal_a, contact.b, rows.normal_b,
                 -r_.solution->normal_impulse[i]);
    EmitMomentum(locals, contact.a, rows.tangent_a, contact.b, rows.tangent_b,
                 -r_.solution->tangent_impulse[i]);
    if (sticks) {
      Emit(locals, row + 1,
           rates.tangent +
               RowTimes(a_.data(), contact.a, rows.tangent_a, contact.b, rows.tangent_b));
    } else {
      Friction(i, contact, rows);
    }
    if (!r_.correction) {
      RatesByTwist(contact, row, sticks);
    }
  }

  void RatesByTwist(const ActiveContact& contact, int row, bool sticks) {
    Locals locals;
    const MovingPose<LocalJet> a = ByTwist(contact.a, &locals);
    const MovingPose<LocalJet> b = ByTwist(contact.b, &locals);
    Locals numbers;  // not read: rates by shapes' numbers are emitted with the poses
    const ShapeView<LocalJet> shape_a = LocalShapeOfA(contact, &numbers);
    const ShapeView<LocalJet> shape_b = LocalShapeOfB(contact, &numbers);
    for (std::vector<LocalJet>* values : {&this->scratch_.numbers_a, &this->scratch_.numbers_b}) {
      for (LocalJet& x : *values) {
        x.v.setZero();
      }
    }
    ContactRows<LocalJet> rows;
    ContactRates<LocalJet> rates;
    EvaluateContactRates(contact.feature, shape_a, a, shape_b, b, &rates_scratch_, &rows, &rates);
    Emit(locals, row, rates.normal);
    if (sticks) {
      Emit(locals, row + 1, rates.tangent);
    }
  }

  // λt = −σ μ λn. Without friction σ is the sign of the sliding speed all the same: the one-sided
  // derivative as μ leaves 0.
  void Friction(int i, const ActiveContact& contact, const ContactRows<LocalJet>& rows) {
    const ContactMode mode = r_.solution->modes[i];
    double sign = SlidingSign(mode);
    if (mode == ContactMode::kClosed && !r_.correction) {
      sign = ClosedSlidingSign(contact, rows);
    }
    const CoefficientSource& friction = (*r_.friction)[i];
    for (int k = 0; k < 2 && sign != 0.0; ++k) {
      if (friction.numbers[k] >= 0) {
        EmitRowTimesVariable(contact.a, rows.tangent_a, contact.b, rows.tangent_b,
                             s_.NumberVariable(friction.numbers[k]),
                             sign * r_.solution->normal_impulse[i] * friction.derivatives[k]);
      }
    }
  }

  double ClosedSlidingSign(const ActiveContact& contact, const ContactRows<LocalJet>& rows) {
    constexpr double kRounding = 1e-12;
    double slip = 0.0;
    double terms = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double on_a = rows.tangent_a[i].a * v_[3 * contact.a + i];
      const double on_b = rows.tangent_b[i].a * v_[3 * contact.b + i];
      slip += on_a + on_b;
      terms += std::abs(on_a) + std::abs(on_b);
    }
    return std::abs(slip) <= kRounding * terms ? 0.0 : slip > 0.0 ? 1.0 : -1.0;
  }

  const SolvedAcceleration& r_;
  const double* v_;
  std::vector<double> a_;  ///< of all bodies
  ContactRateScratch<LocalJet> rates_scratch_;
};

}  // namespace

template <typename Sink>
void VisitAccelerationJacobian(const Model<double>& model, const SolvedAcceleration& solved,
                               LocalJacobianScratch* scratch, const Sink& sink) {
  AccelerationVisitor<Sink> visitor(model, solved, scratch, sink);
  visitor.Masses();
  if (!solved.correction) {
    visitor.Forces();
  }
  visitor.Joints();
  visitor.Contacts();
}

#define TANGIBLE_INSTANTIATE(Sink)                                                               \
  template void VisitAccelerationJacobian<Sink>(const Model<double>&, const SolvedAcceleration&, \
                                                LocalJacobianScratch*, const Sink&);
TANGIBLE_INSTANTIATE(TangentSink)
TANGIBLE_INSTANTIATE(AdjointSink)
TANGIBLE_INSTANTIATE(SingleAdjointSink)
TANGIBLE_INSTANTIATE(EntryListSink)

}  // namespace tangible
