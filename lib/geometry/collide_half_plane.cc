// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/collide_core.h"
#include "tangible/geometry/tolerances.h"

namespace tangible::internal {

int CollideHalfPlane(const ConvexCore& core, const Vector2<double>& normal, double offset,
                     PlaneSide side, double max_gap, ContactFeature features[2]) {
  const auto candidate = [&](int vertex) {
    const double gap = normal.dot(core.VertexAt(vertex)) - offset - core.Radius();
    return side == PlaneSide::kSecond ? Candidate{{FeatureKind::kVertexPlane, vertex, 0}, gap}
                                      : Candidate{{FeatureKind::kPlaneVertex, 0, vertex}, gap};
  };
  int lowest = 0;
  double lowest_height = normal.dot(core.VertexAt(0));
  for (int i = 1; i < core.Size(); ++i) {
    const double height = normal.dot(core.VertexAt(i));
    if (height < lowest_height) {
      lowest = i;
      lowest_height = height;
    }
  }
  Candidate candidates[2] = {candidate(lowest), {}};
  if (candidates[0].gap >= max_gap) {
    return 0;
  }
  if (core.IsPolygon()) {
    // The lowest vertex may lie between the ends of a flat face of several edges; the contacts are
    // at its ends.
    const CoreFace face = FaceAgainst(core, lowest, normal);
    if (face.edge >= 0) {
      candidates[0] = candidate(face.first);
      candidates[1] = candidate(face.last);
      return WriteCandidates(candidates, 2, max_gap, features);
    }
    return WriteCandidates(candidates, 1, max_gap, features);
  }
  const Candidate next = candidate(core.Next(lowest));
  const Candidate previous = candidate(core.Previous(lowest));
  // The lower neighbour is the second contact; where the other neighbour takes its place, both have
  // the same gap. The two corners at the tip of a needle count as one contact, and its other end is
  // the second.
  const auto length = [&](int vertex) {
    return (core.VertexAt(vertex) - core.VertexAt(lowest)).norm();
  };
  bool is_next = next.gap <= previous.gap;
  const double shorter = length(is_next ? core.Next(lowest) : core.Previous(lowest));
  const double longer = length(is_next ? core.Previous(lowest) : core.Next(lowest));
  if (shorter < kTip * longer && (is_next ? previous : next).gap < max_gap) {
    is_next = !is_next;
  }
  candidates[1] = is_next ? next : previous;
  // A capsule without length is a circle.
  const bool is_point =
      core.VertexAt(is_next ? core.Next(lowest) : core.Previous(lowest)) == core.VertexAt(lowest);
  return WriteCandidates(candidates, is_point ? 1 : 2, max_gap, features);
}

}  // namespace tangible::internal
