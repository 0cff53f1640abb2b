// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/jacobian/equation_jacobian.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tangible/dynamics/assembly/equations_inl.h"
#include "tangible/dynamics/elements/contact_rows_adjoint.h"
#include "tangible/dynamics/jacobian/local_entries_inl.h"

namespace tangible {
namespace {

using internal::BodyRow;

// The builder of equations_inl.h that emits the derivatives of an element's residual.
template <Level kLevel, typename Sink>
class EntryBuilder : private internal::LocalEntries<Sink> {
 public:
  using Scalar = LocalJet;
  static constexpr bool kKeepsJoints = false;

  EntryBuilder(const Model<double>& model, const SolvedEquations& solved, JacobianRoute route,
               LocalJacobianScratch* scratch, const Sink& sink)
      : internal::LocalEntries<Sink>(model, *solved.state, scratch, sink),
        solved_(solved),
        by_hand_(route == JacobianRoute::kByHand),
        before_(solved.state->twist.data()),
        equations_(s_, at_, this) {
    at_.t = solved.instant.t;
    at_.h = solved.instant.h;
    at_.middle = solved.instant.middle;
    at_.time = LocalJet(solved.instant.time);
    unknown_ = kLevel == Level::kVelocity ? solved.new_twist->data() : this->SpreadSolved(solved);
    damped_ = kLevel == Level::kAcceleration ? before_ : unknown_;
  }

  void Visit() {
    for (int k = 0; k < s_.num_blocks(); ++k) {
      if (by_hand_ && s_.bodies[s_.moving[k]].quadratic_drag < 0) {
        BodyByHand(k);
      } else {
        equations_.Body(k);
      }
    }
    if (equations_.Weight() > 0.0) {
      for (const SpringIndex& spring : s_.springs) {
        equations_.Spring(spring);
      }
      for (const ForceIndex& force : s_.forces) {
        equations_.Force(force);
      }
    }
    for (int j = 0; j < static_cast<int>(s_.joints.size()); ++j) {
      if (IsReleased(j)) continue;
      const JointType type = s_.joints[j].type;
      const bool by_hand =
          by_hand_ && !this->FollowsPath(s_.joints[j].a) && !this->FollowsPath(s_.joints[j].b);
      if (type == JointType::kRevolute && by_hand) {
        RevoluteByHand(j);
      } else if (type == JointType::kPrismatic && by_hand) {
        PrismaticByHand(j);
      } else {
        equations_.Joint(j);
      }
      equations_.JointSpring(j);
      equations_.JointFrictionDecay(j);
    }
    for (int k = 0; k < static_cast<int>(s_.servos.size()); ++k) equations_.Servo(k);
    for (int k = 0; k < static_cast<int>(s_.supports.size()); ++k) equations_.Support(k);
    for (size_t i = 0; i < solved_.contacts->size(); ++i) {
      const ActiveContact& contact = (*solved_.contacts)[i];
      if ((*solved_.contact_block)[i] < 0) {
        continue;
      }
      if constexpr (kLevel == Level::kVelocity && std::is_same_v<Sink, SingleAdjointSink>) {
        if (contact.IsOfShapes() && by_hand_) {
          ContactAdjointByHand(static_cast<int>(i), contact);
          continue;
        }
      }
      equations_.Contact(static_cast<int>(i), contact);
    }
  }

  void Begin() { locals_ = internal::Locals(); }
  LocalJet Number(int i) { return LocalNumber(i, &locals_); }
  const LocalJet* Numbers(int first, int count, LocalJet* buffer) {
    for (int i = 0; i < count; ++i) buffer[i] = LocalNumber(first + i, &locals_);
    return buffer;
  }
  Pose<LocalJet> PoseOf(int body) { return LocalPose(body, &locals_); }
  LocalJet Angle(int body) {
    return locals_.Add(state_.pose[3 * body + 2], s_.PoseVariable(body, 2));
  }
  const LocalJet* TwistOf(int body, LocalJet* buffer) {
    for (int i = 0; i < 3; ++i) {
      buffer[i] = locals_.Add(before_[3 * body + i], s_.TwistVariable(body, i));
    }
    return buffer;
  }
  MovingPose<LocalJet> Moving(int body) {
    return {LocalPose(body, &locals_),
            {LocalJet(before_[3 * body]), LocalJet(before_[3 * body + 1]),
             LocalJet(before_[3 * body + 2])}};
  }
  ShapeView<LocalJet> ShapeOfA(const ActiveContact& contact) {
    return LocalShapeOfA(contact, this->FeatureNow(contact), &locals_);
  }
  ShapeView<LocalJet> ShapeOfB(const ActiveContact& contact) {
    return LocalShapeOfB(contact, this->FeatureNow(contact), &locals_);
  }
  ContactFeature FeatureOf(const ActiveContact& contact) const { return this->FeatureNow(contact); }
  bool IsReleased(int j) const { return tangible::IsReleased(state_, j); }
  JointRows<LocalJet>& RowsOf(int) { return joint_rows_; }
  JointRates<LocalJet>& RatesOf(int) { return joint_rates_; }
  ContactRateScratch<LocalJet>* RateScratch() { return &scratch_.rates; }
  // The coefficient is a parameter of its own; EntriesOfCoefficients has its derivative.
  LocalJet Restitution(int i) const { return LocalJet((*solved_.restitution)[i].value); }
  LocalJet Approach(const ActiveContact& contact, const ContactRows<LocalJet>& rows) const {
    return RowTimes(before_, contact.a, rows.normal_a, contact.b, rows.normal_b);
  }
  int ModeOf(int servo, const ServoTime<LocalJet>& time) const {
    return ServoMode(model_, state_, servo, {time.time.a, time.middle, time.h});
  }
  using internal::LocalEntries<Sink>::SupportAt;
  LocalJet Time() { return locals_.Add(solved_.instant.time, TimeVariable(s_)); }

  void Body(int k, const LocalJet mass[3], const LocalJet load[3]) {
    for (int i = 0; i < 3; ++i) {
      Emit(locals_, 3 * k + i, mass[i] * unknown_[3 * s_.moving[k] + i] - load[i]);
    }
  }

  void Push(int a, const RowPart<LocalJet>& row_a, int b, const RowPart<LocalJet>& row_b,
            const LocalJet& amount) {
    EmitMomentum(locals_, a, row_a, b, row_b, -amount);
  }

  void Dampen(int body, const RowPart<LocalJet>& row, const LocalJet& damping) {
    const RowPart<LocalJet> none{LocalJet(0.0), LocalJet(0.0), LocalJet(0.0)};
    const LocalJet speed = RowTimes(unknown_, body, row, s_.world(), none);
    EmitMomentum(locals_, body, row, s_.world(), none, damping * speed);
  }

  void AddForce(int body, const LocalJet value[3]) {
    for (int i = 0; i < 3; ++i) {
      Emit(locals_, BodyRow(s_, body) + i, -value[i]);
    }
  }

  void Along(int a, const RowPart<LocalJet>& row_a, int b, const RowPart<LocalJet>& row_b,
             const LocalJet& push, const LocalJet& damping) {
    const LocalJet speed = RowTimes(damped_, a, row_a, b, row_b);
    EmitMomentum(locals_, a, row_a, b, row_b, damping * speed - push);
    EmitByTwists(a, row_a, b, row_b, damping.a);
  }

  void Decay(int a, const RowPart<LocalJet>& row_a, int b, const RowPart<LocalJet>& row_b,
             const LocalJet numbers[3]) {
    const LocalJet speed = RowTimes(damped_, a, row_a, b, row_b);
    EmitMomentum(locals_, a, row_a, b, row_b, -FrictionDecay(numbers, speed));
    const LocalJet fixed[3] = {LocalJet(numbers[0].a), LocalJet(numbers[1].a),
                               LocalJet(numbers[2].a)};
    EmitByTwists(a, row_a, b, row_b, -FrictionDecay(fixed, LocalJet(speed.a, 0)).v[0]);
  }

  void Joint(int j, const JointRows<LocalJet>& rows, const LocalJet rhs[3]) {
    const JointIndex& joint = s_.joints[j];
    RowsOn(joint.a, joint.b, j, rows, rhs);
    if constexpr (kLevel == Level::kAcceleration) {
      internal::Locals twists;
      JointRates<LocalJet> rates;
      RatesByTwist(joint, &twists, &rates);
      for (int k = 0; k < rows.rows; ++k) {
        Emit(twists, JointRow(j) + k, rates.row[k]);
      }
    }
  }

  void Share(int j, int k, const JointRows<LocalJet>& rows, const LocalJet rhs[3]) {
    const JointIndex& of = s_.joints[s_.joints[j].coupled[k]];
    RowsOn(of.a, of.b, j, rows, rhs);
    if constexpr (kLevel == Level::kAcceleration) {
      if (rows.rows == 0) return;
      internal::Locals twists;
      JointRates<LocalJet> rates;
      this->ShareRatesByTwist(s_.joints[j], k, &twists, &rates);
      Emit(twists, JointRow(j), rates.coordinate);
    }
  }

  void BeginShare(int k) { share_ = k; }

  void Hold(int k, const RowPart<LocalJet>* rows, const LocalJet* rhs, int count) {
    this->EmitHeld(locals_, k, {rows, rhs, count}, unknown_, *solved_.solution);
  }

  void Contact(int i, const ActiveContact& contact, const ContactRows<LocalJet>& rows,
               const LocalJet& c_n, const LocalJet& c_t) {
    const int a = contact.a;
    const int b = contact.b;
    const int row = 3 * (*solved_.contact_block)[i];
    const bool sticks = solved_.solution->modes[i] == ContactMode::kSticking;
    EmitMomentum(locals_, a, rows.normal_a, b, rows.normal_b, -solved_.solution->normal_impulse[i]);
    EmitMomentum(locals_, a, rows.tangent_a, b, rows.tangent_b,
                 -solved_.solution->tangent_impulse[i]);
    if (!IsDriven(i)) {
      Emit(locals_, row, RowTimes(unknown_, a, rows.normal_a, b, rows.normal_b) + c_n);
    }
    if (sticks) {
      Emit(locals_, row + 1, RowTimes(unknown_, a, rows.tangent_a, b, rows.tangent_b) + c_t);
    }
    EmitByRows(i, contact, rows);
    if constexpr (kLevel == Level::kAcceleration) {
      internal::Locals twists;
      ContactRates<LocalJet> rates;
      RatesByTwist(contact, share_, &twists, &rates);
      Emit(twists, row, rates.normal);
      if (sticks) {
        Emit(twists, row + 1, rates.tangent);
      }
    }
  }

 private:
  using Base = internal::LocalEntries<Sink>;
  using Base::Emit;
  using Base::EmitDecay;
  using Base::EmitFriction;
  using Base::EmitGiven;
  using Base::EmitMomentum;
  using Base::EmitRowTimesVariable;
  using Base::JointRow;
  using Base::LocalNumber;
  using Base::LocalPose;
  using Base::LocalShapeOfA;
  using Base::LocalShapeOfB;
  using Base::model_;
  using Base::RatesByTwist;
  using Base::RowTimes;
  using Base::s_;
  using Base::scratch_;
  using Base::sink_;
  using Base::state_;
  using Base::x_;

  // The rows of joint j, or a share of them, on two bodies.
  void RowsOn(int a, int b, int j, const JointRows<LocalJet>& rows, const LocalJet rhs[3]) {
    const double* y = &solved_.solution->joint_impulse[3 * static_cast<size_t>(j)];
    for (int k = 0; k < rows.rows; ++k) {
      const int row = JointRow(j) + k;
      Emit(locals_, row, RowTimes(unknown_, a, rows.row_a[k], b, rows.row_b[k]) - rhs[k]);
      EmitMomentum(locals_, a, rows.row_a[k], b, rows.row_b[k], -y[k]);
      EmitPrescribed(a, rows.row_a[k], b, rows.row_b[k], row);
    }
  }

  // Whether the speeds that dampers act against are variables. In a step these are the new speeds,
  // which are unknowns except for prescribed motion; at the level of accelerations they are those
  // of the state.
  bool SpeedsReadTwist(int body) const {
    const Motion motion = s_.bodies[body].motion;
    return kLevel == Level::kAcceleration ? motion != Motion::kStatic
                                          : motion == Motion::kKinematic;
  }

  // Momentum rows += rowᵀ slope · row: the derivative of a force along a row by the speed along it.
  void EmitByTwists(int a, const RowPart<LocalJet>& row_a, int b, const RowPart<LocalJet>& row_b,
                    double slope) {
    const auto by_twist = [&](int body, const RowPart<LocalJet>& part) {
      for (int i = 0; i < 3 && SpeedsReadTwist(body); ++i) {
        EmitRowTimesVariable(a, row_a, b, row_b, s_.TwistVariable(body, i), slope * part[i].a);
      }
    };
    by_twist(a, row_a);
    by_twist(b, row_b);
  }

  // A constraint row reads the twist or acceleration of a body with prescribed motion.
  template <typename T>
  void EmitPrescribed(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b, int row) {
    const auto emit = [&](int body, const RowPart<T>& part) {
      for (int i = 0; i < 3 && s_.bodies[body].motion == Motion::kKinematic; ++i) {
        sink_(row, s_.TwistVariable(body, i), ValueOf(part[i]));
      }
    };
    if constexpr (kLevel == Level::kVelocity) {
      emit(a, row_a);
      emit(b, row_b);
    } else if constexpr (kLevel == Level::kAcceleration) {
      EmitGiven(row, a, row_a, solved_.instant);
      EmitGiven(row, b, row_b, solved_.instant);
    }
  }

  // R1 = m (x − v − h g) + h c x for a step, m (a − g) + c v for accelerations, m δ for a
  // correction.
  void BodyByHand(int k) {
    const int body = s_.moving[k];
    const BodyIndex& index = s_.bodies[body];
    const double weight = equations_.Weight();
    for (int i = 0; i < 3; ++i) {
      const int inertial = i < 2 ? index.mass : index.inertia;
      const int damping = i < 2 ? index.linear_damping : index.angular_damping;
      double change = unknown_[3 * body + i];
      if constexpr (kLevel == Level::kVelocity) {
        change -= before_[3 * body + i];
      }
      sink_(3 * k + i, s_.ParameterVariable(inertial),
            i < 2 ? change - weight * x_[kGravityX + i] : change);
      if constexpr (kLevel == Level::kCorrection) {
        continue;
      }
      sink_(3 * k + i, s_.ParameterVariable(damping), weight * damped_[3 * body + i]);
      if (i < 2) {
        sink_(3 * k + i, s_.ParameterVariable(kGravityX + i), -weight * x_[inertial]);
      }
      sink_(3 * k + i, s_.TwistVariable(body, i),
            kLevel == Level::kVelocity ? -x_[inertial] : x_[damping]);
    }
  }

  // Two rows p_a − p_b with arms r = R(θ) anchor; only the arms depend on variables,
  //   ∂r/∂θ = r⊥,  ∂r/∂anchor = R(θ),
  // and a side's rows are ±(ẋ + turn r⊥ + along r) with ẋ the unknown of the position, turn that of
  // the angle, and along = −ω² or the correction's share.
  void RevoluteByHand(int j) {
    const JointIndex& joint = s_.joints[j];
    const double* y = &solved_.solution->joint_impulse[3 * static_cast<size_t>(j)];
    const double share = equations_.DriftShare();
    const auto side = [&](int body, int anchor, double sign) {
      const double angle = state_.pose[3 * body + 2];
      const double c = std::cos(angle);
      const double s = std::sin(angle);
      const double ax = x_[anchor];
      const double ay = x_[anchor + 1];
      const double arm[2] = {c * ax - s * ay, s * ax + c * ay};
      // The columns are the derivatives of the arm with respect to θ and the two components of the
      // anchor.
      const double dx[3] = {-s * ax - c * ay, c, -s};
      const double dy[3] = {arm[0], s, c};
      const int variables[3] = {s_.PoseVariable(body, 2), s_.ParameterVariable(anchor),
                                s_.ParameterVariable(anchor + 1)};
      const double turn = unknown_[3 * body + 2];
      const double omega = before_[3 * body + 2];
      const double along = kLevel == Level::kAcceleration ? -omega * omega : share;
      const int row = BodyRow(s_, body);
      for (int k = 0; k < 3; ++k) {
        sink_(JointRow(j), variables[k], sign * (along * dx[k] - turn * dy[k]));
        sink_(JointRow(j) + 1, variables[k], sign * (along * dy[k] + turn * dx[k]));
        if (row >= 0) {
          sink_(row + 2, variables[k], -sign * (-dy[k] * y[0] + dx[k] * y[1]));
        }
      }
      for (int i = 0; i < 2; ++i) {
        if (share != 0.0) {
          sink_(JointRow(j) + i, s_.PoseVariable(body, i), sign * share);
        }
        if (kLevel == Level::kAcceleration && s_.bodies[body].motion != Motion::kStatic) {
          sink_(JointRow(j) + i, s_.TwistVariable(body, 2), -2.0 * sign * omega * arm[i]);
        }
        if (kLevel == Level::kVelocity && s_.bodies[body].motion == Motion::kKinematic) {
          sink_(JointRow(j) + i, s_.TwistVariable(body, i), sign);
          sink_(JointRow(j) + i, s_.TwistVariable(body, 2),
                i == 0 ? -sign * arm[1] : sign * arm[0]);
        }
      }
    };
    side(joint.a, joint.geometry, 1.0);
    side(joint.b, joint.geometry + 2, -1.0);
    DriveByHand(joint);
  }

  // Effort and damping along θ_a − θ_b.
  void DriveByHand(const JointIndex& joint) {
    const double weight = equations_.Weight();
    if (kLevel == Level::kCorrection || weight == 0.0) {
      return;
    }
    double slope = 0.0;
    if (kLevel == Level::kAcceleration && joint.effort_signal >= 0) {
      const Signal& signal = s_.signals[joint.effort_signal];
      slope = SignalAt(signal, signal.value, LocalJet(solved_.instant.time, 0), at_.middle).v[0];
    }
    const int bodies[2] = {joint.a, joint.b};
    const double speed = damped_[3 * joint.a + 2] - damped_[3 * joint.b + 2];
    for (int i = 0; i < 2; ++i) {
      const int row = BodyRow(s_, bodies[i]) + 2;
      const double sign = i == 0 ? 1.0 : -1.0;
      if (row < 2) {
        continue;
      }
      sink_(row, s_.ParameterVariable(joint.damping), sign * weight * speed);
      if (joint.effort_signal < 0) {
        sink_(row, s_.ParameterVariable(joint.effort), -sign * weight);
      } else if (slope != 0.0) {
        sink_(row, TimeVariable(s_), -sign * slope);
      }
      for (int k = 0; k < 2; ++k) {
        if (SpeedsReadTwist(bodies[k])) {
          sink_(row, s_.TwistVariable(bodies[k], 2),
                (i == k ? weight : -weight) * x_[joint.damping]);
        }
      }
    }
  }

  // A prismatic joint (joint_prismatic_inl.h) with the arm r, the reach e = p_a + r − x_b and the
  // direction w across its axis u = −w⊥; X, Ω are the unknowns of positions and angles, ζ = v_a +
  // ω_a r⊥ − v_b, o the offset of the anchors. Besides rows of θ_a − θ_b,
  //   row   w·(X_a − X_b) − Ω_a w⊥·r + Ω_b w⊥·e + share w·o + 2 ω_b w⊥·ζ − ω_b² w·e − ω_a² w·r
  // the last three of accelerations. Derivatives are those by r, e, w, o along each variable.
  struct Slider {
    Vector2<double> r, e, w, o;
  };

  // Along a joint's coordinate the force against the motion is amount = damping · speed − push.
  struct Drive {
    double amount = 0.0, damping = 0.0, speed = 0.0, slope = 0.0;
  };

  void PrismaticByHand(int j) {
    const JointIndex& joint = s_.joints[j];
    const double* numbers = &x_[joint.geometry];
    const Pose<double> pose_a = state_.PoseOf(joint.a);
    const Pose<double> pose_b = state_.PoseOf(joint.b);
    const Vector2<double> zero(0.0, 0.0);
    Slider at;
    at.r = pose_a.rotation * Vector2<double>(numbers[0], numbers[1]);
    const Vector2<double> arm_b = pose_b.rotation * Vector2<double>(numbers[2], numbers[3]);
    at.e = pose_a.position + at.r - pose_b.position;
    at.o = at.e - arm_b;
    at.w = Perp(Vector2<double>(pose_b.rotation * Vector2<double>(numbers[4], numbers[5])));
    const Drive drive = DriveOf(joint, at);
    const auto by = [&](int variable, const Slider& change) {
      EmitSlider(j, at, drive, change, variable);
    };
    for (int i = 0; i < 2; ++i) {
      const Vector2<double> unit(i == 0 ? 1.0 : 0.0, i == 0 ? 0.0 : 1.0);
      const Vector2<double> in_a = pose_a.rotation * unit;
      const Vector2<double> in_b = pose_b.rotation * unit;
      by(s_.PoseVariable(joint.a, i), {zero, unit, zero, unit});
      by(s_.PoseVariable(joint.b, i), {zero, -unit, zero, -unit});
      by(s_.ParameterVariable(joint.geometry + i), {in_a, in_a, zero, in_a});
      by(s_.ParameterVariable(joint.geometry + 2 + i), {zero, zero, zero, -in_b});
      by(s_.ParameterVariable(joint.geometry + 4 + i), {zero, zero, Perp(in_b), zero});
    }
    const Vector2<double> turned = Perp(at.r);
    by(s_.PoseVariable(joint.a, 2), {turned, turned, zero, turned});
    by(s_.PoseVariable(joint.b, 2), {zero, zero, Perp(at.w), -Perp(arm_b)});
    SliderByTwists(j, at);
    DriveSlider(joint, at, drive);
    const double share = equations_.DriftShare();
    if (share != 0.0) {
      sink_(JointRow(j) + 1, s_.PoseVariable(joint.a, 2), share);
      sink_(JointRow(j) + 1, s_.PoseVariable(joint.b, 2), -share);
      sink_(JointRow(j) + 1, s_.ParameterVariable(joint.geometry + 6), -share);
    }
  }

  Vector2<double> PlaneOf(const double* values, int body) const {
    return {values[3 * body], values[3 * body + 1]};
  }

  // The entries of one variable, with the given derivatives of r, e, w and o.
  void EmitSlider(int j, const Slider& at, const Drive& drive, const Slider& d, int variable) {
    if constexpr (std::is_same_v<Sink, TangentSink>) {
      if (sink_.fixed != nullptr && sink_.fixed[variable] != 0) return;
    }
    const JointIndex& joint = s_.joints[j];
    const double y = solved_.solution->joint_impulse[3 * static_cast<size_t>(j)];
    const Vector2<double> across = Perp(at.w);
    const Vector2<double> d_across = Perp(d.w);
    // The derivatives of w·r, w·e, w⊥·r, w⊥·e.
    const double d_wr = d.w.dot(at.r) + at.w.dot(d.r);
    const double d_we = d.w.dot(at.e) + at.w.dot(d.e);
    const double d_ar = d_across.dot(at.r) + across.dot(d.r);
    const double d_ae = d_across.dot(at.e) + across.dot(d.e);
    const auto emit = [&](int row, double value) {
      if (value != 0.0) sink_(row, variable, value);
    };
    double row = d.w.dot(PlaneOf(unknown_, joint.a) - PlaneOf(unknown_, joint.b)) -
                 unknown_[3 * joint.a + 2] * d_ar + unknown_[3 * joint.b + 2] * d_ae;
    const double share = equations_.DriftShare();
    row += share * (d.w.dot(at.o) + at.w.dot(d.o));
    if constexpr (kLevel == Level::kAcceleration) {
      const double omega_a = before_[3 * joint.a + 2];
      const double omega_b = before_[3 * joint.b + 2];
      row +=
          2.0 * omega_b * (d_across.dot(SlidingOf(joint, at)) + omega_a * across.dot(Perp(d.r))) -
          omega_b * omega_b * d_we - omega_a * omega_a * d_wr;
    }
    emit(JointRow(j), row);
    // Momentum rows: −y rowᵀ, and effort and damping A along u, with the derivative of A.
    const double d_speed = -d_across.dot(PlaneOf(damped_, joint.a) - PlaneOf(damped_, joint.b)) -
                           damped_[3 * joint.a + 2] * d_wr + damped_[3 * joint.b + 2] * d_we;
    const double d_amount = drive.damping * d_speed;
    const Vector2<double> plane = -y * d.w - d_across * drive.amount - across * d_amount;
    const int row_a = BodyRow(s_, joint.a);
    const int row_b = BodyRow(s_, joint.b);
    if (row_a >= 0) {
      emit(row_a, plane.x());
      emit(row_a + 1, plane.y());
      emit(row_a + 2, y * d_ar - d_wr * drive.amount - at.w.dot(at.r) * d_amount);
    }
    if (row_b >= 0) {
      emit(row_b, -plane.x());
      emit(row_b + 1, -plane.y());
      emit(row_b + 2, -y * d_ae + d_we * drive.amount + at.w.dot(at.e) * d_amount);
    }
  }

  // ζ.
  Vector2<double> SlidingOf(const JointIndex& joint, const Slider& at) const {
    return PlaneOf(before_, joint.a) + before_[3 * joint.a + 2] * Perp(at.r) -
           PlaneOf(before_, joint.b);
  }

  // The derivatives of the rows with respect to the twists that they read: those of accelerations,
  // and of prescribed motion.
  void SliderByTwists(int j, const Slider& at) {
    const JointIndex& joint = s_.joints[j];
    const Vector2<double> across = Perp(at.w);
    const int bodies[2] = {joint.a, joint.b};
    for (int k = 0; k < 2; ++k) {
      const int body = bodies[k];
      const double sign = k == 0 ? 1.0 : -1.0;
      const Vector2<double>& arm = k == 0 ? at.r : at.e;
      if (kLevel == Level::kVelocity && s_.bodies[body].motion == Motion::kKinematic) {
        sink_(JointRow(j), s_.TwistVariable(body, 0), sign * at.w.x());
        sink_(JointRow(j), s_.TwistVariable(body, 1), sign * at.w.y());
        sink_(JointRow(j), s_.TwistVariable(body, 2), -sign * across.dot(arm));
        sink_(JointRow(j) + 1, s_.TwistVariable(body, 2), sign);
      }
      if (kLevel == Level::kAcceleration && s_.bodies[body].motion != Motion::kStatic) {
        const double omega_a = before_[3 * joint.a + 2];
        const double omega_b = before_[3 * joint.b + 2];
        sink_(JointRow(j), s_.TwistVariable(body, 0), 2.0 * sign * omega_b * across.x());
        sink_(JointRow(j), s_.TwistVariable(body, 1), 2.0 * sign * omega_b * across.y());
        sink_(JointRow(j), s_.TwistVariable(body, 2),
              k == 0 ? 2.0 * (omega_b - omega_a) * at.w.dot(at.r)
                     : 2.0 * (across.dot(SlidingOf(joint, at)) - omega_b * at.w.dot(at.e)));
      }
    }
  }

  bool HasDrive(const JointIndex& joint) const {
    return kLevel != Level::kCorrection && joint.damping >= 0 && equations_.Weight() != 0.0;
  }

  Drive DriveOf(const JointIndex& joint, const Slider& at) {
    Drive drive;
    if (!HasDrive(joint)) return drive;
    const double weight = equations_.Weight();
    drive.speed = -Perp(at.w).dot(PlaneOf(damped_, joint.a) - PlaneOf(damped_, joint.b)) -
                  damped_[3 * joint.a + 2] * at.w.dot(at.r) +
                  damped_[3 * joint.b + 2] * at.w.dot(at.e);
    drive.damping = weight * x_[joint.damping];
    drive.amount = drive.damping * drive.speed - weight * EffortOf(joint, &drive.slope);
    return drive;
  }

  // With its slope in time at the level of accelerations.
  double EffortOf(const JointIndex& joint, double* slope) {
    if (joint.effort_signal < 0) return x_[joint.effort];
    if constexpr (kLevel == Level::kVelocity) {
      return MeanEffort(s_, joint, solved_.instant.t, solved_.instant.h);
    }
    const Signal& signal = s_.signals[joint.effort_signal];
    const LocalJet effort =
        SignalAt(signal, signal.value, LocalJet(solved_.instant.time, 0), at_.middle);
    *slope = effort.v[0];
    return effort.a;
  }

  // The derivatives of effort and damping with respect to their parameters, the time, and the
  // twists that dampers act against.
  void DriveSlider(const JointIndex& joint, const Slider& at, const Drive& drive) {
    if (!HasDrive(joint)) return;
    const double weight = equations_.Weight();
    const Vector2<double> along = -Perp(at.w);
    const RowPart<double> row_a = {along.x(), along.y(), -at.w.dot(at.r)};
    const RowPart<double> row_b = {-along.x(), -along.y(), at.w.dot(at.e)};
    const auto emit = [&](int variable, double value) {
      EmitRowTimesVariable(joint.a, row_a, joint.b, row_b, variable, value);
    };
    emit(s_.ParameterVariable(joint.damping), weight * drive.speed);
    if (joint.effort_signal < 0) {
      emit(s_.ParameterVariable(joint.effort), -weight);
    } else if (drive.slope != 0.0) {
      emit(TimeVariable(s_), -weight * drive.slope);
    }
    for (int i = 0; i < 3; ++i) {
      if (SpeedsReadTwist(joint.a)) emit(s_.TwistVariable(joint.a, i), drive.damping * row_a[i]);
      if (SpeedsReadTwist(joint.b)) emit(s_.TwistVariable(joint.b, i), drive.damping * row_b[i]);
    }
  }

  // The entries of a contact times one column u, by the adjoint of its geometry. The sum of u times
  // its rows:
  //   α_a·n_a + α_b·n_b + β_a·t_a + β_b·t_b + γ gap.
  void ContactAdjointByHand(int i, const ActiveContact& contact) {
    const Pose<double> pose_a = state_.PoseOf(contact.a);
    const Pose<double> pose_b = state_.PoseOf(contact.b);
    const ShapeView<double> shape_a = tangible::ShapeOfA(model_, contact);
    const ShapeView<double> shape_b = tangible::ShapeOfB(model_, contact);
    const ContactFeature feature = FeatureAt(contact.feature, shape_a, pose_a, shape_b, pose_b);
    ContactRows<double> rows;
    rows.geometry = EvaluateContact(feature, shape_a, pose_a, shape_b, pose_b);
    RowsFromGeometry(shape_a.type, pose_a.position, shape_b.type, pose_b.position, &rows);
    const double* u_contact = sink_.u + 3 * static_cast<size_t>((*solved_.contact_block)[i]);
    const double u_n = IsDriven(i) ? 0.0 : u_contact[0];
    const double u_t = solved_.solution->modes[i] == ContactMode::kSticking ? u_contact[1] : 0.0;
    const double e =
        contact.law == ContactLaw::kRestitution ? (*solved_.restitution)[i].value : 0.0;
    RowsAdjoint bar;
    const auto weigh = [&](int body, double* alpha, double* beta) {
      const int row = BodyRow(s_, body);
      for (int k = 0; k < 3; ++k) {
        const double u = row >= 0 ? sink_.u[row + k] : 0.0;
        alpha[k] = u_n * (unknown_[3 * body + k] + e * before_[3 * body + k]) -
                   solved_.solution->normal_impulse[i] * u;
        beta[k] = u_t * unknown_[3 * body + k] - solved_.solution->tangent_impulse[i] * u;
      }
    };
    weigh(contact.a, bar.normal_a, bar.tangent_a);
    weigh(contact.b, bar.normal_b, bar.tangent_b);
    bar.gap = contact.law == ContactLaw::kGap ? u_n / at_.h : 0.0;
    ContactSideAdjoint a_bar;
    ContactSideAdjoint b_bar;
    ContactRowsAdjoint(feature, shape_a, pose_a, shape_b, pose_b, rows, bar, &a_bar, &b_bar);
    const auto add = [&](int body, int part, bool is_edge, int of_feature,
                         const ContactSideAdjoint& side) {
      for (int k = 0; k < 3; ++k) {
        sink_.w_bar[s_.PoseVariable(body, k)] -= side.pose[k];
      }
      const PartIndex index = s_.bodies[body].Part(part);
      int used[kMostFeatureNumbers];
      const int count = FeatureNumbers(index.type, index.num_numbers, is_edge, of_feature, used);
      for (int k = 0; k < count; ++k) {
        sink_.w_bar[s_.ParameterVariable(index.numbers + used[k])] -= side.numbers[k];
      }
    };
    add(contact.a, feature.part_a, feature.kind == FeatureKind::kEdgeVertex, feature.a, a_bar);
    add(contact.b, feature.part_b, feature.kind == FeatureKind::kVertexEdge, feature.b, b_bar);
    EmitByRows(i, contact, rows);
  }

  bool IsDriven(int i) const {
    return (*solved_.contacts)[i].law == ContactLaw::kPoisson &&
           solved_.problem->contacts[i].driven;
  }

  // The entries that depend on the values of the rows only: prescribed twists, restitution,
  // friction.
  template <typename T>
  void EmitByRows(int i, const ActiveContact& contact, const ContactRows<T>& rows) {
    const int row = 3 * (*solved_.contact_block)[i];
    if constexpr (kLevel == Level::kVelocity) {
      if (IsDriven(i)) {
        // λn − e λ¹n, at a fixed impulse λ¹n of the compression; of a coupling once.
        if (contact.joint >= 0 && s_.joints[contact.joint].IsCoupling() && share_ > 0) return;
        EmitCoefficient((*solved_.restitution)[i], row,
                        -solved_.problem->contacts[i].offset / (*solved_.restitution)[i].value);
      } else {
        if (contact.law == ContactLaw::kRestitution) {
          EmitRestitution((*solved_.restitution)[i], contact, rows, row);
        }
        EmitPrescribed(contact.a, rows.normal_a, contact.b, rows.normal_b, row);
      }
    } else {
      EmitPrescribed(contact.a, rows.normal_a, contact.b, rows.normal_b, row);
    }
    if (solved_.solution->modes[i] == ContactMode::kSticking) {
      EmitPrescribed(contact.a, rows.tangent_a, contact.b, rows.tangent_b, row + 1);
      return;
    }
    // λt = −σ μ λn.
    const double sign = SignOfSliding(i, contact, rows);
    const CoefficientSource& friction = (*solved_.friction)[i];
    const double factor = sign * solved_.solution->normal_impulse[i];
    double share = 1.0;
    if constexpr (kLevel == Level::kAcceleration && std::is_same_v<T, LocalJet>) {
      if (sign != 0.0) {
        const LocalJet slip =
            RowTimes(before_, contact.a, rows.tangent_a, contact.b, rows.tangent_b);
        share = EmitDecay(contact, rows, friction.value, slip, locals_, factor);
      }
    }
    EmitFriction(contact, rows, friction, factor * share);
  }

  void EmitCoefficient(const CoefficientSource& source, int row, double factor) {
    for (int k = 0; k < 2; ++k) {
      if (source.numbers[k] >= 0) {
        sink_(row, s_.ParameterVariable(source.numbers[k]), factor * source.derivatives[k]);
      }
    }
  }

  // The derivatives of e n·v with respect to e and to the twists before the impact.
  template <typename T>
  void EmitRestitution(const CoefficientSource& restitution, const ActiveContact& contact,
                       const ContactRows<T>& rows, int row) {
    const auto emit = [&](int body, const RowPart<T>& part) {
      for (int k = 0; k < 3 && s_.bodies[body].motion != Motion::kStatic; ++k) {
        sink_(row, s_.TwistVariable(body, k), restitution.value * ValueOf(part[k]));
      }
    };
    emit(contact.a, rows.normal_a);
    emit(contact.b, rows.normal_b);
    EmitCoefficient(restitution, row,
                    ValueOf(RowTimes(before_, contact.a, rows.normal_a, contact.b, rows.normal_b)));
  }

  // Without friction σ is the sign of the sliding speed too, which gives the one-sided derivative
  // as μ increases from 0. A correction of poses has no friction.
  template <typename T>
  double SignOfSliding(int i, const ActiveContact& contact, const ContactRows<T>& rows) const {
    if (solved_.solution->modes[i] != ContactMode::kClosed) {
      return SlidingSign(solved_.solution->modes[i]);
    }
    if constexpr (kLevel == Level::kVelocity) {
      return FrictionlessSlidingSign(*solved_.problem, solved_.problem->contacts[i],
                                     solved_.solution->motion.data());
    }
    if constexpr (kLevel == Level::kCorrection) {
      return 0.0;
    }
    return SlipSign(state_, contact, rows);
  }

  const SolvedEquations& solved_;
  const bool by_hand_;
  Instant<LocalJet> at_;
  const double* before_;   ///< twists of the state
  const double* unknown_;  ///< v⁺, a or δ of all bodies
  const double* damped_;   ///< the twists that dampers act against
  internal::Locals locals_;
  int share_ = 0;  ///< of a limit of a coupling: whose coordinate
  JointRows<LocalJet> joint_rows_;
  JointRates<LocalJet> joint_rates_;
  internal::Equations<kLevel, EntryBuilder> equations_;
};

}  // namespace

template <typename Sink>
void VisitJacobian(const Model<double>& model, const SolvedEquations& solved, JacobianRoute route,
                   LocalJacobianScratch* scratch, const Sink& sink) {
  switch (solved.level) {
    case Level::kVelocity:
      EntryBuilder<Level::kVelocity, Sink>(model, solved, route, scratch, sink).Visit();
      break;
    case Level::kAcceleration:
      EntryBuilder<Level::kAcceleration, Sink>(model, solved, route, scratch, sink).Visit();
      break;
    case Level::kCorrection:
      EntryBuilder<Level::kCorrection, Sink>(model, solved, route, scratch, sink).Visit();
      break;
  }
}

#define TANGIBLE_INSTANTIATE(Sink)                                                               \
  template void VisitJacobian<Sink>(const Model<double>&, const SolvedEquations&, JacobianRoute, \
                                    LocalJacobianScratch*, const Sink&);
TANGIBLE_INSTANTIATE(TangentSink)
TANGIBLE_INSTANTIATE(AdjointSink)
TANGIBLE_INSTANTIATE(SingleAdjointSink)
TANGIBLE_INSTANTIATE(EntryListSink)

}  // namespace tangible
