// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/model_part.h"

#include <numeric>

#include "tangible/dynamics/model/driven_bodies.h"

namespace tangible {
namespace {

class PartTaker {
 public:
  PartTaker(const ModelStructure& whole, const std::vector<int>& bodies)
      : whole_(whole), local_(whole.bodies.size(), -1) {
    part_.bodies = bodies;
    part_.bodies.push_back(whole.world());
    for (size_t k = 0; k < part_.bodies.size(); ++k) {
      local_[part_.bodies[k]] = static_cast<int>(k);
    }
  }

  ModelPart Take() {
    to_->scene_name = whole_.scene_name;
    to_->settings = whole_.settings;
    to_->friction_decays = whole_.friction_decays;
    to_->has_rolling_friction = whole_.has_rolling_friction;
    TakeNumber(kGravityX);
    TakeNumber(kGravityY);
    TakeBodies();
    TakeJoints();
    TakeSpringsAndForces();
    TakePairs();
    to_->num_parameters = static_cast<int>(part_.numbers.size());
    part_.structure = std::move(to_);
    return std::move(part_);
  }

 private:
  void TakeNumber(int number) { part_.numbers.push_back(number); }

  // Takes `count` numbers and sets the place of the first of them; −1 stays −1.
  void TakeNumbers(int count, int* place) {
    if (*place < 0) return;
    const int first = *place;
    *place = static_cast<int>(part_.numbers.size());
    for (int i = 0; i < count; ++i) {
      TakeNumber(first + i);
    }
  }
  void TakeOne(int* place) { TakeNumbers(1, place); }

  bool Moves(int body) const { return local_[body] >= 0 && whole_.bodies[body].block >= 0; }

  void TakeBodies() {
    to_->bodies.reserve(part_.bodies.size());
    for (const int body : part_.bodies) {
      BodyIndex& index = to_->bodies.emplace_back(whole_.bodies[body]);
      TakeNumbers(index.num_shape_numbers, &index.shape_numbers);
      TakeNumbers(2 * index.num_contact_points, &index.contact_points);
      TakeOne(&index.friction);
      TakeOne(&index.restitution);
      if (index.block >= 0) {
        index.block = to_->num_blocks();
        to_->moving.push_back(to_->num_bodies() - 1);
      }
      TakeOne(&index.mass);
      TakeOne(&index.inertia);
      TakeOne(&index.linear_damping);
      TakeOne(&index.angular_damping);
      TakeOne(&index.quadratic_drag);
      TakeNumbers(2, &index.kinetic_friction);
      TakeOne(&index.rolling_friction);
      for (const SupportIndex& support : whole_.supports) {
        if (support.body != body) continue;
        SupportIndex& own = to_->supports.emplace_back(support);
        own.body = to_->num_bodies() - 1;
        TakeNumbers(support.size(), &own.numbers);
      }
      if (const int path = PathOfBody(whole_, body); path >= 0) {
        PathIndex& own = to_->paths.emplace_back(whole_.paths[path]);
        own.body = to_->num_bodies() - 1;
        TakeNumbers(kNumPathNumbers, &own.numbers);
      }
    }
  }

  void TakeSignal(int* place) {
    if (*place < 0) return;
    to_->signals.push_back(whole_.signals[*place]);
    *place = static_cast<int>(to_->signals.size()) - 1;
  }

  // The servos of a joint or force of the whole; `own` is its place in the part.
  void TakeServos(int ServoIndex::*owner, size_t of_whole, size_t own) {
    for (const ServoIndex& servo : whole_.servos) {
      if (servo.*owner != static_cast<int>(of_whole)) continue;
      ServoIndex& index = to_->servos.emplace_back(servo);
      index.*owner = static_cast<int>(own);
      TakeNumbers(servo.size(), &index.numbers);
      TakeSignal(&index.signal);
    }
  }

  void TakeJoints() {
    std::vector<int> local_joint(whole_.joints.size(), -1);
    for (size_t j = 0; j < whole_.joints.size(); ++j) {
      if (!Moves(whole_.joints[j].a) && !Moves(whole_.joints[j].b)) continue;
      JointIndex& index = to_->AddJoint(whole_.joints[j]);
      local_joint[j] = static_cast<int>(part_.joints.size());
      part_.joints.push_back(static_cast<int>(j));
      index.a = local_[index.a];
      index.b = local_[index.b];
      if (index.c >= 0) index.c = local_[index.c];
      if (index.d >= 0) index.d = local_[index.d];
      TakeNumbers(index.num_geometry, &index.geometry);
      TakeOne(&index.damping);
      TakeOne(&index.effort);
      TakeNumbers(2, &index.stiffness);
      TakeNumbers(index.has_decay ? 3 : 1, &index.friction);
      TakeNumbers(2, &index.motor);
      TakeOne(&index.low);
      TakeOne(&index.high);
      TakeOne(&index.limit_restitution);
      TakeOne(&index.until);
      to_->has_releases = to_->has_releases || index.until >= 0;
      TakeSignal(&index.effort_signal);
      TakeServos(&ServoIndex::joint, j, to_->joints.size() - 1);
    }
    // Joints that are coupled have moving bodies, which are bodies of the coupling.
    for (JointIndex& index : to_->joints) {
      for (int& coupled : index.coupled) coupled = coupled < 0 ? -1 : local_joint[coupled];
    }
    to_->joint_loops = whole_.joint_loops && !to_->joints.empty();
    for (const auto& [a, b] : whole_.joined) {
      if (local_[a] >= 0 && local_[b] >= 0) {
        to_->joined.emplace_back(local_[a], local_[b]);
      }
    }
  }

  void TakeSpringsAndForces() {
    for (const SpringIndex& spring : whole_.springs) {
      if (!Moves(spring.a) && !Moves(spring.b)) continue;
      SpringIndex& index = to_->springs.emplace_back(spring);
      index.a = local_[index.a];
      index.b = local_[index.b];
      TakeNumbers(7, &index.numbers);
    }
    for (size_t k = 0; k < whole_.forces.size(); ++k) {
      const ForceIndex& force = whole_.forces[k];
      if (!Moves(force.body)) continue;
      ForceIndex& index = to_->forces.emplace_back(force);
      index.body = local_[index.body];
      TakeNumbers(5, &index.numbers);
      TakeOne(&index.start);
      TakeOne(&index.end);
      TakeSignal(&index.force_signal);
      TakeSignal(&index.torque_signal);
      TakeServos(&ServoIndex::force, k, to_->forces.size() - 1);
    }
  }

  std::vector<bool> OfPart(const std::vector<bool>& of_whole) const {
    std::vector<bool> own;
    own.reserve(part_.bodies.size());
    for (const int body : part_.bodies) {
      own.push_back(of_whole[body]);
    }
    return own;
  }

  void TakePairs() {
    const auto any = [](const std::vector<bool>& x) {
      return std::find(x.begin(), x.end(), true) != x.end();
    };
    for (const PairIndex& pair : whole_.pairs) {
      PairIndex index{OfPart(pair.first), OfPart(pair.second),   pair.friction,
                      pair.restitution,   pair.kinetic_friction, pair.rolling_friction};
      if (!any(index.first) || !any(index.second)) continue;
      TakeOne(&index.friction);
      TakeOne(&index.restitution);
      TakeNumbers(2, &index.kinetic_friction);
      TakeOne(&index.rolling_friction);
      to_->pairs.push_back(std::move(index));
    }
    for (const auto& [first, second] : whole_.no_contact) {
      to_->no_contact.emplace_back(OfPart(first), OfPart(second));
    }
  }

  const ModelStructure& whole_;
  std::vector<int> local_;  ///< for each body of the whole; −1: not in the part
  ModelPart part_;
  std::shared_ptr<ModelStructure> to_ = std::make_shared<ModelStructure>();
};

}  // namespace

ModelPart TakePart(const ModelStructure& whole, const std::vector<int>& bodies) {
  return PartTaker(whole, bodies).Take();
}

bool IsDivisible(const ModelStructure& whole) {
  std::vector<int> all(static_cast<size_t>(whole.world()));
  std::iota(all.begin(), all.end(), 0);
  const std::vector<int> numbers = TakePart(whole, all).numbers;
  return static_cast<int>(numbers.size()) == whole.num_parameters;
}

}  // namespace tangible
