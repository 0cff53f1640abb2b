// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Edges: the given times at which a force's window opens or closes or a signal has a corner.
//
// A segment that ends at an edge s has the length s − t, and the next one starts at s. With S_τ⁻
// and S_τ⁺ the rates of both motions, which differ by the force and by what it changes,
//
//   ∂x⁺/∂s = S_τ⁻ − S_τ⁺
//
// An edge on the boundary of two steps is a segment of zero length at the start of the second one
// (AddEdgesAtStart), with the forces from before the edge: the state there does not change, but its
// derivative does. At the start of a run there is no motion before, and at its end none after: the
// derivatives of both sides differ, and no segment is added. Where several windows' edges s₁ ≤ s₂ …
// fall on one instant, there is a segment of zero length between each two of them, with the modes
// that contacts have between them (AddFurtherEdges). If another order gives other accelerations the
// derivative differs on each side, and the segment names the edge at its start.

#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

struct Edge {
  double time;
  WindowEdge window;  ///< window.number −1: a corner of a signal
};

/// The edges within (from, to), in their order; those next to an end of the step do not count.
std::vector<Edge> EdgesWithin(const Model<double>& model, double from, double to);

/// Edges at one instant.
struct EdgeGroup {
  bool any = false;
  double time = 0.0;  ///< of the first
  WindowEdge window;  ///< the first whose time is a parameter
  std::vector<WindowEdge> further;

  void Add(const Edge& edge);
};

/// The first edge after `now` of a sorted list, with those at its instant.
EdgeGroup NextEdges(const std::vector<Edge>& edges, double now, double rounding);

/// The edges of windows on the boundary of two steps at `time`.
EdgeGroup EdgesAt(const Model<double>& model, double time);

/// Adds to accelerations at a segment's state the loads (N, N, N m) by which its edges still to
/// come differ from those passed: −F where a window opens, F where it closes.
void AddEdgesToCome(const Model<double>& model, const Segment& segment,
                    ContactProblem<double>* problem);

}  // namespace tangible
