// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The core of a shape at a pose, in double, from which features are chosen. Internal to the module.
//
// A point is a polygon with one vertex and no edge, a segment is one with two vertices and two
// edges, one for each side, so that all pairs share the same code. Coordinates are relative to a
// common origin near the pair, so that little is lost to rounding far from the world's origin.

#include <cmath>
#include <limits>

#include "tangible/geometry/shape.h"

namespace tangible::internal {

/// An edge from `start` along the unit vector `tangent`; both are zero where it has no length.
struct CoreEdge {
  Vector2<double> start{0.0, 0.0};
  Vector2<double> tangent{0.0, 0.0};
  double length = 0.0;

  Vector2<double> Normal() const { return Vector2<double>(tangent.y(), -tangent.x()); }
  /// The height of a point above the edge's line.
  double Height(const Vector2<double>& p) const { return Normal().dot(p - start); }
};

class ConvexCore {
 public:
  ConvexCore(const ShapeView<double>& shape, const Pose<double>& pose,
             const Vector2<double>& origin)
      : shape_(shape),
        rotation_(pose.rotation),
        position_(pose.position - origin),
        size_(NumVertices(shape.type, shape.num_numbers)),
        radius_(CoreRadius(shape)) {
    for (int i = 0; i < size_ && i < kNumCached; ++i) {
      cached_[i] = Place(i);
    }
  }

  int Size() const { return size_; }
  double Radius() const { return radius_; }
  /// Vertices may be collinear, so that a face of a polygon may consist of several edges.
  bool IsPolygon() const { return shape_.type == ShapeType::kPolygon; }
  int Next(int i) const { return i + 1 == size_ ? 0 : i + 1; }
  int Previous(int i) const { return i == 0 ? size_ - 1 : i - 1; }
  Vector2<double> VertexAt(int i) const { return i < kNumCached ? cached_[i] : Place(i); }

  CoreEdge Edge(int i) const {
    CoreEdge edge;
    edge.start = VertexAt(i);
    const Vector2<double> along = VertexAt(Next(i)) - edge.start;
    edge.length = std::sqrt(along.squaredNorm());
    if (edge.length > 0.0) {
      edge.tangent = along / edge.length;
    }
    return edge;
  }

  struct Deepest {
    int vertex = 0;
    double height = std::numeric_limits<double>::infinity();
  };
  /// The vertex of the least height above an edge's line, the first of equals.
  Deepest DeepestOver(const CoreEdge& edge) const {
    Deepest deepest;
    for (int j = 0; j < size_; ++j) {
      const double height = edge.Height(VertexAt(j));
      if (height < deepest.height) deepest = {j, height};
    }
    return deepest;
  }

 private:
  static constexpr int kNumCached =
      8;  ///< vertices placed once; those beyond are placed at each use

  Vector2<double> Place(int i) const { return position_ + rotation_ * Vertex(shape_, i); }

  ShapeView<double> shape_;
  Rotation<double> rotation_;
  Vector2<double> position_;
  int size_;
  double radius_;
  Vector2<double> cached_[kNumCached];
};

/// A face: an edge with the edges collinear to it.
struct CoreFace {
  int edge = -1;  ///< the one that stands for the face; −1: none
  int first = 0;  ///< vertex where the face starts
  int last = 0;   ///< vertex where it ends
  CoreEdge line;  ///< from the first vertex to the last
};

/// The face that contains an edge, given as Edge(edge), which must have a length.
CoreFace FaceOfEdge(const ConvexCore& core, int edge, const CoreEdge& line);

/// The face at a vertex whose outward normal is closest to −`direction`; its edge is −1 where the
/// core has no face.
CoreFace FaceAgainst(const ConvexCore& core, int vertex, const Vector2<double>& direction);

}  // namespace tangible::internal
