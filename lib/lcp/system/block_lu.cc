// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <iterator>
#include <limits>

#include "tangible/lcp/system/block_lu_inl.h"

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

// State of a node: for constraints, how many of its bodies must be eliminated first; or:
constexpr int kReady = 0;
constexpr int kEliminated = -1;

// The least of a changing list of keys, by a tournament tree: a change costs the logarithm of its
// size.
class Tournament {
 public:
  static constexpr std::int64_t kOut = std::numeric_limits<std::int64_t>::max();

  explicit Tournament(std::vector<std::int64_t>* keys) : keys_(*keys) {}
  void Start(int size) {
    leaves_ = 1;
    while (leaves_ < size) {
      leaves_ *= 2;
    }
    keys_.assign(2 * static_cast<size_t>(leaves_), kOut);
  }
  void Set(int leaf, std::int64_t key) {
    size_t at = static_cast<size_t>(leaves_) + leaf;
    keys_[at] = key;
    for (at /= 2; at > 0; at /= 2) {
      const std::int64_t least = std::min(keys_[2 * at], keys_[2 * at + 1]);
      if (keys_[at] == least) {
        break;
      }
      keys_[at] = least;
    }
  }
  std::int64_t Least() const { return keys_[1]; }

 private:
  std::vector<std::int64_t>& keys_;
  int leaves_ = 1;
};

class Ordering {
 public:
  Ordering(std::vector<std::vector<int>>* adjacency, std::vector<int>* state,
           std::vector<int>* merged, std::vector<std::pair<int, int>>* waiting,
           std::vector<std::int64_t>* keys, BlockLuPattern* pattern)
      : adjacency_(*adjacency),
        state_(*state),
        merged_(*merged),
        waiting_(*waiting),
        ready_(keys),
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
    ready_.Start(n);
    for (int i = 0; i < n; ++i) {
      Update(i);
    }
  }

  // The key of a node: its degree, where 0 is no better than 1, then its number.
  void Update(int node) {
    const size_t degree = std::max<size_t>(adjacency_[node].size(), 1);
    ready_.Set(node, state_[node] == kReady ? static_cast<std::int64_t>(degree) << 32 | node
                                            : Tournament::kOut);
  }

  // The ready node of least degree, the first of equals. One node is always ready: bodies are ready
  // from the start, a constraint once one of its bodies is eliminated.
  int Choose() const { return static_cast<int>(ready_.Least() & 0x7fffffff); }

  void Eliminate(int node) {
    state_[node] = kEliminated;
    pattern_.order.push_back(node);
    pattern_.start.push_back(static_cast<int>(pattern_.neighbour.size()));
    const std::vector<int>& front = adjacency_[node];
    for (auto w = std::lower_bound(waiting_.begin(), waiting_.end(), std::make_pair(node, 0));
         w != waiting_.end() && w->first == node; ++w) {
      --state_[w->second];
    }
    Update(node);
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
      Update(i);
    }
  }

  std::vector<std::vector<int>>& adjacency_;
  std::vector<int>& state_;
  std::vector<int>& merged_;
  std::vector<std::pair<int, int>>& waiting_;  // (body, constraint that waits for it), ascending
  Tournament ready_;
  BlockLuPattern& pattern_;
};

// Place of the pair of blocks of nodes i and j: the slot in the list of the node that is eliminated
// first. `position[node]` is its place in the order. Neighbour lists are sorted by node.
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
                           std::vector<std::int64_t>* keys, BlockLuPattern* pattern) {
  Ordering(adjacency, state, merged, waiting, keys, pattern).Run();
  FindPlaces(state, pattern);
}

template class BlockLu<double>;
#define TANGIBLE_INSTANTIATE_BLOCK_LU(N) template class BlockLu<Jet<N>>;
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_BLOCK_LU)

}  // namespace tangible
