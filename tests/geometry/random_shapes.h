// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Shapes that own their numbers, random ones, and a distance of cores that shares nothing with the
// engine's: the signed distance of the origin to the convex hull of all differences of vertices.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tangible/geometry/collide.h"

namespace tangible::testing {

/// A few roundings of coordinates of order 1.
inline constexpr double kTolerance = 1e-14;

template <typename T>
struct OwnedShape {
  ShapeType type;
  std::vector<T> numbers;
  ShapeView<T> View() const { return {type, numbers.data(), static_cast<int>(numbers.size())}; }
};
using TestShape = OwnedShape<double>;

inline TestShape Circle(double radius) { return {ShapeType::kCircle, {radius}}; }
inline TestShape Box(double width, double height) { return {ShapeType::kBox, {width, height}}; }
inline TestShape Capsule(double length, double radius) {
  return {ShapeType::kCapsule, {length, radius}};
}
inline TestShape Ellipse(double a, double b) { return {ShapeType::kEllipse, {a, b}}; }
inline TestShape Polygon(std::vector<double> vertices) {
  return {ShapeType::kPolygon, std::move(vertices)};
}
inline TestShape HalfPlane(double x, double y, double offset) {
  return {ShapeType::kHalfPlane, {x, y, offset}};
}
inline Pose<double> At(double x, double y, double angle = 0.0) {
  return Pose<double>(Vector2<double>(x, y), angle);
}

struct Contacts {
  int count = 0;
  ContactFeature features[2];
  ContactGeometry<double> geometry[2];
};

inline Contacts Collide(const TestShape& a, const Pose<double>& pose_a, const TestShape& b,
                        const Pose<double>& pose_b,
                        double max_gap = std::numeric_limits<double>::infinity()) {
  Contacts contacts;
  contacts.count =
      FindContactFeatures(a.View(), pose_a, b.View(), pose_b, max_gap, contacts.features);
  for (int i = 0; i < contacts.count; ++i) {
    contacts.geometry[i] =
        EvaluateContact(contacts.features[i], a.View(), pose_a, b.View(), pose_b);
  }
  return contacts;
}

inline double Uniform(std::mt19937* random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(*random);
}

/// Vertices on an ellipse at random angles: convex whatever the angles.
inline TestShape RandomPolygon(std::mt19937* random, int num_vertices) {
  std::vector<double> angles(num_vertices);
  for (int i = 0; i < num_vertices; ++i) {
    angles[i] = 2.0 * std::numbers::pi * (i + Uniform(random, 0.0, 0.8)) / num_vertices;
  }
  const double a = Uniform(random, 0.3, 1.5);
  const double b = Uniform(random, 0.3, 1.5);
  std::vector<double> vertices;
  for (const double angle : angles) {
    vertices.push_back(a * std::cos(angle));
    vertices.push_back(b * std::sin(angle));
  }
  return Polygon(vertices);
}

/// A circle, box, capsule or polygon of 3 to 12 vertices.
inline TestShape RandomShape(std::mt19937* random) {
  switch (std::uniform_int_distribution<int>(0, 3)(*random)) {
    case 0:
      return Circle(Uniform(random, 0.1, 1.0));
    case 1:
      return Box(Uniform(random, 0.2, 2.0), Uniform(random, 0.2, 2.0));
    case 2:
      return Capsule(Uniform(random, 0.2, 2.0), Uniform(random, 0.05, 0.5));
    default:
      return RandomPolygon(random, std::uniform_int_distribution<int>(3, 12)(*random));
  }
}

inline TestShape RandomEllipse(std::mt19937* random) {
  const double a = Uniform(random, 0.3, 1.5);
  return Ellipse(a, Uniform(random, 0.3, 1.5));
}

inline Pose<double> RandomPose(std::mt19937* random, double extent) {
  const double x = Uniform(random, -extent, extent);
  const double y = Uniform(random, -extent, extent);
  return At(x, y, Uniform(random, -3.0, 3.0));
}

/// Convex hull, counter-clockwise (monotone chain).
inline std::vector<Vector2<double>> ConvexHull(std::vector<Vector2<double>> points) {
  std::sort(points.begin(), points.end(), [](const auto& p, const auto& q) {
    return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
  });
  std::vector<Vector2<double>> hull;
  const auto extend = [&hull](const Vector2<double>& point, std::size_t keep) {
    while (hull.size() >= keep + 2 && Cross(Vector2<double>(hull.back() - hull[hull.size() - 2]),
                                            Vector2<double>(point - hull.back())) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(point);
  };
  for (const auto& point : points) {
    extend(point, 0);
  }
  const std::size_t lower = hull.size() - 1;
  for (auto point = points.rbegin() + 1; point != points.rend(); ++point) {
    extend(*point, lower);
  }
  hull.pop_back();
  return hull;
}

/// Distance of the surfaces, negative the least translation that separates the cores: by the hull
/// of differences.
inline double SignedDistance(const TestShape& a, const Pose<double>& pose_a, const TestShape& b,
                             const Pose<double>& pose_b) {
  std::vector<Vector2<double>> differences;
  for (int i = 0; i < NumVertices(a.type, static_cast<int>(a.numbers.size())); ++i) {
    for (int j = 0; j < NumVertices(b.type, static_cast<int>(b.numbers.size())); ++j) {
      differences.push_back(pose_a * Vertex(a.View(), i) - pose_b * Vertex(b.View(), j));
    }
  }
  const double radii = CoreRadius(a.View()) + CoreRadius(b.View());
  if (differences.size() == 1) {
    return differences[0].norm() - radii;
  }
  const std::vector<Vector2<double>> hull = ConvexHull(differences);
  bool inside = hull.size() > 2;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2<double> along = hull[(i + 1) % hull.size()] - hull[i];
    const double t = std::clamp(-along.dot(hull[i]) / along.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (hull[i] + t * along).norm());
    inside = inside && Cross(along, Vector2<double>(-hull[i])) >= 0.0;
  }
  return (inside ? -nearest : nearest) - radii;
}

/// The same feature seen from the other body.
inline ContactFeature Mirrored(const ContactFeature& feature) {
  FeatureKind kind = feature.kind;
  switch (feature.kind) {
    case FeatureKind::kVertexVertex:
      break;
    case FeatureKind::kVertexEdge:
      kind = FeatureKind::kEdgeVertex;
      break;
    case FeatureKind::kEdgeVertex:
      kind = FeatureKind::kVertexEdge;
      break;
    case FeatureKind::kVertexPlane:
      kind = FeatureKind::kPlaneVertex;
      break;
    case FeatureKind::kPlaneVertex:
      kind = FeatureKind::kVertexPlane;
      break;
  }
  return {kind, feature.b, feature.a};
}

}  // namespace tangible::testing
