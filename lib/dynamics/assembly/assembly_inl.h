// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of assembly.h; included by assembly.cc, and by verification's file
// for another scalar.

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/math/scratch.h"

namespace tangible {
namespace internal {

template <typename T>
class FreeAssembly {
 public:
  FreeAssembly(const Model<T>& model, const State<T>& state, double t, double h,
               ContactProblem<T>* problem, std::vector<Pose<T>>* poses)
      : model_(model),
        structure_(*model.structure),
        state_(state),
        t_(t),
        h_(h),
        p_(*problem),
        poses_(*poses) {
    poses_.clear();
    for (int body = 0; body < structure_.num_bodies(); ++body) {
      poses_.push_back(state.PoseOf(body));
    }
  }

  void Bodies() {
    p_.num_bodies = structure_.num_blocks();
    SizeScratch(3 * static_cast<size_t>(p_.num_bodies), &p_.mass);
    SizeScratch(3 * static_cast<size_t>(p_.num_bodies), &p_.momentum);
    p_.dampers.clear();
    p_.joints.clear();
    p_.contacts.clear();
    p_.pushed_momentum.clear();
    p_.redundant_joints = structure_.joint_loops;
    const std::vector<T>& x = model_.numbers;
    for (int k = 0; k < p_.num_bodies; ++k) {
      const int body = structure_.moving[k];
      const BodyIndex& index = structure_.bodies[body];
      const T& mass = x[index.mass];
      const T damped = mass + h_ * x[index.linear_damping];
      p_.mass[3 * k] = damped;
      p_.mass[3 * k + 1] = damped;
      p_.mass[3 * k + 2] = x[index.inertia] + h_ * x[index.angular_damping];
      p_.momentum[3 * k] = mass * (state_.twist[3 * body] + h_ * x[kGravityX]);
      p_.momentum[3 * k + 1] = mass * (state_.twist[3 * body + 1] + h_ * x[kGravityY]);
      p_.momentum[3 * k + 2] = x[index.inertia] * state_.twist[3 * body + 2];
    }
  }

  void Springs() {
    for (const SpringIndex& spring : structure_.springs) {
      SpringRow<T> row;
      EvaluateSpring(poses_[spring.a], poses_[spring.b], &model_.numbers[spring.numbers], &row);
      AddImpulse(spring.a, row.pull_a, spring.b, row.pull_b, T(-h_));
      AddDamper(spring.a, row.row_a, spring.b, row.row_b,
                T(h_ * model_.numbers[spring.numbers + 5]));
    }
  }

  void Forces() {
    for (const ForceIndex& force : structure_.forces) {
      const int block = structure_.bodies[force.body].block;
      if (block < 0) {
        continue;
      }
      const std::vector<T>& x = model_.numbers;
      T impulse[3];
      ForceImpulse(structure_, force, t_, h_, state_.pose[3 * force.body + 2], &x[force.numbers],
                   force.start >= 0 ? &x[force.start] : nullptr,
                   force.end >= 0 ? &x[force.end] : nullptr, impulse);
      for (int i = 0; i < 3; ++i) {
        p_.momentum[3 * block + i] += impulse[i];
      }
    }
  }

  void Joints(bool correct_drift, std::vector<JointRows<T>>* rows) {
    rows->resize(structure_.joints.size());
    p_.joints.reserve(structure_.joints.size());
    for (size_t j = 0; j < rows->size(); ++j) {
      const JointIndex& joint = structure_.joints[j];
      JointRows<T>& r = (*rows)[j];
      EvaluateJoint(joint.type, poses_[joint.a], poses_[joint.b], &model_.numbers[joint.geometry],
                    &r);
      JointBlock<T>& block = p_.joints.emplace_back();
      block.a = structure_.bodies[joint.a].block;
      block.b = structure_.bodies[joint.b].block;
      block.rows = r.rows;
      const bool correct = correct_drift && h_ > 0.0 &&
                           JointCorrectionOf(structure_.settings) == JointCorrection::kBaumgarte;
      for (int k = 0; k < r.rows; ++k) {
        block.row_a[k] = r.row_a[k];
        block.row_b[k] = r.row_b[k];
        block.rhs[k] =
            -PrescribedSpeed(structure_, state_, joint.a, r.row_a[k], joint.b, r.row_b[k]);
        if (correct) {
          block.rhs[k] -= (structure_.settings.baumgarte / h_) * r.error[k];
        }
      }
      Drive(joint, r);
    }
  }

 private:
  // Damping and effort along a joint's coordinate.
  void Drive(const JointIndex& joint, const JointRows<T>& r) {
    if (joint.damping < 0 || h_ == 0.0) {
      return;
    }
    if (joint.effort_signal >= 0) {
      const double effort = MeanEffort(structure_, joint, t_, h_);
      AddImpulse(joint.a, r.coordinate_a, joint.b, r.coordinate_b, T(h_ * effort));
    } else if (model_.numbers[joint.effort] != T(0.0) || NumDerivatives<T>::value > 0) {
      AddImpulse(joint.a, r.coordinate_a, joint.b, r.coordinate_b,
                 T(h_ * model_.numbers[joint.effort]));
    }
    AddDamper(joint.a, r.coordinate_a, joint.b, r.coordinate_b,
              T(h_ * model_.numbers[joint.damping]));
  }

  void AddImpulse(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b,
                  const T& impulse) {
    AddRowTransposed(structure_.bodies[a].block, row_a, structure_.bodies[b].block, row_b, impulse,
                     p_.momentum.data());
  }

  void AddDamper(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b, const T& weight) {
    // Without derivatives a damper of weight 0 is nothing; with them its derivative counts.
    if (ValueOf(weight) == 0.0 && NumDerivatives<T>::value == 0) {
      return;
    }
    const T prescribed = PrescribedSpeed(structure_, state_, a, row_a, b, row_b);
    AddImpulse(a, row_a, b, row_b, T(-weight * prescribed));
    p_.dampers.push_back(
        {structure_.bodies[a].block, structure_.bodies[b].block, row_a, row_b, weight});
  }

  const Model<T>& model_;
  const ModelStructure& structure_;
  const State<T>& state_;
  const double t_, h_;
  ContactProblem<T>& p_;
  std::vector<Pose<T>>& poses_;
};

// Rounding of a gap: a few units in the last place of the positions it is the difference of, m.
template <typename T>
double PositionRounding(const State<T>& state, int a, int b) {
  constexpr double kUnits = 4.0 * std::numeric_limits<double>::epsilon();
  double size = 0.0;
  for (int i = 0; i < 2; ++i) {
    size = std::max(
        {size, std::abs(ValueOf(state.pose[3 * a + i])), std::abs(ValueOf(state.pose[3 * b + i]))});
  }
  return kUnits * size;
}

}  // namespace internal

template <typename T>
void AssembleFree(const Model<T>& model, const State<T>& state, double t, double h,
                  ContactProblem<T>* problem, AssemblyScratch<T>* scratch, bool correct_drift) {
  internal::FreeAssembly<T> assembly(model, state, t, h, problem, &scratch->poses);
  assembly.Bodies();
  if (h > 0.0) {
    assembly.Springs();
    assembly.Forces();
  }
  assembly.Joints(correct_drift, &scratch->joints);
}

template <typename T>
void AssembleContacts(const Model<T>& model, const State<T>& state, double h,
                      const std::vector<ActiveContact>& contacts,
                      const std::vector<CoefficientSource>& friction,
                      const std::vector<CoefficientSource>& restitution,
                      const AssemblyScratch<T>& scratch, ContactProblem<T>* problem) {
  const ModelStructure& structure = *model.structure;
  problem->contacts.clear();
  problem->contacts.reserve(contacts.size());
  for (size_t i = 0; i < contacts.size(); ++i) {
    const ActiveContact& contact = contacts[i];
    ContactRows<T> rows;
    if (contact.joint >= 0) {
      EvaluateLimitRows(model, scratch.joints[contact.joint], contact, &rows);
    } else {
      EvaluateContactRows(model, scratch.poses, contact, &rows);
    }
    ContactBlock<T>& block = problem->contacts.emplace_back();
    block.a = structure.bodies[contact.a].block;
    block.b = structure.bodies[contact.b].block;
    block.normal_a = rows.normal_a;
    block.normal_b = rows.normal_b;
    block.tangent_a = rows.tangent_a;
    block.tangent_b = rows.tangent_b;
    block.friction = EvaluateCoefficient(friction[i], model.numbers);
    block.has_friction = friction[i].value > 0.0;
    const T approach = RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b);
    const T e = EvaluateCoefficient(restitution[i], model.numbers);
    block.c_n =
        LawConstant(contact.law, rows.geometry.gap, h, e, approach, structure.settings) +
        PrescribedSpeed(structure, state, contact.a, rows.normal_a, contact.b, rows.normal_b);
    block.rounding = contact.law == ContactLaw::kGap && contact.joint < 0
                         ? internal::PositionRounding(state, contact.a, contact.b) / h
                         : 0.0;
    block.c_t =
        PrescribedSpeed(structure, state, contact.a, rows.tangent_a, contact.b, rows.tangent_b);
  }
}

}  // namespace tangible
