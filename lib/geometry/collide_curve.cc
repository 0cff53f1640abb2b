// SPDX-License-Identifier: Apache-2.0
//
// The features of a spline and vertices of another shape. All places are in the spline's frame.

#include <algorithm>
#include <cmath>

#include "tangible/geometry/collide_core.h"
#include "tangible/geometry/curve.h"
#include "tangible/geometry/spline_inl.h"
#include "tangible/math/scalar.h"

namespace tangible::internal {
namespace {

// Calls a function for each minimum.
template <typename Function>
class Calling : public Curve::Visitor {
 public:
  explicit Calling(const Function& function) : function_(function) {}
  void Visit(const Curve::Minimum& minimum) override { function_(minimum); }

 private:
  const Function& function_;
};

// Of the minima within reach the nearest one, and the two that are nearest on the free side.
struct Near {
  double distance = kInfinity;
  bool is_in_solid = false;
  Curve::Minimum nearest, free[2];
  int count = 0;

  void Take(const Curve::Minimum& minimum) {
    if (std::abs(minimum.side) < distance) {
      distance = std::abs(minimum.side);
      nearest = minimum;
      is_in_solid = minimum.side < -kFlushStep;
    }
    if (minimum.side < -kFlushStep || (count == 2 && !(minimum.height < free[1].height))) return;
    if (count < 2) ++count;
    free[count - 1] = minimum;
    if (count == 2 && free[1].height < free[0].height) std::swap(free[0], free[1]);
  }
  void TakeEnd(double of_end) {
    if (!(of_end < distance)) return;
    distance = of_end;
    is_in_solid = false;
  }
};

class CurvePair {
 public:
  CurvePair(const PlacedCurve& placed, const PlacedVertices& vertices, SeamSide side)
      : curve_(placed.curve),
        pose_(placed.pose),
        vertices_(vertices),
        is_first_(side == SeamSide::kFirst),
        radius_(CoreRadius(vertices.shape)) {}

  int Find(double max_gap, ContactFeature features[2]) {
    for (int i = 0; i < vertices_.count; ++i) FindOf(vertices_.first + i, max_gap);
    return WriteCandidates(found_, count_, max_gap, features);
  }

  double Distance(ContactFeature* feature) {
    double best = kInfinity;
    for (int i = 0; i < vertices_.count; ++i) {
      const int vertex = vertices_.first + i;
      const SplineFoot foot = FootOver(vertices_.shape, vertices_.pose, vertex, pose_);
      const Curve::Nearest nearest = curve_.FindNearest(foot.point);
      const double distance = nearest.distance - radius_ - std::max(foot.axes[0], foot.axes[1]);
      if (distance >= best) continue;
      best = distance;
      *feature = OnCurve(nearest.minimum.place, vertex);
    }
    return best;
  }

 private:
  ContactFeature OnCurve(int place, int vertex) const {
    ContactFeature feature = is_first_ ? ContactFeature{FeatureKind::kEdgeVertex, place, vertex}
                                       : ContactFeature{FeatureKind::kVertexEdge, vertex, place};
    feature.places = curve_.num_places();
    return feature;
  }

  // Of all candidates the two nearest are kept.
  void Add(const ContactFeature& feature, double gap) {
    if (count_ == 2 && !(gap < found_[1].gap)) return;
    if (count_ < 2) ++count_;
    found_[count_ - 1] = {feature, gap};
    if (count_ == 2 && found_[1].gap < found_[0].gap) std::swap(found_[0], found_[1]);
  }

  void FindOf(int vertex, double max_gap) {
    const SplineFoot foot = FootOver(vertices_.shape, vertices_.pose, vertex, pose_);
    const double axis = std::max(foot.axes[0], foot.axes[1]);
    double reach = max_gap + radius_;
    if (!std::isfinite(max_gap)) reach = curve_.FindNearest(foot.point).distance + radius_ + axis;
    // The nearest minimum within reach is the nearest of all.
    Near near;
    const auto take = [&](const Curve::Minimum& minimum) { near.Take(minimum); };
    Calling visitor(take);
    curve_.ForEachMinimum(foot, reach, &visitor);
    for (const Curve::End end : {Curve::End::kFirst, Curve::End::kLast}) {
      if (!curve_.is_closed()) near.TakeEnd((foot.point - curve_.AtEnd(end).place).norm());
    }
    if (near.distance > reach + axis) return FindDeep(vertex, foot, max_gap);
    if (near.is_in_solid) {
      return Add(OnCurve(near.nearest.place, vertex), near.nearest.height - radius_);
    }
    for (int i = 0; i < near.count; ++i) {
      Add(OnCurve(near.free[i].place, vertex), near.free[i].height - radius_);
    }
    if (curve_.is_closed()) return;
    for (const Curve::End end : {Curve::End::kFirst, Curve::End::kLast}) TryEnd(vertex, foot, end);
  }

  // What is far from the curve has a contact only if it is in the solid.
  void FindDeep(int vertex, const SplineFoot& foot, double max_gap) {
    if (!std::isfinite(max_gap)) return;
    const Curve::Nearest nearest = curve_.FindNearest(foot.point);
    if (nearest.is_end || !(nearest.minimum.height < 0.0)) return;
    if (foot.axes[0] > 0.0) return FindDeepest(vertex, foot, nearest);
    Add(OnCurve(nearest.minimum.place, vertex), nearest.minimum.height - radius_);
  }

  // An ellipse whose centre is in the solid: the minimum of its own distance nearest to that of the
  // centre.
  void FindDeepest(int vertex, const SplineFoot& foot, const Curve::Nearest& nearest) {
    const double reach = nearest.distance + std::max(foot.axes[0], foot.axes[1]);
    Curve::Minimum best = nearest.minimum;
    best.height = -kInfinity;
    const auto take = [&](const Curve::Minimum& minimum) {
      if (minimum.side < 0.0 && minimum.height > best.height) best = minimum;
    };
    Calling visitor(take);
    curve_.ForEachMinimum(foot, reach, &visitor);
    if (std::isfinite(best.height)) Add(OnCurve(best.place, vertex), best.height);
  }

  // The corner at an end: where F says that the curve would go on to come nearer, on the free side.
  void TryEnd(int vertex, const SplineFoot& foot, Curve::End end) {
    const SplineAt<double> at = curve_.AtEnd(end);
    const double sign = end == Curve::End::kFirst ? -1.0 : 1.0;
    const Vector2<double> tangent = at.rate / at.rate.norm();
    const Vector2<double> normal(tangent.y(), -tangent.x());
    const int corner = end == Curve::End::kFirst ? 0 : curve_.num_pieces();
    const ContactFeature feature = is_first_
                                       ? ContactFeature{FeatureKind::kVertexVertex, corner, vertex}
                                       : ContactFeature{FeatureKind::kVertexVertex, vertex, corner};
    const Vector2<double> apart = foot.point - at.place;
    const double distance = apart.norm();
    if (!(distance > 0.0)) return;
    if (foot.axes[0] > 0.0) {
      const Vector2<double> place = pose_ * at.place;
      const double point[2] = {0.0, 0.0};
      const ContactGeometry<double> contact = EvaluateContact(
          ContactFeature{}, vertices_.shape, vertices_.pose,
          ShapeView<double>{ShapeType::kPolygon, point, 2}, Pose<double>(place, 0.0));
      const Vector2<double> n = pose_.rotation.Inverse(contact.normal);
      if (sign * tangent.dot(n) > 0.0 && normal.dot(n) >= 0.0) Add(feature, contact.gap);
      return;
    }
    double slope, height;
    const double f = foot.At(at, &slope, &height);
    const bool is_beyond = end == Curve::End::kFirst ? f < 0.0 : f >= 0.0;
    if (is_beyond && height >= 0.0) Add(feature, distance - radius_);
  }

  const Curve& curve_;
  const Pose<double>& pose_;
  const PlacedVertices& vertices_;
  const bool is_first_;
  const double radius_;
  Candidate found_[2];
  int count_ = 0;
};

}  // namespace
}  // namespace tangible::internal

namespace tangible {

int FindCurveFeatures(const PlacedCurve& curve, const PlacedVertices& vertices, SeamSide side,
                      double max_gap, ContactFeature features[2]) {
  return internal::CurvePair(curve, vertices, side).Find(max_gap, features);
}

double DistanceOfCurve(const PlacedCurve& curve, const PlacedVertices& vertices, SeamSide side,
                       ContactFeature* nearest) {
  return internal::CurvePair(curve, vertices, side).Distance(nearest);
}

}  // namespace tangible
