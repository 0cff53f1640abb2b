// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/collide_core.h"

#include <cmath>

#include "tangible/geometry/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible::internal {
namespace {

/// How far apart two faces' ends may be along them, m. A power of two: where features change, and
/// what a run makes of it, must not depend on the faces' lengths, whose derivative would be
/// missing.
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

/// The edge that the other core is farthest in front of. The distance of the cores is at least the
/// separation, and equal to it where a vertex is nearest to the inside of an edge.
FaceQuery QueryFaces(const ConvexCore& faces, const ConvexCore& points) {
  FaceQuery best;
  const int num_edges = faces.Size() > 1 ? faces.Size() : 0;
  for (int i = 0; i < num_edges; ++i) {
    const CoreEdge edge = faces.Edge(i);
    if (!(edge.length > 0.0)) {
      continue;
    }
    FaceQuery query{i, 0, kInfinity, edge};
    for (int j = 0; j < points.Size(); ++j) {
      const double height = edge.Height(points.VertexAt(j));
      if (height < query.separation) {
        query.vertex = j;
        query.separation = height;
      }
    }
    if (best.edge < 0 || query.separation > best.separation) {
      best = query;
    }
  }
  return best;
}

/// Whether the foot of a point lies on a face, up to a fraction of its length.
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
  /// The first body's vertex stands, whichever rounding prefers.
  const Candidate& Chosen(const Sides& sides) const {
    return sides.reference_is_first ? of_reference : of_incident;
  }
};

/// One end of the overlap. `overhang`: how far the incident face ends inside of the reference face;
/// `tie`: how far apart ends may be that count as one above the other.
/// Adds nothing where the reference's vertex has no foot on the incident face and the incident one
/// is beyond the reference's end; by rounding alone it is not beyond, and may be the nearest there
/// is.
void AddEnd(const Sides& sides, const CoreFace& reference, const CoreFace& incident,
            int reference_vertex, int incident_vertex, double overhang, double tie,
            FaceEnds* ends) {
  const VertexOverVertex vertices(sides, reference, incident, reference_vertex, incident_vertex);
  // As far beyond the end as vertices count as one above the other: what is found must not depend
  // on which face rounding made the reference.
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

/// One where they overlap in no more than a point, and are parallel; none where they do not oppose
/// each other.
FaceEnds FindFaceEnds(const Sides& sides, const CoreFace& reference, const CoreFace& incident) {
  FaceEnds ends;
  if (incident.edge < 0 || reference.line.tangent.dot(incident.line.tangent) >= 0.0) {
    return ends;
  }
  // Along the reference face; an opposing face runs the other way.
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

/// The nearest vertex over an edge of `sides.reference`, if nearer than `*distance`.
void NearestOverEdges(const Sides& sides, double* distance, FaceQuery* nearest) {
  const int num_edges = sides.reference.Size() > 1 ? sides.reference.Size() : 0;
  for (int i = 0; i < num_edges; ++i) {
    const CoreEdge edge = sides.reference.Edge(i);
    for (int j = 0; j < sides.incident.Size() && edge.length > 0.0; ++j) {
      const Vector2<double> point = sides.incident.VertexAt(j);
      const double height = edge.Height(point);
      // Behind an edge by no more than rounding: else the vertex is near another one.
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

/// Contacts with the reference face of `query`, whose deepest vertex is a valid contact. Without
/// two ends there is the one.
int CollideFaces(const Sides& sides, const FaceQuery& query, const CoreFace& reference,
                 const FaceEnds& ends, double max_gap, ContactFeature features[2]) {
  if (ends.count > 0) {
    return WriteCandidates(ends.candidates, ends.count, max_gap, features);
  }
  const Candidate deepest = {sides.VertexOnReference(query.vertex, reference.edge),
                             query.separation - sides.Radii()};
  return WriteCandidates(&deepest, 1, max_gap, features);
}

/// The cores are apart and no face of either separates them best, or rounding hid it: compares all
/// vertices with all edges and vertices.
int CollideNearest(const ConvexCore& a, const ConvexCore& b, double max_gap,
                   ContactFeature features[2]) {
  const Candidate vertices = NearestVertices(a, b);
  double distance = kInfinity;
  FaceQuery query_a;
  FaceQuery query_b;
  NearestOverEdges({a, b, true}, &distance, &query_a);
  NearestOverEdges({b, a, false}, &distance, &query_b);
  const double vertex_distance = vertices.gap + a.Radius() + b.Radius();
  // No edge at all: distances that overflow.
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
  // A vertex that counts as above the end of a face may be as far beyond it, and so further away
  // than its gap says.
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

  // The deepest vertex over the face of largest separation is the nearest pair, or the least way
  // out.
  const double length = reference.line.length + incident.line.length;
  bool is_face_contact =
      IsOver(reference.line, sides.incident.VertexAt(query.vertex), kLengthRounding);
  // Parallel faces: rounding may have chosen a vertex beside the overlap, whose ends are as near.
  for (int i = 0; i < ends.count && !is_face_contact; ++i) {
    is_face_contact =
        ends.candidates[i].gap <= query.separation - sides.Radii() + kLengthRounding * length;
  }
  // In penetration the least way out is through a face.
  if (is_face_contact || query.separation < -kLengthRounding * length) {
    return CollideFaces(sides, query, reference, ends, max_gap, features);
  }
  return CollideNearest(a, b, max_gap, features);
}

}  // namespace tangible::internal
