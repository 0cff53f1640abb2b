// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The equations of each element, written once for all levels and all uses. The assembly of problems
// (assembly_inl.h) and their derivatives (jacobian/equation_jacobian.cc) include this file.
//
// A builder receives each element: that of the assembly stores its blocks in a contact problem;
// that of the Jacobian evaluates it in Jets of the few variables that it reads, and emits the
// derivatives of its residual. A builder has
//
//   Scalar; kKeepsJoints                      whether RowsOf and RatesOf keep rows
//   Begin()                                   before each element
//   Number(i), Numbers(first, count, buffer)  parameters of the model
//   PoseOf, Angle, TwistOf, Moving (body)     where a body is, and how it moves
//   ShapeOfA, ShapeOfB (contact)              its shapes
//   RowsOf, RatesOf (joint), RateScratch      memory
//   IsReleased(j)                             whether joint j has ended
//   Restitution(i), Approach(contact, rows)   of contact i: e, and n·v before the step
//   Time()                                    of accelerations
//   ModeOf(servo, time)                       of a servo: servo.h
//   SupportAt(support)                        of a support: its SupportState, or null
//
// and takes
//
//   Body(k, mass, load)                       M x = load
//   Push(a, row_a, b, row_b, amount)          load += rowᵀ amount
//   Dampen(body, row, damping)                 load −= rowᵀ damping (row · x)
//   AddForce(body, value)                     the same of a force or impulse on one body
//   Along(a, row_a, b, row_b, push, damping)  load += rowᵀ (push − damping · speed)
//   Decay(a, row_a, b, row_b, numbers)        load += rowᵀ FrictionDecay(numbers, speed)
//   Joint(j, rows, rhs)                       row · x = rhs − prescribed speed
//   Hold(support, rows, rhs, count)           row · x = rhs of its body
//   Share(j, k, rows, rhs)                    coordinate k's share of a coupling's row; builders
//                                             that keep joints receive the whole row
//   BeginShare(k)                             the contact that follows is one such share
//   Contact(i, contact, rows, c_n, c_t)       n · x + c_n, t · x + c_t

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/dynamics/elements/joint_coupling_inl.h"
#include "tangible/dynamics/model/tolerances.h"

namespace tangible::internal {

template <Level kLevel, typename Builder>
class Equations {
 public:
  using T = typename Builder::Scalar;

  Equations(const ModelStructure& structure, const Instant<T>& instant, Builder* builder)
      : s_(structure), at_(instant), b_(*builder) {}

  /// Mass, load and damping of the body of block k.
  void Body(int k) {
    b_.Begin();
    const BodyIndex& index = s_.bodies[s_.moving[k]];
    T buffer[3];
    const T* twist = b_.TwistOf(s_.moving[k], buffer);
    const T mass = b_.Number(index.mass);
    const T inertia = b_.Number(index.inertia);
    T diagonal[3] = {mass, mass, inertia};
    T load[3] = {T(0.0), T(0.0), T(0.0)};
    if constexpr (kLevel == Level::kVelocity) {
      const T linear = LinearDamping(index, twist);
      diagonal[0] = diagonal[1] = mass + at_.h * linear;
      diagonal[2] = inertia + at_.h * b_.Number(index.angular_damping);
      load[0] = mass * (twist[0] + at_.h * b_.Number(kGravityX));
      load[1] = mass * (twist[1] + at_.h * b_.Number(kGravityY));
      load[2] = inertia * twist[2];
    } else if constexpr (kLevel == Level::kAcceleration) {
      const T linear = LinearDamping(index, twist);
      load[0] = mass * b_.Number(kGravityX) - linear * twist[0];
      load[1] = mass * b_.Number(kGravityY) - linear * twist[1];
      load[2] = -b_.Number(index.angular_damping) * twist[2];
    }
    b_.Body(k, diagonal, load);
  }

  void Spring(const SpringIndex& spring) {
    b_.Begin();
    T buffer[7];
    const T* x = b_.Numbers(spring.numbers, 7, buffer);
    SpringRow<T> row;
    EvaluateSpring<T>(b_.PoseOf(spring.a), b_.PoseOf(spring.b), x, &row);
    b_.Push(spring.a, row.pull_a, spring.b, row.pull_b, T(-Weight()));
    b_.Along(spring.a, row.row_a, spring.b, row.row_b, T(0.0),
             T(Weight() * x[SpringIndex::kDamping]));
  }

  void Force(const ForceIndex& force) {
    if (s_.bodies[force.body].block < 0) {
      return;
    }
    b_.Begin();
    const T angle = b_.Angle(force.body);
    T buffer[5];
    const T* x = b_.Numbers(force.numbers, 5, buffer);
    T start, end;
    const T* from = force.start >= 0 ? b_.Numbers(force.start, 1, &start) : nullptr;
    const T* to = force.end >= 0 ? b_.Numbers(force.end, 1, &end) : nullptr;
    T value[3];
    if constexpr (kLevel == Level::kVelocity) {
      ForceImpulse(s_, force, at_.t, at_.h, angle, x, from, to, value);
    } else {
      ForceAt(s_, force, angle, x, from, to, b_.Time(), at_.middle, value);
    }
    b_.AddForce(force.body, value);
  }

  void Joint(int j) {
    const JointIndex& joint = s_.joints[j];
    T rhs[3];
    const bool released = b_.IsReleased(j);
    if constexpr (!Builder::kKeepsJoints) {
      if (released) return;
      for (int k = 0; k < 2 && joint.IsCoupling(); ++k) {
        b_.Begin();
        JointRows<T> share;
        JointRates<T> rates;
        EvaluateShare(joint, k, &share, &rates);
        RightHandSide(share, rates, rhs);
        b_.Share(j, k, share, rhs);
      }
      if (joint.IsCoupling()) return;
    }
    b_.Begin();
    JointRows<T>& rows = b_.RowsOf(j);
    JointRates<T>& rates = b_.RatesOf(j);
    EvaluateRows(joint, &rows, &rates);
    if (released) rows.rows = 0;
    RightHandSide(rows, rates, rhs);
    b_.Joint(j, rows, rhs);
    if (released) return;
    Drive(joint, rows.coordinate_a, rows.coordinate_b);
  }

  /// The spring along a joint's coordinate. It is an element of its own, because together with the
  /// joint it would read more variables than a local Jet has.
  void JointSpring(int j) {
    const JointIndex& joint = s_.joints[j];
    if (joint.stiffness < 0 || Weight() == 0.0 || b_.IsReleased(j)) {
      return;
    }
    b_.Begin();
    JointRows<T> rows;
    EvaluateAtPoses(joint, &rows);
    T spring[2];
    const T* k = b_.Numbers(joint.stiffness, 2, spring);
    b_.Push(joint.a, rows.coordinate_a, joint.b, rows.coordinate_b,
            T(-Weight() * k[0] * (rows.coordinate - k[1])));
  }

  /// A servo at its bound, or its spring and its damper: each an element of its own, for the same
  /// reason.
  void Servo(int k) {
    if constexpr (kLevel != Level::kCorrection) {
      if (Weight() == 0.0) return;
      const ServoIndex& servo = s_.servos[k];
      if (servo.joint >= 0 && b_.IsReleased(servo.joint)) return;
      ServoTime<T> time;
      time.h = kLevel == Level::kVelocity ? at_.h : 0.0;
      time.time = kLevel == Level::kVelocity ? T(at_.t) : T(ValueOf(at_.time));
      time.middle = at_.middle;
      const int mode = b_.ModeOf(k, time);
      b_.Begin();
      ServoRows<T> rows;
      EvaluateServo(servo, &rows);
      const T weight = WeightOf(servo);
      if (mode != 0) {
        b_.Push(
            rows.a, rows.row_a, rows.b, rows.row_b,
            T(static_cast<double>(mode) * weight * b_.Number(servo.Number(ServoIndex::kLimit))));
        return;
      }
      if constexpr (kLevel == Level::kAcceleration) {
        if (servo.signal >= 0) time.time = b_.Time();
      }
      const T number = servo.signal < 0 ? b_.Number(servo.numbers) : T(0.0);
      const ServoTarget<T> target = TargetOf(s_, servo, number, time);
      b_.Push(rows.a, rows.row_a, rows.b, rows.row_b,
              T(-weight * b_.Number(servo.Number(ServoIndex::kStiffness)) *
                (rows.coordinate - target.value)));
      ServoDamper(servo, target.rate);
    }
  }

  /// Friction of a body on the plane of motion: each point of its support is an element.
  /// Corrections of poses have no friction, and leave what is held where it is.
  void Support(int k) {
    const SupportIndex& support = s_.supports[k];
    const SupportState* at = b_.SupportAt(k);
    if (at == nullptr) return Hold(k, -1);
    if (at->holds == SupportState::kBody) return HoldBody(k);
    if constexpr (kLevel != Level::kCorrection) {
      // At an instant friction, which is a force, does nothing; what is held stays so.
      if (Weight() > 0.0 && support.kind == SupportIndex::kDisc) {
        DiscSlides(support, *at);
      } else if (Weight() > 0.0) {
        for (int i = 0; i < support.num_points; ++i) {
          if (i != at->holds) PointSlides(support, i, *at);
        }
      }
    }
    Hold(k, at->holds);
  }

  /// What the friction of a joint that slides is below that at rest. Steps of a fixed size do not
  /// have it (settings.h).
  void JointFrictionDecay(int j) {
    if constexpr (kLevel == Level::kAcceleration) {
      const JointIndex& joint = s_.joints[j];
      if (!joint.has_decay || b_.IsReleased(j)) {
        return;
      }
      b_.Begin();
      JointRows<T> rows;
      EvaluateAtPoses(joint, &rows);
      T friction[3];
      b_.Decay(joint.a, rows.coordinate_a, joint.b, rows.coordinate_b,
               b_.Numbers(joint.friction, 3, friction));
    }
  }

  /// Effort and damping along a joint's coordinate.
  template <typename Row>
  void Drive(const JointIndex& joint, const Row& row_a, const Row& row_b) {
    if constexpr (kLevel != Level::kCorrection) {
      if (joint.damping < 0 || Weight() == 0.0) {
        return;
      }
      T effort;
      if (joint.effort_signal < 0) {
        effort = b_.Number(joint.effort);
      } else if constexpr (kLevel == Level::kVelocity) {
        effort = T(MeanEffort(s_, joint, at_.t, at_.h));
      } else {
        const Signal& signal = s_.signals[joint.effort_signal];
        effort = SignalAt(signal, signal.value, b_.Time(), at_.middle);
      }
      b_.Along(joint.a, row_a, joint.b, row_b, T(Weight() * effort),
               T(Weight() * b_.Number(joint.damping)));
    }
  }

  void Contact(int i, const ActiveContact& contact) {
    if constexpr (!Builder::kKeepsJoints) {
      if (contact.joint >= 0 && s_.joints[contact.joint].IsCoupling()) {
        for (int k = 0; k < 2; ++k) CoupledLimit(i, contact, k);
        return;
      }
    }
    b_.Begin();
    ContactRows<T> rows;
    ContactRates<T> rates;
    if (contact.is_rolling) {
      SetRollingRows(&rows);
    } else if (contact.joint >= 0) {
      Limit(contact, &rows, &rates);
    } else if constexpr (kLevel == Level::kAcceleration) {
      const MovingPose<T> a = b_.Moving(contact.a);
      const MovingPose<T> b = b_.Moving(contact.b);
      const ShapeView<T> shape_a = b_.ShapeOfA(contact);
      const ShapeView<T> shape_b = b_.ShapeOfB(contact);
      EvaluateContactRates(b_.FeatureOf(contact), shape_a, a, shape_b, b, b_.RateScratch(), &rows,
                           &rates);
    } else {
      const auto& pose_a = b_.PoseOf(contact.a);
      const auto& pose_b = b_.PoseOf(contact.b);
      const ShapeView<T> shape_a = b_.ShapeOfA(contact);
      const ShapeView<T> shape_b = b_.ShapeOfB(contact);
      rows.geometry = EvaluateContact(b_.FeatureOf(contact), shape_a, pose_a, shape_b, pose_b);
      RowsFromGeometry(shape_a.type, pose_a.position, shape_b.type, pose_b.position, &rows);
    }
    FinishContact(i, contact, &rows, &rates);
  }

  /// The factor of forces: the length of the step, or 1; corrections have no forces.
  double Weight() const {
    return kLevel == Level::kVelocity ? at_.h : kLevel == Level::kAcceleration ? 1.0 : 0.0;
  }

  /// The factor of the joints' position errors, which corrections of poses remove.
  double DriftShare() const {
    const bool corrects = kLevel == Level::kCorrection &&
                          JointCorrectionOf(s_.settings) == JointCorrection::kProjection;
    return corrects ? 1.0 : 0.0;
  }

 private:
  void FinishContact(int i, const ActiveContact& contact, ContactRows<T>* at,
                     ContactRates<T>* of_rows) {
    ContactRows<T>& rows = *at;
    ContactRates<T>& rates = *of_rows;
    if constexpr (kLevel == Level::kVelocity) {
      rates.normal = LawConstant(contact.law, rows.geometry.gap, at_.h, b_.Restitution(i),
                                 b_.Approach(contact, rows), s_.settings);
      if (contact.is_motor) rates.tangent = rows.slide;
      if (LeavesOverlap(contact)) rates.normal = T(0.0);
    } else if constexpr (kLevel == Level::kCorrection) {
      rates.normal = contact.law == ContactLaw::kRecovery ? T(-at_.recovery) : rows.geometry.gap;
    }
    b_.Contact(i, contact, rows, rates.normal, rates.tangent);
  }

  /// Whether two bodies overlap by the error of a step, which turns them against each other, and
  /// are held by their supports: to push them apart would take all that both can hold.
  bool LeavesOverlap(const ActiveContact& contact) const {
    const bool is_slight =
        contact.gap < 0.0 && contact.gap > -kHeldOverlap * s_.settings.contact_margin;
    if (s_.supports.empty() || !is_slight || !contact.IsOfShapes()) return false;
    const auto is_held = [&](int body) {
      if (s_.bodies[body].block < 0) return true;
      for (int k = 0; k < static_cast<int>(s_.supports.size()); ++k) {
        if (s_.supports[k].body != body) continue;
        const SupportState* at = b_.SupportAt(k);
        return at != nullptr && at->holds == SupportState::kBody;
      }
      return false;
    };
    return is_held(contact.a) && is_held(contact.b);
  }

  /// The share that coordinate k has in a limit of a coupling, as a limit of the coupled joint.
  void CoupledLimit(int i, const ActiveContact& contact, int k) {
    b_.Begin();
    const JointIndex& joint = s_.joints[contact.joint];
    JointRows<T> share;
    JointRates<T> share_rates;
    EvaluateShare(joint, k, &share, &share_rates);
    const T number = k == 0 ? b_.Number(LimitNumber(joint, contact)) : T(0.0);
    ActiveContact of_share = contact;
    of_share.a = s_.joints[joint.coupled[k]].a;
    of_share.b = s_.joints[joint.coupled[k]].b;
    ContactRows<T> rows;
    ContactRates<T> rates;
    EvaluateLimitRows(number, share, contact, &rows);
    if constexpr (kLevel == Level::kAcceleration) SetLimitRates(contact, share_rates, &rates);
    b_.BeginShare(k);
    FinishContact(i, of_share, &rows, &rates);
  }

  void RightHandSide(const JointRows<T>& rows, const JointRates<T>& rates, T rhs[3]) const {
    const double share = DriftShare();
    for (int k = 0; k < 3; ++k) {
      rhs[k] = T(0.0);
      if (k >= rows.rows) continue;
      if constexpr (kLevel == Level::kAcceleration) {
        rhs[k] = -rates.row[k];
      } else if (share != 0.0) {
        rhs[k] = -share * rows.error[k];
      }
    }
  }

  /// Coordinate k of a coupling: its share of the rows, and of the rates.
  void EvaluateShare(const JointIndex& coupling, int k, JointRows<T>* share, JointRates<T>* rates) {
    EvaluateRows(s_.joints[coupling.coupled[k]], share, rates);
    // The first share reads the value at time 0, the other one the ratio.
    const T number = b_.Number(coupling.geometry + (k == 0 ? 1 : 0));
    const T numbers[2] = {number, number};
    ScaleToShare(coupling.type, k, numbers, share);
    if (k == 1) rates->coordinate = number * rates->coordinate;
    rates->row[0] = rates->coordinate;
  }

  // The arm of a point of a support, and its share of the load.
  Vector2<T> ArmOf(const SupportIndex& support, int point, T* share) {
    const auto& pose = b_.PoseOf(support.body);
    *share = T(1.0);
    if (support.kind == SupportIndex::kCentre) return Vector2<T>(T(0.0), T(0.0));
    T buffer[3];
    const T* x = b_.Numbers(support.Point(point), 3, buffer);
    *share = x[2];
    return pose.rotation * Vector2<T>(x[0], x[1]);
  }

  void PointSlides(const SupportIndex& support, int point, const SupportState& at) {
    using std::sqrt;
    b_.Begin();
    T share, cone[2];
    const Vector2<T> arm = ArmOf(support, point, &share);
    const T* x = b_.Numbers(support.numbers, 2, cone);
    const T limit = Weight() * x[SupportIndex::kFriction] * x[SupportIndex::kLoad] * share;
    T buffer[3];
    const T* twist = TwistOf(support, at, point, buffer);
    const Vector2<T> velocity(twist[0] - twist[2] * arm.y(), twist[1] + twist[2] * arm.x());
    const T square = velocity.squaredNorm();
    const bool is_sought = kLevel == Level::kVelocity || (at.is_sought && at.IsSlow(point));
    if (at.secant > 0.0 && is_sought) {
      const T damping = limit / sqrt(T(square + at.secant * at.secant));
      DampenPoint(support, point, at, Vector2<T>(T(1.0), T(0.0)), arm, damping);
      DampenPoint(support, point, at, Vector2<T>(T(0.0), T(1.0)), arm, damping);
      return;
    }
    if (!(ValueOf(square) > 0.0)) return;
    const T speed = sqrt(square);
    const Vector2<T> along = velocity / speed;
    const RowPart<T> none{T(0.0), T(0.0), T(0.0)};
    b_.Push(support.body, PointRow(along, arm), s_.world(), none, T(-limit));
    if (is_sought) {
      DampenPoint(support, point, at, Vector2<T>(-along.y(), along.x()), arm, T(limit / speed));
    }
  }

  // A point that starts on a body that turns about it has its own acceleration, a + α × r − ω² r.
  void DampenPoint(const SupportIndex& support, int point, const SupportState& at,
                   const Vector2<T>& along, const Vector2<T>& arm, const T& damping) {
    const RowPart<T> row = PointRow(along, arm);
    DampenSupport(support.body, at, row, damping);
    if constexpr (kLevel == Level::kAcceleration) {
      if (at.slow != point) return;
      T buffer[3];
      const T turn = b_.TwistOf(support.body, buffer)[2];
      const RowPart<T> none{T(0.0), T(0.0), T(0.0)};
      b_.Push(support.body, row, s_.world(), none, T(damping * turn * turn * along.dot(arm)));
    }
  }

  void DampenSupport(int body, const SupportState& at, const RowPart<T>& row, const T& damping) {
    const RowPart<T> none{T(0.0), T(0.0), T(0.0)};
    if constexpr (kLevel == Level::kVelocity) {
      b_.Along(body, row, s_.world(), none, T(0.0), damping);
    } else {
      b_.Dampen(body, row, damping);
      if (!(at.horizon > 0.0)) return;
      T buffer[3];
      const T* twist = b_.TwistOf(body, buffer);
      const T speed = row[0] * twist[0] + row[1] * twist[1] + row[2] * twist[2];
      b_.Push(body, row, s_.world(), none, T(-damping * speed / at.horizon));
    }
  }

  // The twist that tells the direction of a point's friction: of a step that about which it is
  // linearised, and of accelerations the body's own, except where it is next to nothing.
  const T* TwistOf(const SupportIndex& support, const SupportState& at, int point, T buffer[3]) {
    if (kLevel == Level::kAcceleration && !at.IsSlow(point)) {
      return b_.TwistOf(support.body, buffer);
    }
    for (int i = 0; i < 3; ++i) buffer[i] = T(at.twist[i]);
    return buffer;
  }

  // The friction at û and, as dampers, Ψ'' in the form Σ d lᵀ l of a Cholesky factorisation.
  void DiscSlides(const SupportIndex& support, const SupportState& at) {
    b_.Begin();
    T buffer[3], friction[3], own[3];
    const T* x = b_.Numbers(support.numbers, 3, buffer);
    const T* twist = TwistOf(support, at, 0, own);
    if (at.secant > 0.0) return DiscSecantOf(support, at, x);
    DiscFriction(x[SupportIndex::kRadius], twist, friction);
    const T limit = Weight() * x[SupportIndex::kFriction] * x[SupportIndex::kLoad];
    const double weight = ValueOf(limit);
    const double radius = ValueOf(x[SupportIndex::kRadius]);
    for (T& component : friction) component *= limit;
    b_.AddForce(support.body, friction);
    if (kLevel == Level::kVelocity || at.is_sought) DiscDampersOf(support, at, radius, weight);
  }

  void DiscSecantOf(const SupportIndex& support, const SupportState& at, const T* x) {
    const T limit = Weight() * x[SupportIndex::kFriction] * x[SupportIndex::kLoad];
    double dampers[3];
    DiscSecant(ValueOf(x[SupportIndex::kRadius]), at.twist.data(), at.secant, dampers);
    for (int r = 0; r < 3; ++r) {
      RowPart<T> row{T(0.0), T(0.0), T(0.0)};
      row[r] = T(1.0);
      DampenSupport(support.body, at, row, T(limit * dampers[r]));
    }
  }

  void DiscDampersOf(const SupportIndex& support, const SupportState& at, double radius,
                     double weight) {
    double rows[3][3], weights[3];
    DiscDampers(radius, at.twist.data(), rows, weights);
    b_.Begin();
    const RowPart<T> none{T(0.0), T(0.0), T(0.0)};
    for (int r = 0; r < 3; ++r) {
      double speed = 0.0;
      for (int i = 0; i < 3; ++i) speed += rows[r][i] * at.twist[i];
      const RowPart<T> row{T(rows[r][0]), T(rows[r][1]), T(rows[r][2])};
      const T damping(weight * weights[r]);
      if constexpr (kLevel == Level::kVelocity) {
        b_.Along(support.body, row, s_.world(), none, T(damping * speed), damping);
      } else {
        b_.Push(support.body, row, s_.world(), none, T(damping * speed));
        DampenSupport(support.body, at, row, damping);
      }
    }
  }

  // The rows of a point that is held; −1: none.
  void Hold(int k, int point) {
    RowPart<T> rows[3];
    T rhs[3] = {T(0.0), T(0.0), T(0.0)};
    int count = 0;
    if (point >= 0) {
      b_.Begin();
      T share;
      const Vector2<T> arm = ArmOf(s_.supports[k], point, &share);
      rows[0] = PointRow(Vector2<T>(T(1.0), T(0.0)), arm);
      rows[1] = PointRow(Vector2<T>(T(0.0), T(1.0)), arm);
      if constexpr (kLevel == Level::kAcceleration) {
        T buffer[3];
        const T turn = b_.TwistOf(s_.supports[k].body, buffer)[2];
        for (int i = 0; i < 2; ++i) rhs[i] = turn * turn * arm[i];
      }
      count = 2;
    }
    b_.Hold(k, rows, rhs, count);
  }
  void HoldBody(int k) {
    RowPart<T> rows[3];
    for (int r = 0; r < 3; ++r) {
      for (int i = 0; i < 3; ++i) rows[r][i] = T(r == i ? 1.0 : 0.0);
    }
    b_.Begin();
    const T rhs[3] = {T(0.0), T(0.0), T(0.0)};
    b_.Hold(k, rows, rhs, 3);
  }

  void ServoDamper(const ServoIndex& servo, double target_rate) {
    b_.Begin();
    ServoRows<T> rows;
    EvaluateServo(servo, &rows);
    const T damping = WeightOf(servo) * b_.Number(servo.Number(ServoIndex::kDamping));
    b_.Along(rows.a, rows.row_a, rows.b, rows.row_b, T(damping * target_rate), damping);
  }

  void EvaluateServo(const ServoIndex& servo, ServoRows<T>* rows) {
    if (servo.joint < 0) {
      const ForceIndex& force = s_.forces[servo.force];
      T buffer[2];
      const auto& pose = b_.PoseOf(force.body);
      EvaluateForceServo<T>(servo, force.body, s_.world(), pose,
                            b_.Numbers(force.numbers, 2, buffer), rows);
      return;
    }
    const JointIndex& joint = s_.joints[servo.joint];
    JointRows<T> of_joint;
    EvaluateAtPoses(joint, &of_joint);
    *rows = {joint.a, joint.b, of_joint.coordinate_a, of_joint.coordinate_b, of_joint.coordinate};
  }

  /// Weight() of a servo: of a force over its window.
  T WeightOf(const ServoIndex& servo) {
    if (servo.joint >= 0) return T(Weight());
    const ForceIndex& force = s_.forces[servo.force];
    T start, end;
    const T* from = force.start >= 0 ? b_.Numbers(force.start, 1, &start) : nullptr;
    const T* to = force.end >= 0 ? b_.Numbers(force.end, 1, &end) : nullptr;
    if constexpr (kLevel == Level::kVelocity) return WindowOverlap(at_.t, at_.h, from, to);
    const bool is_on = !(from != nullptr && ValueOf(*from) > at_.middle) &&
                       !(to != nullptr && ValueOf(*to) < at_.middle);
    return T(is_on ? 1.0 : 0.0);
  }

  /// c of the force −c v: the linear damping plus, for quadratic drag, the coefficient times |v|
  /// before the step. The speed |v| of a body at rest has no derivative; that of |v| v is 0 there.
  T LinearDamping(const BodyIndex& index, const T* twist) {
    using std::sqrt;
    const T linear = b_.Number(index.linear_damping);
    if (index.quadratic_drag < 0) {
      return linear;
    }
    const T square = twist[0] * twist[0] + twist[1] * twist[1];
    const T drag = b_.Number(index.quadratic_drag);
    return ValueOf(square) > 0.0 ? linear + drag * sqrt(square) : linear;
  }

  void EvaluateRows(const JointIndex& joint, JointRows<T>* rows, JointRates<T>* rates) {
    if (joint.IsCoupling()) {
      T rate(0.0);
      for (int k = 0; k < 2; ++k) {
        JointRows<T> share;
        JointRates<T> of_share;
        EvaluateShare(joint, k, &share, &of_share);
        AddShare(joint, s_.joints[joint.coupled[k]], k, share, rows);
        rate += of_share.coordinate;
      }
      rates->coordinate = rates->row[0] = rate;
      return;
    }
    if constexpr (kLevel == Level::kAcceleration) {
      T buffer[7];
      const MovingPose<T> a = b_.Moving(joint.a);
      const MovingPose<T> b = b_.Moving(joint.b);
      EvaluateJointRates(joint.type, a, b, b_.Numbers(joint.geometry, joint.num_geometry, buffer),
                         joint.num_geometry, rows, rates);
    } else {
      EvaluateAtPoses(joint, rows);
    }
  }

  void EvaluateAtPoses(const JointIndex& joint, JointRows<T>* rows) {
    T buffer[7];
    const auto& a = b_.PoseOf(joint.a);
    const auto& b = b_.PoseOf(joint.b);
    EvaluateJoint<T>(joint.type, a, b, b_.Numbers(joint.geometry, joint.num_geometry, buffer),
                     rows);
  }

  void Limit(const ActiveContact& contact, ContactRows<T>* rows, ContactRates<T>* rates) {
    const JointIndex& joint = s_.joints[contact.joint];
    JointRows<T>& of_joint = b_.RowsOf(contact.joint);
    JointRates<T>& rates_of_joint = b_.RatesOf(contact.joint);
    if constexpr (!Builder::kKeepsJoints) {
      EvaluateRows(joint, &of_joint, &rates_of_joint);
    }
    const bool is_friction = contact.IsJointFriction() && !contact.is_motor;
    const T number = is_friction ? T(0.0) : b_.Number(LimitNumber(joint, contact));
    EvaluateLimitRows(number, of_joint, contact, rows);
    if constexpr (kLevel == Level::kAcceleration) {
      SetLimitRates(contact, rates_of_joint, rates);
    }
  }

  const ModelStructure& s_;
  const Instant<T>& at_;
  Builder& b_;
};

}  // namespace tangible::internal
