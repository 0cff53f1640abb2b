// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/collide_core.h"

#include <cmath>

#include "tangible/geometry/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible::internal {
namespace {

/// The largest distance along two faces at which their ends count as one above the other, m. It is
/// a power of two, hence locally constant: otherwise the place where features change would depend
/// on the lengths of the faces, and that derivative would be missing.
double AlignedWithin(const CoreEdge& a, const CoreEdge& b) {
  return std::ldexp(kAligned, std::ilogb(a.length + b.length));
}

/// A pair seen from the body whose face is the reference.
struct Sides {
  const ConvexCore& reference;
  const ConvexCore& incident;
  bool reference_is_first;

  ContactFeature VertexOnReference(int vertex, int edge) const {
    return reference_is_first ? ContactFeature{FeatureKind::kEdgeVertex, edge, vertex}
                              : ContactFeature{FeatureKind::kVertexEdge, vertex, edge};
  }
  ContactFeature VertexOnIncident(int vertex, int edge) const {
    return reference_is_first ? ContactFeature{FeatureKind::kVertexEdge, vertex, edge}
                              : ContactFeature{FeatureKind::kEdgeVertex, edge, vertex};
  }
  double Radii() const { return reference.Radius() + incident.Radius(); }
};

/// An edge of one core and the vertex of the other that is deepest below it.
struct FaceQuery {
  int edge = -1;  ///< −1: the core has no edge
  int vertex = 0;
  double separation = -kInfinity;  ///< m, between the cores
  CoreEdge line;                   ///< the edge
};

/// The edge with the largest height of the other core above it. The distance of the cores is at
/// least this separation, and equal to it where the nearest points are a vertex and the inside of
/// an edge.
FaceQuery QueryFaces(const ConvexCore& faces, const ConvexCore& points) {
  FaceQuery best;
  const int num_edges = faces.Size() > 1 ? faces.Size() : 0;
  for (int i = 0; i < num_edges; ++i) {
    const CoreEdge edge = faces.Edge(i);
    if (!(edge.length > 0.0)) {
      continue;
    }
    const auto [vertex, separation] = points.DeepestOver(edge);
    if (best.edge < 0 || separation > best.separation) {
      best = {i, vertex, separation, edge};
    }
  }
  return best;
}

/// Whether the projection of a point onto a face lies on it, up to a fraction of its length.
bool IsOver(const CoreEdge& line, const Vector2<double>& point, double fraction) {
  const double along = line.tangent.dot(point - line.start);
  return along >= -fraction * line.length && along <= (1.0 + fraction) * line.length;
}

/// The two ends of the overlap of two opposing faces.
struct FaceEnds {
  Candidate candidates[2];
  int count = 0;
};

/// A vertex of each face, one over the other, seen from either face.
struct VertexOverVertex {
  Candidate of_incident, of_reference;

  VertexOverVertex(const Sides& sides, const CoreFace& reference, const CoreFace& incident,
                   int reference_vertex, int incident_vertex)
      : of_incident{sides.VertexOnReference(incident_vertex, reference.edge),
                    reference.line.Height(sides.incident.VertexAt(incident_vertex)) -
                        sides.Radii()},
        of_reference{
            sides.VertexOnIncident(reference_vertex, incident.edge),
            incident.line.Height(sides.reference.VertexAt(reference_vertex)) - sides.Radii()} {}

  bool IsTie(double tie) const { return std::abs(of_incident.gap - of_reference.gap) <= tie; }
  /// The vertex of the first body is chosen, so that rounding does not decide.
  const Candidate& Chosen(const Sides& sides) const {
    return sides.reference_is_first ? of_reference : of_incident;
  }
};

/// Adds the contact at one end of the overlap. `overhang`: how far the incident face ends inside of
/// the reference face; `tie`: the distance up to which two ends count as one above the other. Adds
/// nothing where the vertex of the reference face does not project onto the incident face and the
/// incident vertex is beyond the end of the reference face. A vertex that is beyond the end by
/// rounding alone is a contact, because it may be the nearest one.
void AddEnd(const Sides& sides, const CoreFace& reference, const CoreFace& incident,
            int reference_vertex, int incident_vertex, double overhang, double tie,
            FaceEnds* ends) {
  const VertexOverVertex vertices(sides, reference, incident, reference_vertex, incident_vertex);
  // The projection may be beyond the end by `tie` as well, so that the result does not depend on
  // which face rounding has made the reference.
  const bool has_foot =
      IsOver(incident.line, sides.reference.VertexAt(reference_vertex), tie / incident.line.length);
  if (std::abs(overhang) <= tie && has_foot && vertices.IsTie(tie)) {
    ends->candidates[ends->count++] = vertices.Chosen(sides);
  } else if (overhang >= (has_foot ? 0.0 : -tie)) {
    ends->candidates[ends->count++] = vertices.of_incident;
  } else if (has_foot) {
    ends->candidates[ends->count++] = vertices.of_reference;
  }
}

/// There is one end where the faces are parallel and overlap in no more than a point, and none
/// where they do not oppose each other.
FaceEnds FindFaceEnds(const Sides& sides, const CoreFace& reference, const CoreFace& incident) {
  FaceEnds ends;
  if (incident.edge < 0 || reference.line.tangent.dot(incident.line.tangent) >= 0.0) {
    return ends;
  }
  // Coordinates along the reference face; an opposing face runs in the other direction.
  const auto along = [&](int vertex) {
    return reference.line.tangent.dot(sides.incident.VertexAt(vertex) - reference.line.start);
  };
  const double low = along(incident.last);
  const double high = along(incident.first);
  const double length = reference.line.length;
  const double overlap = (high < length ? high : length) - (low > 0.0 ? low : 0.0);
  const double tie = AlignedWithin(reference.line, incident.line);
  if (overlap <= tie) {
    const bool at_last = high > length;
    const VertexOverVertex vertices(sides, reference, incident,
                                    at_last ? reference.last : reference.first,
                                    at_last ? incident.last : incident.first);
    if (overlap >= -tie && vertices.IsTie(tie)) {
      ends.candidates[ends.count++] = vertices.Chosen(sides);
    }
    return ends;
  }
  AddEnd(sides, reference, incident, reference.first, incident.last, low, tie, &ends);
  AddEnd(sides, reference, incident, reference.last, incident.first, length - high, tie, &ends);
  return ends;
}

/// Finds the nearest vertex over an edge of `sides.reference`, if it is nearer than `*distance`.
void NearestOverEdges(const Sides& sides, double* distance, FaceQuery* nearest) {
  const int num_edges = sides.reference.Size() > 1 ? sides.reference.Size() : 0;
  for (int i = 0; i < num_edges; ++i) {
    const CoreEdge edge = sides.reference.Edge(i);
    for (int j = 0; j < sides.incident.Size() && edge.length > 0.0; ++j) {
      const Vector2<double> point = sides.incident.VertexAt(j);
      const double height = edge.Height(point);
      // The vertex may be behind the edge by rounding only; otherwise it is near another edge.
      if (height >= -kLengthRounding * edge.length && height < *distance &&
          IsOver(edge, point, kLengthRounding)) {
        *distance = height;
        *nearest = {i, j, height, edge};
      }
    }
  }
}

Candidate NearestVertices(const ConvexCore& a, const ConvexCore& b) {
  Candidate nearest;
  nearest.feature = {FeatureKind::kVertexVertex, 0, 0};
  double best = kInfinity;
  for (int i = 0; i < a.Size(); ++i) {
    const Vector2<double> vertex = a.VertexAt(i);
    for (int j = 0; j < b.Size(); ++j) {
      const double square = (vertex - b.VertexAt(j)).squaredNorm();
      if (square < best) {
        best = square;
        nearest.feature = {FeatureKind::kVertexVertex, i, j};
      }
    }
  }
  nearest.gap = std::sqrt(best) - a.Radius() - b.Radius();
  return nearest;
}

/// Contacts with the reference face of `query`, whose deepest vertex is a valid contact. Where the
/// overlap does not have two ends, this is the only contact.
int CollideFaces(const Sides& sides, const FaceQuery& query, const CoreFace& reference,
                 const FaceEnds& ends, double max_gap, ContactFeature features[2]) {
  if (ends.count > 0) {
    return WriteCandidates(ends.candidates, ends.count, max_gap, features);
  }
  const Candidate deepest = {sides.VertexOnReference(query.vertex, reference.edge),
                             query.separation - sides.Radii()};
  return WriteCandidates(&deepest, 1, max_gap, features);
}

/// For cores that are apart while no face of either separates them best, or rounding hides it:
/// compares all vertices with all edges and vertices.
int CollideNearest(const ConvexCore& a, const ConvexCore& b, double max_gap,
                   ContactFeature features[2]) {
  const Candidate vertices = NearestVertices(a, b);
  double distance = kInfinity;
  FaceQuery query_a;
  FaceQuery query_b;
  NearestOverEdges({a, b, true}, &distance, &query_a);
  NearestOverEdges({b, a, false}, &distance, &query_b);
  const double vertex_distance = vertices.gap + a.Radius() + b.Radius();
  // No edge was found, because distances overflow.
  const bool has_edge = query_a.edge >= 0 || query_b.edge >= 0;
  if (!has_edge || !(distance <= vertex_distance * (1.0 + kLengthRounding))) {
    return WriteCandidates(&vertices, 1, max_gap, features);
  }
  const Sides sides = query_b.edge >= 0 ? Sides{b, a, false} : Sides{a, b, true};
  const FaceQuery& query = query_b.edge >= 0 ? query_b : query_a;
  const CoreFace reference = FaceOfEdge(sides.reference, query.edge, query.line);
  const CoreFace incident = FaceAgainst(sides.incident, query.vertex, reference.line.Normal());
  return CollideFaces(sides, query, reference, FindFaceEnds(sides, reference, incident), max_gap,
                      features);
}

}  // namespace

int WriteCandidates(const Candidate* candidates, int count, double max_gap,
                    ContactFeature features[2]) {
  int written = 0;
  const int first = count > 1 && candidates[1].gap < candidates[0].gap ? 1 : 0;
  for (int i = 0; i < count; ++i) {
    const Candidate& candidate = candidates[i == 0 ? first : 1 - first];
    if (candidate.gap < max_gap) {
      features[written++] = candidate.feature;
    }
  }
  return written;
}

int CollideCores(const ConvexCore& a, const ConvexCore& b, double max_gap,
                 ContactFeature features[2]) {
  const double max_separation = max_gap + a.Radius() + b.Radius();
  const FaceQuery query_a = QueryFaces(a, b);
  // A vertex that counts as above the end of a face may be beyond the end by the tolerance, and
  // hence farther away than its gap.
  const auto is_far = [&](const FaceQuery& query) {
    return query.separation >= max_separation &&
           query.separation >= max_separation + kBeyondEnd * query.line.length;
  };
  if (is_far(query_a)) {
    return 0;
  }
  const FaceQuery query_b = QueryFaces(b, a);
  if (is_far(query_b)) {
    return 0;
  }
  if (query_a.edge < 0 && query_b.edge < 0) {
    const Candidate vertices = NearestVertices(a, b);
    return WriteCandidates(&vertices, 1, max_gap, features);
  }
  const bool is_first = query_a.separation >= query_b.separation;
  const Sides sides = is_first ? Sides{a, b, true} : Sides{b, a, false};
  const FaceQuery& query = is_first ? query_a : query_b;
  const CoreFace reference = FaceOfEdge(sides.reference, query.edge, query.line);
  const CoreFace incident = FaceAgainst(sides.incident, query.vertex, reference.line.Normal());
  const FaceEnds ends = FindFaceEnds(sides, reference, incident);

  // The deepest vertex over the face with the largest separation is the nearest pair, or the least
  // depth.
  const double length = reference.line.length + incident.line.length;
  bool is_face_contact =
      IsOver(reference.line, sides.incident.VertexAt(query.vertex), kLengthRounding);
  // The faces are parallel, and rounding may have chosen a vertex beside the overlap, while the
  // ends of the overlap are equally near.
  for (int i = 0; i < ends.count && !is_face_contact; ++i) {
    is_face_contact =
        ends.candidates[i].gap <= query.separation - sides.Radii() + kLengthRounding * length;
  }
  // In penetration the direction of least depth is the normal of a face.
  if (is_face_contact || query.separation < -kLengthRounding * length) {
    return CollideFaces(sides, query, reference, ends, max_gap, features);
  }
  return CollideNearest(a, b, max_gap, features);
}

}  // namespace tangible::internal
