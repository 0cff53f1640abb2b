// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/flush_corners.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// Whether a place is at one of the ends of its edge: −1, 1, or 0.
int EndAt(const FacePlace& place) {
  if (!place.is_found) return 0;
  const double near = kOverCorner * (1.0 + std::abs(place.along));
  return std::abs(place.along - place.from) <= near ? -1
         : std::abs(place.along - place.to) <= near ? 1
                                                    : 0;
}

}  // namespace

FacePlace PlaceOnFace(const Model<double>& model, const State<double>& state,
                      const ActiveContact& contact) {
  FacePlace place;
  place.of_first = contact.feature.kind == FeatureKind::kEdgeVertex;
  if (!contact.IsOfShapes() ||
      !(place.of_first || contact.feature.kind == FeatureKind::kVertexEdge)) {
    return place;
  }
  const int body = place.of_first ? contact.a : contact.b;
  const BodyIndex& index = model.structure->bodies[body];
  const int part = place.of_first ? contact.feature.part_a : contact.feature.part_b;
  const Outline* const outline = index.has_free_points ? model.OutlineOf(body, part) : nullptr;
  if (outline == nullptr) return place;
  place.edge = place.of_first ? contact.feature.a : contact.feature.b;
  const OutlineRun& run = outline->run(index.RunOfPart(part));
  if (place.edge < run.first || place.edge > run.last) return place;
  ContactRows<double> rows;
  EvaluateContactRows(model, state, contact, &rows);
  const Pose<double> pose = state.PoseOf(body);
  const Vector2<double> point = pose.rotation.Inverse(rows.geometry.point - pose.position);
  place.is_found = true;
  place.along = run.tangent.dot(point - run.start);
  place.from = place.edge > run.first ? outline->StartOfEdge(place.edge) : -HUGE_VAL;
  place.to = place.edge < run.last ? outline->StartOfEdge(place.edge + 1) : HUGE_VAL;
  return place;
}

double SpeedAlongFace(const Model<double>& model, const State<double>& state,
                      const ActiveContact& contact) {
  // So that a body moves by far more than rounding, and by next to nothing of its size.
  double fastest = 0.0;
  for (const int body : {contact.a, contact.b}) {
    for (int i = 0; i < 3; ++i) {
      fastest = std::max(fastest, std::abs(state.twist[3 * static_cast<size_t>(body) + i]));
    }
  }
  if (!(fastest > 0.0)) return 0.0;
  const double time = kAheadOnFace / fastest;
  State<double> ahead = state;
  for (size_t i = 0; i < ahead.pose.size(); ++i) ahead.pose[i] += time * ahead.twist[i];
  return (PlaceOnFace(model, ahead, contact).along - PlaceOnFace(model, state, contact).along) /
         time;
}

bool IsOverFlushCorner(const Model<double>& model, const State<double>& state,
                       const ActiveContact& contact) {
  return EndAt(PlaceOnFace(model, state, contact)) != 0;
}

bool AreOnOneFace(const Model<double>& model, const ActiveContact& x, const ActiveContact& y) {
  if (!x.IsOfShapes() || !x.IsOfTheSameShapes(y) || x.feature.kind != y.feature.kind) return false;
  return x.feature.kind == FeatureKind::kVertexEdge
             ? x.feature.a == y.feature.a && model.OutlineOf(x.b, x.feature.part_b) != nullptr
             : x.feature.kind == FeatureKind::kEdgeVertex && x.feature.b == y.feature.b &&
                   model.OutlineOf(x.a, x.feature.part_a) != nullptr;
}

void TakeEdgeAhead(const Model<double>& model, const State<double>& state, ActiveContact* contact) {
  const FacePlace place = PlaceOnFace(model, state, *contact);
  const int end = EndAt(place);
  if (end == 0 || !(end * SpeedAlongFace(model, state, *contact) > 0.0)) return;
  (place.of_first ? contact->feature.a : contact->feature.b) += end;
}

}  // namespace tangible
