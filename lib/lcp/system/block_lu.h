// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Block-sparse LU of a matrix with symmetric pattern and 3 x 3 blocks: the linear algebra of a
// step.
//
//   K = L U,   L unit lower triangular, U upper triangular, by blocks, in an elimination order
//
// The pattern is a graph whose nodes are blocks: bodies (always invertible pivots) and constraints
// (joints, contacts), whose diagonal block may be zero before a neighbour is eliminated. The order
// is of minimum degree, with a constraint only after one of its bodies; a chain of bodies and
// joints then has no fill and costs O(number of links). Blocks smaller than 3 are padded with the
// identity; for blocks marked as narrow the third unknown is left out of all products. There is no
// pivoting between blocks (within a block there is): the systems of mechanics [M −Jᵀ; J δ] are
// quasi-definite, for which any order is stable; sliding friction makes them slightly unsymmetric,
// so the solution is refined by the caller against the true residual.
//
// The symbolic part (order, fill, places) is kept while the pattern stays; numeric factorisation
// and solves allocate nothing. Derivation: Davis, Direct Methods for Sparse Linear Systems, ch.
// 4, 6.

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

/// Elimination order and places of the fill of one pattern.
struct BlockLuPattern {
  int num_blocks = 0;
  int num_bodies = 0;
  std::vector<std::pair<int, int>> edges;  ///< as given
  std::vector<int> edge_slot;              ///< place of an edge's pair of blocks
  std::vector<char> edge_flipped;          ///< 1 where the edge's second node is eliminated first
  std::vector<int> order;                  ///< node eliminated k-th
  std::vector<int> start;                  ///< k -> first of its slots; num_blocks + 1 entries
  std::vector<int> neighbour;              ///< slot -> node that is eliminated later
  std::vector<int> target_start;           ///< k -> first of its update targets
  std::vector<int> target;  ///< place of block (neighbour r, neighbour s), in units of blocks
};

/// The factorisation; T is double or a Jet. Copyable: a copy shares the pattern.
template <typename T>
class BlockLu {
 public:
  /// Sets the pattern: `num_bodies` nodes that may be eliminated at any time, then constraints;
  /// edges join any two nodes and may repeat. Cheap where the pattern is that of the last call.
  void SetPattern(int num_blocks, int num_bodies, const std::vector<std::pair<int, int>>& edges);
  /// Allocates the storage for patterns of up to this many blocks and edges.
  void Reserve(int num_blocks, int num_edges);

  void SetZero();
  /// 3 x 3 row-major diagonal block; the caller adds to it after SetZero and before Factor.
  T* Diagonal(int block) { return &values_[9 * static_cast<size_t>(block)]; }
  /// Promises that the third unknown of a block is coupled to no other, of its own block or of
  /// another (a hinge has two rows; on a disc without friction nothing exerts a torque). To be
  /// called after SetZero and before Factor.
  void SetNarrow(int block) { width_[block] = 2; }
  /// Block (row = first node of the edge, column = second).
  T* FirstSecond(int edge) { return Place(edge, pattern_->edge_flipped[edge] != 0); }
  /// Block (row = second node, column = first).
  T* SecondFirst(int edge) { return Place(edge, pattern_->edge_flipped[edge] == 0); }

  /// Factorises in place; false where a pivot block is singular or not finite.
  bool Factor();
  /// x := K⁻¹ x, with x row-major of shape (3 num_blocks, columns).
  void Solve(T* x, int columns) const;
  /// x := K⁻ᵀ x.
  void SolveTransposed(T* x, int columns) const;

  /// Moves the factors to `other`; this object keeps the pattern, and takes the other's memory for
  /// its next factors.
  void MoveFactorsTo(BlockLu* other) {
    other->pattern_ = pattern_;
    values_.swap(other->values_);
    row_order_.swap(other->row_order_);
    width_.swap(other->width_);
    other->all_narrow_ = all_narrow_;
  }

  /// Exchanges the pattern with one kept elsewhere, so that the symbolic factorisation can be
  /// reused. The factors are lost.
  void SwapPattern(std::shared_ptr<BlockLuPattern>* pattern) { pattern_.swap(*pattern); }

  int num_blocks() const { return pattern_ ? pattern_->num_blocks : 0; }
  /// Memory, bytes, without the pattern, which copies share.
  size_t bytes() const;

 private:
  template <bool kTransposed, typename Columns>
  void SolveColumns(T* x, Columns columns) const;
  template <bool kTransposed, int kRows, typename Columns>
  void SolveRows(T* x, Columns columns) const;
  template <int kWidth, int kRows>
  bool Eliminate(int k);
  T* Place(int edge, bool lower) {
    const size_t slot = pattern_->edge_slot[edge];
    const size_t slots = pattern_->neighbour.size();
    return &values_[9 * (pattern_->num_blocks + slot + (lower ? 0 : slots))];
  }

  std::shared_ptr<BlockLuPattern> pattern_;
  std::vector<T> values_;  ///< diagonal blocks, lower blocks, upper blocks (9 numbers each)
  std::vector<unsigned char> row_order_;  ///< of the rows of each diagonal block
  std::vector<unsigned char> width_;      ///< of each block: 3, or 2 where it is narrow
  bool all_narrow_ = false;
  // Scratch of the symbolic phase.
  std::vector<std::vector<int>> adjacency_;
  std::vector<int> state_;
  std::vector<int> merged_;
  std::vector<std::pair<int, int>> waiting_;
  std::vector<std::int64_t> keys_;
};

extern template class BlockLu<double>;
#define TANGIBLE_EXTERN_BLOCK_LU(N) extern template class BlockLu<Jet<N>>;
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_EXTERN_BLOCK_LU)
#undef TANGIBLE_EXTERN_BLOCK_LU

}  // namespace tangible
