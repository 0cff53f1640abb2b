// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Seams: where shapes that do not move relative to each other touch, such as the flush tiles of a
// floor. What is inside of their union is no surface, so that some features of a shape are no
// contacts.
//
// A contact has a normal n, from the shape T to the body that touches it, at a point x of T.
//   1. Of an edge, the part whose points x + ε n lie in a neighbour is hidden.
//   2. A vertex v within a neighbour U is a contact only with a normal that both leave free,
//          n ∈ N_T(v) ∩ N_U(v),
//      where N(v) is the cone between the normals of the edges at v, the normal alone within an
//      edge, and empty inside. At a flush seam the cone is one direction, which the edges have, so
//      that there is neither a corner nor an end of a face. Where the union is concave it is empty.
// A point counts as in a neighbour where it is at most kFlushStep outside, so that a step of that
// height counts as flush. All places are in the frame of T. Of an outline (outline.h) the edges are
// its runs and the vertices their starts, and the end of an open line; behind a run of a line
// everything is solid, and at an end its cone is that of its corner.

#include <algorithm>
#include <vector>

#include "tangible/geometry/collide.h"
#include "tangible/geometry/tolerances.h"
#include "tangible/math/planar.h"
#include "tangible/math/scalar.h"

namespace tangible {

class Outline;

struct SeamVertex {
  bool is_bounded = false;  ///< a neighbour contains it
  bool is_open = true;      ///< contacts with a normal of the cone exist
  /// The cone, counter-clockwise; without neighbours that of the shape.
  Vector2<double> first{0.0, 0.0}, last{0.0, 0.0};
  /// M: how far the edges reach beyond a bounded vertex: to the neighbour, and by rounding, so that
  /// each place has an owner. Where it has two, one of the contacts acts (seam_contacts.h).
  double beyond = 0.0;

  /// Whether a contact with this normal exists at the vertex.
  bool Allows(const Vector2<double>& normal) const {
    return is_open && Cross(first, normal) >= -kFlushTurn && Cross(normal, last) >= -kFlushTurn &&
           normal.dot(first + last) > 0.0;
  }
};

/// From the edge's start, m.
struct FreePart {
  double from, to;
};

struct SeamEdge {
  Vector2<double> start{0.0, 0.0}, tangent{0.0, 0.0}, normal{0.0, 0.0};
  double length = 0.0;
  bool is_whole = true;         ///< nothing of it is hidden
  std::vector<FreePart> parts;  ///< that are not hidden, where it is not whole

  /// Whether something between two places of the edge is not hidden.
  bool IsFree(double low, double high) const {
    const auto is_over = [&](const FreePart& part) {
      return high >= (part.from > 0.0 ? part.from : -kInfinity) &&
             low <= (part.to < length ? part.to : kInfinity);
    };
    return is_whole || std::any_of(parts.begin(), parts.end(), is_over);
  }
  bool IsHidden() const { return !is_whole && parts.empty(); }
};

/// What the neighbours of a polygon, box or outline leave of it; vertex i is the start of edge i.
struct ShapeSeams {
  std::vector<SeamVertex> vertices;
  std::vector<SeamEdge> edges;
};

/// A shape at rest, or one of several that move alike.
struct PlacedShape {
  ShapeView<double> shape;
  Pose<double> pose;
  const Outline* outline = nullptr;  ///< of a polyline or a concave polygon
};

/// Whether a shape may be part of a seam: a box, polygon or half-plane with an area, or a polyline.
bool MayHaveSeams(const ShapeView<double>& shape);

/// The steps that count as flush.
struct FlushSteps {
  int count = 0;
  double highest = 0.0;  ///< m
};

/// Sets what the neighbours leave of a box, polygon or outline, and returns whether they take
/// anything. Adds the steps down from it that exceed rounding to `steps`.
bool FindSeams(const PlacedShape& placed, const std::vector<PlacedShape>& neighbours,
               ShapeSeams* seams, FlushSteps* steps);

/// Says which shape of a pair has seams.
enum class SeamSide { kFirst, kSecond };

/// FindContactFeatures for a pair of which one shape has seams. Where nothing that is hidden is
/// nearest the result is the same.
int FindContactFeaturesAtSeams(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                               const ShapeView<double>& shape_b, const Pose<double>& pose_b,
                               const ShapeSeams& seams, SeamSide side, double max_gap,
                               ContactFeature features[2]);

}  // namespace tangible
