// SPDX-License-Identifier: Apache-2.0
#include <iterator>

#include "tangible/lcp/block_lu_inl.h"

namespace tangible {
namespace {

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

void internal::OrderBlocks(std::vector<std::vector<int>>* adjacency, std::vector<int>* state,
                           std::vector<int>* merged, std::vector<std::pair<int, int>>* waiting,
                           BlockLuPattern* pattern) {
  Ordering(adjacency, state, merged, waiting, pattern).Run();
  FindPlaces(state, pattern);
}

template class BlockLu<double>;
#define TANGIBLE_INSTANTIATE_BLOCK_LU(N) template class BlockLu<Jet<N>>;
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_BLOCK_LU)

}  // namespace tangible
