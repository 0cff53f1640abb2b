// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/block_lu.h"

#include <algorithm>
#include <cmath>

namespace tangible {
namespace {

// c −= a b, all 3 x 3 row-major.
template <typename T>
inline void SubtractProduct(const T* a, const T* b, T* c) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      c[3 * i + j] -= a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    }
  }
}

// a := a b.
template <typename T>
inline void MultiplyInPlace(T* a, const T* b) {
  for (int i = 0; i < 3; ++i) {
    const T a0 = a[3 * i];
    const T a1 = a[3 * i + 1];
    const T a2 = a[3 * i + 2];
    for (int j = 0; j < 3; ++j) {
      a[3 * i + j] = a0 * b[j] + a1 * b[3 + j] + a2 * b[6 + j];
    }
  }
}

// Inverse of a 3 x 3 matrix by Gauss-Jordan elimination with partial pivoting (by value); false
// where a pivot is 0 or not finite.
template <typename T>
bool InvertInPlace(T* a) {
  using std::abs;
  int row_of[3] = {0, 1, 2};
  T m[3][6];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      m[i][j] = a[3 * i + j];
      m[i][j + 3] = T(i == j ? 1.0 : 0.0);
    }
  }
  for (int k = 0; k < 3; ++k) {
    int pivot = k;
    for (int i = k + 1; i < 3; ++i) {
      if (std::abs(ValueOf(m[row_of[i]][k])) > std::abs(ValueOf(m[row_of[pivot]][k]))) {
        pivot = i;
      }
    }
    std::swap(row_of[k], row_of[pivot]);
    T* row = m[row_of[k]];
    const double value = ValueOf(row[k]);
    if (value == 0.0 || !std::isfinite(value)) {
      return false;
    }
    const T inverse = 1.0 / row[k];
    for (int j = 0; j < 6; ++j) {
      row[j] *= inverse;
    }
    for (int i = 0; i < 3; ++i) {
      if (i == k) {
        continue;
      }
      T* other = m[row_of[i]];
      const T factor = other[k];
      for (int j = 0; j < 6; ++j) {
        other[j] -= factor * row[j];
      }
    }
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      a[3 * i + j] = m[row_of[i]][j + 3];
    }
  }
  return true;
}

// y −= a x for `columns` right-hand sides (row-major).
template <typename T>
inline void SubtractApply(const T* a, const T* x, T* y, int columns) {
  for (int i = 0; i < 3; ++i) {
    for (int c = 0; c < columns; ++c) {
      y[i * columns + c] -=
          a[3 * i] * x[c] + a[3 * i + 1] * x[columns + c] + a[3 * i + 2] * x[2 * columns + c];
    }
  }
}

template <typename T>
inline void SubtractApplyTransposed(const T* a, const T* x, T* y, int columns) {
  for (int i = 0; i < 3; ++i) {
    for (int c = 0; c < columns; ++c) {
      y[i * columns + c] -= a[i] * x[c] + a[3 + i] * x[columns + c] + a[6 + i] * x[2 * columns + c];
    }
  }
}

// x := a x, or aᵀ x with strides (1, 3).
template <typename T>
inline void ApplyInPlace(const T* a, int row_stride, int column_stride, T* x, int columns) {
  for (int c = 0; c < columns; ++c) {
    const T x0 = x[c];
    const T x1 = x[columns + c];
    const T x2 = x[2 * columns + c];
    for (int i = 0; i < 3; ++i) {
      x[i * columns + c] = a[i * row_stride] * x0 + a[i * row_stride + column_stride] * x1 +
                           a[i * row_stride + 2 * column_stride] * x2;
    }
  }
}

// Adds `node` to a sorted list; false if it is there already.
bool InsertSorted(std::vector<int>* list, int node) {
  const auto place = std::lower_bound(list->begin(), list->end(), node);
  if (place != list->end() && *place == node) {
    return false;
  }
  list->insert(place, node);
  return true;
}

// State of a node: how many of its bodies must go first (constraints), or:
constexpr int kReady = 0;
constexpr int kEliminated = -1;

class Ordering {
 public:
  Ordering(std::vector<std::vector<int>>* adjacency, std::vector<int>* state,
           std::vector<int>* merged, std::vector<std::pair<int, int>>* waiting,
           BlockLuPattern* pattern)
      : adjacency_(*adjacency),
        state_(*state),
        merged_(*merged),
        waiting_(*waiting),
        pattern_(*pattern) {}

  // Eliminates all nodes; fills order, start and neighbour.
  void Run() {
    BuildGraph();
    pattern_.order.clear();
    pattern_.start.clear();
    pattern_.neighbour.clear();
    for (int k = 0; k < pattern_.num_blocks; ++k) {
      Eliminate(Choose());
    }
    pattern_.start.push_back(static_cast<int>(pattern_.neighbour.size()));
  }

 private:
  void BuildGraph() {
    const int n = pattern_.num_blocks;
    if (static_cast<int>(adjacency_.size()) < n) {
      adjacency_.resize(n);
    }
    for (int i = 0; i < n; ++i) {
      adjacency_[i].clear();
    }
    state_.assign(n, kReady);
    for (const auto& [i, j] : pattern_.edges) {
      if (InsertSorted(&adjacency_[i], j)) {
        InsertSorted(&adjacency_[j], i);
      }
    }
    waiting_.clear();
    for (int i = pattern_.num_bodies; i < n; ++i) {
      state_[i] = static_cast<int>(adjacency_[i].size());
      for (const int body : adjacency_[i]) {
        waiting_.emplace_back(body, i);
      }
    }
    std::sort(waiting_.begin(), waiting_.end());
  }

  // The ready node of least degree, the first of equals; a blocked one (isolated) only when no
  // other is left.
  int Choose() const {
    int best = -1;
    size_t best_degree = 0;
    for (int i = 0; i < pattern_.num_blocks; ++i) {
      if (state_[i] != kReady) {
        continue;
      }
      if (best < 0 || adjacency_[i].size() < best_degree) {
        best = i;
        best_degree = adjacency_[i].size();
        if (best_degree <= 1) {
          break;
        }
      }
    }
    return best;
  }

  void Eliminate(int node) {
    state_[node] = kEliminated;
    pattern_.order.push_back(node);
    pattern_.start.push_back(static_cast<int>(pattern_.neighbour.size()));
    const std::vector<int>& front = adjacency_[node];
    for (auto w = std::lower_bound(waiting_.begin(), waiting_.end(), std::make_pair(node, 0));
         w != waiting_.end() && w->first == node; ++w) {
      --state_[w->second];
    }
    pattern_.neighbour.insert(pattern_.neighbour.end(), front.begin(), front.end());
    for (const int i : front) {
      // adjacency[i] := adjacency[i] ∪ front \ {i, node}
      merged_.clear();
      std::set_union(adjacency_[i].begin(), adjacency_[i].end(), front.begin(), front.end(),
                     std::back_inserter(merged_));
      adjacency_[i].clear();
      for (const int j : merged_) {
        if (j != i && j != node) {
          adjacency_[i].push_back(j);
        }
      }
    }
  }

  std::vector<std::vector<int>>& adjacency_;
  std::vector<int>& state_;
  std::vector<int>& merged_;
  std::vector<std::pair<int, int>>& waiting_;  // (body, constraint that waits for it), ascending
  BlockLuPattern& pattern_;
};

// Place of the pair of blocks of nodes i and j: the slot in the list of whichever goes first.
// `position[node]` is its place in the order. Neighbour lists are sorted by node.
int FindSlot(const BlockLuPattern& pattern, const std::vector<int>& position, int i, int j) {
  const int first = position[i] < position[j] ? i : j;
  const int later = first == i ? j : i;
  const auto begin = pattern.neighbour.begin() + pattern.start[position[first]];
  const auto end = pattern.neighbour.begin() + pattern.start[position[first] + 1];
  return static_cast<int>(std::lower_bound(begin, end, later) - pattern.neighbour.begin());
}

void FindPlaces(std::vector<int>* position_scratch, BlockLuPattern* pattern) {
  std::vector<int>& position = *position_scratch;
  const int n = pattern->num_blocks;
  position.resize(n);
  for (int k = 0; k < n; ++k) {
    position[pattern->order[k]] = k;
  }
  const int slots = static_cast<int>(pattern->neighbour.size());
  pattern->edge_slot.clear();
  pattern->edge_flipped.clear();
  for (const auto& [i, j] : pattern->edges) {
    pattern->edge_slot.push_back(FindSlot(*pattern, position, i, j));
    pattern->edge_flipped.push_back(position[j] < position[i] ? 1 : 0);
  }
  pattern->target_start.clear();
  pattern->target.clear();
  for (int k = 0; k < n; ++k) {
    pattern->target_start.push_back(static_cast<int>(pattern->target.size()));
    for (int r = pattern->start[k]; r < pattern->start[k + 1]; ++r) {
      for (int s = pattern->start[k]; s < pattern->start[k + 1]; ++s) {
        const int row = pattern->neighbour[r];
        const int column = pattern->neighbour[s];
        if (row == column) {
          pattern->target.push_back(row);
          continue;
        }
        const int slot = FindSlot(*pattern, position, row, column);
        // The lower block has the row that is eliminated later.
        const bool lower = position[column] < position[row];
        pattern->target.push_back(n + slot + (lower ? 0 : slots));
      }
    }
  }
}

}  // namespace

template <typename T>
void BlockLu<T>::Reserve(int num_blocks, int num_edges) {
  if (!pattern_) {
    pattern_ = std::make_shared<BlockLuPattern>();
  }
  pattern_->edges.reserve(num_edges);
  pattern_->edge_slot.reserve(num_edges);
  pattern_->edge_flipped.reserve(num_edges);
  pattern_->order.reserve(num_blocks);
  pattern_->start.reserve(num_blocks + 1);
  pattern_->neighbour.reserve(4 * num_edges);
  pattern_->target_start.reserve(num_blocks);
  pattern_->target.reserve(16 * num_edges);
  values_.reserve(9 * (static_cast<size_t>(num_blocks) + 8 * num_edges));
  adjacency_.resize(std::max<size_t>(adjacency_.size(), num_blocks));
  for (std::vector<int>& list : adjacency_) {
    list.reserve(std::min(num_blocks, 32));
  }
  state_.reserve(num_blocks);
  merged_.reserve(num_blocks);
  waiting_.reserve(num_edges);
}

template <typename T>
void BlockLu<T>::SetPattern(int num_blocks, int num_bodies,
                            const std::vector<std::pair<int, int>>& edges) {
  if (pattern_ && pattern_->num_blocks == num_blocks && pattern_->num_bodies == num_bodies &&
      pattern_->edges == edges && pattern_->order.size() == static_cast<size_t>(num_blocks)) {
    return;
  }
  if (!pattern_ || pattern_.use_count() > 1) {  // copies keep theirs
    pattern_ = std::make_shared<BlockLuPattern>();
  }
  pattern_->num_blocks = num_blocks;
  pattern_->num_bodies = num_bodies;
  pattern_->edges = edges;
  Ordering(&adjacency_, &state_, &merged_, &waiting_, pattern_.get()).Run();
  FindPlaces(&state_, pattern_.get());
}

template <typename T>
void BlockLu<T>::SetZero() {
  const size_t blocks = pattern_->num_blocks + 2 * pattern_->neighbour.size();
  values_.assign(9 * blocks, T(0.0));
}

template <typename T>
bool BlockLu<T>::Factor() {
  const BlockLuPattern& p = *pattern_;
  const size_t n = p.num_blocks;
  const size_t slots = p.neighbour.size();
  T* values = values_.data();
  for (size_t k = 0; k < n; ++k) {
    T* pivot = values + 9 * static_cast<size_t>(p.order[k]);
    if (!InvertInPlace(pivot)) {
      return false;
    }
    const int* target = p.target.data() + p.target_start[k];
    for (int r = p.start[k]; r < p.start[k + 1]; ++r) {
      T* lower = values + 9 * (n + r);
      MultiplyInPlace(lower, pivot);
      for (int s = p.start[k]; s < p.start[k + 1]; ++s) {
        SubtractProduct(lower, values + 9 * (n + slots + s),
                        values + 9 * static_cast<size_t>(*target));
        ++target;
      }
    }
  }
  return true;
}

template <typename T>
void BlockLu<T>::Solve(T* x, int columns) const {
  const BlockLuPattern& p = *pattern_;
  const size_t n = p.num_blocks;
  const size_t slots = p.neighbour.size();
  const size_t stride = 3 * static_cast<size_t>(columns);
  const T* values = values_.data();
  for (size_t k = 0; k < n; ++k) {
    const T* pivot_x = x + stride * p.order[k];
    for (int r = p.start[k]; r < p.start[k + 1]; ++r) {
      SubtractApply(values + 9 * (n + r), pivot_x, x + stride * p.neighbour[r], columns);
    }
  }
  for (size_t k = n; k-- > 0;) {
    T* pivot_x = x + stride * p.order[k];
    for (int s = p.start[k]; s < p.start[k + 1]; ++s) {
      SubtractApply(values + 9 * (n + slots + s), x + stride * p.neighbour[s], pivot_x, columns);
    }
    ApplyInPlace(values + 9 * static_cast<size_t>(p.order[k]), 3, 1, pivot_x, columns);
  }
}

template <typename T>
void BlockLu<T>::SolveTransposed(T* x, int columns) const {
  const BlockLuPattern& p = *pattern_;
  const size_t n = p.num_blocks;
  const size_t slots = p.neighbour.size();
  const size_t stride = 3 * static_cast<size_t>(columns);
  const T* values = values_.data();
  for (size_t k = 0; k < n; ++k) {
    T* pivot_x = x + stride * p.order[k];
    ApplyInPlace(values + 9 * static_cast<size_t>(p.order[k]), 1, 3, pivot_x, columns);
    for (int s = p.start[k]; s < p.start[k + 1]; ++s) {
      SubtractApplyTransposed(values + 9 * (n + slots + s), pivot_x, x + stride * p.neighbour[s],
                              columns);
    }
  }
  for (size_t k = n; k-- > 0;) {
    T* pivot_x = x + stride * p.order[k];
    for (int r = p.start[k]; r < p.start[k + 1]; ++r) {
      SubtractApplyTransposed(values + 9 * (n + r), x + stride * p.neighbour[r], pivot_x, columns);
    }
  }
}

template <typename T>
size_t BlockLu<T>::bytes() const {
  size_t sum =
      values_.capacity() * sizeof(T) + (state_.capacity() + merged_.capacity()) * sizeof(int) +
      waiting_.capacity() * sizeof(waiting_[0]) + adjacency_.capacity() * sizeof(std::vector<int>);
  for (const std::vector<int>& list : adjacency_) {
    sum += list.capacity() * sizeof(int);
  }
  return sum;
}

template class BlockLu<double>;
#define TANGIBLE_INSTANTIATE_BLOCK_LU(N) template class BlockLu<Jet<N>>;
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_BLOCK_LU)

}  // namespace tangible
