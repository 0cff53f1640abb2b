// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/assembly/acceleration.h"

#include <algorithm>

namespace tangible {
namespace {

template <typename T>
class AccelerationAssembly {
 public:
  AccelerationAssembly(const Model<T>& model, const State<T>& state,
                       AccelerationScratch<T>* scratch, ContactProblem<T>* problem)
      : model_(model),
        structure_(*model.structure),
        x_(model.numbers),
        state_(state),
        scratch_(*scratch),
        p_(*problem) {}

  void Masses() {
    p_.num_bodies = structure_.num_blocks();
    p_.mass.resize(3 * p_.num_bodies);
    p_.momentum.assign(3 * p_.num_bodies, T(0.0));
    p_.dampers.clear();
    p_.joints.clear();
    p_.contacts.clear();
    p_.redundant_joints = structure_.joint_loops;
    for (int k = 0; k < p_.num_bodies; ++k) {
      const BodyIndex& index = structure_.bodies[structure_.moving[k]];
      p_.mass[3 * k] = x_[index.mass];
      p_.mass[3 * k + 1] = x_[index.mass];
      p_.mass[3 * k + 2] = x_[index.inertia];
    }
  }

  void Forces(const T& t, double middle) {
    for (int k = 0; k < p_.num_bodies; ++k) {
      const int body = structure_.moving[k];
      const BodyIndex& index = structure_.bodies[body];
      for (int i = 0; i < 2; ++i) {
        p_.momentum[3 * k + i] = x_[index.mass] * x_[kGravityX + i] -
                                 x_[index.linear_damping] * state_.twist[3 * body + i];
      }
      p_.momentum[3 * k + 2] = -x_[index.angular_damping] * state_.twist[3 * body + 2];
    }
    for (const SpringIndex& spring : structure_.springs) {
      SpringRow<T> row;
      EvaluateSpring(state_.PoseOf(spring.a), state_.PoseOf(spring.b), &x_[spring.numbers], &row);
      Add(spring.a, row.pull_a, spring.b, row.pull_b, T(-1.0));
      const T speed = RelativeSpeed(state_, spring.a, row.row_a, spring.b, row.row_b);
      Add(spring.a, row.row_a, spring.b, row.row_b, T(-x_[spring.numbers + 5] * speed));
    }
    for (const ForceIndex& force : structure_.forces) {
      const int block = structure_.bodies[force.body].block;
      if (block < 0) {
        continue;
      }
      T value[3];
      ForceAt(structure_, force, x_, state_.pose[3 * force.body + 2], t, middle, value);
      for (int i = 0; i < 3; ++i) {
        p_.momentum[3 * block + i] += value[i];
      }
    }
  }

  void Joints() {
    scratch_.joints.resize(structure_.joints.size());
    scratch_.rates.resize(structure_.joints.size());
    for (size_t j = 0; j < structure_.joints.size(); ++j) {
      const JointIndex& joint = structure_.joints[j];
      JointRows<T>& rows = scratch_.joints[j];
      EvaluateJointRates(joint.type, MovingPoseOf(state_, joint.a), MovingPoseOf(state_, joint.b),
                         &x_[joint.geometry], joint.num_geometry, &rows, &scratch_.rates[j]);
      JointBlock<T>& block = AddJoint(joint, rows);
      for (int k = 0; k < rows.rows; ++k) {
        block.rhs[k] = -scratch_.rates[j].row[k];
      }
    }
  }

  void Drives(const T& t, double middle) {
    for (size_t j = 0; j < structure_.joints.size(); ++j) {
      const JointIndex& joint = structure_.joints[j];
      if (joint.damping < 0) {
        continue;
      }
      const JointRows<T>& r = scratch_.joints[j];
      const T speed = RelativeSpeed(state_, joint.a, r.coordinate_a, joint.b, r.coordinate_b);
      T effort = x_[joint.effort];
      if (joint.effort_signal >= 0) {
        const Signal& signal = structure_.signals[joint.effort_signal];
        effort = SignalAt(signal, signal.value, t, middle, nullptr);
      }
      Add(joint.a, r.coordinate_a, joint.b, r.coordinate_b, T(effort - x_[joint.damping] * speed));
    }
  }

  void Contacts(const std::vector<ActiveContact>& contacts,
                const std::vector<CoefficientSource>& friction) {
    for (size_t i = 0; i < contacts.size(); ++i) {
      const ActiveContact& contact = contacts[i];
      ContactRows<T> rows;
      ContactRates<T> rates;
      if (contact.joint >= 0) {
        EvaluateLimitRows(model_, scratch_.joints[contact.joint], contact, &rows);
        rates.normal = contact.side * scratch_.rates[contact.joint].coordinate;
      } else {
        EvaluateContactRates(contact.feature, model_.Shape(contact.a),
                             MovingPoseOf(state_, contact.a), model_.Shape(contact.b),
                             MovingPoseOf(state_, contact.b), &scratch_.contact, &rows, &rates);
      }
      ContactBlock<T>& block = AddContact(contact, friction[i], rows);
      block.c_n = rates.normal;
      block.c_t = rates.tangent;
    }
  }

  void CorrectJoints() {
    const double share = JointCorrectionShare(structure_.settings);
    scratch_.joints.resize(structure_.joints.size());
    for (size_t j = 0; j < structure_.joints.size(); ++j) {
      const JointIndex& joint = structure_.joints[j];
      JointRows<T>& rows = scratch_.joints[j];
      EvaluateJoint(joint.type, state_.PoseOf(joint.a), state_.PoseOf(joint.b), &x_[joint.geometry],
                    &rows);
      JointBlock<T>& block = AddJoint(joint, rows);
      for (int k = 0; k < rows.rows; ++k) {
        block.rhs[k] = -share * rows.error[k];
      }
    }
  }

  void CorrectContacts(const std::vector<ActiveContact>& contacts,
                       const std::vector<CoefficientSource>& friction, const T& recovery) {
    for (size_t i = 0; i < contacts.size(); ++i) {
      ContactRows<T> rows;
      if (contacts[i].joint >= 0) {
        EvaluateLimitRows(model_, scratch_.joints[contacts[i].joint], contacts[i], &rows);
      } else {
        EvaluateContactRows(model_, state_, contacts[i], &rows);
      }
      ContactBlock<T>& block = AddContact(contacts[i], friction[i], rows);
      block.c_n = contacts[i].law == ContactLaw::kRecovery ? -recovery : rows.geometry.gap;
      block.c_t = T(0.0);
    }
  }

 private:
  JointBlock<T>& AddJoint(const JointIndex& joint, const JointRows<T>& rows) {
    JointBlock<T>& block = p_.joints.emplace_back();
    block.a = structure_.bodies[joint.a].block;
    block.b = structure_.bodies[joint.b].block;
    block.rows = rows.rows;
    for (int k = 0; k < rows.rows; ++k) {
      block.row_a[k] = rows.row_a[k];
      block.row_b[k] = rows.row_b[k];
    }
    return block;
  }

  ContactBlock<T>& AddContact(const ActiveContact& contact, const CoefficientSource& friction,
                              const ContactRows<T>& rows) {
    ContactBlock<T>& block = p_.contacts.emplace_back();
    block.a = structure_.bodies[contact.a].block;
    block.b = structure_.bodies[contact.b].block;
    block.normal_a = rows.normal_a;
    block.normal_b = rows.normal_b;
    block.tangent_a = rows.tangent_a;
    block.tangent_b = rows.tangent_b;
    block.friction = EvaluateCoefficient(friction, x_);
    block.has_friction = friction.value > 0.0;
    return block;
  }

  void Add(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b, const T& amount) {
    AddRowTransposed(structure_.bodies[a].block, row_a, structure_.bodies[b].block, row_b, amount,
                     p_.momentum.data());
  }

  const Model<T>& model_;
  const ModelStructure& structure_;
  const std::vector<T>& x_;
  const State<T>& state_;
  AccelerationScratch<T>& scratch_;
  ContactProblem<T>& p_;
};

}  // namespace

template <typename T>
T SignalAt(const Signal& signal, const std::vector<double>& column, const T& t, double middle,
           double* slope) {
  if (slope != nullptr) {
    *slope = 0.0;
  }
  if (column.empty()) {
    return T(0.0);
  }
  const auto next = std::upper_bound(signal.time.begin(), signal.time.end(), middle);
  if (next == signal.time.begin()) {
    return T(column.front());
  }
  const size_t k = next - signal.time.begin() - 1;
  if (next == signal.time.end() || signal.interpolation == Signal::Interpolation::kConstant) {
    return T(column[k]);
  }
  const double rate = (column[k + 1] - column[k]) / (signal.time[k + 1] - signal.time[k]);
  if (slope != nullptr) {
    *slope = rate;
  }
  return column[k] + rate * (t - signal.time[k]);
}

template <typename T>
void ForceAt(const ModelStructure& structure, const ForceIndex& force,
             const std::vector<T>& numbers, const T& angle, const T& t, double middle, T out[3]) {
  const bool acts = (force.start < 0 || ValueOf(numbers[force.start]) <= middle) &&
                    (force.end < 0 || middle <= ValueOf(numbers[force.end]));
  if (!acts) {
    out[0] = out[1] = out[2] = T(0.0);
    return;
  }
  const T* x = &numbers[force.numbers];
  if (force.force_signal >= 0) {
    const Signal& signal = structure.signals[force.force_signal];
    out[0] = SignalAt(signal, signal.x, t, middle, nullptr);
    out[1] = SignalAt(signal, signal.y, t, middle, nullptr);
  } else {
    out[0] = x[2];
    out[1] = x[3];
  }
  const Vector2<T> arm = Rotation<T>(angle) * Vector2<T>(x[0], x[1]);
  out[2] = Cross(arm, Vector2<T>(out[0], out[1]));
  if (force.torque_signal >= 0) {
    const Signal& signal = structure.signals[force.torque_signal];
    out[2] += SignalAt(signal, signal.value, t, middle, nullptr);
  } else {
    out[2] += x[4];
  }
}

template <typename T>
void AssembleAcceleration(const Model<T>& model, const State<T>& state, const T& t, double middle,
                          const std::vector<ActiveContact>& contacts,
                          const std::vector<CoefficientSource>& friction,
                          AccelerationScratch<T>* scratch, ContactProblem<T>* problem) {
  AccelerationAssembly<T> assembly(model, state, scratch, problem);
  assembly.Masses();
  assembly.Forces(t, middle);
  assembly.Joints();
  assembly.Drives(t, middle);
  assembly.Contacts(contacts, friction);
}

double JointCorrectionShare(const SimulationSettings& settings) {
  return JointCorrectionOf(settings) == JointCorrection::kNone        ? 0.0
         : JointCorrectionOf(settings) == JointCorrection::kBaumgarte ? settings.baumgarte
                                                                      : 1.0;
}

template <typename T>
void AssembleCorrection(const Model<T>& model, const State<T>& state,
                        const std::vector<ActiveContact>& contacts,
                        const std::vector<CoefficientSource>& friction, const T& recovery,
                        AccelerationScratch<T>* scratch, ContactProblem<T>* problem) {
  AccelerationAssembly<T> assembly(model, state, scratch, problem);
  assembly.Masses();
  assembly.CorrectJoints();
  assembly.CorrectContacts(contacts, friction, recovery);
}

#define TANGIBLE_INSTANTIATE(T)                                                                 \
  template T SignalAt<T>(const Signal&, const std::vector<double>&, const T&, double, double*); \
  template void ForceAt<T>(const ModelStructure&, const ForceIndex&, const std::vector<T>&,     \
                           const T&, const T&, double, T[3]);                                   \
  template void AssembleAcceleration<T>(                                                        \
      const Model<T>&, const State<T>&, const T&, double, const std::vector<ActiveContact>&,    \
      const std::vector<CoefficientSource>&, AccelerationScratch<T>*, ContactProblem<T>*);      \
  template void AssembleCorrection<T>(const Model<T>&, const State<T>&,                         \
                                      const std::vector<ActiveContact>&,                        \
                                      const std::vector<CoefficientSource>&, const T&,          \
                                      AccelerationScratch<T>*, ContactProblem<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
