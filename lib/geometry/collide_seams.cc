// SPDX-License-Identifier: Apache-2.0
//
// The features of a pair of which one shape, T, has seams; B is the other one.
//
// The features found without the seams stand where all of them are contacts. Otherwise the
// directions in which the two may be apart are tried, the normals of the edges of both, and the one
// with the largest separation that has a contact is taken. A round point of B (a circle or an
// ellipse) has the nearest feature of T that is a contact.

#include <algorithm>
#include <cmath>

#include "tangible/geometry/collide_core.h"
#include "tangible/geometry/seams.h"
#include "tangible/geometry/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible::internal {
namespace {

class SeamPair {
 public:
  SeamPair(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
           const ShapeView<double>& shape_b, const Pose<double>& pose_b, const ShapeSeams& seams,
           SeamSide side)
      : shape_a_(shape_a),
        pose_a_(pose_a),
        shape_b_(shape_b),
        pose_b_(pose_b),
        seams_(seams),
        is_first_(side == SeamSide::kFirst),
        frame_(is_first_ ? pose_a : pose_b),
        other_(is_first_ ? shape_b : shape_a, is_first_ ? pose_b : pose_a, frame_.position),
        tiled_(is_first_ ? shape_a : shape_b, frame_, frame_.position),
        is_round_(NumVertices(OtherShape().type, OtherShape().num_numbers) == 1 &&
                  OtherShape().type != ShapeType::kPolygon),
        is_plane_(OtherShape().type == ShapeType::kHalfPlane) {}

  /// Whether a feature found without the seams is a contact, whatever the others are.
  bool Stands(const ContactFeature& feature) const {
    const int on_tiled = is_first_ ? feature.a : feature.b;
    const bool of_edge =
        feature.kind == (is_first_ ? FeatureKind::kEdgeVertex : FeatureKind::kVertexEdge);
    if (!of_edge) {
      return !seams_.vertices[on_tiled].is_bounded ||
             (!is_plane_ && seams_.vertices[on_tiled].Allows(NormalOf(feature)));
    }
    const SeamEdge& edge = seams_.edges[on_tiled];
    const SeamVertex& start = seams_.vertices[on_tiled];
    const SeamVertex& end = seams_.vertices[tiled_.Next(on_tiled)];
    if (edge.is_whole && !start.is_bounded && !end.is_bounded) {
      return true;
    }
    const double along = AlongEdge(on_tiled, feature);
    return (!start.is_bounded || along >= -start.beyond) &&
           (!end.is_bounded || along <= edge.length + end.beyond) && edge.IsFree(along, along);
  }

  int Find(double max_gap, ContactFeature features[2]) {
    if (is_plane_) {
      return 0;
    }
    max_gap_ = max_gap;
    if (is_round_) {
      FindOfRound();
    } else {
      FindOfCore();
    }
    return WriteCandidates(best_, count_, max_gap, features);
  }

 private:
  const ShapeView<double>& OtherShape() const { return is_first_ ? shape_b_ : shape_a_; }
  ContactGeometry<double> Evaluate(const ContactFeature& feature) const {
    return EvaluateContact(feature, shape_a_, pose_a_, shape_b_, pose_b_);
  }
  /// From T to B, in the frame of T.
  Vector2<double> OutOfTiled(const ContactGeometry<double>& contact) const {
    return frame_.rotation.Inverse(Vector2<double>(is_first_ ? -contact.normal : contact.normal));
  }
  Vector2<double> NormalOf(const ContactFeature& feature) const {
    return OutOfTiled(Evaluate(feature));
  }
  double AlongEdge(int edge, const ContactFeature& feature) const {
    const SeamEdge& of = seams_.edges[edge];
    return of.tangent.dot(frame_.Inverse(Evaluate(feature).point) - of.start);
  }
  ContactFeature OnEdge(int edge, int vertex) const {
    return is_first_ ? ContactFeature{FeatureKind::kEdgeVertex, edge, vertex}
                     : ContactFeature{FeatureKind::kVertexEdge, vertex, edge};
  }
  ContactFeature OnVertex(int vertex, int other) const {
    return is_first_ ? ContactFeature{FeatureKind::kVertexVertex, vertex, other}
                     : ContactFeature{FeatureKind::kVertexVertex, other, vertex};
  }
  ContactFeature OnOther(int vertex, int edge) const {
    return is_first_ ? ContactFeature{FeatureKind::kVertexEdge, vertex, edge}
                     : ContactFeature{FeatureKind::kEdgeVertex, edge, vertex};
  }

  /// How far an edge of T reaches beyond a vertex.
  double Reach(int vertex, double length) const {
    const SeamVertex& at = seams_.vertices[vertex];
    return at.is_bounded ? at.beyond : kLengthRounding * length;
  }
  bool IsOver(int edge, double along) const {
    const double length = seams_.edges[edge].length;
    return along >= -Reach(edge, length) && along <= length + Reach(tiled_.Next(edge), length);
  }
  /// Whether a point is in a core, up to the flush step.
  static bool IsInside(const ConvexCore& core, const Vector2<double>& point) {
    if (core.Size() < 3) {
      return false;
    }
    for (int i = 0; i < core.Size(); ++i) {
      const CoreEdge edge = core.Edge(i);
      if (edge.length > 0.0 && edge.Height(point) > 2.0 * kFlushStep) {
        return false;
      }
    }
    return true;
  }

  void FindOfRound();
  void FindOfCore();
  void TryEdgeOfTiled(int edge);
  void TryEdgeOfOther(int edge);
  void AddEnds(const CoreFace& on_tiled, const CoreFace& on_other);
  void AddOnEdge(int edge, int vertex, double low, double high);
  void AddOnOther(const CoreFace& face, int vertex);
  void Keep(double separation);

  const ShapeView<double>& shape_a_;
  const Pose<double>& pose_a_;
  const ShapeView<double>& shape_b_;
  const Pose<double>& pose_b_;
  const ShapeSeams& seams_;
  const bool is_first_;  ///< T is the first shape
  const Pose<double>& frame_;
  const ConvexCore other_, tiled_;
  const bool is_round_, is_plane_;
  double max_gap_ = 0.0;
  Candidate found_[2], best_[2];
  int num_found_ = 0, count_ = 0;
  double separation_ = -kInfinity;
};

void SeamPair::FindOfRound() {
  const auto take = [&](const Candidate& candidate) {
    if (count_ == 0 || candidate.gap > best_[0].gap) {
      best_[0] = candidate;
      count_ = 1;
    }
  };
  const double radius = CoreRadius(OtherShape());
  for (int i = 0; i < tiled_.Size(); ++i) {
    const SeamEdge& edge = seams_.edges[i];
    const ContactFeature feature = OnEdge(i, 0);
    const double along = AlongEdge(i, feature);
    const double gap = Evaluate(feature).gap;
    const bool is_apart = gap + radius >= 0.0;
    if (IsOver(i, along) && edge.IsFree(along, along) &&
        (is_apart || IsInside(tiled_, other_.VertexAt(0)))) {
      take({feature, gap});
    }
  }
  for (int i = 0; i < tiled_.Size(); ++i) {
    const ContactFeature feature = OnVertex(i, 0);
    const ContactGeometry<double> contact = Evaluate(feature);
    if (contact.gap + radius > 0.0 && seams_.vertices[i].Allows(OutOfTiled(contact))) {
      take({feature, contact.gap});
    }
  }
}

/// A vertex of B on an edge of T; B's face lies over the edge from `low` to `high`.
void SeamPair::AddOnEdge(int edge, int vertex, double low, double high) {
  const CoreEdge line = tiled_.Edge(edge);
  const Vector2<double> point = other_.VertexAt(vertex);
  const double height = line.Height(point);
  if (seams_.edges[edge].IsFree(low, high) &&
      (height >= -2.0 * kFlushStep || IsInside(tiled_, point))) {
    found_[num_found_++] = {OnEdge(edge, vertex), height - other_.Radius()};
  }
}

/// A vertex of T on a face of B, where it is a contact with the face's normal.
void SeamPair::AddOnOther(const CoreFace& face, int vertex) {
  const Vector2<double> point = tiled_.VertexAt(vertex);
  const double height = face.line.Height(point);
  const Vector2<double> normal = frame_.rotation.Inverse(Vector2<double>(-face.line.Normal()));
  if ((!seams_.vertices[vertex].is_bounded || seams_.vertices[vertex].Allows(normal)) &&
      (height >= -2.0 * kFlushStep || IsInside(other_, point))) {
    found_[num_found_++] = {OnOther(vertex, face.edge), height - other_.Radius()};
  }
}

/// The contacts at the ends of the overlap of two opposing faces: the vertex of B where it is over
/// the face of T, else the vertex of T.
void SeamPair::AddEnds(const CoreFace& on_tiled, const CoreFace& on_other) {
  if (on_tiled.edge < 0 || on_other.edge < 0 ||
      on_tiled.line.tangent.dot(on_other.line.tangent) >= 0.0) {
    return;
  }
  const auto along = [&](int vertex) {
    return on_tiled.line.tangent.dot(other_.VertexAt(vertex) - on_tiled.line.start);
  };
  const double length = on_tiled.line.length;
  const double low = along(on_other.last);
  const double high = along(on_other.first);
  const double before = Reach(on_tiled.first, length);
  const double after = Reach(on_tiled.last, length);
  if (high < -before || low > length + after) {
    return;
  }
  if (low >= -before) {
    AddOnEdge(on_tiled.edge, on_other.last, low, high);
  } else {
    AddOnOther(on_other, on_tiled.first);
  }
  if (high <= length + after) {
    AddOnEdge(on_tiled.edge, on_other.first, low, high);
  } else {
    AddOnOther(on_other, on_tiled.last);
  }
}

/// Keeps the contacts found where the cores are apart by more than in the directions before.
void SeamPair::Keep(double separation) {
  if (num_found_ > 0 && separation > separation_) {
    separation_ = separation;
    count_ = num_found_;
    std::copy_n(found_, num_found_, best_);
  }
}

void SeamPair::TryEdgeOfTiled(int i) {
  const CoreEdge edge = tiled_.Edge(i);
  if (!(edge.length > 0.0) || seams_.edges[i].IsHidden()) {
    return;
  }
  const auto [deepest, separation] = other_.DeepestOver(edge);
  num_found_ = 0;
  AddEnds(FaceOfEdge(tiled_, i, edge), FaceAgainst(other_, deepest, edge.Normal()));
  const double along = edge.tangent.dot(other_.VertexAt(deepest) - edge.start);
  if (num_found_ == 0 && IsOver(i, along)) {
    AddOnEdge(i, deepest, along, along);
  }
  Keep(separation);
}

void SeamPair::TryEdgeOfOther(int i) {
  const CoreEdge edge = other_.Edge(i);
  if (!(edge.length > 0.0)) {
    return;
  }
  const auto [deepest, separation] = tiled_.DeepestOver(edge);
  num_found_ = 0;
  const CoreFace face = FaceOfEdge(other_, i, edge);
  AddEnds(FaceAgainst(tiled_, deepest, edge.Normal()), face);
  const double along = face.line.tangent.dot(tiled_.VertexAt(deepest) - face.line.start);
  const double room = kLengthRounding * face.line.length;
  if (num_found_ == 0 && along >= -room && along <= face.line.length + room) {
    AddOnOther(face, deepest);
  }
  Keep(separation);
}

void SeamPair::FindOfCore() {
  for (int i = 0; i < tiled_.Size(); ++i) {
    TryEdgeOfTiled(i);
  }
  const int num_edges = other_.Size() > 1 ? other_.Size() : 0;
  for (int i = 0; i < num_edges; ++i) {
    TryEdgeOfOther(i);
  }
  // Apart from the faces, two vertices may be nearest.
  for (int i = 0; i < tiled_.Size() && count_ == 0; ++i) {
    for (int j = 0; j < other_.Size(); ++j) {
      const ContactFeature feature = OnVertex(i, j);
      const ContactGeometry<double> contact = Evaluate(feature);
      if (contact.gap + other_.Radius() > 0.0 && contact.gap < max_gap_ &&
          seams_.vertices[i].Allows(OutOfTiled(contact)) &&
          (count_ == 0 || contact.gap < best_[0].gap)) {
        best_[0] = {feature, contact.gap};
        count_ = 1;
      }
    }
  }
}

}  // namespace
}  // namespace tangible::internal

namespace tangible {

int FindContactFeaturesAtSeams(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                               const ShapeView<double>& shape_b, const Pose<double>& pose_b,
                               const ShapeSeams& seams, SeamSide side, double max_gap,
                               ContactFeature features[2]) {
  const int count = FindContactFeatures(shape_a, pose_a, shape_b, pose_b, max_gap, features);
  if (count == 0) {
    return 0;
  }
  internal::SeamPair pair(shape_a, pose_a, shape_b, pose_b, seams, side);
  const bool stand = std::all_of(features, features + count,
                                 [&](const ContactFeature& f) { return pair.Stands(f); });
  return stand ? count : pair.Find(max_gap, features);
}

}  // namespace tangible
