// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/convex_core.h"

#include "tangible/geometry/tolerances.h"

namespace tangible::internal {
namespace {

/// Whether an edge continues a face in the same direction, or has no length.
bool Continues(const ConvexCore& core, const CoreEdge& face, int edge) {
  const CoreEdge next = core.Edge(edge);
  return std::abs(Cross(face.tangent, next.tangent)) <= kLengthRounding &&
         face.tangent.dot(next.tangent) >= 0.0;
}

}  // namespace

CoreFace FaceOfEdge(const ConvexCore& core, int edge, const CoreEdge& line) {
  CoreFace face{edge, edge, core.Next(edge), line};
  if (!core.IsPolygon()) {
    return face;
  }
  for (int i = 0; i < core.Size() && Continues(core, line, face.last); ++i) {
    face.last = core.Next(face.last);
  }
  for (int i = 0; i < core.Size() && Continues(core, line, core.Previous(face.first)); ++i) {
    face.first = core.Previous(face.first);
  }
  face.line.start = core.VertexAt(face.first);
  face.line.length = line.tangent.dot(core.VertexAt(face.last) - face.line.start);
  return face;
}

CoreFace FaceAgainst(const ConvexCore& core, int vertex, const Vector2<double>& direction) {
  if (core.Size() < 2) {
    return CoreFace{};
  }
  // Edges without length are skipped on either side.
  int after = vertex;
  int before = core.Previous(vertex);
  CoreEdge edge_after = core.Edge(after);
  CoreEdge edge_before = core.Edge(before);
  for (int i = 1; i < core.Size() && !(edge_after.length > 0.0); ++i) {
    after = core.Next(after);
    edge_after = core.Edge(after);
  }
  for (int i = 1; i < core.Size() && !(edge_before.length > 0.0); ++i) {
    before = core.Previous(before);
    edge_before = core.Edge(before);
  }
  if (!(edge_after.length > 0.0)) {
    return CoreFace{};
  }
  return edge_after.Normal().dot(direction) <= edge_before.Normal().dot(direction)
             ? FaceOfEdge(core, after, edge_after)
             : FaceOfEdge(core, before, edge_before);
}

}  // namespace tangible::internal
