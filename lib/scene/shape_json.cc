// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/shape_json.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tangible/math/planar.h"
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

// A polygon is convex and counter-clockwise if every corner turns left and all turns add up to one
// full turn (a pentagram's add up to two). Linear in the vertices.
void CheckPolygon(const JsonReader& vertices, const std::vector<double>& numbers) {
  const Points points = Scaled(numbers);
  const std::size_t size = points.size();
  if (DoubleArea(points) < -kStraightCorner) {
    return vertices.Fail("expected counter-clockwise vertices, got clockwise ones");
  }
  double turn = 0.0;
  for (std::size_t i = 0; i < size; ++i) {
    const Vector2<double> in = points[i] - points[(i + size - 1) % size];
    const Vector2<double> out = points[(i + 1) % size] - points[i];
    const double sine = Cross(in, out);
    const double bound = kStraightCorner * in.norm() * out.norm();
    const JsonReader corner = vertices.At(static_cast<int>(i));
    if (in.norm() == 0.0 || out.norm() == 0.0) {
      const JsonReader second = in.norm() == 0.0 ? corner : vertices.At(static_cast<int>(i + 1));
      return second.Fail("expected a convex polygon, got the same vertex twice");
    }
    if (sine < -bound) {
      return corner.Fail("expected a convex polygon, got a corner that turns inward");
    }
    if (sine <= bound) {
      return corner.Fail("expected a convex polygon, got a vertex on the line of its neighbours");
    }
    turn += std::atan2(sine, in.dot(out));
  }
  if (turn > 3.0 * kPi) vertices.Fail("expected a convex polygon, got one that crosses itself");
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
    return reader.Fail("expected one of circle, ellipse, box, capsule, polygon, half_plane, got " +
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
  item.ExpectKeys(fields.keys(), article + keys[0]);
  if (!item.ok()) return;
  FieldReader numbers(item);
  VisitShape(*shape, &numbers);
  if (reader.ok()) CheckShape(*shape, reader);
}

void CheckShape(const BasicShape<double>& shape, const JsonReader& place) {
  switch (shape.type) {
    case ShapeType::kEllipse:
      return CheckEllipse(place.At("ellipse").At("radii"), shape.numbers);
    case ShapeType::kPolygon:
      return CheckPolygon(place.At("polygon").At("vertices"), shape.numbers);
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
