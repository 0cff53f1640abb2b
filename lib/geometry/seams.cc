// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/seams.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tangible/geometry/contact_geometry_inl.h"
#include "tangible/geometry/tolerances.h"

namespace tangible {
namespace {

using internal::EdgeLine;
using internal::HalfPlaneLine;

/// A line of a neighbour in the frame of the shape: it is solid where n·x ≤ offset.
struct Line {
  Vector2<double> normal;
  double offset;
  double Height(const Vector2<double>& p) const { return normal.dot(p) - offset; }
};

int NumLines(const ShapeView<double>& shape) {
  return shape.type == ShapeType::kHalfPlane ? 1 : NumVertices(shape.type, shape.num_numbers);
}

/// The lines of a neighbour, counter-clockwise.
std::vector<Line> LinesOf(const PlacedShape& of, const Pose<double>& frame) {
  std::vector<Line> lines;
  const bool is_plane = of.shape.type == ShapeType::kHalfPlane;
  for (int i = 0; i < NumLines(of.shape); ++i) {
    const auto line = is_plane ? HalfPlaneLine(of.shape) : EdgeLine(of.shape, i);
    const Vector2<double> normal = of.pose.rotation * line.normal;
    lines.push_back({frame.rotation.Inverse(normal),
                     line.offset + normal.dot(of.pose.position - frame.position)});
  }
  return lines;
}

/// M: of a half-plane 0.
double SizeOf(const ShapeView<double>& shape) {
  double size = 0.0;
  for (int i = 0; i < NumVertices(shape.type, shape.num_numbers); ++i) {
    size = std::max(size, Vertex(shape, i).norm());
  }
  return size;
}

/// The angle from `from` to `to`, in (−π, π].
double Turn(const Vector2<double>& from, const Vector2<double>& to) {
  return std::atan2(Cross(from, to), from.dot(to));
}

/// The angles of a cone from the normal of the edge that ends at its vertex.
struct Cone {
  double low, high;
  void Intersect(const Cone& other) {
    low = std::max(low, other.low);
    high = std::min(high, other.high);
  }
};

/// The lines of a neighbour at a point of it: `count` from `first` on.
struct LinesAt {
  bool is_inside = false;  ///< the point is in the neighbour
  int first = 0;
  int count = 0;
};

LinesAt FindLinesAt(const std::vector<Line>& lines, const Vector2<double>& point, double within) {
  LinesAt at;
  const int n = static_cast<int>(lines.size());
  const auto is_near = [&](int i) { return lines[i].Height(point) >= -within; };
  int runs = 0;
  for (int i = 0; i < n; ++i) {
    if (lines[i].Height(point) > within) {
      return at;
    }
    if (is_near(i)) {
      ++at.count;
      if (n == 1 || !is_near(i == 0 ? n - 1 : i - 1)) {
        at.first = i;
        ++runs;
      }
    }
  }
  // A shape that is thinner than the tolerance hides nothing.
  at.is_inside = at.count == 0 || runs == 1;
  return at;
}

/// Finds what the neighbours of one shape leave of it.
class SeamFinder {
 public:
  SeamFinder(const PlacedShape& placed, ShapeSeams* seams, FlushSteps* steps)
      : placed_(placed), seams_(*seams), steps_(*steps) {
    const int n = NumVertices(placed.shape.type, placed.shape.num_numbers);
    seams_.edges.assign(n, SeamEdge());
    seams_.vertices.assign(n, SeamVertex());
    hidden_.resize(n);
    for (int i = 0; i < n; ++i) {
      SeamEdge& edge = seams_.edges[i];
      edge.start = Vertex(placed.shape, i);
      const Vector2<double> along = Vertex(placed.shape, i + 1 == n ? 0 : i + 1) - edge.start;
      edge.length = along.norm();
      edge.normal = EdgeLine(placed.shape, i).normal;
      edge.tangent = Vector2<double>(-edge.normal.y(), edge.normal.x());
    }
    for (int i = 0; i < n; ++i) {
      cones_.push_back({0.0, Turn(Before(i), After(i))});
    }
  }

  void Add(const PlacedShape& neighbour) {
    const std::vector<Line> lines = LinesOf(neighbour, placed_.pose);
    const Vector2<double>& here = placed_.pose.position;
    const Vector2<double>& there = neighbour.pose.position;
    rounding_ = kLengthRounding * std::max(SizeOf(placed_.shape), SizeOf(neighbour.shape)) +
                kSeamRounding * std::max({std::abs(here.x()), std::abs(here.y()),
                                          std::abs(there.x()), std::abs(there.y())});
    within_ = kFlushStep + rounding_;
    for (size_t i = 0; i < seams_.vertices.size(); ++i) {
      Bound(lines, static_cast<int>(i));
      Hide(lines, static_cast<int>(i));
    }
  }

  /// Returns whether the neighbours take anything.
  bool Finish() {
    bool any = false;
    for (size_t i = 0; i < seams_.vertices.size(); ++i) {
      SeamVertex& vertex = seams_.vertices[i];
      const Cone& cone = cones_[i];
      const Rotation<double> low(cone.low), high(cone.high);
      vertex.is_open = !vertex.is_bounded || cone.high - cone.low > kFlushTurn;
      vertex.first = low * Before(static_cast<int>(i));
      vertex.last = high * Before(static_cast<int>(i));
      FindParts(&hidden_[i], &seams_.edges[i]);
      any = any || vertex.is_bounded || !seams_.edges[i].is_whole;
    }
    return any;
  }

 private:
  const Vector2<double>& Before(int i) const {
    return seams_.edges[i == 0 ? seams_.edges.size() - 1 : i - 1].normal;
  }
  const Vector2<double>& After(int i) const { return seams_.edges[i].normal; }

  /// Bounds the cone of vertex i by a neighbour that contains it.
  void Bound(const std::vector<Line>& lines, int i) {
    const Vector2<double>& point = seams_.edges[i].start;
    const LinesAt at = FindLinesAt(lines, point, within_);
    if (!at.is_inside) {
      return;
    }
    SeamVertex& vertex = seams_.vertices[i];
    vertex.is_bounded = true;
    if (at.count == 0) {
      cones_[i] = {1.0, 0.0};
      return;
    }
    const int n = static_cast<int>(lines.size());
    const Line& first = lines[at.first];
    const Line& last = lines[(at.first + at.count - 1) % n];
    const double low = Turn(Before(i), first.normal);
    const Cone own = cones_[i];
    cones_[i].Intersect({low, low + Turn(first.normal, last.normal)});
    const bool is_flush = std::abs(cones_[i].high - cones_[i].low) <= kFlushTurn;
    const double middle = 0.5 * (cones_[i].low + cones_[i].high);
    const Vector2<double> normal = Rotation<double>(middle) * Before(i);
    double reach = 2.0 * rounding_;
    for (int k = 0; k < at.count; ++k) {
      const Line& line = lines[(at.first + k) % n];
      const double height = line.Height(point);
      if (!is_flush || std::abs(Turn(normal, line.normal)) > kFlushTurn) {
        reach = std::max(reach, height + 2.0 * rounding_);
      } else if (height > rounding_ && own.high - own.low > kFlushTurn) {
        ++steps_.count;
        steps_.highest = std::max(steps_.highest, height);
      }
    }
    vertex.beyond = std::max(vertex.beyond, reach);
  }

  /// Adds the part of edge i that a neighbour hides. Along the edge the neighbour must reach beyond
  /// it; where their normals are opposite it covers the edge up to the tolerance.
  void Hide(const std::vector<Line>& lines, int i) {
    const SeamEdge& edge = seams_.edges[i];
    double from = 0.0;
    double to = edge.length;
    for (const Line& line : lines) {
      const double height = line.Height(edge.start);
      const double slope = line.normal.dot(edge.tangent);
      const double outward = line.normal.dot(edge.normal);
      if (std::abs(slope) <= kFlushTurn) {
        if (height > (outward > 0.0 ? -rounding_ : within_)) {
          return;
        }
      } else if (slope > 0.0) {
        to = std::min(to, -height / slope);
      } else {
        from = std::max(from, -height / slope);
      }
    }
    if (to > from) {
      hidden_[i].push_back({from, to});
    }
  }

  /// The parts between the hidden ones. One that is no longer than the tolerance is a step that
  /// counts as flush.
  void FindParts(std::vector<FreePart>* hidden, SeamEdge* edge) const {
    edge->is_whole = hidden->empty();
    std::sort(hidden->begin(), hidden->end(),
              [](const FreePart& x, const FreePart& y) { return x.from < y.from; });
    hidden->push_back({edge->length, edge->length});
    double from = 0.0;
    for (const FreePart& part : *hidden) {
      if (part.from - from > within_) {
        edge->parts.push_back({from, part.from});
      }
      from = std::max(from, part.to);
    }
  }

  const PlacedShape& placed_;
  ShapeSeams& seams_;
  FlushSteps& steps_;
  std::vector<Cone> cones_;
  std::vector<std::vector<FreePart>> hidden_;
  double rounding_ = 0.0, within_ = 0.0;
};

}  // namespace

bool MayHaveSeams(const ShapeView<double>& shape) {
  switch (shape.type) {
    case ShapeType::kHalfPlane:
      return shape.numbers[0] != 0.0 || shape.numbers[1] != 0.0;
    case ShapeType::kBox:
      return shape.numbers[0] > 0.0 && shape.numbers[1] > 0.0;
    case ShapeType::kPolygon:
      return shape.num_numbers >= 6;
    default:
      return false;
  }
}

bool FindSeams(const PlacedShape& placed, const std::vector<PlacedShape>& neighbours,
               ShapeSeams* seams, FlushSteps* steps) {
  SeamFinder finder(placed, seams, steps);
  for (const PlacedShape& neighbour : neighbours) {
    finder.Add(neighbour);
  }
  return finder.Finish();
}

}  // namespace tangible
