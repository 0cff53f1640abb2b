// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contacts_ahead.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/model/lengths.h"
#include "tangible/dynamics/model/tolerances.h"
#include "tangible/geometry/tolerances.h"

namespace tangible {
namespace {

// The solid beside a vertex: the directions from `first`, counterclockwise, to `last`.
struct Wedge {
  Vector2<double> place{0.0, 0.0}, first{0.0, 0.0}, last{0.0, 0.0};
};

bool HasWedges(const ShapeView<double>& shape) {
  return shape.type == ShapeType::kBox || shape.type == ShapeType::kPolygon ||
         shape.type == ShapeType::kPolyline;
}

Wedge WedgeAt(const ShapeView<double>& shape, const Pose<double>& pose, int vertex) {
  const int n = NumVertices(shape.type, shape.num_numbers);
  const bool repeats_first =
      shape.type == ShapeType::kPolyline && Vertex(shape, 0) == Vertex(shape, n - 1);
  const bool is_open = shape.type == ShapeType::kPolyline && !repeats_first;
  const int size = repeats_first ? n - 1 : n;
  const int at = vertex % size;
  const Vector2<double> place = Vertex(shape, at);
  const auto towards = [&](int other) {
    return Vector2<double>((Vertex(shape, other) - place).normalized());
  };
  Wedge wedge{pose * place, towards((at + 1) % size), towards((at + size - 1) % size)};
  // An open end is a corner, from which the solid goes straight down.
  if (is_open && at == 0) wedge.last = Vector2<double>(-wedge.first.y(), wedge.first.x());
  if (is_open && at == size - 1) wedge.first = Vector2<double>(wedge.last.y(), -wedge.last.x());
  wedge.first = pose.rotation * wedge.first;
  wedge.last = pose.rotation * wedge.last;
  return wedge;
}

// Whether the solids beside two corners overlap. Cones V and C at places v and c do where c − v is
// inside of V − C: where no line separates it from that cone.
bool Overlap(const Wedge& v, const Wedge& c) {
  const auto inside = [](const Wedge& wedge) {
    const Vector2<double> sum = wedge.first + wedge.last;
    const double turn = Cross(wedge.first, wedge.last);
    if (std::abs(turn) <= kFlushTurn) return Vector2<double>(-wedge.first.y(), wedge.first.x());
    return Vector2<double>((turn > 0.0 ? sum : Vector2<double>(-sum)).normalized());
  };
  const Vector2<double> rays[6] = {v.first, v.last, inside(v), -c.first, -c.last, -inside(c)};
  const Vector2<double> apart = c.place - v.place;
  for (const Vector2<double>& ray : rays) {
    for (const double side : {1.0, -1.0}) {
      const Vector2<double> normal(-side * ray.y(), side * ray.x());
      const bool bounds = std::all_of(rays, rays + 6, [&](const Vector2<double>& other) {
        return normal.dot(other) >= -kFlushTurn;
      });
      if (bounds && normal.dot(apart) <= kFlushTurn * apart.norm()) return false;
    }
  }
  return true;
}

// Whether the solids beside the corners of a contact overlap at other poses: the corners of two
// faces of the same width, which meet one above the other, pass by nothing.
bool CornersOverlap(const Model<double>& model, const ActiveContact& contact,
                    const Pose<double>& pose_a, const Pose<double>& pose_b, double near) {
  const ShapeView<double> a = ShapeOfA(model, contact);
  const ShapeView<double> b = ShapeOfB(model, contact);
  const ContactFeature& feature = contact.feature;
  if (!HasWedges(a) || !HasWedges(b) || feature.places > 0) return false;
  const bool a_is_edge = feature.kind == FeatureKind::kEdgeVertex;
  const bool b_is_edge = feature.kind == FeatureKind::kVertexEdge;
  if (!a_is_edge && !b_is_edge && feature.kind != FeatureKind::kVertexVertex) return false;
  const auto end = [](const ShapeView<double>& shape, int edge, int k) {
    return (edge + k) % NumVertices(shape.type, shape.num_numbers);
  };
  for (int k = 0; k < 2; ++k) {
    const Wedge of_a = WedgeAt(a, pose_a, a_is_edge ? end(a, feature.a, k) : feature.a);
    const Wedge of_b = WedgeAt(b, pose_b, b_is_edge ? end(b, feature.b, k) : feature.b);
    if ((of_a.place - of_b.place).norm() <= near && Overlap(of_a, of_b)) return true;
  }
  return false;
}

}  // namespace

Pose<double> PoseAfter(const State<double>& state, int body, double time) {
  const double* pose = &state.pose[3 * body];
  const double* twist = &state.twist[3 * body];
  return Pose<double>(Vector2<double>(pose[0] + time * twist[0], pose[1] + time * twist[1]),
                      pose[2] + time * twist[2]);
}

ContactsAhead FindContactsAhead(const Model<double>& model, const State<double>& state,
                                const ActiveContact& contact, double approach, double size,
                                double tolerance, double slow) {
  ContactsAhead ahead;
  const double time = (std::max(contact.gap, 0.0) + kCorner * size) / -approach;
  const int a = contact.a;
  const int b = contact.b;
  ContactFeature features[2];
  const int count =
      FindFeatures(model, a, PoseAfter(state, a, time), b, PoseAfter(state, b, time),
                   contact.Parts(), std::numeric_limits<double>::infinity(), features);
  for (int k = 0; k < count; ++k) {
    ActiveContact& next = ahead.contacts[k];
    next = contact;
    next.feature = features[k];
    ContactRows<double> rows;
    EvaluateContactRows(model, state, next, &rows);
    next.gap = rows.geometry.gap;
    ahead.speed[k] = RelativeSpeed(state, a, rows.normal_a, b, rows.normal_b);
    if (!(std::abs(next.gap) <= tolerance && ahead.speed[k] > approach + slow)) {
      return ContactsAhead();
    }
  }
  ahead.count = count;
  return ahead;
}

bool HaveCorners(const ModelStructure& structure, const ActiveContact& contact) {
  const auto has = [&](int body) {
    const ShapeType shape = structure.bodies[body].shape;
    return shape != ShapeType::kCircle && shape != ShapeType::kHalfPlane &&
           shape != ShapeType::kSpline;
  };
  return has(contact.a) && has(contact.b);
}

bool PassesBy(const Model<double>& model, const State<double>& state, const ActiveContact& contact,
              double approach, double size, double slow) {
  const double time = (std::max(contact.gap, 0.0) + kCorner * size) / -approach;
  const double past = kCorner * size / -approach;
  const double speed =
      SpeedOf(&state.twist[3 * contact.a], size) + SpeedOf(&state.twist[3 * contact.b], size);
  // What comes down slowly is beside something else by then.
  if (past * speed > kBesideCorner * size) return false;
  const Pose<double> pose_a = PoseAfter(state, contact.a, time);
  const Pose<double> pose_b = PoseAfter(state, contact.b, time);
  if (CornersOverlap(model, contact, pose_a, pose_b, kBesideCorner * size)) return false;
  ContactFeature features[2];
  const int count = FindFeatures(model, contact.a, pose_a, contact.b, pose_b, contact.Parts(),
                                 std::numeric_limits<double>::infinity(), features);
  for (int k = 0; k < count; ++k) {
    ActiveContact next = contact;
    next.feature = features[k];
    if (next.SameAs(contact)) return false;
    ContactRows<double> rows;
    EvaluateContactRows(model, pose_a, pose_b, next, &rows);
    // A step up of more than kFlushStep is a wall, however low.
    if (rows.geometry.gap < -kFlushStep ||
        RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b) < -slow) {
      return false;
    }
  }
  // Behind the end of a run of an outline nothing of it is near.
  return true;
}

}  // namespace tangible
