// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A part of a model as a model of its own: some of its bodies with the joints, springs, forces and
// coefficients of pairs that act on them. Bodies keep their order, and so do the numbers.
//
// A part moves as it does within the whole model for as long as none of its bodies is joined to, or
// touches, a body outside of it.

#include <algorithm>
#include <memory>
#include <vector>

#include "tangible/dynamics/model/model.h"

namespace tangible {

struct ModelPart {
  std::shared_ptr<const ModelStructure> structure;
  // For each body (the world is the last), joint and number of the part: which one of the whole it
  // is, in ascending order.
  std::vector<int> bodies, joints, numbers;

  /// The part's index of a body or joint of the whole; −1: it is not in the part.
  int LocalBody(int body) const { return Find(bodies, body); }
  int LocalJoint(int joint) const { return Find(joints, joint); }

  /// The part's numbers out of the whole model's.
  template <typename T>
  void GatherNumbers(const std::vector<T>& whole, std::vector<T>* own) const {
    own->resize(numbers.size());
    for (size_t i = 0; i < numbers.size(); ++i) {
      (*own)[i] = whole[numbers[i]];
    }
  }
  /// The part's model out of the whole one. What bodies outside of the part hide stays hidden.
  template <typename T>
  void GatherModel(const Model<T>& whole, Model<T>* own) const {
    own->structure = structure;
    GatherNumbers(whole.parameters, &own->parameters);
    own->seams = whole.seams;
    if (whole.seams != nullptr) {
      own->seams_of.resize(bodies.size());
      own->outline_of.resize(bodies.size());
      own->curve_of.resize(bodies.size());
      for (size_t k = 0; k < bodies.size(); ++k) {
        own->seams_of[k] = whole.seams_of[bodies[k]];
        own->outline_of[k] = whole.outline_of[bodies[k]];
        own->curve_of[k] = whole.curve_of[bodies[k]];
      }
    }
  }
  /// The part's poses and twists out of the whole ones.
  template <typename T>
  void GatherState(const State<T>& whole, State<T>* own) const {
    own->pose.resize(3 * bodies.size());
    own->twist.resize(3 * bodies.size());
    own->released.clear();
    for (size_t k = 0; k < bodies.size(); ++k) {
      std::copy_n(&whole.pose[3 * bodies[k]], 3, &own->pose[3 * k]);
      std::copy_n(&whole.twist[3 * bodies[k]], 3, &own->twist[3 * k]);
    }
  }
  /// Sets poses and twists of the part's moving bodies in the whole state.
  template <typename T>
  void ScatterState(const State<T>& own, State<T>* whole) const {
    for (const int k : structure->moving) {
      std::copy_n(&own.pose[3 * k], 3, &whole->pose[3 * bodies[k]]);
      std::copy_n(&own.twist[3 * k], 3, &whole->twist[3 * bodies[k]]);
    }
  }

 private:
  static int Find(const std::vector<int>& ascending, int value) {
    const auto place = std::lower_bound(ascending.begin(), ascending.end(), value);
    return place != ascending.end() && *place == value ? static_cast<int>(place - ascending.begin())
                                                       : -1;
  }
};

/// The part with these bodies, ascending and without the world, and with all joints, springs and
/// forces that act on a moving one of them, whose other bodies must be among them. O(bodies +
/// joints + springs + forces + pairs of the whole).
ModelPart TakePart(const ModelStructure& whole, const std::vector<int>& bodies);

/// Whether the part of all bodies has all numbers. A kind of number that TakePart did not know
/// would be missing, and parts would be wrong.
bool IsDivisible(const ModelStructure& whole);

}  // namespace tangible
