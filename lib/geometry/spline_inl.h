// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A spline against a vertex of another shape, or an ellipse, for any scalar.
//
// Piece i of a spline is the cubic c(s) between its points i and i + 1 (math/spline_curve.h), with
// 0 ≤ s ≤ h. Its unit normal is n = (c'_y, −c'_x)/|c'|, to the right of the way along the points,
// because the solid is on the left. A vertex x, or the point x(−n) that an ellipse has farthest
// along −n, has its foot where:
//   F(s) = (x − c)·c' = 0,   F' = −|c'|² + (x − c)·c'' − ρ (c' × c'')/|c'| < 0              (1)
//   gap = n·(x − c) − radius
// (ρ: the radius of curvature of the ellipse there, else 0). The root is found in double. Two
// Newton steps from there in T make the value and the derivatives up to the third order exact, as
// those of ellipses (ellipse.h), so that the turning of the normal along the curve is in the rows'
// derivatives and rates.
//
// Each piece has kPlacesOfPiece places, equal parts of it, which are the edges of a spline. Moving
// poses take a contact from one place to the next: it is at the place where F changes its sign.
// Values and first derivatives of rows are the same for both pieces at a point where they meet.

#include <algorithm>
#include <cmath>

#include "tangible/geometry/collide.h"
#include "tangible/geometry/ellipse_inl.h"
#include "tangible/geometry/tolerances.h"
#include "tangible/math/spline_curve.h"

namespace tangible::internal {

inline constexpr int kPlacesOfPiece = 4;

template <typename T>
SplinePiece<T> PieceOf(const ShapeView<T>& spline, int piece) {
  const T* const p = spline.numbers + 2 * piece;
  return MakePiece(p[0], p[1], p[2], p[3], p + spline.num_numbers / 2);
}

/// The same in double.
template <typename T>
SplinePiece<double> PieceValues(const ShapeView<T>& spline, int piece) {
  const T* const p = spline.numbers + 2 * piece;
  const T* const of_m = p + spline.num_numbers / 2;
  double m[4];
  for (int i = 0; i < 4; ++i) m[i] = ValueOf(of_m[i]);
  return MakePiece(ValueOf(p[0]), ValueOf(p[1]), ValueOf(p[2]), ValueOf(p[3]), m);
}

/// What of another shape has its foot on a spline, in the spline's frame and in double: a vertex,
/// or an ellipse about its centre.
struct SplineFoot {
  Vector2<double> point{0.0, 0.0};
  double axes[2] = {0.0, 0.0};  ///< of an ellipse, else 0
  Rotation<double> rotation;

  /// x and ρ of (1).
  Vector2<double> PointAlong(const Vector2<double>& normal, double* bend) const {
    *bend = 0.0;
    if (!(axes[0] > 0.0)) return point;
    const double axis[4] = {axes[0], axes[1], 0.0, 0.0};
    Pose<double> turned;
    turned.rotation = rotation;
    const Support<double> support = SupportOf(ShapeView<double>{ShapeType::kEllipse, axis, 2},
                                              turned, 0, Vector2<double>(-normal.x(), -normal.y()));
    *bend = support.bend;
    return point + support.arm;
  }
  /// F and F' of (1), and the height n·(x − c).
  double At(const SplineAt<double>& at, double* slope, double* height) const {
    const double speed = at.rate.norm();
    const Vector2<double> normal(at.rate.y() / speed, -at.rate.x() / speed);
    double bend;
    const Vector2<double> w = PointAlong(normal, &bend) - at.place;
    *slope = -speed * speed + w.dot(at.bend) - bend * Cross(at.rate, at.bend) / speed;
    *height = normal.dot(w);
    return w.dot(at.rate);
  }
  /// F alone.
  double At(const SplinePiece<double>& piece, double s) const {
    if (!(axes[0] > 0.0)) {
      const SplineAt<double> at = piece.At(s);
      return (point - at.place).dot(at.rate);
    }
    double slope, height;
    return At(piece.At(s), &slope, &height);
  }
};

template <typename T>
SplineFoot FootOver(const ShapeView<T>& shape, const Pose<T>& pose, int vertex,
                    const Pose<T>& spline_pose) {
  const auto values = [](const Vector2<T>& x) {
    return Vector2<double>(ValueOf(x.x()), ValueOf(x.y()));
  };
  const auto turn = [](const Rotation<T>& x) {
    Rotation<double> rotation;
    rotation.cosine = ValueOf(x.cosine);
    rotation.sine = ValueOf(x.sine);
    return rotation;
  };
  const Rotation<double> own = turn(pose.rotation), frame = turn(spline_pose.rotation);
  SplineFoot foot;
  const Vector2<double> relative = values(pose.position) - values(spline_pose.position);
  foot.point = frame.Inverse(Vector2<double>(relative + own * values(Vertex(shape, vertex))));
  if (shape.type == ShapeType::kEllipse) {
    for (int i = 0; i < 2; ++i) foot.axes[i] = ValueOf(shape.numbers[i]);
    foot.rotation.cosine = frame.cosine * own.cosine + frame.sine * own.sine;
    foot.rotation.sine = frame.cosine * own.sine - frame.sine * own.cosine;
  }
  return foot;
}

/// Where a place of a piece starts; that of kPlacesOfPiece is the piece's end.
inline double StartOfPlace(const SplinePiece<double>& piece, int place) {
  return place == kPlacesOfPiece ? piece.length : piece.length * place / kPlacesOfPiece;
}

/// The piece near which a foot is, by Newton's steps that are longer than two pieces: with many
/// points a contact moves past many of them in one step.
template <typename T>
int PieceTowards(const ShapeView<T>& spline, int at, bool closed, const SplineFoot& foot) {
  constexpr int kMostSteps = 8;
  const int num_pieces = spline.num_numbers / 4 - 1;
  double last = kInfinity;
  for (int k = 0; k < kMostSteps; ++k) {
    const SplinePiece<double> piece = PieceValues(spline, at);
    double slope, height;
    const double f = foot.At(piece.At(0.5 * piece.length), &slope, &height);
    const double way = -f / slope / piece.length;
    // Longer steps than the one before lead elsewhere.
    if (!(slope < 0.0) || !(std::abs(way) > 2.0) || !(std::abs(way) < 0.5 * last)) break;
    last = std::abs(way);
    if (!(last < 0.25 * num_pieces)) break;
    const int next = at + static_cast<int>(std::lround(way));
    at = closed ? (next + num_pieces) % num_pieces : std::clamp(next, 0, num_pieces - 1);
  }
  return at;
}

/// The place to which a contact has moved: that in which F goes from F ≥ 0 to F < 0, in the
/// direction in which the curve comes nearer. At an end of the curve it stays.
template <typename T>
int PlaceAt(const ShapeView<T>& spline, int place, const SplineFoot& foot) {
  const int num_pieces = spline.num_numbers / 4 - 1;
  const T* const last = spline.numbers + 2 * num_pieces;
  const bool closed = ValueOf(spline.numbers[0]) == ValueOf(last[0]) &&
                      ValueOf(spline.numbers[1]) == ValueOf(last[1]);
  int at = place / kPlacesOfPiece;
  int part = place % kPlacesOfPiece;
  if (const int near = PieceTowards(spline, at, closed, foot); near != at) {
    at = near;
    part = 0;
  }
  SplinePiece<double> piece = PieceValues(spline, at);
  int way = 0;
  for (int passed = 0; passed <= num_pieces;) {
    if (way <= 0 && foot.At(piece, StartOfPlace(piece, part)) < 0.0) {
      way = -1;
    } else if (way >= 0 && foot.At(piece, StartOfPlace(piece, part + 1)) >= 0.0) {
      way = 1;
    } else {
      break;
    }
    part += way;
    while (part < 0 || part >= kPlacesOfPiece) {
      if (!closed && at + way != std::clamp(at + way, 0, num_pieces - 1)) {
        return kPlacesOfPiece * at + (way < 0 ? 0 : kPlacesOfPiece - 1);
      }
      at = (at + way + num_pieces) % num_pieces;
      piece = PieceValues(spline, at);
      part = way < 0 ? kPlacesOfPiece - 1 : 0;
      if (++passed > num_pieces) break;
      // A piece at whose far end the curve still comes nearer is passed as a whole.
      const double far = foot.At(piece, way < 0 ? 0.0 : piece.length);
      if (way < 0 ? far < 0.0 : far >= 0.0) part = way < 0 ? -1 : kPlacesOfPiece;
    }
  }
  return kPlacesOfPiece * at + std::clamp(part, 0, kPlacesOfPiece - 1);
}

/// The root of F in [low, high], where it falls through 0, or beyond, where it has none there: by
/// Newton's steps, and by halving where these leave a bracket.
inline double RootOfFoot(const SplineFoot& foot, const SplinePiece<double>& piece, double low,
                         double high) {
  constexpr int kMostSteps = 100;
  const double f_low = foot.At(piece, low), f_high = foot.At(piece, high);
  const bool bracketed = f_low >= 0.0 && f_high <= 0.0 && f_low > f_high;
  double s = bracketed ? low + (high - low) * (f_low / (f_low - f_high)) : f_low < 0.0 ? low : high;
  for (int k = 0; k < kMostSteps; ++k) {
    double slope, height;
    const double f = foot.At(piece.At(s), &slope, &height);
    if (bracketed) (f >= 0.0 ? low : high) = s;
    double next = s - f / slope;
    if (bracketed && !(next >= low && next <= high)) next = 0.5 * (low + high);
    // Without a bracket, a step that leads away from the piece is as good as the next one.
    if (!bracketed && !(slope < 0.0 && std::abs(next - s) <= piece.length)) break;
    if (std::abs(next - s) <= kTurnRounding * piece.length) break;
    s = next;
  }
  return s;
}

/// A vertex, or an ellipse, against a place of a spline; the normal points to the vertex.
template <typename T>
ContactGeometry<T> VertexAgainstSpline(const ShapeView<T>& shape, const Pose<T>& pose, int vertex,
                                       const ShapeView<T>& spline, const Pose<T>& spline_pose,
                                       int place) {
  using std::sqrt;
  const SplinePiece<T> piece = PieceOf(spline, place / kPlacesOfPiece);
  const SplinePiece<double> values = PieceValues(spline, place / kPlacesOfPiece);
  const int part = place % kPlacesOfPiece;
  T s(RootOfFoot(FootOver(shape, pose, vertex, spline_pose), values, StartOfPlace(values, part),
                 StartOfPlace(values, part + 1)));
  ContactGeometry<T> result;
  Support<T> support;
  T height;
  for (int step = 0;; ++step) {
    const SplineAt<T> at = piece.At(s);
    const T square = at.rate.x() * at.rate.x() + at.rate.y() * at.rate.y();
    const T speed = sqrt(square);
    const Vector2<T> normal(at.rate.y() / speed, -at.rate.x() / speed);
    result.normal = spline_pose.rotation * normal;
    support = SupportOf(shape, pose, vertex, Vector2<T>(-result.normal.x(), -result.normal.y()));
    const Vector2<T> x = spline_pose.rotation.Inverse(
        Vector2<T>(pose.position.x() - spline_pose.position.x() + support.arm.x(),
                   pose.position.y() - spline_pose.position.y() + support.arm.y()));
    const Vector2<T> w(x.x() - at.place.x(), x.y() - at.place.y());
    height = normal.x() * w.x() + normal.y() * w.y();
    const T bent =
        w.x() * at.bend.x() + w.y() * at.bend.y() - support.bend * Cross(at.rate, at.bend) / speed;
    constexpr int kSteps = 2;
    // At a centre of curvature the foot has no derivative.
    if (step == kSteps || IsUnbent(ValueOf(square - bent), ValueOf(square))) break;
    s = s + (w.x() * at.rate.x() + w.y() * at.rate.y()) / (square - bent);
  }
  const T radius = CoreRadius(shape);
  result.gap = height - radius;
  const T depth = radius + 0.5 * result.gap;
  result.point = Vector2<T>(pose.position.x() + support.arm.x() - result.normal.x() * depth,
                            pose.position.y() + support.arm.y() - result.normal.y() * depth);
  return result;
}

}  // namespace tangible::internal
