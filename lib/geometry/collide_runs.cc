// SPDX-License-Identifier: Apache-2.0
//
// The features of the runs of two outlines, A and B.
//
// A corner belongs to the run that starts there, so that each corner is a contact of one pair of
// runs. Over the other outline's run it is one where it points towards it; where both corners are
// beyond the runs of the other outline, the distance of the two is the gap.

#include <algorithm>
#include <cmath>

#include "tangible/geometry/collide_core.h"
#include "tangible/geometry/collide_outline.h"
#include "tangible/math/scalar.h"

namespace tangible::internal {
namespace {

struct RunCorner {
  int vertex = 0;
  Vector2<double> place;
  NormalCone cone;
  int before = -1, after = -1;  ///< the runs that end and start there; −1: none
};

bool IsOpen(const SeamVertex* bound) { return bound == nullptr || bound->is_open; }

/// Whether the start of a run is a corner that neighbours leave free; and its end, at any joint.
bool StartsAtCorner(const Outline& outline, int run) {
  const OutlineJoint joint = outline.run(run).before;
  return (joint == OutlineJoint::kConvex || joint == OutlineJoint::kEnd) &&
         IsOpen(outline.BoundedStart(run));
}
bool EndsAtCorner(const Outline& outline, int run) {
  const OutlineJoint joint = outline.run(run).after;
  return (joint == OutlineJoint::kConvex || joint == OutlineJoint::kEnd) &&
         IsOpen(outline.BoundedEnd(run));
}

RunCorner StartOf(const Outline& outline, int run) {
  const OutlineRun& of = outline.run(run);
  const int before = of.before == OutlineJoint::kEnd ? -1 : outline.Previous(run);
  const NormalCone cone{before >= 0 ? outline.run(before).normal : Vector2<double>(-of.tangent),
                        of.normal, false, before >= 0};
  return {of.first, of.start, BoundedCone(cone, outline.BoundedStart(run)), before, run};
}

RunCorner EndCornerOf(const Outline& outline, int run) {
  const OutlineRun& of = outline.run(run);
  const int after = of.after == OutlineJoint::kEnd ? -1 : outline.Next(run);
  return {outline.EndOf(run), outline.EndPlace(run),
          BoundedCone({of.normal, after >= 0 ? outline.run(after).normal : of.tangent, false, true,
                       after >= 0},
                      outline.BoundedEnd(run)),
          run, after};
}

/// The corners that belong to a run.
int CornersOf(const Outline& outline, int run, RunCorner corners[2]) {
  int count = 0;
  if (StartsAtCorner(outline, run)) corners[count++] = StartOf(outline, run);
  if (outline.run(run).after == OutlineJoint::kEnd && EndsAtCorner(outline, run)) {
    corners[count++] = EndCornerOf(outline, run);
  }
  return count;
}

/// Whether a point is over neither run of a corner, on the free side: the same tests as those of
/// the runs, so that rounding leaves out no place and takes none twice.
bool IsBeyond(const Outline& outline, const RunCorner& corner, const Vector2<double>& x) {
  const Vector2<double> arm = x - corner.place;
  if (corner.cone.is_bounded && !corner.cone.Contains(arm.normalized())) return false;
  if (corner.after < 0) {
    const OutlineRun& before = outline.run(corner.before);
    return !outline.IsBeforeEnd(corner.before, x) && before.normal.dot(arm) >= 0.0;
  }
  if (outline.IsAfterStart(corner.after, x)) return false;
  if (corner.before >= 0) return !outline.IsBeforeEnd(corner.before, x);
  const OutlineRun& after = outline.run(corner.after);
  return after.tangent.dot(arm) < 0.0 && after.normal.dot(arm) >= 0.0;
}

/// One outline as seen from the other one: `pose` is that of `own` in the frame of `other`.
struct View {
  const Outline& own;
  const Outline& other;
  Pose<double> pose;
  Vector2<double> ToOther(const Vector2<double>& x) const { return pose * x; }
  Vector2<double> ToOwn(const Vector2<double>& x) const { return pose.Inverse(x); }
  Vector2<double> DirectionToOther(const Vector2<double>& d) const { return pose.rotation * d; }
  Vector2<double> DirectionToOwn(const Vector2<double>& d) const {
    return pose.rotation.Inverse(d);
  }
};

/// Whether a corner is a contact with a run of the other outline.
bool IsOverRun(const View& view, const RunCorner& corner, int run) {
  const auto faces = [&](const Vector2<double>& normal) {
    return corner.cone.Faces(view.DirectionToOwn(Vector2<double>(-normal)));
  };
  return faces(view.other.run(run).normal) &&
         IsOverOrBehind(view.other, run, view.ToOther(corner.place), faces);
}

/// Whether a corner over a run is above a corner of it that is a contact with one of the edges that
/// meet in the first one: then that contact acts, so that rounding does not choose between them.
bool IsAboveCorner(const View& view, const View& back, const RunCorner& corner, int run) {
  const OutlineRun& of = view.other.run(run);
  const double s = of.tangent.dot(view.ToOther(corner.place) - of.start);
  const auto takes = [&](const RunCorner& below, double foot) {
    for (const int face : {corner.before, corner.after}) {
      if (face < 0) continue;
      const OutlineRun& own = view.own.run(face);
      if (std::abs(s - foot) <= kAligned * (of.length + own.length) &&
          -view.DirectionToOther(own.normal).dot(of.normal) > kFacing &&
          IsOverRun(back, below, face)) {
        return true;
      }
    }
    return false;
  };
  return (StartsAtCorner(view.other, run) && takes(StartOf(view.other, run), 0.0)) ||
         (EndsAtCorner(view.other, run) && takes(EndCornerOf(view.other, run), of.length));
}

class RunPair {
 public:
  RunPair(const PlacedRun& a, const PlacedRun& b)
      : a_(a),
        b_(b),
        of_a_{a.outline, b.outline, RelativeTo(b.pose, a.pose)},
        of_b_{b.outline, a.outline, RelativeTo(a.pose, b.pose)} {}

  int Find(double max_gap, ContactFeature features[2]) {
    RunCorner of_a[2], of_b[2];
    const int num_a = CornersOf(a_.outline, a_.run, of_a);
    const int num_b = CornersOf(b_.outline, b_.run, of_b);
    for (int i = 0; i < num_a; ++i) {
      if (!IsOverRun(of_a_, of_a[i], b_.run)) continue;
      AddOverRun(of_a_, of_a[i], b_.run, FeatureKind::kVertexEdge);
    }
    for (int j = 0; j < num_b; ++j) {
      if (!IsOverRun(of_b_, of_b[j], a_.run)) continue;
      if (IsAboveCorner(of_b_, of_a_, of_b[j], a_.run)) continue;
      AddOverRun(of_b_, of_b[j], a_.run, FeatureKind::kEdgeVertex);
    }
    for (int i = 0; i < num_a; ++i) {
      for (int j = 0; j < num_b; ++j) TryCorners(of_a[i], of_b[j]);
    }
    std::sort(found_, found_ + count_,
              [](const Candidate& x, const Candidate& y) { return x.gap < y.gap; });
    return WriteCandidates(found_, std::min(count_, 2), max_gap, features);
  }

 private:
  void AddOverRun(const View& view, const RunCorner& corner, int run, FeatureKind kind) {
    const OutlineRun& of = view.other.run(run);
    const Vector2<double> arm = view.ToOther(corner.place) - of.start;
    const int edge = view.other.EdgeAt(run, of.tangent.dot(arm));
    const bool is_first = kind == FeatureKind::kVertexEdge;
    found_[count_++] = {{kind, is_first ? corner.vertex : edge, is_first ? edge : corner.vertex},
                        of.normal.dot(arm)};
  }

  void TryCorners(const RunCorner& of_a, const RunCorner& of_b) {
    const Vector2<double> x = of_a_.ToOther(of_a.place);
    const double distance = (x - of_b.place).norm();
    if (distance > 0.0 && IsBeyond(b_.outline, of_b, x) &&
        IsBeyond(a_.outline, of_a, of_b_.ToOther(of_b.place))) {
      found_[count_++] = {{FeatureKind::kVertexVertex, of_a.vertex, of_b.vertex}, distance};
    }
  }

  const PlacedRun& a_;
  const PlacedRun& b_;
  const View of_a_, of_b_;
  Candidate found_[8];
  int count_ = 0;
};

}  // namespace
}  // namespace tangible::internal

namespace tangible {

int FindFeaturesOfRuns(const PlacedRun& a, const PlacedRun& b, double max_gap,
                       ContactFeature features[2]) {
  return internal::RunPair(a, b).Find(max_gap, features);
}

double DistanceOfRuns(const PlacedRun& a, const PlacedRun& b, int* end_a, int* end_b) {
  const Pose<double> relative = internal::RelativeTo(b.pose, a.pose);
  const Vector2<double> of_a[2] = {relative * a.of().start, relative * a.outline.EndPlace(a.run)};
  const Vector2<double> of_b[2] = {b.of().start, b.outline.EndPlace(b.run)};
  double best = kInfinity;
  double nearest = kInfinity;
  for (int i = 0; i < 2; ++i) {
    best = std::min({best, internal::DistanceOfSegment(of_b[0], of_b[1], of_a[i]),
                     internal::DistanceOfSegment(of_a[0], of_a[1], of_b[i])});
    for (int j = 0; j < 2; ++j) {
      const double square = (of_a[i] - of_b[j]).squaredNorm();
      if (square >= nearest) continue;
      nearest = square;
      *end_a = i == 0 ? a.of().first : a.outline.EndOf(a.run);
      *end_b = j == 0 ? b.of().first : b.outline.EndOf(b.run);
    }
  }
  if (internal::SegmentsCross(of_a[0], of_a[1], of_b[0], of_b[1])) return 0.0;
  return best;
}

}  // namespace tangible
