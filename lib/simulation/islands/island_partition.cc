// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_partition.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/model_part.h"
#include "tangible/math/scalar.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The room that a step leaves for contacts to make a body faster.
constexpr double kRoom = 1.5;

}  // namespace

IslandPartition::IslandPartition(const Model<double>& model) : lengths_(model), islands_(1) {
  const ModelStructure& structure = *model.structure;
  busy_.resize(structure.bodies.size());
  expects_.resize(structure.bodies.size());
  island_of_.resize(structure.bodies.size(), -1);
  reach_.resize(structure.bodies.size());
  boxes_.resize(structure.bodies.size());
  Connect(structure);
  bool is_apart = false;
  for (const int body : structure.moving) {
    is_apart = is_apart || moving_.Root(body) != moving_.Root(structure.moving[0]);
  }
  may_divide_ = is_apart && IsDivisible(structure);
}

// Connects two bodies of which at least one moves.
void IslandPartition::Join(int a, int b) {
  for (const int body : {a, b}) {
    if (moving_.Has(body)) busy_[body] = 1;
  }
  if (moving_.Has(a) && moving_.Has(b)) {
    moving_.Join(a, b);
  } else if (moving_.Has(a) || moving_.Has(b)) {
    given_.emplace_back(moving_.Has(a) ? a : b, moving_.Has(a) ? b : a);
  }
}

// Connects the bodies of joints and springs.
void IslandPartition::Connect(const ModelStructure& structure) {
  given_.clear();
  std::fill(busy_.begin(), busy_.end(), 0);
  moving_.Clear(structure.bodies.size());
  for (const int body : structure.moving) {
    moving_.Add(body);
  }
  for (const JointIndex& joint : structure.joints) {
    Join(joint.a, joint.b);
    if (joint.c < 0) continue;
    Join(joint.a, joint.c);
    Join(joint.a, joint.d);
  }
  for (const SpringIndex& spring : structure.springs) {
    Join(spring.a, spring.b);
  }
}

double IslandPartition::SpeedOf(int body, const double* twist) const {
  return std::hypot(twist[0], twist[1]) + std::abs(twist[2]) * lengths_.radius(body);
}

void IslandPartition::FindReach(const Model<double>& model, const State<double>& state, double t,
                                double h) {
  const ModelStructure& structure = *model.structure;
  AssembleWithoutContacts(model, state, t, h, &free_, &scratch_);
  for (int body = 0; body < structure.num_bodies(); ++body) {
    double speed = SpeedOf(body, &state.twist[3 * body]);
    if (const int block = structure.bodies[body].block; block >= 0) {
      double after[3];
      for (int i = 0; i < 3; ++i) {
        after[i] = free_.load[3 * block + i] / free_.mass[3 * block + i];
      }
      speed = std::max(speed, SpeedOf(body, after));
    }
    speed = std::max(speed, LargestGivenSpeed(model, body, t, t + h, lengths_.radius(body)));
    reach_[body] = kRoom * h * speed;
  }
}

void IslandPartition::Divide(const Model<double>& model, const State<double>& state,
                             const EventGuess& last) {
  const ModelStructure& structure = *model.structure;
  Connect(structure);
  for (int body = 0; body < structure.num_bodies(); ++body) {
    // Bodies that touch are near: their gap is within the touching tolerance.
    const double touches =
        lengths_.Touch(state, body, body) + kWiderBoxes * lengths_.smallest_radius();
    boxes_[body] = BoxOf(model, body, state.PoseOf(body), reach_[body] + touches);
    if (structure.bodies[body].shape == ShapeType::kHalfPlane &&
        (state.twist[3 * body + 2] != 0.0 || TurnsAlongPath(structure, body))) {
      boxes_[body] = {-kInfinity, -kInfinity, kInfinity, kInfinity};
    }
  }
  broad_phase_.FindPairs(
      boxes_, [&](int i, int j) { return structure.MayCollide(i, j); }, &pairs_);
  closed_.clear();
  for (size_t i = 0; i < last.contacts.size(); ++i) {
    if (last.contacts[i].IsOfShapes() && last.modes[i] != ContactMode::kOpen) {
      closed_.emplace_back(last.contacts[i].a, last.contacts[i].b);
    }
  }
  std::sort(closed_.begin(), closed_.end());
  for (const auto& [a, b] : pairs_) {
    Join(a, b);
  }
  std::fill(expects_.begin(), expects_.end(), 0);
  for (const auto& [a, b] : pairs_) {
    const int body = moving_.Has(a) ? a : b;
    if (!std::binary_search(closed_.begin(), closed_.end(), std::make_pair(a, b))) {
      expects_[moving_.Root(body)] = 1;
    }
  }
}

void IslandPartition::List(const ModelStructure& structure, Together together) {
  num_islands_ = 1;
  islands_[0].clear();
  for (const int body : structure.moving) {
    const int root = moving_.Root(body);
    if (root == body) {  // the first body of its island
      const bool is_apart = together == Together::kWithout ? busy_[body] != 0 : expects_[body] != 0;
      island_of_[body] = is_apart ? num_islands_++ : 0;
      if (static_cast<int>(islands_.size()) < num_islands_) {
        islands_.emplace_back();
      }
      if (is_apart) islands_[island_of_[body]].clear();
    }
    island_of_[body] = island_of_[root];
    islands_[island_of_[body]].push_back(body);
  }
  for (const auto& [body, given] : given_) {
    islands_[island_of_[body]].push_back(given);
  }
  for (int k = 0; k < num_islands_; ++k) {
    std::vector<int>& bodies = islands_[k];
    std::sort(bodies.begin(), bodies.end());
    bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
    if (!bodies.empty() && bodies.back() == structure.world()) bodies.pop_back();
  }
}

}  // namespace tangible
