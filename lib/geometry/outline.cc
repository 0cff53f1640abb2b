// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/outline.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tangible/geometry/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible {
namespace {

/// How far a run reaches beyond its ends, m: the same in all tests, so that each place belongs to
/// either the run or the corner.
double RoomOf(const OutlineRun& run) { return kLengthRounding * run.length; }

double FootOver(const OutlineRun& run, const Vector2<double>& x) {
  return run.tangent.dot(x - run.start);
}
double HeightOver(const OutlineRun& run, const Vector2<double>& x) {
  return run.normal.dot(x - run.start);
}

void Include(const Vector2<double>& point, Aabb* box) {
  box->min_x = std::min(box->min_x, point.x());
  box->min_y = std::min(box->min_y, point.y());
  box->max_x = std::max(box->max_x, point.x());
  box->max_y = std::max(box->max_y, point.y());
}

}  // namespace

bool IsConcavePolygon(const ShapeView<double>& shape) {
  if (shape.type != ShapeType::kPolygon) return false;
  const int size = NumVertices(shape.type, shape.num_numbers);
  for (int i = 0; i < size; ++i) {
    const Vector2<double> at = Vertex(shape, (i + 1) % size);
    const Vector2<double> in = at - Vertex(shape, i);
    const Vector2<double> out = Vertex(shape, (i + 2) % size) - at;
    if (Cross(in, out) < -kFlushTurn * in.norm() * out.norm()) return true;
  }
  return false;
}

Outline::Outline(const ShapeView<double>& shape) {
  is_polygon_ = shape.type == ShapeType::kPolygon;
  const int num_points = NumVertices(shape.type, shape.num_numbers);
  num_edges_ = is_polygon_ ? num_points : num_points - 1;
  is_closed_ = is_polygon_ || Vertex(shape, 0) == Vertex(shape, num_edges_);
  along_.resize(static_cast<size_t>(num_edges_));
  for (int i = 0; i < num_edges_; ++i) {
    const Vector2<double> start = Vertex(shape, i);
    const Vector2<double> along = Vertex(shape, (i + 1) % num_points) - start;
    const double length = std::sqrt(along.squaredNorm());
    const Vector2<double> tangent = along / length;
    if (i > 0 && std::abs(Cross(runs_.back().tangent, tangent)) <= kFlushTurn &&
        runs_.back().tangent.dot(tangent) > 0.0) {
      OutlineRun& run = runs_.back();
      along_[static_cast<size_t>(i)] = run.length;
      run.last = i;
      run.length += length;
      continue;
    }
    OutlineRun& run = runs_.emplace_back();
    run.first = run.last = i;
    run.start = start;
    run.tangent = tangent;
    run.normal = Vector2<double>(tangent.y(), -tangent.x());
    run.length = length;
    along_[static_cast<size_t>(i)] = 0.0;
  }
  SetJoints();
  BuildTree(shape);
  if (is_polygon_) BuildHull(shape);
}

void Outline::SetJoints() {
  for (int i = 0; i < num_runs(); ++i) {
    const int next = Next(i);
    if (next < 0) {
      // As if a wall went straight down from each end.
      runs_[i].bisector_after = runs_[0].bisector_before = 1.0;
      continue;
    }
    OutlineRun& before = runs_[i];
    OutlineRun& after = runs_[next];
    const double sine = Cross(before.tangent, after.tangent);
    const double cosine = before.tangent.dot(after.tangent);
    const OutlineJoint joint = std::abs(sine) <= kFlushTurn && cosine > 0.0 ? OutlineJoint::kFlush
                               : sine >= 0.0                                ? OutlineJoint::kConvex
                                             : OutlineJoint::kConcave;
    before.after = after.before = joint;
    if (joint == OutlineJoint::kConvex) {
      before.bisector_after = after.bisector_before = std::tan(0.5 * std::atan2(sine, cosine));
    }
  }
}

void Outline::BuildTree(const ShapeView<double>& shape) {
  const int num_points = NumVertices(shape.type, shape.num_numbers);
  while (num_leaves_ < num_runs()) num_leaves_ *= 2;
  tree_.assign(2 * static_cast<size_t>(num_leaves_),
               {kInfinity, kInfinity, -kInfinity, -kInfinity});
  for (int i = 0; i < num_runs(); ++i) {
    for (int k = runs_[i].first; k <= runs_[i].last + 1; ++k) {
      Include(Vertex(shape, k % num_points), &tree_[static_cast<size_t>(num_leaves_ + i)]);
    }
  }
  for (int node = num_leaves_ - 1; node > 0; --node) {
    const Aabb& low = tree_[2 * static_cast<size_t>(node)];
    const Aabb& high = tree_[2 * static_cast<size_t>(node) + 1];
    tree_[static_cast<size_t>(node)] = {
        std::min(low.min_x, high.min_x), std::min(low.min_y, high.min_y),
        std::max(low.max_x, high.max_x), std::max(low.max_y, high.max_y)};
  }
}

// The lower chain from the leftmost vertex and the upper one back to it (Andrew's algorithm).
void Outline::BuildHull(const ShapeView<double>& shape) {
  const int size = NumVertices(shape.type, shape.num_numbers);
  std::vector<int> order(static_cast<size_t>(size));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const Vector2<double> x = Vertex(shape, i), y = Vertex(shape, j);
    return x.x() < y.x() || (x.x() == y.x() && x.y() < y.y());
  });
  std::vector<Vector2<double>> hull;
  const auto add = [&](const Vector2<double>& x, size_t least) {
    while (hull.size() > least && !(Cross(Vector2<double>(hull.back() - hull[hull.size() - 2]),
                                          Vector2<double>(x - hull.back())) > 0.0)) {
      hull.pop_back();
    }
    hull.push_back(x);
  };
  for (const int vertex : order) add(Vertex(shape, vertex), 1);
  const size_t lower = hull.size();
  for (size_t i = order.size() - 1; i-- > 0;) add(Vertex(shape, order[i]), lower);
  hull.pop_back();
  const double room = kNearHull * (hull[lower - 1] - hull[0]).norm();
  for (int run = 0; run < num_runs(); ++run) {
    const Vector2<double>& x = runs_[run].start;
    bool is_near = false;
    for (size_t i = 0; i < hull.size() && !is_near; ++i) {
      const Vector2<double> along = hull[(i + 1) % hull.size()] - hull[i];
      is_near = Cross(along, Vector2<double>(x - hull[i])) <= room * along.norm();
    }
    if (is_near && runs_[run].before == OutlineJoint::kConvex) hull_runs_.push_back(run);
  }
}

// The edges that a ray towards +x crosses are counted, of two that meet at its height one.
bool Outline::Contains(const Vector2<double>& x) const {
  bool is_in = false;
  ForEachRun({x.x(), x.y(), kInfinity, x.y()}, [&](int i) {
    const OutlineRun& run = runs_[i];
    const Vector2<double>& end = runs_[Next(i)].start;
    if ((run.start.y() > x.y()) == (end.y() > x.y())) return;
    // Of a run that goes up the left side is the inner one.
    const bool is_left = HeightOver(run, x) < 0.0;
    if (is_left == (end.y() > run.start.y())) is_in = !is_in;
  });
  return is_in;
}

int Outline::EdgeAt(int run, double s) const {
  const OutlineRun& of = runs_[run];
  const auto first = along_.begin() + of.first;
  const auto after = std::upper_bound(first + 1, along_.begin() + of.last + 1, s);
  return of.first + static_cast<int>(after - first) - 1;
}

bool Outline::IsAfterStart(int run, const Vector2<double>& x) const {
  const OutlineRun& of = runs_[run];
  const double s = FootOver(of, x);
  const double h = HeightOver(of, x);
  if (const SeamVertex* start = BoundedStart(run); start != nullptr) return s >= -start->beyond;
  if (s >= -RoomOf(of)) {
    return h >= 0.0 || s >= -h * of.bisector_before - RoomOf(of);
  }
  if (of.before != OutlineJoint::kConcave) return false;
  // What is solid behind the run before bounds it, up to the end of an open line.
  const int before = Previous(run);
  const OutlineRun& previous = runs_[before];
  return HeightOver(previous, x) <= 0.0 && FootOver(previous, x) >= 0.0 &&
         (previous.before != OutlineJoint::kEnd || IsAfterStart(before, x)) && MayContain(x);
}

bool Outline::IsBeforeEnd(int run, const Vector2<double>& x) const {
  const OutlineRun& of = runs_[run];
  const double left = of.length - FootOver(of, x);
  const double h = HeightOver(of, x);
  if (const SeamVertex* end = BoundedEnd(run); end != nullptr) return left >= -end->beyond;
  if (left >= -RoomOf(of)) {
    return h >= 0.0 || left >= -h * of.bisector_after - RoomOf(of);
  }
  if (of.after != OutlineJoint::kConcave) return false;
  const int after = Next(run);
  const OutlineRun& next = runs_[after];
  return HeightOver(next, x) <= 0.0 && FootOver(next, x) <= next.length &&
         (next.after != OutlineJoint::kEnd || IsBeforeEnd(after, x)) && MayContain(x);
}

// Whether a point at some depth behind a run is on the free side of another one that is nearer.
bool Outline::IsBehindFree(int run, const Vector2<double>& x, double depth) const {
  bool is_free = false;
  ForEachRun({x.x() - depth, x.y() - depth, x.x() + depth, x.y() + depth}, [&](int i) {
    if (i == run || is_free) return;
    const double s = FootOver(runs_[i], x);
    const double h = HeightOver(runs_[i], x);
    is_free = h >= 0.0 && h < depth && s >= 0.0 && s <= runs_[i].length && !IsHiddenAt(i, s);
  });
  return is_free;
}

// Whether a point at some depth behind a run of a polygon is in the solid, and over no other run
// with a smaller depth. At a concave joint both runs bound the free side.
bool Outline::IsNearest(int run, const Vector2<double>& x, double depth) const {
  if (!Contains(x)) return false;
  const OutlineRun& of = runs_[run];
  const int before = of.before == OutlineJoint::kConcave ? Previous(run) : run;
  const int after = of.after == OutlineJoint::kConcave ? Next(run) : run;
  bool is_nearest = true;
  ForEachRun({x.x() - depth, x.y() - depth, x.x() + depth, x.y() + depth}, [&](int i) {
    if (i == run || i == before || i == after || !is_nearest) return;
    const double other = -HeightOver(runs_[i], x);
    const bool is_nearer = other >= 0.0 && (other < depth || (other == depth && i < run));
    if (is_nearer && IsAfterStart(i, x) && IsBeforeEnd(i, x) &&
        !IsHiddenAt(i, FootOver(runs_[i], x))) {
      is_nearest = false;
    }
  });
  return is_nearest;
}

bool Outline::IsOver(int run, const Vector2<double>& x) const {
  if (!IsAfterStart(run, x) || !IsBeforeEnd(run, x)) return false;
  if (IsHiddenAt(run, FootOver(runs_[run], x))) return false;
  const double h = HeightOver(runs_[run], x);
  if (h >= -kFlushStep) return true;
  return is_polygon_ ? IsNearest(run, x, -h) : !IsBehindFree(run, x, -h);
}

Aabb BoxOfOutline(const Outline& outline, const Pose<double>& pose, double margin) {
  if (outline.Next(outline.num_runs() - 1) < 0) {
    // The solid behind a line that is open has no other side.
    return {-kInfinity, -kInfinity, kInfinity, kInfinity};
  }
  const Aabb& own = outline.box();
  Aabb box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (const double x : {own.min_x, own.max_x}) {
    for (const double y : {own.min_y, own.max_y}) {
      Include(pose * Vector2<double>(x, y), &box);
    }
  }
  return {box.min_x - margin, box.min_y - margin, box.max_x + margin, box.max_y + margin};
}

}  // namespace tangible
