// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Polylines and concave polygons: outlines of a solid, which other bodies touch from the free side
// alone.
//
// Going along the points the solid is on the left, so that the normal n of an edge with the
// tangent t is (t_y, −t_x), as of a counter-clockwise polygon. A joint of two edges that turn
// by at most kFlushTurn is flush, and nothing of it is a contact. Where the outline turns left
// it is convex, and the corner is a contact with the normals between both edges. Where it
// turns right it is concave, the corner is none, and bodies touch both edges. An end that
// nothing follows is a corner with the normals between that of its edge and the direction in
// which the outline ends there.
//
// A run is a maximal sequence of edges with flush joints. It is one face, and the part of its
// body that contacts belong to. A point x has the foot s = t·(x − start) and the height n·(x −
// start) over a run. It is over the run where its foot is. Behind the run it is so at a convex
// joint only up to the bisector, so that it is over the nearest one of the two runs, and at the end
// of an open line as if a wall went straight down there: a face that meets the end is not in the
// solid with what of it lies below. Beyond a
// concave joint it is also where it is behind the neighbour, because near the joint both bound
// the free side. A point behind a run that is over another run with a smaller height above it
// is on the free side of a thin solid, and no contact of the first one.
//
// A polygon bounds its solid on all sides, so that more is known: a point behind a run touches it
// only if it is in the polygon, and of the runs that it is over only the nearest one, or two that
// meet at a concave joint. What is deep in the solid is pushed out through the nearest edge.

#include <utility>
#include <vector>

#include "tangible/geometry/broad_phase.h"
#include "tangible/geometry/collide.h"
#include "tangible/geometry/seams.h"

namespace tangible {

enum class OutlineJoint : unsigned char { kEnd, kFlush, kConvex, kConcave };

struct OutlineRun {
  int first = 0, last = 0;  ///< edges of the polyline
  Vector2<double> start{0.0, 0.0}, tangent{0.0, 0.0}, normal{0.0, 0.0};
  double length = 0.0;
  OutlineJoint before = OutlineJoint::kEnd, after = OutlineJoint::kEnd;
  double bisector_before = 0.0, bisector_after = 0.0;  ///< tan(turn / 2); of ends 1
};

/// Whether a shape is a polygon with a corner that turns inward, by more than kFlushTurn.
bool IsConcavePolygon(const ShapeView<double>& shape);

/// A polyline or a polygon in its body's frame.
class Outline {
 public:
  /// O(n) for n points, no two of which that follow each other are equal; O(n log n) of a polygon.
  explicit Outline(const ShapeView<double>& shape);

  /// What neighbours leave of the outline, from FindSeams: a part of a run that they hide is over
  /// nothing, and at a corner in a neighbour the run reaches to it, whatever is behind.
  void SetSeams(ShapeSeams seams) { seams_ = std::move(seams); }
  bool HasSeams() const { return !seams_.edges.empty(); }
  /// Whether nothing of a run is a contact.
  bool IsHidden(int run) const { return HasSeams() && seams_.edges[run].IsHidden(); }
  /// The corner at a run's start, or at its end, where a neighbour contains it, or nullptr.
  const SeamVertex* BoundedStart(int run) const { return Bounded(run); }
  const SeamVertex* BoundedEnd(int run) const {
    return Bounded(runs_[run].after == OutlineJoint::kEnd ? num_runs() : Next(run));
  }

  bool IsPolygon() const { return is_polygon_; }
  /// The runs of a polygon that start at its convex hull, or at most kNearHull inside: their starts
  /// are what a half-plane touches.
  const std::vector<int>& hull_runs() const { return hull_runs_; }
  /// Whether a point is in a polygon. O(log n + the edges beside it).
  bool Contains(const Vector2<double>& x) const;
  /// The vertex at which a run ends, and its place.
  int EndOf(int run) const {
    return is_polygon_ && runs_[run].last + 1 == num_edges_ ? 0 : runs_[run].last + 1;
  }
  Vector2<double> EndPlace(int run) const {
    return runs_[run].start + runs_[run].length * runs_[run].tangent;
  }

  int num_runs() const { return static_cast<int>(runs_.size()); }
  const OutlineRun& run(int i) const { return runs_[i]; }
  /// The box of all edges.
  const Aabb& box() const { return tree_[1]; }
  /// The foot of an edge's start over its run.
  double StartOfEdge(int edge) const { return along_[static_cast<size_t>(edge)]; }
  /// The edge of a run at the foot s.
  int EdgeAt(int run, double s) const;
  /// Whether a point is over a run at its start, or its end (see above).
  bool IsAfterStart(int run, const Vector2<double>& x) const;
  bool IsBeforeEnd(int run, const Vector2<double>& x) const;
  /// Whether a point is over a run whose solid it may touch.
  bool IsOver(int run, const Vector2<double>& x) const;
  /// The run before or after another one; −1: none.
  int Previous(int run) const { return run > 0 ? run - 1 : is_closed_ ? num_runs() - 1 : -1; }
  int Next(int run) const { return run + 1 < num_runs() ? run + 1 : is_closed_ ? 0 : -1; }

  /// Calls visit(run) for the runs whose boxes overlap another one, in ascending order.
  /// O(log n + found).
  template <typename Visit>
  void ForEachRun(const Aabb& box, const Visit& visit) const {
    VisitNode(1, 0, num_leaves_, box, visit);
  }

 private:
  template <typename Visit>
  void VisitNode(int node, int low, int high, const Aabb& box, const Visit& visit) const {
    const Aabb& own = tree_[node];
    if (!(own.min_x <= box.max_x && box.min_x <= own.max_x && own.min_y <= box.max_y &&
          box.min_y <= own.max_y)) {
      return;
    }
    if (high - low == 1) {
      // The box of a leaf without a run overlaps one that has no end.
      if (low < num_runs()) visit(low);
      return;
    }
    const int middle = (low + high) / 2;
    VisitNode(2 * node, low, middle, box, visit);
    VisitNode(2 * node + 1, middle, high, box, visit);
  }
  const SeamVertex* Bounded(int vertex) const {
    return HasSeams() && seams_.vertices[vertex].is_bounded ? &seams_.vertices[vertex] : nullptr;
  }
  bool IsHiddenAt(int run, double s) const { return HasSeams() && !seams_.edges[run].IsFree(s, s); }
  bool IsBehindFree(int run, const Vector2<double>& x, double depth) const;
  /// What is behind a run of an open line may be anywhere in the solid.
  bool MayContain(const Vector2<double>& x) const { return !is_polygon_ || Contains(x); }
  bool IsNearest(int run, const Vector2<double>& x, double depth) const;
  void SetJoints();
  void BuildTree(const ShapeView<double>& shape);
  void BuildHull(const ShapeView<double>& shape);

  std::vector<OutlineRun> runs_;
  ShapeSeams seams_;           ///< empty: there are none
  std::vector<double> along_;  ///< the foot of each edge's start over its run
  int num_edges_ = 0;
  bool is_closed_ = false, is_polygon_ = false;
  std::vector<int> hull_runs_;
  int num_leaves_ = 1;      ///< a power of two
  std::vector<Aabb> tree_;  ///< a heap whose leaves are the boxes of the runs
};

/// The box of an outline at a pose, grown by `margin`.
Aabb BoxOfOutline(const Outline& outline, const Pose<double>& pose, double margin);

/// FindContactFeatures for one run of a polyline and another shape, which is no half-plane: the
/// lowest vertex over the run and its lower neighbour over it, and the corners at which the run
/// starts or the outline ends. `side`: which one the polyline is. `seams`: those of the other
/// shape, or null.
int FindOutlineFeatures(const Outline& outline, int run, const ShapeView<double>& shape_a,
                        const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                        const Pose<double>& pose_b, SeamSide side, const ShapeSeams* seams,
                        double max_gap, ContactFeature features[2]);

/// The same for the start of a run of a polygon and a half-plane.
int FindPlaneFeature(const Outline& outline, int run, const ShapeView<double>& plane,
                     const Pose<double>& pose_a, const Pose<double>& pose_b, SeamSide side,
                     double max_gap, ContactFeature features[2]);

/// A run of an outline at a pose.
struct PlacedRun {
  const Outline& outline;
  int run;
  const Pose<double>& pose;
  const OutlineRun& of() const { return outline.run(run); }
};

/// The same for the runs of two outlines: the corner at which each starts (and ends, where nothing
/// follows) over the other one, and two such corners where neither is over the other's run.
int FindFeaturesOfRuns(const PlacedRun& a, const PlacedRun& b, double max_gap,
                       ContactFeature features[2]);

/// The distance of two runs, 0 where they cross, m. Sets the ends that are nearest.
double DistanceOfRuns(const PlacedRun& a, const PlacedRun& b, int* end_a, int* end_b);

/// A lower bound of the distance of a run and a shape, 0 where they cross, less the shape's
/// radius, m; the distance itself unless the shape is an ellipse. Sets the end of the run and the
/// vertex of the shape that are nearest.
double DistanceOfRun(const Outline& outline, int run, const Pose<double>& pose,
                     const ShapeView<double>& shape, const Pose<double>& shape_pose, int* corner,
                     int* vertex);

/// Whether a vertex of a shape, less its radius, is more than `margin` (m) behind a run of a
/// polygon and in its solid, with its foot on the run: another run may be nearer.
bool IsInSolidBehind(const Outline& outline, int run, const Pose<double>& pose,
                     const ShapeView<double>& shape, const Pose<double>& shape_pose, double margin);

}  // namespace tangible
