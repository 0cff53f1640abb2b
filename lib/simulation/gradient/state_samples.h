// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Numbers that are read off a run: rows of a linear map of its states,
//
//   s = Σ_k S_k x_k,   ṡ = Σ_k S_k ẋ_k,   x̄_k += S_kᵀ s̄      x_k = [poses | twists] after k steps
//
// given by shares: three rows of s get weight times the pose, or the twist, of a body. The states
// that a function of a rollout returns are such rows, and so are the places of observed bodies
// between two steps.

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/math/scalar.h"

namespace tangible {

enum class StatePart { kPose, kTwist };

struct StateShare {
  int row = 0;  ///< the first of three
  int body = 0;
  StatePart part = StatePart::kPose;
  double weight = 1.0;

  /// The three numbers of a state.
  template <typename T>
  const T* In(const State<T>& state) const {
    return (part == StatePart::kPose ? state.pose : state.twist).data() + 3 * body;
  }
  /// The first of their variables.
  int Variable(const ModelStructure& structure) const {
    return part == StatePart::kPose ? structure.PoseVariable(body, 0)
                                    : structure.TwistVariable(body, 0);
  }
  /// Adds to the rows of s and of ṡ.
  template <typename T>
  void Add(const State<T>& state, double* rows) const {
    for (int i = 0; i < 3; ++i) rows[row + i] += weight * ValueOf(In(state)[i]);
  }
  void AddTangent(const ModelStructure& structure, const RowMatrixXd& w_dot,
                  RowMatrixXd* rows) const {
    rows->middleRows(row, 3) += weight * w_dot.middleRows(Variable(structure), 3);
  }
  /// Adds columns first, first + 1, ... of ṡ from the derivatives of a Jet, as many as both have.
  template <int N>
  void AddJets(const State<Jet<N>>& state, Eigen::Index first, RowMatrixXd* rows) const {
    const Eigen::Index count = std::min<Eigen::Index>(N, rows->cols() - first);
    for (int i = 0; i < 3; ++i) {
      rows->row(row + i).segment(first, count) += weight * In(state)[i].v.head(count).transpose();
    }
  }
};

class StateSamples {
 public:
  StateSamples() = default;
  /// `for_each(use)` calls use(step, share) for all shares, of which it is asked three times.
  template <typename ForEach>
  explicit StateSamples(const ForEach& for_each) {
    long last = 0;
    for_each([&](long step, const StateShare&) { last = std::max(last, step); });
    // `first_` is first the number of each step, then the index of its first entry.
    first_.assign(static_cast<size_t>(last) + 2, 0);
    for_each([this](long step, const StateShare&) { ++first_[step + 1]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    all_.resize(first_.back());
    std::vector<size_t> next(first_.begin(), first_.end() - 1);
    for_each([&](long step, const StateShare& share) { all_[next[step]++] = share; });
  }

  /// The last step whose state is read; 0 where none is.
  long last_step() const { return static_cast<long>(first_.size()) - 2; }
  /// The shares of the state after k steps.
  std::span<const StateShare> At(long k) const {
    if (k > last_step()) return {};
    return {all_.data() + first_[k], first_[k + 1] - first_[k]};
  }
  /// Adds the contribution of the state after k steps to all rows.
  template <typename T>
  void Add(long k, const State<T>& state, double* rows) const {
    for (const StateShare& share : At(k)) share.Add(state, rows);
  }
  void AddTangent(long k, const ModelStructure& structure, const RowMatrixXd& w_dot,
                  RowMatrixXd* rows) const {
    for (const StateShare& share : At(k)) share.AddTangent(structure, w_dot, rows);
  }
  template <int N>
  void AddJets(long k, const State<Jet<N>>& state, Eigen::Index first, RowMatrixXd* rows) const {
    for (const StateShare& share : At(k)) share.AddJets(state, first, rows);
  }
  /// Calls add(row, weight, variable) for each entry of S_k: weight s̄(row) belongs to w̄(variable).
  template <typename AddBar>
  void ForEachBar(long k, const ModelStructure& structure, const AddBar& add) const {
    for (const StateShare& share : At(k)) {
      for (int i = 0; i < 3; ++i) {
        add(share.row + i, share.weight, share.Variable(structure) + i);
      }
    }
  }

 private:
  std::vector<size_t> first_ = {0, 0};  ///< of each step, then the end of the last
  std::vector<StateShare> all_;
};

}  // namespace tangible
