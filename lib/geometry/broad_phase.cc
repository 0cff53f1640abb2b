// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tangible/math/scalar.h"

namespace tangible {
namespace {

/// The box of a half-plane is bounded only where its normal lies along an axis.
Aabb HalfPlaneBox(const ShapeView<double>& shape, const Pose<double>& pose, double margin) {
  Aabb box{-kInfinity, -kInfinity, kInfinity, kInfinity};
  const Vector2<double> normal(shape.numbers[0], shape.numbers[1]);
  const double norm = std::sqrt(normal.squaredNorm());
  const Vector2<double> world = pose.rotation * normal;
  const double height = shape.numbers[2] / norm + margin;
  if (world.x() == 0.0 && world.y() > 0.0) {
    box.max_y = pose.position.y() + height;
  } else if (world.x() == 0.0 && world.y() < 0.0) {
    box.min_y = pose.position.y() - height;
  } else if (world.y() == 0.0 && world.x() > 0.0) {
    box.max_x = pose.position.x() + height;
  } else if (world.y() == 0.0 && world.x() < 0.0) {
    box.min_x = pose.position.x() - height;
  }
  return box;
}

/// The half sides of the box are the support function of the ellipse along x and y.
Aabb EllipseBox(const ShapeView<double>& shape, const Pose<double>& pose, double margin) {
  const double a = shape.numbers[0];
  const double b = shape.numbers[1];
  const double c = pose.rotation.cosine;
  const double s = pose.rotation.sine;
  const double x = std::hypot(a * c, b * s) + margin;
  const double y = std::hypot(a * s, b * c) + margin;
  return {pose.position.x() - x, pose.position.y() - y, pose.position.x() + x,
          pose.position.y() + y};
}

}  // namespace

Aabb ComputeAabb(const ShapeView<double>& shape, const Pose<double>& pose, double margin) {
  if (shape.type == ShapeType::kHalfPlane) {
    return HalfPlaneBox(shape, pose, margin);
  }
  if (shape.type == ShapeType::kEllipse) {
    return EllipseBox(shape, pose, margin);
  }
  Aabb box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  const int num_vertices = NumVertices(shape.type, shape.num_numbers);
  for (int i = 0; i < num_vertices; ++i) {
    const Vector2<double> vertex = pose * Vertex(shape, i);
    box.min_x = std::min(box.min_x, vertex.x());
    box.min_y = std::min(box.min_y, vertex.y());
    box.max_x = std::max(box.max_x, vertex.x());
    box.max_y = std::max(box.max_y, vertex.y());
  }
  const double grow = CoreRadius(shape) + margin;
  return {box.min_x - grow, box.min_y - grow, box.max_x + grow, box.max_y + grow};
}

// Boxes are swept along the axis over which they are spread more, because those of a stack or a
// hanging chain all overlap along x. The entries' x is the coordinate along that axis.
bool BroadPhase::ChooseAxis(const std::vector<Aabb>& boxes) {
  double sum[2] = {0.0, 0.0};
  double squares[2] = {0.0, 0.0};
  int count = 0;
  for (const Aabb& box : boxes) {
    const double centre[2] = {0.5 * (box.min_x + box.max_x), 0.5 * (box.min_y + box.max_y)};
    if (std::isfinite(box.max_x - box.min_x) && std::isfinite(box.max_y - box.min_y)) {
      ++count;
      for (int k = 0; k < 2; ++k) {
        sum[k] += centre[k];
        squares[k] += centre[k] * centre[k];
      }
    }
  }
  // The factor prevents that the axis of a square pile changes from step to step.
  const double x = squares[0] - sum[0] * sum[0] / std::max(1, count);
  const double y = squares[1] - sum[1] * sum[1] / std::max(1, count);
  const bool along_y = along_y_ ? 2.0 * y > x : y > 2.0 * x;
  const bool changed = along_y != along_y_;
  along_y_ = along_y;
  return changed;
}

void BroadPhase::Sort(const std::vector<Aabb>& boxes) {
  const auto before = [](const Entry& p, const Entry& q) { return p.box.min_x < q.box.min_x; };
  const auto turned = [this](const Aabb& box) {
    return along_y_ ? Aabb{box.min_y, box.min_x, box.max_y, box.max_x} : box;
  };
  if (ChooseAxis(boxes) || entries_.size() != boxes.size()) {
    entries_.resize(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      entries_[i] = {turned(boxes[i]), static_cast<int>(i)};
    }
    std::sort(entries_.begin(), entries_.end(), before);
    return;
  }
  for (Entry& entry : entries_) {
    entry.box = turned(boxes[entry.index]);
  }
  // Insertion sort takes linear time on an order that has hardly changed.
  for (std::size_t k = 1; k < entries_.size(); ++k) {
    const Entry moving = entries_[k];
    std::size_t place = k;
    for (; place > 0 && before(moving, entries_[place - 1]); --place) {
      entries_[place] = entries_[place - 1];
    }
    entries_[place] = moving;
  }
}

void BroadPhase::SortOverlaps(int num_boxes) {
  // The pairs are sorted by counting those of each first body, which takes linear time; the second
  // bodies of one first body are few.
  first_.assign(num_boxes + 1, 0);
  for (const auto& pair : found_) {
    ++first_[pair.first + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  overlaps_.resize(found_.size());
  for (const auto& pair : found_) {
    overlaps_[first_[pair.first]++] = pair;
  }
  // By now each first_[i] has advanced to the end of its pairs.
  int begin = 0;
  for (int i = 0; i < num_boxes; ++i) {
    std::sort(overlaps_.begin() + begin, overlaps_.begin() + first_[i]);
    begin = first_[i];
  }
}

void BroadPhase::SortAndSweep(const std::vector<Aabb>& boxes) {
  Sort(boxes);
  found_.clear();
  num_compared_ = 0;
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    const Entry entry = entries_[k];
    std::size_t l = k + 1;
    for (; l < entries_.size(); ++l) {
      const Entry& other = entries_[l];
      if (!(other.box.min_x <= entry.box.max_x)) {
        break;
      }
      // The last condition excludes empty boxes (min > max), which an infinite box would overlap.
      if (other.box.min_y <= entry.box.max_y && entry.box.min_y <= other.box.max_y &&
          other.box.min_x <= other.box.max_x) {
        found_.emplace_back(std::min(entry.index, other.index), std::max(entry.index, other.index));
      }
    }
    num_compared_ += static_cast<int>(l - k - 1);
  }
  // The order is ascending, so that results do not depend on how the bodies moved before.
  SortOverlaps(static_cast<int>(boxes.size()));
}

}  // namespace tangible
