// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/load_speed.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/dynamics/elements/force.h"
#include "tangible/dynamics/elements/joint.h"
#include "tangible/dynamics/elements/servo_inl.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

class LoadScan {
 public:
  LoadScan(const Model<double>& model, const Lengths& lengths, double t, double h,
           const State<double>& state)
      : model_(model),
        s_(*model.structure),
        lengths_(lengths),
        from_(t),
        to_(t + h),
        state_(state) {}

  double Run() {
    for (const ForceIndex& force : s_.forces) Force(force);
    for (const SpringIndex& spring : s_.springs) Spring(spring);
    for (const JointIndex& joint : s_.joints) {
      if (!IsReleased(s_, state_, joint) || EndsAtStart(joint)) Joint(joint);
    }
    for (const PathIndex& path : s_.paths) Path(path);
    for (int k = 0; k < static_cast<int>(s_.servos.size()); ++k) Servo(k);
    return fastest_;
  }

 private:
  double Number(int index) const { return model_.parameters[index]; }

  // The friction of a joint that ends as the step begins has left the speeds there.
  bool EndsAtStart(const JointIndex& joint) const {
    return joint.until >= 0 && IsSameInstant(s_, Number(joint.until), from_);
  }

  // The largest magnitude of a signal's column within the step.
  double Largest(const Signal& signal, const std::vector<double>& column) const {
    if (column.empty()) return 0.0;
    const auto place = [&](double time) {
      const auto next = std::upper_bound(signal.time.begin(), signal.time.end(), time);
      return static_cast<size_t>(std::max<long>(0, next - signal.time.begin() - 1));
    };
    const size_t last = std::min(place(to_) + 1, column.size() - 1);
    double largest = 0.0;
    for (size_t k = place(from_); k <= last; ++k) {
      largest = std::max(largest, std::abs(column[k]));
    }
    return largest;
  }

  // A driven body gives the speed that it gains itself.
  void Path(const PathIndex& path) {
    for (const double time : {from_, to_}) {
      const PathSide side = time == from_ ? PathSide::kAfter : PathSide::kBefore;
      GivenAccelerations(model_, time, BesideInstant(s_, time, side), &given_);
      const double* a = &given_[3 * path.body];
      const double turn = std::abs(a[2]) * lengths_.radius(path.body);
      fastest_ = std::max(fastest_, s_.settings.dt * (std::hypot(a[0], a[1]) + turn));
    }
  }

  // The speed that a force (N) and a torque (N m) give a body.
  double SpeedBy(int body, double force, double torque) const {
    const BodyIndex& index = s_.bodies[body];
    if (index.block < 0) return 0.0;
    const double mass = Number(index.mass);
    const double size = lengths_.size(body);
    double speed = force / mass;
    if (torque > 0.0)
      speed = std::max(speed, torque * size / (Number(index.inertia) + mass * size * size));
    return std::isfinite(speed) ? s_.settings.dt * speed : 0.0;
  }
  void Add(int body, double force, double torque) {
    fastest_ = std::max(fastest_, SpeedBy(body, force, torque));
  }

  void Force(const ForceIndex& force) {
    if ((force.start >= 0 && Number(force.start) > to_) ||
        (force.end >= 0 && Number(force.end) < from_)) {
      return;
    }
    const double* x = &model_.parameters[force.numbers];
    double size = std::hypot(x[2], x[3]);
    double torque = std::abs(x[4]);
    if (force.force_signal >= 0) {
      const Signal& signal = s_.signals[force.force_signal];
      size = std::hypot(Largest(signal, signal.x), Largest(signal, signal.y));
    }
    if (force.torque_signal >= 0) {
      const Signal& signal = s_.signals[force.torque_signal];
      torque = Largest(signal, signal.value);
    }
    Add(force.body, size, torque + std::hypot(x[0], x[1]) * size);
  }

  void Spring(const SpringIndex& spring) {
    SpringRow<double> row;
    EvaluateSpring<double>(state_.PoseOf(spring.a), state_.PoseOf(spring.b),
                           &model_.parameters[spring.numbers], &row);
    const double force = std::abs(row.tension);
    Add(spring.a, force, force * std::abs(row.row_a[2]));
    Add(spring.b, force, force * std::abs(row.row_b[2]));
  }

  // What a servo does at the step's start.
  void Servo(int k) {
    const double middle = 0.5 * (from_ + to_);
    if (!IsServoOn(model_, k, middle)) return;
    const ServoIndex& servo = s_.servos[k];
    double acts = std::abs(UnboundedEffort(model_, state_, k, {from_, middle, 0.0}));
    if (servo.has_limit) acts = std::min(acts, Number(servo.Number(ServoIndex::kLimit)));
    ServoRows<double> rows;
    EvaluateServo(model_, state_, servo, &rows);
    Add(rows.a, acts * std::hypot(rows.row_a[0], rows.row_a[1]), acts * std::abs(rows.row_a[2]));
    Add(rows.b, acts * std::hypot(rows.row_b[0], rows.row_b[1]), acts * std::abs(rows.row_b[2]));
  }

  // Effort, spring and friction along a joint's coordinate.
  void Joint(const JointIndex& joint) {
    double acts = 0.0;
    if (joint.damping >= 0) {
      acts = joint.effort_signal < 0
                 ? std::abs(Number(joint.effort))
                 : Largest(s_.signals[joint.effort_signal], s_.signals[joint.effort_signal].value);
    }
    if (joint.stiffness >= 0) {
      JointRows<double> rows;
      EvaluateJoint(joint.type, state_.PoseOf(joint.a), state_.PoseOf(joint.b),
                    &model_.parameters[joint.geometry], &rows);
      acts += std::abs(Number(joint.stiffness) * (rows.coordinate - Number(joint.stiffness + 1)));
    }
    const double friction = (joint.friction >= 0 ? Number(joint.friction) : 0.0) +
                            (joint.motor >= 0 ? Number(joint.motor + 1) : 0.0);
    const bool slides = joint.type == JointType::kPrismatic;
    for (const int body : {joint.a, joint.b}) {
      Add(body, slides ? acts : 0.0, slides ? 0.0 : acts);
      const double most = kStoppedSizes * lengths_.size(body) / s_.settings.dt;
      fastest_ =
          std::max(fastest_,
                   std::min(most, SpeedBy(body, slides ? friction : 0.0, slides ? 0.0 : friction)));
    }
  }

  const Model<double>& model_;
  const ModelStructure& s_;
  const Lengths& lengths_;
  const double from_, to_;
  const State<double>& state_;
  double fastest_ = 0.0;
  std::vector<double> given_;
};

}  // namespace

double LoadSpeed(const Model<double>& model, const Lengths& lengths, double t, double h,
                 const State<double>& state) {
  return LoadScan(model, lengths, t, h, state).Run();
}

double LoadAcceleration(const ContactProblem<double>& problem) {
  double fastest = 0.0;
  for (size_t i = 0; i < problem.load.size(); ++i) {
    const double acceleration = std::abs(problem.load[i]) / problem.mass[i];
    const size_t k = 3 * (i / 3);
    const double arm = i % 3 == 2 ? std::sqrt(problem.mass[k + 2] / problem.mass[k]) : 1.0;
    fastest = std::max(fastest, arm * acceleration);
  }
  return fastest;
}

double LimitAcceleration(const ContactProblem<double>& problem) {
  double largest = 0.0;
  for (const ContactBlock<double>& contact : problem.contacts) {
    if (!contact.limit_given) continue;
    const double limit = contact.friction * contact.offset;
    for (int i = 0; i < 3; ++i) {
      for (const auto& [block, row] :
           {std::pair(contact.a, &contact.tangent_a), std::pair(contact.b, &contact.tangent_b)}) {
        if (block < 0) continue;
        largest = std::max(largest, limit * std::abs((*row)[i]) / problem.mass[3 * block + i]);
      }
    }
  }
  return largest;
}

}  // namespace tangible
