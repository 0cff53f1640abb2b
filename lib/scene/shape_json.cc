// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/shape_json.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tangible/math/planar.h"
#include "tangible/math/spline_curve.h"
#include "tangible/scene/field_reader.h"
#include "tangible/scene/scene_fields.h"
#include "tangible/scene/scene_names.h"
#include "tangible/scene/tolerances.h"

namespace tangible {
namespace {

using Points = std::vector<Vector2<double>>;

constexpr double kPi = 3.14159265358979323846;

// The vertices in units of the polygon's largest coordinate difference, relative to the first one:
// products of coordinates neither overflow nor vanish, however large or small the polygon is.
Points Scaled(const std::vector<double>& numbers) {
  Points points;
  double extent = 0.0;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
    points.emplace_back(numbers[i] - numbers[0], numbers[i + 1] - numbers[1]);
    extent = std::max({extent, std::abs(points.back().x()), std::abs(points.back().y())});
  }
  if (extent > 0.0) {
    for (Vector2<double>& point : points) point = point / extent;
  }
  return points;
}

// Twice the area.
double DoubleArea(const Points& points) {
  double area = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    area += Cross(points[i], points[(i + 1) % points.size()]);
  }
  return area;
}

// On which side of the line from a to b the point is: 1 left, -1 right, and 0 where its distance
// cannot be distinguished from rounding. The points are scaled, so the bound is a share of the
// extent.
int SideOf(const Vector2<double>& a, const Vector2<double>& b, const Vector2<double>& point) {
  const double area = Cross(Vector2<double>(b - a), Vector2<double>(point - a));
  const double bound = kStraightCorner * (b - a).norm();
  return (area > bound ? 1 : 0) - (area < -bound ? 1 : 0);
}

// Whether the segments from a to b and from c to d have a point in common.
bool SegmentsMeet(const Vector2<double>& a, const Vector2<double>& b, const Vector2<double>& c,
                  const Vector2<double>& d) {
  const int c_side = SideOf(a, b, c), d_side = SideOf(a, b, d);
  const int a_side = SideOf(c, d, a), b_side = SideOf(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  const auto between = [](const Vector2<double>& from, const Vector2<double>& to,
                          const Vector2<double>& point) {
    return (point - from).dot(point - to) <= 0.0;
  };
  return (c_side == 0 && between(a, b, c)) || (d_side == 0 && between(a, b, d)) ||
         (a_side == 0 && between(c, d, a)) || (b_side == 0 && between(c, d, b));
}

// Two of the outline's first `size` edges, neighbours excepted, that cross or touch, the lower
// one first, or {-1, -1}. Edge i goes from vertex i to the next one. Edges are sorted by their
// left ends, and each is compared with those alone that begin before it ends: a crossing is
// looked for in faulty outlines only, but these may be large too. Of several pairs it is the
// first in that order. After kMostComparisons none is named, so that a file of a million edges
// is refused in a moment.
std::pair<int, int> CrossingEdges(const Points& points, int size) {
  const int num_points = static_cast<int>(points.size());
  const auto start = [&points](int edge) { return points[static_cast<std::size_t>(edge)]; };
  const auto end = [&](int edge) { return start((edge + 1) % num_points); };
  std::vector<std::pair<double, int>> by_left;
  by_left.reserve(points.size());
  for (int i = 0; i < size; ++i) by_left.emplace_back(std::min(start(i).x(), end(i).x()), i);
  std::sort(by_left.begin(), by_left.end());
  constexpr long kMostComparisons = 20'000'000;
  long comparisons = 0;
  for (std::size_t i = 0; i < by_left.size(); ++i) {
    const int edge = by_left[i].second;
    const double right = std::max(start(edge).x(), end(edge).x()) + kStraightCorner;
    for (std::size_t j = i + 1; j < by_left.size() && by_left[j].first <= right; ++j) {
      if (++comparisons > kMostComparisons) return {-1, -1};
      const auto [low, high] = std::minmax(edge, by_left[j].second);
      if (high - low == 1 || (high - low == size - 1 && size == num_points)) {
        continue;
      }
      if (SegmentsMeet(start(low), end(low), start(high), end(high))) return {low, high};
    }
  }
  return {-1, -1};
}

// Refuses an outline of which two edges cross, and returns whether it does.
bool RefuseCrossing(const JsonReader& vertices, const Points& points, int num_edges) {
  const auto [low, high] = CrossingEdges(points, num_edges);
  if (low < 0) return false;
  const auto name = [&points](int edge) {
    const int next = (edge + 1) % static_cast<int>(points.size());
    return "the edge of vertices " + std::to_string(edge) + " and " + std::to_string(next);
  };
  vertices.Fail("expected an outline that does not cross or touch itself, got " + name(low) +
                " that meets " + name(high));
  return true;
}

// Refuses an outline that is not what a polygon must be: with the two edges that cross where there
// are such, because then neither the direction of the vertices nor a corner is what is wrong; else
// with the message at `place`.
void RefuseOutline(const JsonReader& vertices, const Points& points, const JsonReader& place,
                   const std::string& message) {
  if (!RefuseCrossing(vertices, points, static_cast<int>(points.size()))) place.Fail(message);
}

// A polygon is counter-clockwise and does not cross itself. It is convex if every corner turns left
// and all turns add up to one full turn (a pentagram's add up to two), which takes a time linear in
// the vertices; crossings are looked for where a corner turns right.
void CheckPolygon(const JsonReader& vertices, const std::vector<double>& numbers) {
  const Points points = Scaled(numbers);
  const std::size_t size = points.size();
  for (std::size_t i = 0; i < size; ++i) {
    if (points[i] != points[(i + size - 1) % size]) continue;
    return vertices.At(static_cast<int>(i))
        .Fail("expected a polygon of different vertices, got the same vertex twice");
  }
  if (DoubleArea(points) < -kStraightCorner) {
    return RefuseOutline(vertices, points, vertices,
                         "expected counter-clockwise vertices, got clockwise ones");
  }
  double turn = 0.0;
  bool is_concave = false;
  for (std::size_t i = 0; i < size; ++i) {
    const Vector2<double> in = points[i] - points[(i + size - 1) % size];
    const Vector2<double> out = points[(i + 1) % size] - points[i];
    const double sine = Cross(in, out);
    const double bound = kStraightCorner * in.norm() * out.norm();
    const JsonReader corner = vertices.At(static_cast<int>(i));
    if (std::abs(sine) <= bound) {
      return corner.Fail("expected a corner, got a vertex on the line of its neighbours");
    }
    is_concave = is_concave || sine < 0.0;
    turn += std::atan2(sine, in.dot(out));
  }
  if (turn > 3.0 * kPi) {
    return RefuseOutline(vertices, points, vertices,
                         "expected an outline that goes around once, got one that does so twice");
  }
  if (is_concave && !RefuseCrossing(vertices, points, static_cast<int>(size)) &&
      DoubleArea(points) <= kStraightCorner) {
    vertices.Fail("expected an outline that encloses an area, got none");
  }
}

// The curve of a spline as chords, each from the point of the same index to the next, and the piece
// that each belongs to. A piece that turns far has several.
struct Chords {
  Points points;
  std::vector<int> pieces;
};

Chords ChordsOf(const Points& points, bool closed) {
  constexpr double kTurn = 0.1;
  constexpr int kOfPiece = 8;
  std::vector<double> numbers;
  for (const Vector2<double>& point : points) {
    numbers.insert(numbers.end(), {point.x(), point.y()});
  }
  if (closed) numbers.insert(numbers.end(), {points[0].x(), points[0].y()});
  const std::vector<double> m = SplineCurvatures(numbers);
  Chords chords;
  for (std::size_t i = 0; 2 * i + 2 < numbers.size(); ++i) {
    const double* const p = &numbers[2 * i];
    const SplinePiece<double> piece = MakePiece(p[0], p[1], p[2], p[3], &m[2 * i]);
    const int count = TurnOf(piece) > kTurn ? kOfPiece : 1;
    for (int k = 0; k < count; ++k) {
      chords.points.push_back(piece.At(piece.length * k / count).place);
      chords.pieces.push_back(static_cast<int>(i));
    }
  }
  if (!closed) chords.points.push_back(points.back());
  return chords;
}

// Refuses a spline that crosses itself.
void RefuseCrossingCurve(const JsonReader& points_at, const Points& points, bool closed) {
  const Chords chords = ChordsOf(points, closed);
  const auto [low, high] = CrossingEdges(chords.points, static_cast<int>(chords.pieces.size()));
  if (low < 0) return;
  const auto name = [&](int chord) {
    const int piece = chords.pieces[static_cast<std::size_t>(chord)];
    const int next = (piece + 1) % static_cast<int>(points.size());
    return "the piece of points " + std::to_string(piece) + " and " + std::to_string(next);
  };
  points_at.Fail("expected a curve that does not cross or touch itself, got " + name(low) +
                 " that meets " + name(high));
}

// The edges of a polyline, or the pieces of a spline, do not meet but at their common points, and
// do not turn back there.
void CheckTrack(const JsonReader& place, const BasicShape<double>& shape) {
  const JsonReader points_at = place.At("points");
  const Points points = Scaled(shape.numbers);
  const int size = static_cast<int>(points.size());
  if (size < (shape.closed ? 3 : 2)) {
    return points_at.Fail("expected at least " + std::to_string(shape.closed ? 3 : 2) +
                          " points, got " + std::to_string(size));
  }
  const int num_edges = shape.closed ? size : size - 1;
  for (int i = 0; i < num_edges; ++i) {
    const int next = (i + 1) % size;
    if (points[i] == points[next]) {
      return points_at.At(next).Fail("expected another point than the one before, got the same");
    }
  }
  if (!shape.closed && size > 2 && points[0] == points[size - 1]) {
    return points_at.At(size - 1).Fail(
        "expected another point than the first, or \"closed\": true without this one");
  }
  for (int i = shape.closed ? 0 : 1; i < num_edges; ++i) {
    const Vector2<double>& at = points[i];
    const Vector2<double> in = at - points[(i + size - 1) % size];
    const Vector2<double> out = points[(i + 1) % size] - at;
    if (in.dot(out) < 0.0 && std::abs(Cross(in, out)) <= kStraightCorner * in.norm() * out.norm()) {
      return points_at.At(i).Fail("expected a corner that does not turn back by 180 degrees");
    }
  }
  if (shape.type == ShapeType::kSpline) return RefuseCrossingCurve(points_at, points, shape.closed);
  RefuseCrossing(points_at, points, num_edges);
}

void CheckEllipse(const JsonReader& radii, const std::vector<double>& numbers) {
  const auto [least, most] = std::minmax(numbers[0], numbers[1]);
  if (least >= kSlenderEllipse * most) return;
  radii.Fail("expected two radii of a ratio of at most 1e9, got " + Describe(Json(numbers[0])) +
             " and " + Describe(Json(numbers[1])));
}

}  // namespace

void ReadShape(const JsonReader& reader, BasicShape<double>* shape) {
  std::vector<std::string> names;
  for (const auto& entry : kShapeTypeNames) names.emplace_back(entry.first);
  reader.ExpectKeys(names, " of a shape");
  if (!reader.ok()) return;
  const std::vector<std::string> keys = reader.Keys();
  if (keys.size() != 1) {
    return reader.Fail(
        "expected one of circle, ellipse, box, capsule, polygon, half_plane, "
        "polyline, spline, got " +
        std::to_string(keys.size()) + " of them");
  }
  for (const auto& entry : kShapeTypeNames) {
    if (keys[0] == entry.first) shape->type = entry.second;
  }
  shape->numbers.assign(static_cast<std::size_t>(NumNumbers(shape->type)), 0.0);
  FieldKeys fields;
  VisitShape(*shape, &fields);
  const JsonReader item = reader.At(keys[0]);
  const char* const article = shape->type == ShapeType::kEllipse ? " of an " : " of a ";
  std::vector<std::string> expected = fields.keys();
  const bool is_track = IsTrack(shape->type);
  if (is_track) expected.insert(expected.end(), {"closed", "solid"});
  item.ExpectKeys(expected, article + keys[0]);
  if (!item.ok()) return;
  FieldReader numbers(item);
  VisitShape(*shape, &numbers);
  if (is_track) {
    numbers.Flag("closed", shape->closed);
    numbers.Choice("solid", kSolidSideNames, shape->solid);
  }
  if (reader.ok()) CheckShape(*shape, reader);
}

void CheckShape(const BasicShape<double>& shape, const JsonReader& place) {
  switch (shape.type) {
    case ShapeType::kEllipse:
      return CheckEllipse(place.At("ellipse").At("radii"), shape.numbers);
    case ShapeType::kPolygon:
      return CheckPolygon(place.At("polygon").At("vertices"), shape.numbers);
    case ShapeType::kPolyline:
    case ShapeType::kSpline:
      return CheckTrack(place.At(NameOf(shape.type, kShapeTypeNames)), shape);
    case ShapeType::kHalfPlane:
      if (shape.numbers[0] == 0.0 && shape.numbers[1] == 0.0) {
        place.At("half_plane").At("normal").Fail("expected a direction, got the zero vector");
      }
      return;
    case ShapeType::kNone:
    case ShapeType::kCircle:
    case ShapeType::kBox:
    case ShapeType::kCapsule:
      return;
  }
}

bool IsCentred(const BasicShape<double>& shape) {
  if (shape.type != ShapeType::kPolygon) return true;
  // The centroid relative to the first vertex, and that vertex relative to the origin.
  const Points points = Scaled(shape.numbers);
  Vector2<double> moment(0.0, 0.0);
  double extent = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2<double>& next = points[(i + 1) % points.size()];
    moment += Cross(points[i], next) * (points[i] + next);
    extent = std::max({extent, std::abs(shape.numbers[2 * i] - shape.numbers[0]),
                       std::abs(shape.numbers[2 * i + 1] - shape.numbers[1])});
  }
  const Vector2<double> centroid = moment / (3.0 * DoubleArea(points));
  const Vector2<double> first(shape.numbers[0] / extent, shape.numbers[1] / extent);
  return (first + centroid).norm() <= kCentred;
}

}  // namespace tangible
