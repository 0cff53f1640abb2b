// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tangible/geometry/spline_inl.h"
#include "tangible/math/scalar.h"

namespace tangible {
namespace {

using internal::kPlacesOfPiece;
using internal::SplineFoot;

void Widen(const Vector2<double>& point, Aabb* box) {
  box->min_x = std::min(box->min_x, point.x());
  box->min_y = std::min(box->min_y, point.y());
  box->max_x = std::max(box->max_x, point.x());
  box->max_y = std::max(box->max_y, point.y());
}

double SquareOfDistance(const Aabb& box, const Vector2<double>& x) {
  const double dx = std::max({box.min_x - x.x(), x.x() - box.max_x, 0.0});
  const double dy = std::max({box.min_y - x.y(), x.y() - box.max_y, 0.0});
  return dx * dx + dy * dy;
}

}  // namespace

Curve::Curve(const ShapeView<double>& shape) {
  const int num_points = NumVertices(shape.type, shape.num_numbers);
  is_closed_ = num_points > 3 && Vertex(shape, 0) == Vertex(shape, num_points - 1);
  const auto count = static_cast<std::size_t>(num_points - 1);
  while (static_cast<std::size_t>(num_leaves_) < count) num_leaves_ *= 2;
  Node none;
  none.box = {kInfinity, kInfinity, -kInfinity, -kInfinity};
  tree_.assign(2 * static_cast<std::size_t>(num_leaves_), none);
  for (std::size_t i = 0; i < count; ++i) {
    pieces_.push_back(internal::PieceOf(shape, static_cast<int>(i)));
    const std::array<Vector2<double>, 4> points = ControlPointsOf(pieces_.back());
    const double turn = TurnOf(pieces_.back());
    is_straight_.push_back(turn <= kStraightPiece);
    Node& leaf = tree_[static_cast<std::size_t>(num_leaves_) + i];
    for (const Vector2<double>& point : points) Widen(point, &leaf.box);
    // The tangents lie between the directions of the control polygon.
    const Vector2<double> middle = points[2] - points[1];
    leaf.direction = middle / middle.norm();
    leaf.spread = turn;
    leaf.sine = turn < 0.5 * std::numbers::pi ? std::sin(turn) : 1.0;
  }
  for (std::size_t node = static_cast<std::size_t>(num_leaves_) - 1; node > 0; --node) {
    tree_[node] = Joined(tree_[2 * node], tree_[2 * node + 1]);
  }
}

int Curve::num_places() const { return kPlacesOfPiece * num_pieces(); }

Curve::Node Curve::Joined(const Node& low, const Node& high) {
  if (!(high.box.min_x <= high.box.max_x)) return low;
  Node node;
  node.box = {std::min(low.box.min_x, high.box.min_x), std::min(low.box.min_y, high.box.min_y),
              std::max(low.box.max_x, high.box.max_x), std::max(low.box.max_y, high.box.max_y)};
  const Vector2<double> sum = low.direction + high.direction;
  const double norm = sum.norm();
  node.sine = 1.0;
  node.spread = std::numbers::pi;
  if (!(norm > kStraightPiece)) return node;
  node.direction = sum / norm;
  const auto spread = [&](const Node& of) {
    return of.spread + std::abs(std::atan2(Cross(node.direction, of.direction),
                                           node.direction.dot(of.direction)));
  };
  node.spread = std::max(spread(low), spread(high));
  if (node.spread < 0.5 * std::numbers::pi) node.sine = std::sin(node.spread);
  return node;
}

// F = (x − c)·c' has no root where w = x − c cannot be at a right angle to a direction in the cone
// about d, |w·d| > |w| sin(spread). Of w's component along d and of |w| the box gives bounds, here
// without roots.
bool Curve::MayHaveMinimum(const Node& node, const SplineFoot& foot) {
  const double axis = std::max(foot.axes[0], foot.axes[1]);
  const double half_x = 0.5 * (node.box.max_x - node.box.min_x) + axis;
  const double half_y = 0.5 * (node.box.max_y - node.box.min_y) + axis;
  const Vector2<double> apart(foot.point.x() - 0.5 * (node.box.min_x + node.box.max_x),
                              foot.point.y() - 0.5 * (node.box.min_y + node.box.max_y));
  const Vector2<double>& d = node.direction;
  const double along = std::abs(apart.dot(d)) - half_x * std::abs(d.x()) -
                       half_y * std::abs(d.y()) - node.sine * (half_x + half_y);
  return along <= 0.0 || along * along <= node.sine * node.sine * apart.squaredNorm();
}

void Curve::VisitNode(int node, int low, int high, const SplineFoot& foot, const Aabb& box,
                      Visitor* visitor) const {
  const Node& own = tree_[static_cast<std::size_t>(node)];
  if (!(own.box.min_x <= box.max_x && box.min_x <= own.box.max_x && own.box.min_y <= box.max_y &&
        box.min_y <= own.box.max_y && MayHaveMinimum(own, foot))) {
    return;
  }
  if (high - low == 1) return VisitMinima(low, foot, visitor);
  const int middle = (low + high) / 2;
  VisitNode(2 * node, low, middle, foot, box, visitor);
  VisitNode(2 * node + 1, middle, high, foot, box, visitor);
}

void Curve::ForEachMinimum(const SplineFoot& foot, double distance, Visitor* visitor) const {
  const double reach = distance + std::max(foot.axes[0], foot.axes[1]);
  VisitNode(1, 0, num_leaves_, foot,
            {foot.point.x() - reach, foot.point.y() - reach, foot.point.x() + reach,
             foot.point.y() + reach},
            visitor);
}

// F at the start of a piece; at the end of the one before it is the same number, so that rounding
// loses no minimum and finds none twice.
double Curve::AtKnot(int piece, const SplineFoot& foot) const {
  if (piece < num_pieces()) return foot.At(pieces_[static_cast<std::size_t>(piece)], 0.0);
  return is_closed_ ? foot.At(pieces_.front(), 0.0)
                    : foot.At(pieces_.back(), pieces_.back().length);
}

void Curve::VisitMinima(int piece, const SplineFoot& foot, Visitor* visitor) const {
  const SplinePiece<double>& of = pieces_[static_cast<std::size_t>(piece)];
  const double end = AtKnot(piece + 1, foot);
  double before = AtKnot(piece, foot);
  if (is_straight_[static_cast<std::size_t>(piece)]) {
    if (before >= 0.0 && end < 0.0) visitor->Visit(MinimumIn(piece, 0, kPlacesOfPiece, foot));
    return;
  }
  for (int part = 0; part < kPlacesOfPiece; ++part) {
    const bool is_last = part + 1 == kPlacesOfPiece;
    const double after = is_last ? end : foot.At(of, internal::StartOfPlace(of, part + 1));
    if (before >= 0.0 && after < 0.0) visitor->Visit(MinimumIn(piece, part, part + 1, foot));
    before = after;
  }
}

// Between the starts of two parts of a piece F falls through 0: where, and in which of the parts.
Curve::Minimum Curve::MinimumIn(int piece, int first_part, int last_part,
                                const SplineFoot& foot) const {
  const SplinePiece<double>& of = pieces_[static_cast<std::size_t>(piece)];
  while (last_part - first_part > 1) {
    const int middle = (first_part + last_part) / 2;
    (foot.At(of, internal::StartOfPlace(of, middle)) >= 0.0 ? first_part : last_part) = middle;
  }
  const double s = internal::RootOfFoot(foot, of, internal::StartOfPlace(of, first_part),
                                        internal::StartOfPlace(of, last_part));
  const SplineAt<double> at = of.At(s);
  Minimum minimum;
  minimum.place = kPlacesOfPiece * piece + first_part;
  double slope;
  foot.At(at, &slope, &minimum.height);
  minimum.side = Cross(Vector2<double>(foot.point - at.place), at.rate) / at.rate.norm();
  return minimum;
}

namespace {

class TakeNearest : public Curve::Visitor {
 public:
  void Visit(const Curve::Minimum& minimum) override {
    if (std::abs(minimum.height) >= nearest->distance) return;
    *nearest = {std::abs(minimum.height), minimum, false};
  }
  Curve::Nearest* nearest = nullptr;
};

}  // namespace

void Curve::LookForNearest(int node, int low, int high, const SplineFoot& foot,
                           Nearest* nearest) const {
  if (high - low == 1) {
    if (low >= num_pieces()) return;
    TakeNearest visitor;
    visitor.nearest = nearest;
    return VisitMinima(low, foot, &visitor);
  }
  const int middle = (low + high) / 2;
  const Node& of_first = tree_[2 * static_cast<std::size_t>(node)];
  const Node& of_second = tree_[2 * static_cast<std::size_t>(node) + 1];
  const double of_low = SquareOfDistance(of_first.box, foot.point);
  const double of_high = SquareOfDistance(of_second.box, foot.point);
  const auto is_farther = [&](double square) {
    return square >= nearest->distance * nearest->distance;
  };
  const auto look_low = [&] {
    if (is_farther(of_low) || !MayHaveMinimum(of_first, foot)) return;
    LookForNearest(2 * node, low, middle, foot, nearest);
  };
  const auto look_high = [&] {
    if (is_farther(of_high) || !MayHaveMinimum(of_second, foot)) return;
    LookForNearest(2 * node + 1, middle, high, foot, nearest);
  };
  if (of_low <= of_high) {
    look_low();
    look_high();
  } else {
    look_high();
    look_low();
  }
}

Curve::Nearest Curve::FindNearest(const Vector2<double>& x) const {
  Nearest nearest;
  nearest.distance = kInfinity;
  nearest.is_end = true;
  for (const End end : {End::kFirst, End::kLast}) {
    if (is_closed_) break;
    const double distance = (x - AtEnd(end).place).norm();
    if (distance >= nearest.distance) continue;
    nearest.distance = distance;
    nearest.minimum.place = end == End::kFirst ? 0 : num_places() - 1;
  }
  SplineFoot foot;
  foot.point = x;
  LookForNearest(1, 0, num_leaves_, foot, &nearest);
  return nearest;
}

Aabb BoxOfCurve(const Curve& curve, const Pose<double>& pose, double margin) {
  if (!curve.is_closed()) {
    // The solid behind a curve that is open has no other side.
    return {-kInfinity, -kInfinity, kInfinity, kInfinity};
  }
  const Aabb& own = curve.box();
  Aabb box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (const double x : {own.min_x, own.max_x}) {
    for (const double y : {own.min_y, own.max_y}) Widen(pose * Vector2<double>(x, y), &box);
  }
  return {box.min_x - margin, box.min_y - margin, box.max_x + margin, box.max_y + margin};
}

}  // namespace tangible
