// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Finds the pairs of bodies that may be near each other, by axis-aligned boxes and sort and sweep
// along x or y.

#include <utility>
#include <vector>

#include "tangible/geometry/shape.h"

namespace tangible {

/// An axis-aligned box, m. The box of a half-plane may be infinite. An empty box (of no shape) has
/// min > max and overlaps nothing.
struct Aabb {
  double min_x, min_y, max_x, max_y;
};

/// Whether two boxes have a point in common.
inline bool Overlap(const Aabb& p, const Aabb& q) {
  return p.min_x <= q.max_x && q.min_x <= p.max_x && p.min_y <= q.max_y && q.min_y <= p.max_y &&
         p.min_x <= p.max_x && q.min_x <= q.max_x;
}

/// The box of a shape at a pose, grown by `margin` on each side.
Aabb ComputeAabb(const ShapeView<double>& shape, const Pose<double>& pose, double margin);

/// Finds overlapping pairs. It keeps the sorted order of the last call, so that coherent motion
/// costs little more than one pass, and allocates nothing once its vectors have grown. Pairs are
/// (i, j) with i < j, in ascending order, so that results do not depend on earlier calls.
class BroadPhase {
 public:
  /// The pairs with overlapping boxes for which allowed(i, j) (i < j).
  template <typename Allowed>
  void FindPairs(const std::vector<Aabb>& boxes, Allowed&& allowed,
                 std::vector<std::pair<int, int>>* pairs);
  /// The number of pairs of boxes that the last sweep compared; n boxes have n (n − 1) / 2 pairs.
  int num_compared() const { return num_compared_; }

 private:
  struct Entry {
    Aabb box;
    int index;
  };
  void SortAndSweep(const std::vector<Aabb>& boxes);
  bool ChooseAxis(const std::vector<Aabb>& boxes);
  void Sort(const std::vector<Aabb>& boxes);
  void SortOverlaps(int num_boxes);

  int num_compared_ = 0;
  bool along_y_ = false;        ///< the axis that is swept; entries have their x along it
  std::vector<Entry> entries_;  ///< by min_x, in the order of the last call
  std::vector<std::pair<int, int>> found_;
  std::vector<std::pair<int, int>> overlaps_;  ///< those found, in ascending order
  std::vector<int> first_;                     ///< where the pairs of a first body start
};

template <typename Allowed>
void BroadPhase::FindPairs(const std::vector<Aabb>& boxes, Allowed&& allowed,
                           std::vector<std::pair<int, int>>* pairs) {
  SortAndSweep(boxes);
  pairs->clear();
  for (const auto& pair : overlaps_) {
    if (allowed(pair.first, pair.second)) {
      pairs->push_back(pair);
    }
  }
}

}  // namespace tangible
