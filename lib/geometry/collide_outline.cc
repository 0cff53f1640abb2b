// SPDX-License-Identifier: Apache-2.0
//
// The features of a run of an outline and another shape, B. All places are in the outline's frame.

#include "tangible/geometry/collide_outline.h"

#include <algorithm>
#include <cmath>

#include "tangible/geometry/collide_core.h"
#include "tangible/geometry/ellipse_inl.h"
#include "tangible/geometry/mass_properties.h"
#include "tangible/geometry/outline.h"
#include "tangible/geometry/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible::internal {
namespace {

class OutlinePair {
 public:
  OutlinePair(const Outline& outline, int run, const ShapeView<double>& other,
              const Pose<double>& pose, SeamSide side, const ShapeSeams* seams)
      : outline_(outline),
        run_(run),
        of_(outline.run(run)),
        is_first_(side == SeamSide::kFirst),
        is_ellipse_(other.type == ShapeType::kEllipse),
        shape_(other),
        pose_(pose),
        seams_(seams),
        other_(other, pose, Vector2<double>(0.0, 0.0)) {}

  int Find(double max_gap, ContactFeature features[2]) {
    FindOnRun();
    if (of_.before == OutlineJoint::kEnd || of_.before == OutlineJoint::kConvex) TryStart();
    if (of_.after == OutlineJoint::kEnd) TryEnd();
    std::sort(found_, found_ + count_,
              [](const Candidate& x, const Candidate& y) { return x.gap < y.gap; });
    return WriteCandidates(found_, std::min(count_, 2), max_gap, features);
  }

 private:
  ContactFeature OnEdge(int edge, int vertex) const {
    return is_first_ ? ContactFeature{FeatureKind::kEdgeVertex, edge, vertex}
                     : ContactFeature{FeatureKind::kVertexEdge, vertex, edge};
  }
  ContactFeature OnCorner(int corner, int vertex) const {
    return is_first_ ? ContactFeature{FeatureKind::kVertexVertex, corner, vertex}
                     : ContactFeature{FeatureKind::kVertexVertex, vertex, corner};
  }
  ContactFeature CornerOnEdge(int corner, int edge) const {
    return is_first_ ? ContactFeature{FeatureKind::kVertexEdge, corner, edge}
                     : ContactFeature{FeatureKind::kEdgeVertex, edge, corner};
  }
  /// The point of B over the run: a vertex, or the lowest point of an ellipse.
  Vector2<double> PointAt(int vertex) const {
    return is_ellipse_
               ? Vector2<double>(pose_.position +
                                 SupportOf(shape_, pose_, 0, Vector2<double>(-of_.normal)).arm)
               : other_.VertexAt(vertex);
  }
  double HeightOf(const Vector2<double>& x) const { return of_.normal.dot(x - of_.start); }
  /// Whether neighbours of B leave a vertex of it free towards a direction of the outline's frame.
  bool IsFree(int vertex, const Vector2<double>& direction) const {
    return seams_ == nullptr || !seams_->vertices[vertex].is_bounded ||
           seams_->vertices[vertex].Allows(pose_.rotation.Inverse(direction));
  }
  /// Whether they leave an edge of it free at a foot.
  bool IsFreeAt(int edge, double s) const {
    return seams_ == nullptr || seams_->edges[edge].IsFree(s, s);
  }
  void Add(const ContactFeature& feature, double gap) { found_[count_++] = {feature, gap}; }

  void FindOnRun() {
    double lowest = kInfinity;
    int at = -1;
    for (int i = 0; i < other_.Size(); ++i) {
      const Vector2<double> x = PointAt(i);
      const double height = HeightOf(x);
      if (height < lowest && IsOverRun(i, x) && IsFree(i, -of_.normal) && FacesRun(i, of_.normal)) {
        lowest = height;
        at = i;
      }
    }
    if (at < 0) return;
    AddOnRun(at, lowest);
    int second = -1;
    for (const int i : {other_.Next(at), other_.Previous(at)}) {
      const Vector2<double> x = other_.VertexAt(i);
      if (i != at && (second < 0 || HeightOf(x) < HeightOf(other_.VertexAt(second))) &&
          x != other_.VertexAt(at) && IsOverRun(i, x) && IsFree(i, -of_.normal)) {
        second = i;
      }
    }
    if (second >= 0) AddOnRun(second, HeightOf(other_.VertexAt(second)));
  }

  /// Whether a vertex of B is the lowest one, or belongs to a face that is nearly parallel to the
  /// run. The end of a face that slides on past a corner is over the other edge of that corner too,
  /// up to rounding, and would be stopped by it.
  bool FacesRun(int vertex, const Vector2<double>& normal) const {
    if (is_ellipse_ || other_.Size() < 2) return true;
    const auto rise = [&](int to) {
      return normal.dot(other_.VertexAt(to) - other_.VertexAt(vertex));
    };
    const int edges[2] = {vertex, other_.Previous(vertex)};
    return (rise(other_.Next(vertex)) >= 0.0 && rise(other_.Previous(vertex)) >= 0.0) ||
           std::any_of(edges, edges + 2, [&](int edge) {
             const CoreEdge line = other_.Edge(edge);
             return line.length > 0.0 && -line.Normal().dot(normal) > kFacing;
           });
  }

  bool IsOverRun(int vertex, const Vector2<double>& x) const {
    const bool is_corner = !is_ellipse_ && other_.Size() > 1;
    return IsOverOrBehind(outline_, run_, x, [&](const Vector2<double>& normal) {
      return !is_corner || FacesRun(vertex, normal);
    });
  }

  void AddOnRun(int vertex, double height) {
    const double s = of_.tangent.dot(PointAt(vertex) - of_.start);
    foot_[count_] = s;
    Add(OnEdge(outline_.EdgeAt(run_, s), vertex), height - other_.Radius());
    num_on_run_ = count_;
  }

  void TryStart() {
    const SeamVertex* const bound = outline_.BoundedStart(run_);
    if (bound != nullptr && !bound->is_open) return;
    const int previous = of_.before == OutlineJoint::kConvex ? outline_.Previous(run_) : -1;
    const NormalCone cone =
        BoundedCone({previous >= 0 ? outline_.run(previous).normal : Vector2<double>(-of_.tangent),
                     of_.normal, false, previous >= 0},
                    bound);
    Try(of_.first, of_.start, cone, 0.0, [&](const Vector2<double>& x) {
      const bool is_beyond = of_.tangent.dot(x - of_.start) < 0.0 && HeightOf(x) >= 0.0;
      return !outline_.IsAfterStart(run_, x) &&
             (previous >= 0 ? !outline_.IsBeforeEnd(previous, x) : is_beyond);
    });
  }

  void TryEnd() {
    const SeamVertex* const bound = outline_.BoundedEnd(run_);
    if (bound != nullptr && !bound->is_open) return;
    const Vector2<double> end = outline_.EndPlace(run_);
    Try(of_.last + 1, end, BoundedCone({of_.normal, of_.tangent, false, true, false}, bound),
        of_.length, [&](const Vector2<double>& x) {
          return !outline_.IsBeforeEnd(run_, x) && HeightOf(x) >= 0.0;
        });
  }

  /// Adds the contact of the corner v with B. `is_beyond` says whether a point is in the cone: the
  /// same tests as those of the runs, so that rounding leaves out none and takes none twice.
  template <typename IsBeyond>
  void Try(int corner, const Vector2<double>& v, const NormalCone& cone, double foot,
           const IsBeyond& is_beyond) {
    if (is_ellipse_) return TryEllipse(corner, v, cone);
    if (other_.Size() > 1 && TryFaces(corner, v, cone, foot)) return;
    int nearest = -1;
    double best = kInfinity;
    for (int j = 0; j < other_.Size(); ++j) {
      const double square = (other_.VertexAt(j) - v).squaredNorm();
      if (square < best) {
        best = square;
        nearest = j;
      }
    }
    if (nearest >= 0 && best > 0.0 && is_beyond(other_.VertexAt(nearest)) &&
        (!cone.is_bounded || cone.Contains((other_.VertexAt(nearest) - v).normalized())) &&
        IsFree(nearest, v - other_.VertexAt(nearest))) {
      Add(OnCorner(corner, nearest), std::sqrt(best) - other_.Radius());
    }
  }

  /// The corner against the face of B that separates them best. Where it is in B, it is the best
  /// one whose normal the corner has. False where the vertices of B are nearer.
  bool TryFaces(int corner, const Vector2<double>& v, const NormalCone& cone, double foot) {
    int edge = -1, allowed = -1;
    double height = -kInfinity, of_allowed = -kInfinity;
    for (int i = 0; i < other_.Size(); ++i) {
      const CoreEdge line = other_.Edge(i);
      if (!(line.length > 0.0)) continue;
      const double own = line.Height(v);
      if (own > height) {
        height = own;
        edge = i;
      }
      if (own > of_allowed && cone.Faces(-line.Normal()) && IsOverFace(i, line, v)) {
        of_allowed = own;
        allowed = i;
      }
    }
    if (edge < 0) return false;
    const CoreEdge best = other_.Edge(edge);
    if (height >= 0.0 && !IsFreeAt(edge, best.tangent.dot(v - best.start))) return false;
    const bool is_inside = height < 0.0 && other_.Size() > 2;
    if (!is_inside && edge != allowed) return IsOverFace(edge, best, v);
    if (allowed >= 0 && !IsTaken(foot, other_.Edge(allowed)) && !IsTakenBefore(v, allowed)) {
      Add(CornerOnEdge(corner, allowed), of_allowed - other_.Radius());
    }
    return true;
  }

  bool IsOverFace(int edge, const CoreEdge& line, const Vector2<double>& v) const {
    const double s = line.tangent.dot(v - line.start);
    const auto room = [&](int vertex) {
      return seams_ != nullptr && seams_->vertices[vertex].is_bounded
                 ? seams_->vertices[vertex].beyond
                 : kLengthRounding * line.length;
    };
    return s >= -room(edge) && s <= line.length + room(other_.Next(edge)) && IsFreeAt(edge, s);
  }
  /// Whether a vertex of B's face above the corner is a contact already. A face that faces the edge
  /// that ends at the corner has none on this one.
  bool IsTaken(double foot, const CoreEdge& line) const {
    if (-line.Normal().dot(of_.normal) <= kFacing) return false;
    return std::any_of(foot_, foot_ + num_on_run_, [&](double s) {
      return std::abs(s - foot) <= kLengthRounding * (of_.length + line.length);
    });
  }

  /// Whether a vertex of B's face above the corner is a contact of the run that ends there.
  bool IsTakenBefore(const Vector2<double>& v, int edge) const {
    const int previous = of_.before == OutlineJoint::kConvex ? outline_.Previous(run_) : -1;
    if (previous < 0) return false;
    const OutlineRun& before = outline_.run(previous);
    const CoreEdge line = other_.Edge(edge);
    const double room = kLengthRounding * (before.length + line.length);
    if (-line.Normal().dot(before.normal) <= kFacing) return false;
    const int ends[2] = {edge, other_.Next(edge)};
    return std::any_of(ends, ends + 2, [&](int i) {
      const Vector2<double> x = other_.VertexAt(i);
      return std::abs(before.tangent.dot(x - v)) <= room && outline_.IsOver(previous, x);
    });
  }

  void TryEllipse(int corner, const Vector2<double>& v, const NormalCone& cone) {
    const double point[2] = {v.x(), v.y()};
    const ShapeView<double> of_corner{ShapeType::kPolygon, point, 2};
    const ContactGeometry<double> contact = EvaluateContact(
        ContactFeature{}, shape_, pose_, of_corner, Pose<double>(Vector2<double>(0.0, 0.0), 0.0));
    const Vector2<double>& n = contact.normal;
    if (Cross(cone.first, n) > 0.0 && Cross(n, cone.last) > 0.0 &&
        n.dot(cone.first + cone.last) > 0.0) {
      Add(OnCorner(corner, 0), contact.gap);
    }
  }

  const Outline& outline_;
  const int run_;
  const OutlineRun& of_;
  const bool is_first_, is_ellipse_;
  const ShapeView<double>& shape_;
  const Pose<double>& pose_;
  const ShapeSeams* const seams_;  ///< of B, or null
  const ConvexCore other_;
  Candidate found_[4];
  double foot_[2] = {0.0, 0.0};  ///< of the contacts on the run
  int count_ = 0, num_on_run_ = 0;
};

}  // namespace

Vector2<double> NearerNormal(const Outline& outline, int run, const Vector2<double>& x) {
  Vector2<double> none(0.0, 0.0);
  const OutlineRun& of = outline.run(run);
  const double s = of.tangent.dot(x - of.start);
  const double depth = -of.normal.dot(x - of.start);
  const bool is_shallow = depth > 0.0 && depth <= kBehindFace * of.length;
  if (!is_shallow || s < 0.0 || s > of.length || outline.HasSeams()) return none;
  const bool is_after = outline.IsAfterStart(run, x);
  if (is_after == outline.IsBeforeEnd(run, x)) return none;
  const OutlineJoint joint = is_after ? of.after : of.before;
  if (joint == OutlineJoint::kEnd) return is_after ? of.tangent : Vector2<double>(-of.tangent);
  if (joint != OutlineJoint::kConvex) return none;
  return outline.run(is_after ? outline.Next(run) : outline.Previous(run)).normal;
}

}  // namespace tangible::internal

namespace tangible {

int FindOutlineFeatures(const Outline& outline, int run, const ShapeView<double>& shape_a,
                        const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                        const Pose<double>& pose_b, SeamSide side, const ShapeSeams* seams,
                        double max_gap, ContactFeature features[2]) {
  const bool is_first = side == SeamSide::kFirst;
  const ShapeView<double>& other = is_first ? shape_b : shape_a;
  const Pose<double> relative =
      internal::RelativeTo(is_first ? pose_a : pose_b, is_first ? pose_b : pose_a);
  return internal::OutlinePair(outline, run, other, relative, side, seams).Find(max_gap, features);
}

int FindPlaneFeature(const Outline& outline, int run, const ShapeView<double>& plane,
                     const Pose<double>& pose_a, const Pose<double>& pose_b, SeamSide side,
                     double max_gap, ContactFeature features[2]) {
  const bool is_first = side == SeamSide::kFirst;
  const OutlineRun& of = outline.run(run);
  if (of.before != OutlineJoint::kConvex) return 0;
  const Vector2<double> normal(plane.numbers[0], plane.numbers[1]);
  const Vector2<double> down =
      (is_first ? pose_b : pose_a).rotation * Vector2<double>(-normal / normal.norm());
  const internal::NormalCone cone{outline.run(outline.Previous(run)).normal, of.normal};
  if (!cone.Faces((is_first ? pose_a : pose_b).rotation.Inverse(down))) return 0;
  const double point[2] = {of.start.x(), of.start.y()};
  const ShapeView<double> corner{ShapeType::kPolygon, point, 2};
  const int count = FindContactFeatures(is_first ? corner : plane, pose_a,
                                        is_first ? plane : corner, pose_b, max_gap, features);
  for (int k = 0; k < count; ++k) (is_first ? features[k].a : features[k].b) = of.first;
  return count;
}

double DistanceOfRun(const Outline& outline, int run, const Pose<double>& pose,
                     const ShapeView<double>& shape, const Pose<double>& shape_pose, int* corner,
                     int* vertex) {
  const OutlineRun& of = outline.run(run);
  const Pose<double> relative = internal::RelativeTo(pose, shape_pose);
  const internal::ConvexCore core(shape, relative, Vector2<double>(0.0, 0.0));
  const Vector2<double> ends[2] = {of.start, outline.EndPlace(run)};
  double best = kInfinity;
  double nearest = kInfinity;
  bool crosses = false;
  int sides[2] = {0, 0};  // of the core's edges, on whose left the run's start is, or the right
  for (int j = 0; j < core.Size(); ++j) {
    const Vector2<double> x = core.VertexAt(j);
    best = std::min(best, internal::DistanceOfSegment(ends[0], ends[1], x));
    for (int k = 0; k < 2; ++k) {
      const double square = (x - ends[k]).squaredNorm();
      if (square < nearest) {
        nearest = square;
        *corner = k == 0 ? of.first : outline.EndOf(run);
        *vertex = j;
      }
    }
    if (core.Size() > 1) {
      const Vector2<double> next = core.VertexAt(core.Next(j));
      for (const Vector2<double>& end : ends) {
        best = std::min(best, internal::DistanceOfSegment(x, next, end));
      }
      crosses = crosses || internal::SegmentsCross(ends[0], ends[1], x, next);
      ++sides[Cross(Vector2<double>(next - x), Vector2<double>(ends[0] - x)) > 0.0 ? 0 : 1];
    }
  }
  // Within the core the run's start is on the same side of all its edges.
  if (crosses || (core.Size() > 2 && (sides[0] == 0 || sides[1] == 0))) best = 0.0;
  const double radius =
      shape.type == ShapeType::kEllipse ? BoundingRadius(shape) : CoreRadius(shape);
  return best - radius;
}

bool IsInSolidBehind(const Outline& outline, int run, const Pose<double>& pose,
                     const ShapeView<double>& shape, const Pose<double>& shape_pose,
                     double margin) {
  if (!outline.IsPolygon()) return false;
  const OutlineRun& of = outline.run(run);
  const Pose<double> relative = internal::RelativeTo(pose, shape_pose);
  const internal::ConvexCore core(shape, relative, Vector2<double>(0.0, 0.0));
  const double radius = CoreRadius(shape);
  for (int j = 0; j < core.Size(); ++j) {
    const Vector2<double> lowest = core.VertexAt(j) - radius * of.normal;
    const double along = of.tangent.dot(lowest - of.start);
    const bool is_behind = of.normal.dot(lowest - of.start) < -margin;
    if (is_behind && along > 0.0 && along < of.length && outline.Contains(lowest)) return true;
  }
  return false;
}

}  // namespace tangible
