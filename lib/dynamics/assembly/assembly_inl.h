// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of assembly.h; included by assembly.cc, and by verification's file
// for another scalar.

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/dynamics/assembly/equations_inl.h"
#include "tangible/dynamics/elements/servo_inl.h"
#include "tangible/dynamics/elements/support_inl.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/tolerances.h"
#include "tangible/math/scratch.h"

namespace tangible {
namespace internal {

/// row · x over those bodies of the row that forces do not move (block < 0).
template <typename T>
T PrescribedShare(const ModelStructure& structure, const std::vector<T>& x, int a,
                  const RowPart<T>& row_a, int b, const RowPart<T>& row_b) {
  T share(0.0);
  for (int i = 0; i < 3; ++i) {
    if (structure.bodies[a].block < 0) {
      share += row_a[i] * x[3 * a + i];
    }
    if (structure.bodies[b].block < 0) {
      share += row_b[i] * x[3 * b + i];
    }
  }
  return share;
}

/// The same of their twists.
template <typename T>
T PrescribedSpeed(const ModelStructure& structure, const State<T>& state, int a,
                  const RowPart<T>& row_a, int b, const RowPart<T>& row_b) {
  return PrescribedShare(structure, state.twist, a, row_a, b, row_b);
}

// The rounding of a gap, m: a few units in the last place of the positions of which it is the
// difference.
template <typename T>
double PositionRounding(const State<T>& state, int a, int b) {
  double size = 0.0;
  for (int i = 0; i < 2; ++i) {
    size = std::max(
        {size, std::abs(ValueOf(state.pose[3 * a + i])), std::abs(ValueOf(state.pose[3 * b + i]))});
  }
  return kCornerRounding * size;
}

/// The builder of equations_inl.h that stores the elements in a contact problem.
template <Level kLevel, typename T>
class ProblemBuilder {
 public:
  using Scalar = T;
  static constexpr bool kKeepsJoints = true;

  ProblemBuilder(const Model<T>& model, const State<T>& state, const Instant<T>& instant,
                 AssemblyScratch<T>* scratch, ContactProblem<T>* problem)
      : model_(model),
        s_(*model.structure),
        state_(state),
        at_(instant),
        scratch_(*scratch),
        p_(*problem),
        equations_(s_, at_, this) {}

  /// Adds all elements but the contacts. An impact has no forces.
  void AssembleElements() {
    p_.num_bodies = s_.num_blocks();
    SizeScratch(3 * static_cast<size_t>(p_.num_bodies), &p_.mass);
    SizeScratch(3 * static_cast<size_t>(p_.num_bodies), &p_.load);
    p_.dampers.clear();
    p_.joints.clear();
    p_.contacts.clear();
    p_.pushed_load.clear();
    p_.redundant_joints = s_.joint_loops;
    scratch_.poses.clear();
    for (int body = 0; body < s_.num_bodies(); ++body) {
      scratch_.poses.push_back(state_.PoseOf(body));
    }
    if (IsDriven()) GivenAccelerations(model_, at_.time, at_.middle, &scratch_.given);
    for (int k = 0; k < p_.num_bodies; ++k) {
      equations_.Body(k);
    }
    if (equations_.Weight() > 0.0) {
      for (const SpringIndex& spring : s_.springs) {
        equations_.Spring(spring);
      }
      for (const ForceIndex& force : s_.forces) {
        equations_.Force(force);
      }
    }
    scratch_.joints.resize(s_.joints.size());
    scratch_.rates.resize(kLevel == Level::kAcceleration ? s_.joints.size() : 1);
    p_.joints.reserve(s_.joints.size() + s_.supports.size());
    for (size_t j = 0; j < s_.joints.size(); ++j) {
      equations_.Joint(static_cast<int>(j));
      equations_.JointSpring(static_cast<int>(j));
      equations_.JointFrictionDecay(static_cast<int>(j));
    }
    for (size_t k = 0; k < s_.servos.size(); ++k) equations_.Servo(static_cast<int>(k));
    for (size_t k = 0; k < s_.supports.size(); ++k) equations_.Support(static_cast<int>(k));
  }

  /// `restitution` may be null if no contact rebounds.
  void AssembleContacts(const std::vector<ActiveContact>& contacts,
                        const std::vector<CoefficientSource>& friction,
                        const std::vector<CoefficientSource>* restitution) {
    friction_ = &friction;
    restitution_ = restitution;
    p_.contacts.clear();
    p_.has_rolling = false;
    p_.contacts.reserve(contacts.size());
    for (size_t i = 0; i < contacts.size(); ++i) {
      // In a list without its contact the friction has no load.
      rolls_ = i > 0 && contacts[i - 1].RollsBy(contacts[i]);
      equations_.Contact(static_cast<int>(i), contacts[i]);
    }
  }

  void Begin() {}
  const T& Number(int i) const { return model_.parameters[i]; }
  const T* Numbers(int first, int, T*) const { return &model_.parameters[first]; }
  const Pose<T>& PoseOf(int body) const { return scratch_.poses[body]; }
  const T& Angle(int body) const { return state_.pose[3 * body + 2]; }
  const T* TwistOf(int body, T*) const { return &state_.twist[3 * body]; }
  MovingPose<T> Moving(int body) const {
    return {PoseOf(body),
            {state_.twist[3 * body], state_.twist[3 * body + 1], state_.twist[3 * body + 2]}};
  }
  ShapeView<T> ShapeOfA(const ActiveContact& contact) const {
    return tangible::ShapeOfA(model_, contact);
  }
  ShapeView<T> ShapeOfB(const ActiveContact& contact) const {
    return tangible::ShapeOfB(model_, contact);
  }
  /// The feature at the state: along a spline it moves.
  ContactFeature FeatureOf(const ActiveContact& contact) const {
    return FeatureAt(contact.feature, ShapeOfA(contact), PoseOf(contact.a), ShapeOfB(contact),
                     PoseOf(contact.b));
  }
  bool IsReleased(int j) const { return tangible::IsReleased(state_, j); }
  JointRows<T>& RowsOf(int j) { return scratch_.joints[j]; }
  JointRates<T>& RatesOf(int j) { return scratch_.rates[kLevel == Level::kAcceleration ? j : 0]; }
  ContactRateScratch<T>* RateScratch() { return &scratch_.contact; }
  T Restitution(int i) const { return EvaluateCoefficient((*restitution_)[i], model_.parameters); }
  T Approach(const ActiveContact& contact, const ContactRows<T>& rows) const {
    return RelativeSpeed(state_, contact.a, rows.normal_a, contact.b, rows.normal_b);
  }
  const T& Time() const { return at_.time; }
  int ModeOf(int servo, const ServoTime<T>& time) const {
    return ServoMode(model_, state_, servo, time);
  }

  const SupportState* SupportAt(int k) const {
    return state_.supports.empty() ? nullptr : &state_.supports[k];
  }

  void Body(int k, const T mass[3], const T load[3]) {
    std::copy_n(mass, 3, &p_.mass[3 * static_cast<size_t>(k)]);
    std::copy_n(load, 3, &p_.load[3 * static_cast<size_t>(k)]);
  }

  void Push(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b, const T& amount) {
    AddRowTransposed(s_.bodies[a].block, row_a, s_.bodies[b].block, row_b, amount, p_.load.data());
  }

  void Dampen(int body, const RowPart<T>& row, const T& damping) {
    const RowPart<T> none{T(0.0), T(0.0), T(0.0)};
    p_.dampers.push_back({s_.bodies[body].block, -1, row, none, damping});
  }

  void AddForce(int body, const T value[3]) {
    for (int i = 0; i < 3; ++i) {
      p_.load[3 * s_.bodies[body].block + i] += value[i];
    }
  }

  void Along(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b, const T& push,
             const T& damping) {
    if constexpr (kLevel == Level::kVelocity) {
      // In double a coefficient of 0 has no effect; in Jets its derivative has one.
      constexpr bool kHasDerivatives = NumDerivatives<T>::value > 0;
      if (kHasDerivatives || push != T(0.0)) {
        Push(a, row_a, b, row_b, push);
      }
      if (kHasDerivatives || ValueOf(damping) != 0.0) {
        const T prescribed = PrescribedSpeed(s_, state_, a, row_a, b, row_b);
        Push(a, row_a, b, row_b, T(-damping * prescribed));
        p_.dampers.push_back({s_.bodies[a].block, s_.bodies[b].block, row_a, row_b, damping});
      }
    } else {
      const T speed = RelativeSpeed(state_, a, row_a, b, row_b);
      Push(a, row_a, b, row_b, T(push - damping * speed));
    }
  }

  void Decay(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b, const T numbers[3]) {
    Push(a, row_a, b, row_b, FrictionDecay(numbers, RelativeSpeed(state_, a, row_a, b, row_b)));
  }

  void Joint(int j, const JointRows<T>& rows, const T rhs[3]) {
    const JointIndex& joint = s_.joints[j];
    JointBlock<T>& block = p_.joints.emplace_back();
    block.a = s_.bodies[joint.a].block;
    block.b = s_.bodies[joint.b].block;
    block.rows = rows.rows;
    for (int k = 0; k < rows.rows; ++k) {
      block.row_a[k] = rows.row_a[k];
      block.row_b[k] = rows.row_b[k];
      block.rhs[k] = rhs[k];
      if constexpr (kLevel == Level::kVelocity) {
        block.rhs[k] -= PrescribedSpeed(s_, state_, joint.a, rows.row_a[k], joint.b, rows.row_b[k]);
      } else if (IsDriven()) {
        block.rhs[k] -=
            PrescribedShare(s_, scratch_.given, joint.a, rows.row_a[k], joint.b, rows.row_b[k]);
      }
    }
    if (joint.c >= 0 && rows.rows > 0) Widen(joint, rows, &block);
  }

  // Every support has a block, so that those of others stay where they are as it holds or slides.
  void Hold(int k, const RowPart<T>* rows, const T* rhs, int count) {
    JointBlock<T>& block = p_.joints.emplace_back();
    block.a = s_.bodies[s_.supports[k].body].block;
    block.rows = count;
    block.give.fill(kSupportGive);
    if (count == 3) {
      // The torque counts by the arm at which friction gives its largest one, whatever the inertia.
      const T* mass = &p_.mass[3 * static_cast<size_t>(block.a)];
      const double arm = SupportArm(model_, s_.supports[k]);
      if (arm > 0.0) block.give[2] *= ValueOf(mass[2]) / (ValueOf(mass[0]) * arm * arm);
    }
    for (int r = 0; r < count; ++r) {
      block.row_a[r] = rows[r];
      block.row_b[r] = {T(0.0), T(0.0), T(0.0)};
      block.rhs[r] = rhs[r];
    }
    // The rows of joints to what stands still, or of joints between bodies that are held, may be
    // dependent on these.
    if (count > 0 && !s_.joints.empty()) p_.redundant_joints = true;
  }

  void Contact(int i, const ActiveContact& contact, const ContactRows<T>& rows, const T& c_n,
               const T& c_t) {
    ContactBlock<T>& block = p_.contacts.emplace_back();
    block.a = s_.bodies[contact.a].block;
    block.b = s_.bodies[contact.b].block;
    block.normal_a = rows.normal_a;
    block.normal_b = rows.normal_b;
    block.tangent_a = rows.tangent_a;
    block.tangent_b = rows.tangent_b;
    block.friction = EvaluateCoefficient((*friction_)[i], model_.parameters);
    block.has_friction = (*friction_)[i].value > 0.0;
    if constexpr (kLevel == Level::kAcceleration) {
      if (contact.IsOfShapes() && block.has_friction) LetFrictionDecay(contact, rows, &block);
    }
    block.c_n = c_n;
    block.c_t = c_t;
    if (contact.IsJointFriction()) {
      block.limit_given = block.driven = true;
      block.offset = T(equations_.Weight());
    }
    if (contact.is_rolling) {
      block.limit_given = block.driven = true;
      block.rolls = rolls_;
      p_.has_rolling = p_.has_rolling || rolls_;
    }
    if constexpr (kLevel == Level::kVelocity) {
      const bool is_gap = contact.law == ContactLaw::kGap && contact.IsOfShapes();
      const double rounding = PositionRounding(state_, contact.a, contact.b) / at_.h;
      if (is_gap) block.rounding = rounding;
      // Both rows of a body that just fits between two walls would contradict each other, and those
      // of a taut rope and of a support that holds its body. The derivative of the gap stays.
      const bool is_limit = contact.law == ContactLaw::kGap && contact.joint >= 0 &&
                            !contact.IsPureFriction() && !s_.supports.empty();
      const double none = kGapRounding / kCornerRounding * rounding;
      if ((is_gap || is_limit) && std::abs(ValueOf(c_n)) <= none) block.c_n -= T(ValueOf(c_n));
      block.c_n += PrescribedSpeed(s_, state_, contact.a, rows.normal_a, contact.b, rows.normal_b);
      block.c_t +=
          PrescribedSpeed(s_, state_, contact.a, rows.tangent_a, contact.b, rows.tangent_b);
    } else if (IsDriven()) {
      const auto share = [&](const RowPart<T>& row_a, const RowPart<T>& row_b) {
        return PrescribedShare(s_, scratch_.given, contact.a, row_a, contact.b, row_b);
      };
      block.c_n += share(rows.normal_a, rows.normal_b);
      block.c_t += share(rows.tangent_a, rows.tangent_b);
    }
  }

 private:
  // The row of a coupling on its third and fourth body.
  void Widen(const JointIndex& joint, const JointRows<T>& rows, JointBlock<T>* block) const {
    block->c = s_.bodies[joint.c].block;
    block->d = s_.bodies[joint.d].block;
    block->row_c = rows.row_c;
    block->row_d = rows.row_d;
    if (block->c < 0) {
      std::swap(block->c, block->d);
      std::swap(block->row_c, block->row_d);
    }
    if constexpr (kLevel == Level::kVelocity) {
      block->rhs[0] -= PrescribedSpeed(s_, state_, joint.c, rows.row_c, joint.d, rows.row_d);
    } else if (IsDriven()) {
      block->rhs[0] -=
          PrescribedShare(s_, scratch_.given, joint.c, rows.row_c, joint.d, rows.row_d);
    }
  }

  // Whether some bodies have accelerations of their own.
  bool IsDriven() const { return kLevel == Level::kAcceleration && !s_.paths.empty(); }

  // The coefficient of a contact at its sliding speed (DecaySource).
  void LetFrictionDecay(const ActiveContact& contact, const ContactRows<T>& rows,
                        ContactBlock<T>* block) const {
    DecaySource decay;
    if (!MixedDecay(model_, contact.a, contact.b, &decay)) return;
    const T numbers[3] = {block->friction, EvaluateCoefficient(decay.kinetic, model_.parameters),
                          EvaluateCoefficient(decay.speed, model_.parameters)};
    const T slip = SlipOf(state_, contact, rows);
    const T lost = FrictionDecay(numbers, slip);
    block->friction -= ValueOf(slip) < 0.0 ? T(-lost) : lost;
  }

  const Model<T>& model_;
  const ModelStructure& s_;
  const State<T>& state_;
  const Instant<T>& at_;
  AssemblyScratch<T>& scratch_;
  ContactProblem<T>& p_;
  const std::vector<CoefficientSource>* friction_ = nullptr;
  const std::vector<CoefficientSource>* restitution_ = nullptr;
  bool rolls_ = false;
  Equations<kLevel, ProblemBuilder> equations_;
};

}  // namespace internal

template <typename T>
void AssembleWithoutContacts(const Model<T>& model, const State<T>& state, double t, double h,
                             ContactProblem<T>* problem, AssemblyScratch<T>* scratch) {
  Instant<T> instant;
  instant.t = t;
  instant.h = h;
  internal::ProblemBuilder<Level::kVelocity, T>(model, state, instant, scratch, problem)
      .AssembleElements();
}

template <typename T>
void AssembleContacts(const Model<T>& model, const State<T>& state, double h,
                      const std::vector<ActiveContact>& contacts,
                      const std::vector<CoefficientSource>& friction,
                      const std::vector<CoefficientSource>& restitution,
                      AssemblyScratch<T>* scratch, ContactProblem<T>* problem) {
  Instant<T> instant;
  instant.h = h;
  internal::ProblemBuilder<Level::kVelocity, T>(model, state, instant, scratch, problem)
      .AssembleContacts(contacts, friction, &restitution);
}

}  // namespace tangible
