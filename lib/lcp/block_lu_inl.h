// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of block_lu.h; included by block_lu.cc, and by verification's file
// for another scalar.

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tangible/lcp/block_lu.h"

namespace tangible {
namespace internal {

/// Order of elimination, fill and places of a pattern whose blocks and edges are set; the rest is
/// scratch.
void OrderBlocks(std::vector<std::vector<int>>* adjacency, std::vector<int>* state,
                 std::vector<int>* merged, std::vector<std::pair<int, int>>* waiting,
                 BlockLuPattern* pattern);

// Of single right-hand sides, of which there are the most: its loops vanish.
using OneColumn = std::integral_constant<int, 1>;

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
inline bool InvertInPlace(T* a) {
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

// y −= a x for `columns` right-hand sides (row-major), an int or, known when compiled, OneColumn.
template <typename T, typename Columns>
inline void SubtractApply(const T* a, const T* x, T* y, Columns columns) {
  for (int i = 0; i < 3; ++i) {
    for (int c = 0; c < columns; ++c) {
      y[i * columns + c] -=
          a[3 * i] * x[c] + a[3 * i + 1] * x[columns + c] + a[3 * i + 2] * x[2 * columns + c];
    }
  }
}

template <typename T, typename Columns>
inline void SubtractApplyTransposed(const T* a, const T* x, T* y, Columns columns) {
  for (int i = 0; i < 3; ++i) {
    for (int c = 0; c < columns; ++c) {
      y[i * columns + c] -= a[i] * x[c] + a[3 + i] * x[columns + c] + a[6 + i] * x[2 * columns + c];
    }
  }
}

// x := a x, or aᵀ x with strides (1, 3).
template <typename T, typename Columns>
inline void ApplyInPlace(const T* a, int row_stride, int column_stride, T* x, Columns columns) {
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

}  // namespace internal

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
  internal::OrderBlocks(&adjacency_, &state_, &merged_, &waiting_, pattern_.get());
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
    if (!internal::InvertInPlace(pivot)) {
      return false;
    }
    const int* target = p.target.data() + p.target_start[k];
    for (int r = p.start[k]; r < p.start[k + 1]; ++r) {
      T* lower = values + 9 * (n + r);
      internal::MultiplyInPlace(lower, pivot);
      for (int s = p.start[k]; s < p.start[k + 1]; ++s) {
        internal::SubtractProduct(lower, values + 9 * (n + slots + s),
                                  values + 9 * static_cast<size_t>(*target));
        ++target;
      }
    }
  }
  return true;
}

template <typename T>
void BlockLu<T>::Solve(T* x, int columns) const {
  if (columns == 1) {
    SolveColumns(x, internal::OneColumn());
  } else {
    SolveColumns(x, columns);
  }
}

template <typename T>
template <typename Columns>
void BlockLu<T>::SolveColumns(T* x, Columns columns) const {
  const BlockLuPattern& p = *pattern_;
  const size_t n = p.num_blocks;
  const size_t slots = p.neighbour.size();
  const size_t stride = 3 * static_cast<size_t>(columns);
  const T* values = values_.data();
  for (size_t k = 0; k < n; ++k) {
    const T* pivot_x = x + stride * p.order[k];
    for (int r = p.start[k]; r < p.start[k + 1]; ++r) {
      internal::SubtractApply(values + 9 * (n + r), pivot_x, x + stride * p.neighbour[r], columns);
    }
  }
  for (size_t k = n; k-- > 0;) {
    T* pivot_x = x + stride * p.order[k];
    for (int s = p.start[k]; s < p.start[k + 1]; ++s) {
      internal::SubtractApply(values + 9 * (n + slots + s), x + stride * p.neighbour[s], pivot_x,
                              columns);
    }
    internal::ApplyInPlace(values + 9 * static_cast<size_t>(p.order[k]), 3, 1, pivot_x, columns);
  }
}

template <typename T>
void BlockLu<T>::SolveTransposed(T* x, int columns) const {
  if (columns == 1) {
    SolveTransposedColumns(x, internal::OneColumn());
  } else {
    SolveTransposedColumns(x, columns);
  }
}

template <typename T>
template <typename Columns>
void BlockLu<T>::SolveTransposedColumns(T* x, Columns columns) const {
  const BlockLuPattern& p = *pattern_;
  const size_t n = p.num_blocks;
  const size_t slots = p.neighbour.size();
  const size_t stride = 3 * static_cast<size_t>(columns);
  const T* values = values_.data();
  for (size_t k = 0; k < n; ++k) {
    T* pivot_x = x + stride * p.order[k];
    internal::ApplyInPlace(values + 9 * static_cast<size_t>(p.order[k]), 1, 3, pivot_x, columns);
    for (int s = p.start[k]; s < p.start[k + 1]; ++s) {
      internal::SubtractApplyTransposed(values + 9 * (n + slots + s), pivot_x,
                                        x + stride * p.neighbour[s], columns);
    }
  }
  for (size_t k = n; k-- > 0;) {
    T* pivot_x = x + stride * p.order[k];
    for (int r = p.start[k]; r < p.start[k + 1]; ++r) {
      internal::SubtractApplyTransposed(values + 9 * (n + r), x + stride * p.neighbour[r], pivot_x,
                                        columns);
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

}  // namespace tangible
