// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Disjoint sets of some of the numbers 0 … n − 1, joined one pair after the other; nearly O(1) an
// operation (Tarjan, "Efficiency of a good but not linear set union algorithm", J. ACM 22, 1975).

#include <algorithm>
#include <cstddef>
#include <vector>

namespace tangible {

class DisjointSets {
 public:
  /// None of the numbers is in a set. Allocates only where n exceeds all earlier ones.
  void Clear(size_t n) { parent_.assign(n, -1); }
  /// A set of its own.
  void Add(int i) { parent_[i] = i; }
  /// 0 … n − 1, each a set of its own.
  void AddAll(size_t n) {
    Clear(n);
    for (size_t i = 0; i < n; ++i) Add(static_cast<int>(i));
  }
  bool Has(int i) const { return parent_[i] >= 0; }

  /// The smallest number of the set that i is in.
  int Root(int i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }
  /// Whether the two were in different sets, which then are one.
  bool Join(int a, int b) {
    a = Root(a);
    b = Root(b);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace tangible
