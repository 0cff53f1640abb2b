// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/jacobian/local_jacobian.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tangible/dynamics/elements/contact_rows_adjoint.h"
#include "tangible/dynamics/jacobian/local_entries_inl.h"

namespace tangible {
namespace {

using internal::BodyRow;
using internal::Locals;

template <typename Sink>
class StepVisitor : private internal::LocalEntries<Sink> {
 public:
  StepVisitor(const Model<double>& model, const SolvedStep& step, LocalJacobianScratch* scratch,
              const Sink& sink)
      : internal::LocalEntries<Sink>(model, *step.before, scratch, sink),
        step_(step),
        v_new_(step.new_twist->data()),
        v_old_(step.before->twist.data()) {}

  void Bodies() {
    const double h = step_.h;
    for (int k = 0; k < s_.num_blocks(); ++k) {
      const int body = s_.moving[k];
      const BodyIndex& index = s_.bodies[body];
      const double mass = x_[index.mass];
      for (int i = 0; i < 2; ++i) {
        const double v = v_new_[3 * body + i];
        const double old = v_old_[3 * body + i];
        sink_(3 * k + i, s_.NumberVariable(index.mass), v - old - h * x_[kGravityX + i]);
        sink_(3 * k + i, s_.NumberVariable(index.linear_damping), h * v);
        sink_(3 * k + i, s_.NumberVariable(kGravityX + i), -h * mass);
        sink_(3 * k + i, s_.TwistVariable(body, i), -mass);
      }
      const double omega = v_new_[3 * body + 2];
      sink_(3 * k + 2, s_.NumberVariable(index.inertia), omega - v_old_[3 * body + 2]);
      sink_(3 * k + 2, s_.NumberVariable(index.angular_damping), h * omega);
      sink_(3 * k + 2, s_.TwistVariable(body, 2), -x_[index.inertia]);
    }
  }

  void Springs() {
    for (const SpringIndex& spring : s_.springs) {
      Locals locals;
      const Pose<LocalJet> pose_a = LocalPose(spring.a, &locals);
      const Pose<LocalJet> pose_b = LocalPose(spring.b, &locals);
      LocalJet numbers[7];
      for (int i = 0; i < 7; ++i) {
        numbers[i] = LocalNumber(spring.numbers + i, &locals);
      }
      SpringRow<LocalJet> row;
      EvaluateSpring(pose_a, pose_b, numbers, &row);
      const LocalJet speed = NewSpeed(spring.a, row.row_a, spring.b, row.row_b);
      EmitMomentum(locals, spring.a, row.pull_a, spring.b, row.pull_b, LocalJet(step_.h));
      EmitMomentum(locals, spring.a, row.row_a, spring.b, row.row_b, step_.h * numbers[5] * speed);
      EmitPrescribedDamper(spring.a, row.row_a, spring.b, row.row_b, step_.h * numbers[5].a);
    }
  }

  void Forces() {
    for (const ForceIndex& force : s_.forces) {
      const int row = BodyRow(s_, force.body);
      if (row < 0) {
        continue;
      }
      Locals locals;
      const LocalJet angle =
          locals.Add(step_.before->pose[3 * force.body + 2], s_.PoseVariable(force.body, 2));
      LocalJet numbers[5];
      for (int i = 0; i < 5; ++i) {
        numbers[i] = LocalNumber(force.numbers + i, &locals);
      }
      LocalJet start, end;
      if (force.start >= 0) {
        start = LocalNumber(force.start, &locals);
      }
      if (force.end >= 0) {
        end = LocalNumber(force.end, &locals);
      }
      LocalJet impulse[3];
      ForceImpulse(s_, force, step_.time, step_.h, angle, numbers,
                   force.start >= 0 ? &start : nullptr, force.end >= 0 ? &end : nullptr, impulse);
      for (int i = 0; i < 3; ++i) {
        Emit(locals, row + i, -impulse[i]);
      }
    }
  }

  void Joints(JointRoute route) {
    for (size_t j = 0; j < s_.joints.size(); ++j) {
      if (s_.joints[j].type == JointType::kRevolute && route == JointRoute::kByHand) {
        RevoluteByHand(static_cast<int>(j));
      } else {
        GenericJoint(static_cast<int>(j));
      }
    }
  }

  void Contacts() {
    for (size_t i = 0; i < step_.contacts->size(); ++i) {
      if ((*step_.contact_block)[i] < 0) {
        continue;
      }
      if ((*step_.contacts)[i].joint >= 0) {
        Limit(static_cast<int>(i));
      } else {
        ShapeContact(static_cast<int>(i));
      }
    }
  }

 private:
  template <typename T>
  T Speed(const double* twist, int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b) {
    T sum(0.0);
    for (int i = 0; i < 3; ++i) {
      sum += row_a[i] * twist[3 * a + i] + row_b[i] * twist[3 * b + i];
    }
    return sum;
  }
  template <typename T>
  T NewSpeed(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b) {
    return Speed(v_new_, a, row_a, b, row_b);
  }

  // A constraint row reads the twist of a body of prescribed motion.
  template <typename Row>
  void EmitPrescribed(int a, const Row& row_a, int b, const Row& row_b, int row, double factor) {
    const auto emit = [&](int body, const Row& part) {
      if (s_.bodies[body].motion == Motion::kKinematic) {
        for (int i = 0; i < 3; ++i) {
          sink_(row, s_.TwistVariable(body, i), factor * ValueOf(part[i]));
        }
      }
    };
    emit(a, row_a);
    emit(b, row_b);
  }

  // A damper's impulse reads it too.
  template <typename Row>
  void EmitPrescribedDamper(int a, const Row& row_a, int b, const Row& row_b, double weight) {
    const auto emit = [&](int body, const Row& part) {
      if (s_.bodies[body].motion == Motion::kKinematic) {
        for (int i = 0; i < 3; ++i) {
          EmitRowTimesVariable(a, row_a, b, row_b, s_.TwistVariable(body, i),
                               weight * ValueOf(part[i]));
        }
      }
    };
    emit(a, row_a);
    emit(b, row_b);
  }

  // An impact (h = 0) corrects nothing, and no damping or effort acts in it.
  bool Corrects() const {
    return step_.corrects_drift && step_.h > 0.0 &&
           JointCorrectionOf(s_.settings) == JointCorrection::kBaumgarte;
  }

  // Two rows p_a − p_b with arms r = R(θ) anchor: only the arms depend on variables, and
  //   ∂r/∂θ = r⊥,  ∂r/∂anchor = R(θ).
  void RevoluteByHand(int j) {
    const JointIndex& joint = s_.joints[j];
    const double* y = &step_.solution->joint_impulse[3 * j];
    const bool corrects = Corrects();
    const double drift = corrects ? s_.settings.baumgarte / step_.h : 0.0;
    const auto side = [&](int body, int anchor, double sign) {
      const double angle = step_.before->pose[3 * body + 2];
      const double c = std::cos(angle);
      const double s = std::sin(angle);
      const double ax = x_[anchor];
      const double ay = x_[anchor + 1];
      // Columns: the arm's change with θ and with the anchor's two components.
      const double dx[3] = {-s * ax - c * ay, c, -s};
      const double dy[3] = {c * ax - s * ay, s, c};
      const int variables[3] = {s_.PoseVariable(body, 2), s_.NumberVariable(anchor),
                                s_.NumberVariable(anchor + 1)};
      const double omega = v_new_[3 * body + 2];
      const int row = BodyRow(s_, body);
      for (int k = 0; k < 3; ++k) {
        sink_(JointRow(j), variables[k], sign * (-dy[k] * omega + drift * dx[k]));
        sink_(JointRow(j) + 1, variables[k], sign * (dx[k] * omega + drift * dy[k]));
        if (row >= 0) {
          sink_(row + 2, variables[k], -sign * (-dy[k] * y[0] + dx[k] * y[1]));
        }
      }
      if (corrects) {
        for (int i = 0; i < 2; ++i) {
          sink_(JointRow(j) + i, s_.PoseVariable(body, i), sign * drift);
        }
      }
      if (s_.bodies[body].motion == Motion::kKinematic) {
        const double rx = c * ax - s * ay;
        const double ry = s * ax + c * ay;
        sink_(JointRow(j), s_.TwistVariable(body, 0), sign);
        sink_(JointRow(j), s_.TwistVariable(body, 2), -sign * ry);
        sink_(JointRow(j) + 1, s_.TwistVariable(body, 1), sign);
        sink_(JointRow(j) + 1, s_.TwistVariable(body, 2), sign * rx);
      }
    };
    side(joint.a, joint.geometry, 1.0);
    side(joint.b, joint.geometry + 2, -1.0);
    const RowPart<double> row_a = {0.0, 0.0, 1.0};
    const RowPart<double> row_b = {0.0, 0.0, -1.0};
    EmitDrive(joint, row_a, row_b);
  }

  // Damping and effort along a coordinate whose row is given: their own numbers, and prescribed
  // twists.
  template <typename Row>
  void EmitDrive(const JointIndex& joint, const Row& row_a, const Row& row_b) {
    if (step_.h == 0.0) {
      return;
    }
    const double speed = ValueOf(NewSpeed(joint.a, row_a, joint.b, row_b));
    EmitRowTimesVariable(joint.a, row_a, joint.b, row_b, s_.NumberVariable(joint.damping),
                         step_.h * speed);
    if (joint.effort_signal < 0) {
      EmitRowTimesVariable(joint.a, row_a, joint.b, row_b, s_.NumberVariable(joint.effort),
                           -step_.h);
    }
    EmitPrescribedDamper(joint.a, row_a, joint.b, row_b, step_.h * x_[joint.damping]);
  }

  void GenericJoint(int j) {
    const JointIndex& joint = s_.joints[j];
    Locals locals;
    JointRows<LocalJet> rows;
    LocalJointRows(joint, &locals, &rows);
    const double* y = &step_.solution->joint_impulse[3 * j];
    const bool corrects = Corrects();
    for (int k = 0; k < rows.rows; ++k) {
      LocalJet row = NewSpeed(joint.a, rows.row_a[k], joint.b, rows.row_b[k]);
      if (corrects) {
        row += (s_.settings.baumgarte / step_.h) * rows.error[k];
      }
      Emit(locals, JointRow(j) + k, row);
      EmitMomentum(locals, joint.a, rows.row_a[k], joint.b, rows.row_b[k], -y[k]);
      EmitPrescribed(joint.a, rows.row_a[k], joint.b, rows.row_b[k], JointRow(j) + k, 1.0);
    }
    if (joint.damping < 0 || step_.h == 0.0) {
      return;
    }
    const double effort =
        joint.effort_signal >= 0 ? MeanEffort(s_, joint, step_.time, step_.h) : x_[joint.effort];
    const LocalJet speed = NewSpeed(joint.a, rows.coordinate_a, joint.b, rows.coordinate_b);
    EmitMomentum(locals, joint.a, rows.coordinate_a, joint.b, rows.coordinate_b,
                 step_.h * (x_[joint.damping] * speed - effort));
    EmitDrive(joint, rows.coordinate_a, rows.coordinate_b);
  }

  void Limit(int i) {
    const ActiveContact& contact = (*step_.contacts)[i];
    const JointIndex& joint = s_.joints[contact.joint];
    Locals locals;
    JointRows<LocalJet> rows;
    LocalJointRows(joint, &locals, &rows);
    const double impulse = step_.solution->normal_impulse[i];
    const int row = 3 * (*step_.contact_block)[i];
    EmitMomentum(locals, joint.a, rows.coordinate_a, joint.b, rows.coordinate_b,
                 -contact.side * impulse);
    LocalJet value =
        contact.side * NewSpeed(joint.a, rows.coordinate_a, joint.b, rows.coordinate_b);
    if (contact.law == ContactLaw::kGap) {
      value += (contact.side / step_.h) * rows.coordinate;
      sink_(row, s_.NumberVariable(contact.side > 0.0 ? joint.low : joint.high),
            -contact.side / step_.h);
    }
    Emit(locals, row, value);
    EmitPrescribed(joint.a, rows.coordinate_a, joint.b, rows.coordinate_b, row, contact.side);
  }

  void ShapeContact(int i) {
    const ActiveContact& contact = (*step_.contacts)[i];
    if constexpr (std::is_same_v<Sink, SingleAdjointSink>) {
      ShapeContactAdjoint(i, contact);
      return;
    }
    Locals locals;
    const Pose<LocalJet> pose_a = LocalPose(contact.a, &locals);
    const Pose<LocalJet> pose_b = LocalPose(contact.b, &locals);
    const ShapeView<LocalJet> shape_a = LocalShapeOfA(contact, &locals);
    const ShapeView<LocalJet> shape_b = LocalShapeOfB(contact, &locals);
    ContactRows<LocalJet> rows;
    rows.geometry = EvaluateContact(contact.feature, shape_a, pose_a, shape_b, pose_b);
    RowsFromGeometry(shape_a.type, pose_a.position, shape_b.type, pose_b.position, &rows);
    EmitContact(i, contact, locals, rows);
  }

  void EmitContact(int i, const ActiveContact& contact, const Locals& locals,
                   const ContactRows<LocalJet>& rows) {
    const int a = contact.a;
    const int b = contact.b;
    const double normal = step_.solution->normal_impulse[i];
    const int row = 3 * (*step_.contact_block)[i];
    EmitMomentum(locals, a, rows.normal_a, b, rows.normal_b, -normal);
    EmitMomentum(locals, a, rows.tangent_a, b, rows.tangent_b, -step_.solution->tangent_impulse[i]);
    if (!IsDriven(i)) {
      const double e = (*step_.restitution)[i].value;
      LocalJet value = NewSpeed(a, rows.normal_a, b, rows.normal_b);
      if (contact.law == ContactLaw::kGap) {
        value += rows.geometry.gap / step_.h;
      } else if (contact.law == ContactLaw::kRestitution) {
        value += e * Speed(v_old_, a, rows.normal_a, b, rows.normal_b);
      }
      Emit(locals, row, value);
    }
    if (step_.solution->modes[i] == ContactMode::kSticking) {
      Emit(locals, row + 1, NewSpeed(a, rows.tangent_a, b, rows.tangent_b));
    }
    EmitByRows(i, contact, rows);
  }

  // The same of one column u by the geometry's adjoint: the sum of u times the contact's rows is
  //   α_a·n_a + α_b·n_b + β_a·t_a + β_b·t_b + γ gap.
  void ShapeContactAdjoint(int i, const ActiveContact& contact) {
    const Pose<double> pose_a = state_.PoseOf(contact.a);
    const Pose<double> pose_b = state_.PoseOf(contact.b);
    const ShapeView<double> shape_a = model_.Shape(contact.a);
    const ShapeView<double> shape_b = model_.Shape(contact.b);
    ContactRows<double> rows;
    rows.geometry = EvaluateContact(contact.feature, shape_a, pose_a, shape_b, pose_b);
    RowsFromGeometry(shape_a.type, pose_a.position, shape_b.type, pose_b.position, &rows);
    const double* u_contact = sink_.u + 3 * static_cast<size_t>((*step_.contact_block)[i]);
    const double u_n = IsDriven(i) ? 0.0 : u_contact[0];
    const double u_t = step_.solution->modes[i] == ContactMode::kSticking ? u_contact[1] : 0.0;
    const double e = contact.law == ContactLaw::kRestitution ? (*step_.restitution)[i].value : 0.0;
    RowsAdjoint bar;
    const auto weigh = [&](int body, double* alpha, double* beta) {
      const int row = BodyRow(s_, body);
      for (int k = 0; k < 3; ++k) {
        const double u = row >= 0 ? sink_.u[row + k] : 0.0;
        alpha[k] = u_n * (v_new_[3 * body + k] + e * v_old_[3 * body + k]) -
                   step_.solution->normal_impulse[i] * u;
        beta[k] = u_t * v_new_[3 * body + k] - step_.solution->tangent_impulse[i] * u;
      }
    };
    weigh(contact.a, bar.normal_a, bar.tangent_a);
    weigh(contact.b, bar.normal_b, bar.tangent_b);
    bar.gap = contact.law == ContactLaw::kGap ? u_n / step_.h : 0.0;
    ContactSideAdjoint a_bar;
    ContactSideAdjoint b_bar;
    ContactRowsAdjoint(contact.feature, shape_a, pose_a, shape_b, pose_b, rows, bar, &a_bar,
                       &b_bar);
    const auto add = [&](int body, bool is_edge, int feature, const ContactSideAdjoint& side) {
      for (int k = 0; k < 3; ++k) {
        sink_.w_bar[s_.PoseVariable(body, k)] -= side.pose[k];
      }
      const BodyIndex& index = s_.bodies[body];
      int used[4];
      const int count =
          FeatureNumbers(index.shape, index.num_shape_numbers, is_edge, feature, used);
      for (int k = 0; k < count; ++k) {
        sink_.w_bar[s_.NumberVariable(index.shape_numbers + used[k])] -= side.numbers[k];
      }
    };
    add(contact.a, contact.feature.kind == FeatureKind::kEdgeVertex, contact.feature.a, a_bar);
    add(contact.b, contact.feature.kind == FeatureKind::kVertexEdge, contact.feature.b, b_bar);
    EmitByRows(i, contact, rows);
  }

  bool IsDriven(int i) const {
    return (*step_.contacts)[i].law == ContactLaw::kPoisson && step_.problem->contacts[i].driven;
  }

  // What depends on the rows' values alone: prescribed twists, restitution and friction.
  template <typename T>
  void EmitByRows(int i, const ActiveContact& contact, const ContactRows<T>& rows) {
    const int a = contact.a;
    const int b = contact.b;
    const ContactMode mode = step_.solution->modes[i];
    const double normal = step_.solution->normal_impulse[i];
    const int row = 3 * (*step_.contact_block)[i];
    if (IsDriven(i)) {
      EmitDriven(i, row);
    } else {
      if (contact.law == ContactLaw::kRestitution) {
        EmitRestitution(i, contact, rows, (*step_.restitution)[i].value, row);
      }
      EmitPrescribed(a, rows.normal_a, b, rows.normal_b, row, 1.0);
    }
    if (mode == ContactMode::kSticking) {
      EmitPrescribed(a, rows.tangent_a, b, rows.tangent_b, row + 1, 1.0);
      return;
    }
    // λt = −σ μ λn. Without friction σ is the sign of the sliding speed all the same: the one-sided
    // derivative as μ leaves 0.
    double sign = SlidingSign(mode);
    if (mode == ContactMode::kClosed) {
      sign = FrictionlessSlidingSign(*step_.problem, step_.problem->contacts[i],
                                     step_.solution->v.data());
    }
    const CoefficientSource& friction = (*step_.friction)[i];
    for (int k = 0; k < 2; ++k) {
      if (friction.numbers[k] >= 0) {
        EmitRowTimesVariable(a, rows.tangent_a, b, rows.tangent_b,
                             s_.NumberVariable(friction.numbers[k]),
                             sign * normal * friction.derivatives[k]);
      }
    }
  }

  // λn − e λ¹n, at a fixed impulse λ¹n of the compression.
  void EmitDriven(int i, int row) {
    const CoefficientSource& restitution = (*step_.restitution)[i];
    const double compression = step_.problem->contacts[i].offset / restitution.value;
    for (int k = 0; k < 2; ++k) {
      if (restitution.numbers[k] >= 0) {
        sink_(row, s_.NumberVariable(restitution.numbers[k]),
              -compression * restitution.derivatives[k]);
      }
    }
  }

  template <typename T>
  void EmitRestitution(int i, const ActiveContact& contact, const ContactRows<T>& rows, double e,
                       int row) {
    const auto emit = [&](int body, const RowPart<T>& part) {
      if (s_.bodies[body].motion != Motion::kStatic) {
        for (int k = 0; k < 3; ++k) {
          sink_(row, s_.TwistVariable(body, k), e * ValueOf(part[k]));
        }
      }
    };
    emit(contact.a, rows.normal_a);
    emit(contact.b, rows.normal_b);
    const double approach =
        ValueOf(Speed(v_old_, contact.a, rows.normal_a, contact.b, rows.normal_b));
    const CoefficientSource& restitution = (*step_.restitution)[i];
    for (int k = 0; k < 2; ++k) {
      if (restitution.numbers[k] >= 0) {
        sink_(row, s_.NumberVariable(restitution.numbers[k]),
              approach * restitution.derivatives[k]);
      }
    }
  }

  using Base = internal::LocalEntries<Sink>;
  using Base::Emit;
  using Base::EmitMomentum;
  using Base::EmitRowTimesVariable;
  using Base::JointRow;
  using Base::LocalJointRows;
  using Base::LocalNumber;
  using Base::LocalPose;
  using Base::LocalShapeOfA;
  using Base::LocalShapeOfB;
  using Base::model_;
  using Base::s_;
  using Base::sink_;
  using Base::state_;
  using Base::x_;

  const SolvedStep& step_;
  const double* v_new_;
  const double* v_old_;
};

}  // namespace

template <typename Sink>
void VisitStepJacobian(const Model<double>& model, const SolvedStep& step, JointRoute route,
                       LocalJacobianScratch* scratch, const Sink& sink) {
  StepVisitor<Sink> visitor(model, step, scratch, sink);
  visitor.Bodies();
  if (step.h > 0.0) {
    visitor.Springs();
    visitor.Forces();
  }
  visitor.Joints(route);
  visitor.Contacts();
}

#define TANGIBLE_INSTANTIATE(Sink)                                                           \
  template void VisitStepJacobian<Sink>(const Model<double>&, const SolvedStep&, JointRoute, \
                                        LocalJacobianScratch*, const Sink&);
TANGIBLE_INSTANTIATE(TangentSink)
TANGIBLE_INSTANTIATE(AdjointSink)
TANGIBLE_INSTANTIATE(SingleAdjointSink)
TANGIBLE_INSTANTIATE(EntryListSink)

}  // namespace tangible
