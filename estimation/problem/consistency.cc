// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/consistency.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/estimation/problem/tolerances.h"
#include "tangible/geometry/mass_properties.h"
#include "tangible/geometry/shape.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

double Cross(const Vector2<double>& a, const Vector2<double>& b) {
  return a[0] * b[1] - a[1] * b[0];
}

/// Σ w |v|² of three vertices with Σ w v = 0; negative if the origin is outside their triangle.
double OfTriangle(const Vector2<double>& a, const Vector2<double>& b, const Vector2<double>& c) {
  // Barycentric weights of the origin are the areas opposite; a triangle without an area has none.
  const double wa = Cross(b, c);
  const double wb = Cross(c, a);
  const double wc = Cross(a, b);
  const double sum = wa + wb + wc;
  const double least = -kInertiaRounding * std::abs(sum);
  const double sign = sum < 0.0 ? -1.0 : 1.0;
  if (sum == 0.0 || sign * wa < least || sign * wb < least || sign * wc < least) {
    return -1.0;
  }
  return (wa * a.squaredNorm() + wb * b.squaredNorm() + wc * c.squaredNorm()) / sum;
}

}  // namespace

double LargestSquaredGyration(const BasicShape<double>& shape) {
  const ShapeView<double> view{shape.type, shape.numbers.data(),
                               static_cast<int>(shape.numbers.size())};
  switch (shape.type) {
    case ShapeType::kNone:
    case ShapeType::kHalfPlane:
    case ShapeType::kPolyline:
    case ShapeType::kSpline:
      return std::numeric_limits<double>::infinity();
    case ShapeType::kCircle:
    case ShapeType::kEllipse:
    case ShapeType::kCapsule:
    case ShapeType::kBox: {
      // Symmetric about the origin: half the mass at each of two opposite farthest points.
      const double radius = BoundingRadius(view);
      return radius * radius;
    }
    case ShapeType::kPolygon:
      break;
  }
  double largest = -1.0;
  const int count = NumVertices(shape.type, view.num_numbers);
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      for (int k = j + 1; k < count; ++k) {
        largest = std::max(largest, OfTriangle(Vertex(view, i), Vertex(view, j), Vertex(view, k)));
      }
    }
  }
  return largest;
}

std::vector<std::string> FindInconsistentBodies(const Scene& scene) {
  std::vector<std::string> found;
  for (const BasicBody<double>& body : scene.bodies) {
    if (body.motion != Motion::kMoving) {
      continue;
    }
    const double largest = LargestSquaredGyration(body.shape);
    if (largest < 0.0) {
      found.push_back("body '" + body.name +
                      "' cannot exist: its centre of mass is outside of its shape");
    } else if (body.inertia && *body.inertia > (1.0 + kInertiaRounding) * body.mass * largest) {
      found.push_back("body '" + body.name + "' cannot exist: expected an inertia of at most " +
                      CompactNumber(body.mass * largest, 4) + " kg m^2, that of its mass of " +
                      CompactNumber(body.mass, 4) + " kg at the border of its shape, got " +
                      CompactNumber(*body.inertia, 4));
    }
  }
  return found;
}

}  // namespace tangible
