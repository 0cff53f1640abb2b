// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Splines: smooth curves that bound a solid, which vertices of other bodies and ellipses touch from
// the free side alone.
//
// Going along the points the solid is on the left, as of a polyline (outline.h). A vertex has a
// contact where its distance from the curve has a minimum and the vertex is on the free side there
// (spline_inl.h). It is in the solid if the point of the whole curve that is nearest to it faces
// away from it: that one is its contact then, however deep it is, and no other. An end that nothing
// follows is a corner with the normals between that of the curve and the direction in which the
// curve ends there. A tree of the pieces' boxes finds those near a vertex, or the nearest one, in
// O(log n) for n points.

#include <vector>

#include "tangible/geometry/broad_phase.h"
#include "tangible/geometry/collide.h"
#include "tangible/geometry/seams.h"
#include "tangible/math/spline_curve.h"

namespace tangible {

namespace internal {
struct SplineFoot;
}

/// A spline in its body's frame.
class Curve {
 public:
  /// O(n) for n points.
  explicit Curve(const ShapeView<double>& shape);

  bool is_closed() const { return is_closed_; }
  int num_pieces() const { return static_cast<int>(pieces_.size()); }
  int num_places() const;
  const Aabb& box() const { return tree_[1].box; }
  /// The curve at its first point, or at its last one.
  enum class End { kFirst, kLast };
  SplineAt<double> AtEnd(End end) const {
    return end == End::kFirst ? pieces_.front().At(0.0) : pieces_.back().At(pieces_.back().length);
  }

  /// Where the distance has a minimum.
  struct Minimum {
    int place = 0;
    double height = 0.0;  ///< n·(x − c), m
    double side = 0.0;    ///< the same of a vertex, or of the centre of an ellipse, m
  };
  /// Receives minima.
  class Visitor {
   public:
    virtual ~Visitor() = default;
    virtual void Visit(const Minimum& minimum) = 0;
  };
  /// Visits the minima that may be no farther than a distance. O(log n + found).
  void ForEachMinimum(const internal::SplineFoot& foot, double distance, Visitor* visitor) const;

  /// The point of the curve that is nearest to another one.
  struct Nearest {
    double distance = 0.0;  ///< m
    Minimum minimum;
    bool is_end = false;
  };
  Nearest FindNearest(const Vector2<double>& x) const;

 private:
  /// Consecutive pieces: their box, and a cone that holds their tangents.
  struct Node {
    Aabb box;
    Vector2<double> direction{0.0, 0.0};  ///< unit; zero: there is no cone
    double spread = 0.0;                  ///< half of its angle, rad
    double sine = 0.0;                    ///< of that
  };
  static Node Joined(const Node& low, const Node& high);
  /// Whether the pieces of a node may have a minimum.
  static bool MayHaveMinimum(const Node& node, const internal::SplineFoot& foot);
  void VisitNode(int node, int low, int high, const internal::SplineFoot& foot, const Aabb& box,
                 Visitor* visitor) const;
  double AtKnot(int piece, const internal::SplineFoot& foot) const;
  void VisitMinima(int piece, const internal::SplineFoot& foot, Visitor* visitor) const;
  Minimum MinimumIn(int piece, int first_part, int last_part,
                    const internal::SplineFoot& foot) const;
  void LookForNearest(int node, int low, int high, const internal::SplineFoot& foot,
                      Nearest* nearest) const;

  std::vector<SplinePiece<double>> pieces_;
  std::vector<bool> is_straight_;  ///< it turns by at most kStraightPiece
  bool is_closed_ = false;
  int num_leaves_ = 1;      ///< a power of two
  std::vector<Node> tree_;  ///< a heap whose leaves are the pieces
};

/// The box of a curve at a pose, grown by `margin`.
Aabb BoxOfCurve(const Curve& curve, const Pose<double>& pose, double margin);

/// A curve at a pose.
struct PlacedCurve {
  const Curve& curve;
  const Pose<double>& pose;
};
/// Some vertices of another shape at a pose; an ellipse counts as one vertex.
struct PlacedVertices {
  const ShapeView<double>& shape;
  const Pose<double>& pose;
  int first = 0, count = 0;
};

/// FindContactFeatures for a spline and vertices of another shape. `side`: which one the spline is.
/// Of an infinite max_gap it finds the nearest feature, and others only where they are about as
/// near.
int FindCurveFeatures(const PlacedCurve& curve, const PlacedVertices& vertices, SeamSide side,
                      double max_gap, ContactFeature features[2]);

/// The least distance of vertices from a spline, on either side, less their radius, m. Sets the
/// feature that is nearest.
double DistanceOfCurve(const PlacedCurve& curve, const PlacedVertices& vertices, SeamSide side,
                       ContactFeature* nearest);

}  // namespace tangible
