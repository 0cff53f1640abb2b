// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/seams.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tangible/geometry/collide_outline.h"
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

/// What a neighbour leaves of the normals at a point.
struct NormalsAt {
  bool is_inside = false;  ///< the point is in the neighbour, or on it
  bool any = false;        ///< the cone from `first` to `last`, counter-clockwise
  Vector2<double> first{0.0, 0.0}, last{0.0, 0.0};
  std::vector<Line> faces;  ///< that meet there
};

NormalsAt NormalsOf(const std::vector<Line>& lines, const Vector2<double>& point, double within) {
  const LinesAt at = FindLinesAt(lines, point, within);
  NormalsAt normals;
  normals.is_inside = at.is_inside;
  if (!at.is_inside || at.count == 0) return normals;
  for (int k = 0; k < at.count; ++k) {
    normals.faces.push_back(lines[(at.first + k) % static_cast<int>(lines.size())]);
  }
  normals.any = true;
  normals.first = normals.faces.front().normal;
  normals.last = normals.faces.back().normal;
  return normals;
}

/// An outline in the frame of a shape.
class NeighbouringOutline {
 public:
  NeighbouringOutline(const PlacedShape& of, const Pose<double>& frame)
      : outline_(*of.outline), pose_(internal::RelativeTo(frame, of.pose)) {}

  NormalsAt NormalsOf(const Vector2<double>& point, double within) const {
    const Vector2<double> x = pose_.Inverse(point);
    std::vector<int> near;
    outline_.ForEachRun(Around(x, x, within), [&](int i) {
      const OutlineRun& run = outline_.run(i);
      const double s = run.tangent.dot(x - run.start);
      if (std::abs(run.normal.dot(x - run.start)) <= within && s >= -within &&
          s <= run.length + within) {
        near.push_back(i);
      }
    });
    NormalsAt normals;
    if (near.empty()) {
      if (!AddEndFace(x, within, &normals)) normals.is_inside = Contains(x);
      return normals;
    }
    // A solid that is thinner than the tolerance hides nothing.
    if (near.size() > 2) return normals;
    if (near.size() == 2 && outline_.Next(near[0]) != near[1]) std::swap(near[0], near[1]);
    if (near.size() == 2 && outline_.Next(near[0]) != near[1]) return normals;
    normals.is_inside = true;
    for (const int i : near) {
      const OutlineRun& run = outline_.run(i);
      const Vector2<double> normal = pose_.rotation * run.normal;
      normals.faces.push_back({normal, normal.dot(pose_ * run.start)});
    }
    const OutlineRun& first = outline_.run(near.front());
    normals.any = near.size() == 1 || first.after != OutlineJoint::kConcave;
    normals.first = normals.faces.front().normal;
    normals.last = normals.faces.back().normal;
    const double s = first.tangent.dot(x - first.start);
    if (near.size() == 1 && first.before == OutlineJoint::kEnd && s <= within) {
      normals.first = pose_.rotation * Vector2<double>(-first.tangent);
    }
    if (near.size() == 1 && first.after == OutlineJoint::kEnd && s >= first.length - within) {
      normals.last = pose_.rotation * first.tangent;
    }
    return normals;
  }

  /// Adds the parts of a line of this length whose points are in the solid.
  void AddHidden(const Vector2<double>& start, const Vector2<double>& tangent, double length,
                 double within, std::vector<FreePart>* hidden) const {
    const Vector2<double> from = pose_.Inverse(start);
    const Vector2<double> along = pose_.rotation.Inverse(tangent);
    std::vector<double> places{0.0, length};
    const auto add = [&](double place) {
      if (place > 0.0 && place < length) places.push_back(place);
    };
    const Vector2<double> to = from + length * along;
    outline_.ForEachRun(Around(from, to, within), [&](int i) {
      const OutlineRun& run = outline_.run(i);
      const double slope = run.normal.dot(along);
      if (std::abs(slope) > kFlushTurn) add(-run.normal.dot(from - run.start) / slope);
      add(along.dot(run.start - from));
      add(along.dot(outline_.EndPlace(i) - from));
    });
    // Behind an open line that ends beside the shape.
    for (const int i : {0, outline_.num_runs() - 1}) {
      const OutlineRun& run = outline_.run(i);
      const double turn = run.tangent.dot(along);
      if (!IsOpen() || std::abs(turn) <= kFlushTurn) continue;
      add(-run.tangent.dot(from - run.start) / turn);
      add((run.length - run.tangent.dot(from - run.start)) / turn);
    }
    std::sort(places.begin(), places.end());
    for (size_t k = 1; k < places.size(); ++k) {
      const double middle = 0.5 * (places[k - 1] + places[k]);
      if (places[k] - places[k - 1] > within && Contains(from + middle * along)) {
        hidden->push_back({places[k - 1], places[k]});
      }
    }
  }

 private:
  static Aabb Around(const Vector2<double>& x, const Vector2<double>& y, double within) {
    return {std::min(x.x(), y.x()) - within, std::min(x.y(), y.y()) - within,
            std::max(x.x(), y.x()) + within, std::max(x.y(), y.y()) + within};
  }
  bool IsOpen() const { return outline_.Next(outline_.num_runs() - 1) < 0; }
  bool Contains(const Vector2<double>& x) const {
    if (outline_.IsPolygon()) return outline_.Contains(x);
    for (int i = 0; i < outline_.num_runs(); ++i) {
      const OutlineRun& run = outline_.run(i);
      if (run.normal.dot(x - run.start) < 0.0 && outline_.IsOver(i, x)) return true;
    }
    return IsOpen() && (IsBehindEnd(false, x) || IsBehindEnd(true, x));
  }
  // Near the end of an open line IsOver takes what is below it for what lies beside the end. What
  // is solid below the line, farther from its end, is solid up to where it ends.
  bool IsBehindEnd(bool at_end, const Vector2<double>& x) const {
    const int i = at_end ? outline_.num_runs() - 1 : 0;
    const OutlineRun& run = outline_.run(i);
    const Vector2<double> inwards = at_end ? Vector2<double>(-run.tangent) : run.tangent;
    const double depth = -run.normal.dot(x - run.start);
    const double s = run.tangent.dot(x - run.start);
    return depth > 0.0 && s >= 0.0 && s <= run.length && outline_.IsOver(i, x + depth * inwards);
  }
  // The face that goes down from where an open line ends, at a point of it.
  bool AddEndFace(const Vector2<double>& x, double within, NormalsAt* normals) const {
    for (const bool at_end : {false, true}) {
      const OutlineRun& run = outline_.run(at_end ? outline_.num_runs() - 1 : 0);
      const Vector2<double> outwards = at_end ? run.tangent : Vector2<double>(-run.tangent);
      const Vector2<double> end = at_end ? run.start + run.length * run.tangent : run.start;
      const double beyond = outwards.dot(x - end);
      if (!IsOpen() || std::abs(beyond) > within) continue;
      if (!Contains(x - (beyond + within) * outwards)) continue;
      const Vector2<double> normal = pose_.rotation * outwards;
      normals->faces.push_back({normal, normal.dot(pose_ * end)});
      normals->is_inside = normals->any = true;
      normals->first = normals->last = normal;
      return true;
    }
    return false;
  }

  const Outline& outline_;
  const Pose<double> pose_;
};

/// Finds what the neighbours of one shape leave of it.
class SeamFinder {
 public:
  SeamFinder(const PlacedShape& placed, ShapeSeams* seams, FlushSteps* steps)
      : placed_(placed), seams_(*seams), steps_(*steps) {
    placed.outline != nullptr ? TakeRuns(*placed.outline) : TakeEdges();
    seams_.vertices.assign(sides_.size(), SeamVertex());
    hidden_.resize(seams_.edges.size());
    for (const Sides& sides : sides_) {
      cones_.push_back({0.0, sides.is_corner ? Turn(sides.before, sides.after) : -1.0});
    }
  }

  void Add(const PlacedShape& neighbour) {
    const Vector2<double>& here = placed_.pose.position;
    const Vector2<double>& there = neighbour.pose.position;
    rounding_ = kLengthRounding * std::max(SizeOf(placed_.shape), SizeOf(neighbour.shape)) +
                kSeamRounding * std::max({std::abs(here.x()), std::abs(here.y()),
                                          std::abs(there.x()), std::abs(there.y())});
    within_ = kFlushStep + rounding_;
    const int num_vertices = static_cast<int>(seams_.vertices.size());
    const int num_edges = static_cast<int>(seams_.edges.size());
    if (neighbour.outline != nullptr) {
      const NeighbouringOutline outline(neighbour, placed_.pose);
      for (int i = 0; i < num_vertices; ++i) {
        Bound(outline.NormalsOf(PlaceOf(i), within_), i);
      }
      for (int i = 0; i < num_edges; ++i) {
        const SeamEdge& edge = seams_.edges[i];
        outline.AddHidden(edge.start + 2.0 * within_ * edge.normal, edge.tangent, edge.length,
                          within_, &hidden_[i]);
      }
      return;
    }
    const std::vector<Line> lines = LinesOf(neighbour, placed_.pose);
    for (int i = 0; i < num_vertices; ++i) {
      Bound(NormalsOf(lines, PlaceOf(i), within_), i);
    }
    for (int i = 0; i < num_edges; ++i) Hide(lines, i);
  }

  /// Returns whether the neighbours take anything.
  bool Finish() {
    bool any = false;
    for (size_t i = 0; i < seams_.vertices.size(); ++i) {
      SeamVertex& vertex = seams_.vertices[i];
      const Cone& cone = cones_[i];
      const Rotation<double> low(cone.low), high(cone.high);
      vertex.is_open = !vertex.is_bounded || cone.high - cone.low > kFlushTurn;
      vertex.first = low * sides_[i].before;
      vertex.last = high * sides_[i].before;
      any = any || vertex.is_bounded;
    }
    for (size_t i = 0; i < seams_.edges.size(); ++i) {
      FindParts(&hidden_[i], &seams_.edges[i]);
      any = any || !seams_.edges[i].is_whole;
    }
    return any;
  }

 private:
  /// The normals beside a vertex, of the edge that ends there and of the one that starts there.
  struct Sides {
    bool is_corner = true;  ///< the outline is not concave there
    Vector2<double> before{0.0, 0.0}, after{0.0, 0.0};
  };

  void TakeEdges() {
    const int n = NumVertices(placed_.shape.type, placed_.shape.num_numbers);
    for (int i = 0; i < n; ++i) {
      SeamEdge& edge = seams_.edges.emplace_back();
      edge.start = Vertex(placed_.shape, i);
      const Vector2<double> along = Vertex(placed_.shape, i + 1 == n ? 0 : i + 1) - edge.start;
      edge.length = along.norm();
      edge.normal = EdgeLine(placed_.shape, i).normal;
      edge.tangent = Vector2<double>(-edge.normal.y(), edge.normal.x());
    }
    for (int i = 0; i < n; ++i) {
      sides_.push_back({true, seams_.edges[i == 0 ? n - 1 : i - 1].normal, seams_.edges[i].normal});
    }
  }

  void TakeRuns(const Outline& outline) {
    const int n = outline.num_runs();
    for (int i = 0; i < n; ++i) {
      const OutlineRun& run = outline.run(i);
      seams_.edges.push_back({run.start, run.tangent, run.normal, run.length, true, {}});
      const int previous = outline.Previous(i);
      const Vector2<double> before =
          previous >= 0 ? outline.run(previous).normal : Vector2<double>(-run.tangent);
      const bool is_corner =
          run.before == OutlineJoint::kConvex || run.before == OutlineJoint::kEnd;
      sides_.push_back({is_corner, before, run.normal});
    }
    const OutlineRun& last = outline.run(n - 1);
    if (last.after == OutlineJoint::kEnd) sides_.push_back({true, last.normal, last.tangent});
  }

  Vector2<double> PlaceOf(int vertex) const {
    if (vertex < static_cast<int>(seams_.edges.size())) return seams_.edges[vertex].start;
    const SeamEdge& last = seams_.edges.back();
    return last.start + last.length * last.tangent;
  }

  /// Bounds the cone of vertex i by a neighbour that leaves these normals there.
  void Bound(const NormalsAt& at, int i) {
    if (!at.is_inside || !sides_[i].is_corner) {
      return;
    }
    SeamVertex& vertex = seams_.vertices[i];
    const Vector2<double> point = PlaceOf(i);
    const Vector2<double>& before = sides_[i].before;
    vertex.is_bounded = true;
    if (!at.any) {
      cones_[i] = {1.0, 0.0};
      return;
    }
    const double low = Turn(before, at.first);
    const Cone own = cones_[i];
    cones_[i].Intersect({low, low + Turn(at.first, at.last)});
    const bool is_flush = std::abs(cones_[i].high - cones_[i].low) <= kFlushTurn;
    const double middle = 0.5 * (cones_[i].low + cones_[i].high);
    const Vector2<double> normal = Rotation<double>(middle) * before;
    double reach = 2.0 * rounding_;
    for (const Line& line : at.faces) {
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
  std::vector<Sides> sides_;
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
    case ShapeType::kPolyline:
      return true;
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
