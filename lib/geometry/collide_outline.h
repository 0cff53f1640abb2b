// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What the features of outlines against other shapes and against outlines share. Internal to the
// module.

#include <algorithm>

#include "tangible/geometry/outline.h"
#include "tangible/geometry/tolerances.h"

namespace tangible::internal {

/// The normals of a corner, counter-clockwise from the normal of the edge that ends there to that
/// of the edge that starts there.
struct NormalCone {
  Vector2<double> first, last;
  bool is_bounded = false;  ///< by a neighbour at whose seam the corner is
  /// Whether edges have these normals: not the line's end at an open end.
  bool has_first = true, has_last = true;
  bool Contains(const Vector2<double>& direction) const {
    return Cross(first, direction) >= -kFlushTurn && Cross(direction, last) >= -kFlushTurn &&
           direction.dot(first + last) > 0.0;
  }
  /// Whether a face whose outward normal is −`direction` may come to lie on one of the corner's
  /// edges: its contact with the corner is the second one of two faces that are nearly parallel.
  bool Faces(const Vector2<double>& direction) const {
    return Contains(direction) || (!is_bounded && ((has_first && direction.dot(first) > kFacing) ||
                                                   (has_last && direction.dot(last) > kFacing)));
  }
};

/// The cone that a neighbour leaves of a corner's; `bound` null: it bounds nothing.
inline NormalCone BoundedCone(const NormalCone& cone, const SeamVertex* bound) {
  return bound == nullptr ? cone : NormalCone{bound->first, bound->last, true};
}

/// `pose` in a frame.
inline Pose<double> RelativeTo(const Pose<double>& frame, const Pose<double>& pose) {
  Pose<double> relative;
  relative.position = frame.Inverse(pose.position);
  relative.angle = pose.angle - frame.angle;
  relative.rotation.cosine =
      frame.rotation.cosine * pose.rotation.cosine + frame.rotation.sine * pose.rotation.sine;
  relative.rotation.sine =
      frame.rotation.cosine * pose.rotation.sine - frame.rotation.sine * pose.rotation.cosine;
  return relative;
}

/// The normal of the run at a convex joint, or of the wall down from an open end, that a point over
/// another run, a little behind both, is nearer to; none, and where neighbours hide a part of the
/// outline: 0.
Vector2<double> NearerNormal(const Outline& outline, int run, const Vector2<double>& x);

/// Whether a corner at x is over a run. Just behind it and beside its end it is, however near the
/// next run is, where it does not face that one: the corner of a body that rocks on a face of its
/// own width. `faces` says whether the corner faces a run with a given normal.
template <typename Faces>
bool IsOverOrBehind(const Outline& outline, int run, const Vector2<double>& x, const Faces& faces) {
  if (outline.IsOver(run, x)) return true;
  const Vector2<double> beside = NearerNormal(outline, run, x);
  return !beside.isZero(0.0) && !faces(beside);
}

inline double DistanceOfSegment(const Vector2<double>& start, const Vector2<double>& end,
                                const Vector2<double>& x) {
  const Vector2<double> along = end - start;
  const double square = along.squaredNorm();
  const double share = square > 0.0 ? std::clamp(along.dot(x - start) / square, 0.0, 1.0) : 0.0;
  return (x - start - share * along).norm();
}

/// Whether two segments cross. Those that only touch do not, nor those on one line, which may be
/// apart.
inline bool SegmentsCross(const Vector2<double>& a, const Vector2<double>& b,
                          const Vector2<double>& c, const Vector2<double>& d) {
  const auto sides = [](const Vector2<double>& from, const Vector2<double>& to,
                        const Vector2<double>& x, const Vector2<double>& y) {
    return Cross(Vector2<double>(to - from), Vector2<double>(x - from)) *
           Cross(Vector2<double>(to - from), Vector2<double>(y - from));
  };
  return sides(a, b, c, d) < 0.0 && sides(c, d, a, b) < 0.0;
}

}  // namespace tangible::internal
