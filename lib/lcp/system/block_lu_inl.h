// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of block_lu.h; included by block_lu.cc, and by verification's file
// for another scalar.

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tangible/lcp/system/block_lu.h"

namespace tangible {
namespace internal {

/// Computes the order of elimination, the fill and the places of a pattern whose blocks and edges
/// are set; the other arguments are scratch.
void OrderBlocks(std::vector<std::vector<int>>* adjacency, std::vector<int>* state,
                 std::vector<int>* merged, std::vector<std::pair<int, int>>* waiting,
                 std::vector<std::int64_t>* keys, BlockLuPattern* pattern);

// The number of columns of a single right-hand side, the most frequent case, known when compiled so
// that its loops vanish.
using OneColumn = std::integral_constant<int, 1>;

// Blocks are 3 x 3, row-major. kWidth (3, or 2 of a narrow block) is the width of the pivot, whose
// third unknown contributes 0 if it is narrow. kRows (3, or 2 where all blocks are narrow) is the
// number of rows of the others.

// c −= a b.
template <int kWidth, int kRows, typename T>
inline void SubtractProduct(const T* a, const T* b, T* c) {
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kRows; ++j) {
      if constexpr (kWidth == 3) {
        c[3 * i + j] -= a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
      } else {
        c[3 * i + j] -= a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j];
      }
    }
  }
}

// 1 / pivot in its place; false where it is 0 or not finite.
template <typename T>
inline bool InvertPivot(T* pivot) {
  const double value = ValueOf(*pivot);
  *pivot = 1.0 / *pivot;
  return value != 0.0 && std::isfinite(value);
}

// Pivot blocks are kept as triangles: P A = L U by Gauss elimination with partial pivoting (by
// value), row i of the block being row order[i] of A, and 1 / U_ii in place of U_ii. An inverse
// would lose the digits of those directions that contacts with a small δ on their diagonal
// (contact_condensation.h) do not hold. False where a pivot is 0 or not finite.
template <int kWidth, typename T>
inline bool FactorPivot(T* a, unsigned char* order) {
  T m[kWidth][kWidth];
  for (int i = 0; i < kWidth; ++i) {
    order[i] = static_cast<unsigned char>(i);
    for (int j = 0; j < kWidth; ++j) {
      m[i][j] = a[3 * i + j];
    }
  }
  for (int k = 0; k < kWidth; ++k) {
    int pivot = k;
    for (int i = k + 1; i < kWidth; ++i) {
      if (std::abs(ValueOf(m[order[i]][k])) > std::abs(ValueOf(m[order[pivot]][k]))) {
        pivot = i;
      }
    }
    std::swap(order[k], order[pivot]);
    T* row = m[order[k]];
    if (!InvertPivot(&row[k])) {
      return false;
    }
    for (int i = k + 1; i < kWidth; ++i) {
      T* other = m[order[i]];
      other[k] *= row[k];
      for (int j = k + 1; j < kWidth; ++j) {
        other[j] -= other[k] * row[j];
      }
    }
  }
  for (int i = 0; i < kWidth; ++i) {
    for (int j = 0; j < kWidth; ++j) {
      a[3 * i + j] = m[order[i]][j];
    }
  }
  return kWidth == 3 || InvertPivot(&a[8]);
}

// b := b A⁻¹ for a block b.
template <int kWidth, int kRows, typename T>
inline void DivideByPivot(const T* a, const unsigned char* order, T* b) {
  for (int i = 0; i < kRows; ++i) {
    T* row = b + 3 * i;
    const T u0 = row[0] * a[0];
    const T u1 = (row[1] - u0 * a[1]) * a[4];
    if constexpr (kWidth == 3) {
      const T u2 = (row[2] - u0 * a[2] - u1 * a[5]) * a[8];
      const T l1 = u1 - u2 * a[7];
      const T l0 = u0 - l1 * a[3] - u2 * a[6];
      row[order[0]] = l0;
      row[order[1]] = l1;
      row[order[2]] = u2;
    } else {
      const T l0 = u0 - u1 * a[3];
      row[order[0]] = l0;
      row[order[1]] = u1;
    }
  }
}

// y −= a x, or aᵀ x, for `columns` right-hand sides (row-major), an int or, known when compiled,
// OneColumn: kFrom entries of x, kTo of y.
template <bool kTransposed, int kTo, int kFrom, typename T, typename Columns>
inline void SubtractApply(const T* a, const T* x, T* y, Columns columns) {
  constexpr int kRow = kTransposed ? 1 : 3;
  constexpr int kColumn = kTransposed ? 3 : 1;
  for (int i = 0; i < kTo; ++i) {
    for (int c = 0; c < columns; ++c) {
      const T* row = a + kRow * i;
      if constexpr (kFrom == 3) {
        y[i * columns + c] -=
            row[0] * x[c] + row[kColumn] * x[columns + c] + row[2 * kColumn] * x[2 * columns + c];
      } else {
        y[i * columns + c] -= row[0] * x[c] + row[kColumn] * x[columns + c];
      }
    }
  }
}

// x := A⁻¹ x.
template <int kWidth, typename T, typename Columns>
inline void SolvePivot(const T* a, const unsigned char* order, T* x, Columns columns) {
  for (int c = 0; c < columns; ++c) {
    const T y0 = x[order[0] * columns + c];
    const T y1 = x[order[1] * columns + c] - a[3] * y0;
    if constexpr (kWidth == 3) {
      const T y2 = x[order[2] * columns + c] - a[6] * y0 - a[7] * y1;
      const T z2 = y2 * a[8];
      const T z1 = (y1 - a[5] * z2) * a[4];
      x[c] = (y0 - a[1] * z1 - a[2] * z2) * a[0];
      x[columns + c] = z1;
      x[2 * columns + c] = z2;
    } else {
      const T z1 = y1 * a[4];
      x[c] = (y0 - a[1] * z1) * a[0];
      x[columns + c] = z1;
      x[2 * columns + c] *= a[8];
    }
  }
}

// x := A⁻ᵀ x.
template <int kWidth, typename T, typename Columns>
inline void SolvePivotTransposed(const T* a, const unsigned char* order, T* x, Columns columns) {
  for (int c = 0; c < columns; ++c) {
    const T y0 = x[c] * a[0];
    const T y1 = (x[columns + c] - a[1] * y0) * a[4];
    if constexpr (kWidth == 3) {
      const T y2 = (x[2 * columns + c] - a[2] * y0 - a[5] * y1) * a[8];
      const T z1 = y1 - a[7] * y2;
      const T z0 = y0 - a[3] * z1 - a[6] * y2;
      x[order[0] * columns + c] = z0;
      x[order[1] * columns + c] = z1;
      x[order[2] * columns + c] = y2;
    } else {
      x[order[0] * columns + c] = y0 - a[3] * y1;
      x[order[1] * columns + c] = y1;
      x[2 * columns + c] *= a[8];
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
  row_order_.reserve(3 * static_cast<size_t>(num_blocks));
  width_.reserve(num_blocks);
  keys_.reserve(4 * static_cast<size_t>(num_blocks));
}

template <typename T>
void BlockLu<T>::SetPattern(int num_blocks, int num_bodies,
                            const std::vector<std::pair<int, int>>& edges) {
  if (pattern_ && pattern_->num_blocks == num_blocks && pattern_->num_bodies == num_bodies &&
      pattern_->edges == edges && pattern_->order.size() == static_cast<size_t>(num_blocks)) {
    return;
  }
  if (!pattern_ || pattern_.use_count() > 1) {  // copies keep the old pattern
    pattern_ = std::make_shared<BlockLuPattern>();
  }
  pattern_->num_blocks = num_blocks;
  pattern_->num_bodies = num_bodies;
  pattern_->edges = edges;
  internal::OrderBlocks(&adjacency_, &state_, &merged_, &waiting_, &keys_, pattern_.get());
}

template <typename T>
void BlockLu<T>::SetZero() {
  const size_t blocks = pattern_->num_blocks + 2 * pattern_->neighbour.size();
  values_.assign(9 * blocks, T(0.0));
  row_order_.resize(3 * static_cast<size_t>(pattern_->num_blocks));
  width_.assign(pattern_->num_blocks, 3);
}

// A separate function call costs a step of a chain 5 %.
template <typename T>
template <int kWidth, int kRows>
[[gnu::always_inline]] inline bool BlockLu<T>::Eliminate(int k) {
  const BlockLuPattern& p = *pattern_;
  const size_t n = p.num_blocks;
  const size_t slots = p.neighbour.size();
  T* values = values_.data();
  T* pivot = values + 9 * static_cast<size_t>(p.order[k]);
  unsigned char* pivot_order = &row_order_[3 * static_cast<size_t>(p.order[k])];
  if (!internal::FactorPivot<kWidth>(pivot, pivot_order)) {
    return false;
  }
  const int* target = p.target.data() + p.target_start[k];
  for (int r = p.start[k]; r < p.start[k + 1]; ++r) {
    T* lower = values + 9 * (n + r);
    internal::DivideByPivot<kWidth, kRows>(pivot, pivot_order, lower);
    for (int s = p.start[k]; s < p.start[k + 1]; ++s) {
      internal::SubtractProduct<kWidth, kRows>(lower, values + 9 * (n + slots + s),
                                               values + 9 * static_cast<size_t>(*target));
      ++target;
    }
  }
  return true;
}

template <typename T>
bool BlockLu<T>::Factor() {
  const auto is_narrow = [](unsigned char width) { return width == 2; };
  all_narrow_ = std::all_of(width_.begin(), width_.end(), is_narrow);
  for (int k = 0; k < pattern_->num_blocks; ++k) {
    const bool done = all_narrow_                             ? Eliminate<2, 2>(k)
                      : is_narrow(width_[pattern_->order[k]]) ? Eliminate<2, 3>(k)
                                                              : Eliminate<3, 3>(k);
    if (!done) {
      return false;
    }
  }
  return true;
}

template <typename T>
void BlockLu<T>::Solve(T* x, int columns) const {
  if (columns == 1) {
    SolveColumns<false>(x, internal::OneColumn());
  } else {
    SolveColumns<false>(x, columns);
  }
}

template <typename T>
void BlockLu<T>::SolveTransposed(T* x, int columns) const {
  if (columns == 1) {
    SolveColumns<true>(x, internal::OneColumn());
  } else {
    SolveColumns<true>(x, columns);
  }
}

template <typename T>
template <bool kTransposed, typename Columns>
void BlockLu<T>::SolveColumns(T* x, Columns columns) const {
  if (all_narrow_) {
    SolveRows<kTransposed, 2>(x, columns);
  } else {
    SolveRows<kTransposed, 3>(x, columns);
  }
}

// Solves with L, then with U and its pivot blocks; transposed with Uᵀ and these, then with Lᵀ.
template <typename T>
template <bool kTransposed, int kRows, typename Columns>
void BlockLu<T>::SolveRows(T* x, Columns columns) const {
  using internal::SubtractApply;
  const BlockLuPattern& p = *pattern_;
  const size_t n = p.num_blocks;
  const size_t slots = p.neighbour.size();
  const size_t stride = 3 * static_cast<size_t>(columns);
  const T* values = values_.data();
  const T* first = values + 9 * (kTransposed ? n + slots : n);
  const T* second = values + 9 * (kTransposed ? n : n + slots);
  const auto divide = [&](int node) {
    const T* pivot = values + 9 * static_cast<size_t>(node);
    const unsigned char* order = &row_order_[3 * static_cast<size_t>(node)];
    T* pivot_x = x + stride * node;
    const bool narrow = kRows == 2 || width_[node] == 2;
    if constexpr (kTransposed) {
      narrow ? internal::SolvePivotTransposed<2>(pivot, order, pivot_x, columns)
             : internal::SolvePivotTransposed<3>(pivot, order, pivot_x, columns);
    } else {
      narrow ? internal::SolvePivot<2>(pivot, order, pivot_x, columns)
             : internal::SolvePivot<3>(pivot, order, pivot_x, columns);
    }
  };
  for (size_t k = 0; k < n; ++k) {
    if constexpr (kTransposed) {
      divide(p.order[k]);
    }
    const T* pivot_x = x + stride * p.order[k];
    const bool narrow = kRows == 3 && width_[p.order[k]] == 2;
    for (int slot = p.start[k]; slot < p.start[k + 1]; ++slot) {
      const T* block = first + 9 * static_cast<size_t>(slot);
      T* to = x + stride * p.neighbour[slot];
      if (narrow) {
        SubtractApply<kTransposed, kRows, 2>(block, pivot_x, to, columns);
      } else {
        SubtractApply<kTransposed, kRows, kRows>(block, pivot_x, to, columns);
      }
    }
  }
  for (size_t k = n; k-- > 0;) {
    T* pivot_x = x + stride * p.order[k];
    const bool narrow = kRows == 3 && width_[p.order[k]] == 2;
    for (int slot = p.start[k]; slot < p.start[k + 1]; ++slot) {
      const T* block = second + 9 * static_cast<size_t>(slot);
      const T* from = x + stride * p.neighbour[slot];
      if (narrow) {
        SubtractApply<kTransposed, 2, kRows>(block, from, pivot_x, columns);
      } else {
        SubtractApply<kTransposed, kRows, kRows>(block, from, pivot_x, columns);
      }
    }
    if constexpr (!kTransposed) {
      divide(p.order[k]);
    }
  }
}

template <typename T>
size_t BlockLu<T>::bytes() const {
  size_t sum = values_.capacity() * sizeof(T) +
               (state_.capacity() + merged_.capacity()) * sizeof(int) +
               waiting_.capacity() * sizeof(waiting_[0]) + keys_.capacity() * sizeof(keys_[0]) +
               adjacency_.capacity() * sizeof(std::vector<int>);
  for (const std::vector<int>& list : adjacency_) {
    sum += list.capacity() * sizeof(int);
  }
  return sum;
}

}  // namespace tangible
