// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Edges: the given times at which a force's window opens or closes, a joint ends, or a signal or a
// body's path has a corner.
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
// derivative differs on each side, and the segment names the edge at its start. A step of a signal
// at that instant, whose time is given, comes before them.
//
// A joint that ends is released at the edge (model_releases.h): twists go on, and accelerations
// jump. Where the edge of a window or of another joint is at the same instant, the derivatives
// depend on the order, and those by numbers that vary apart are refused (CoincidingEdges).
//
// A knot of a path is an edge at knot + delay. Where the rate jumps there (driven_bodies.h) the
// bodies that touch the driven one, or are joined to it, meet its new twist by an impact as soon as
// the edge has been reached: the jump itself has no impulse. Knots of several bodies' paths at one
// instant, as in recordings of one camera, are passed one after another, each with the impulses
// that follow it; where they drive the same bodies all are passed at once, and derivatives by their
// delays apart are refused (CoupledPaths). At the other knots of a cubic path nothing jumps but the
// third derivative; they are edges for the sake of the integrators' order, and give way to others
// at their instant.

#include <string>
#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

struct Edge {
  double time;
  WindowEdge window;       ///< window.number −1: a corner of a signal
  bool gives_way = false;  ///< a knot at which no rate jumps
  bool steps = false;      ///< a corner at which the signal's value jumps
};

/// The edges within (from, to), in their order; those next to an end of the step do not count.
std::vector<Edge> EdgesWithin(const Model<double>& model, double from, double to);

/// Edges at one instant.
struct EdgeGroup {
  bool any = false;
  double time = 0.0;  ///< of the first
  WindowEdge window;  ///< the first whose time is a parameter
  std::vector<WindowEdge> further;
  bool gives_way = true;  ///< whether `window` is a knot at which no rate jumps
  bool steps = false;     ///< whether a signal's value jumps
  /// Knots of further paths at which a rate jumps, in the order of the paths. Empty beside a
  /// force's window or a joint's end, with which all paths go on.
  std::vector<WindowEdge> paths;
  bool follows = false;  ///< others at its instant have been passed

  void Add(const Edge& edge);
  /// Puts the edges of an instant in their order. Where a signal's value jumps beside a window's
  /// edge, that given time comes first: it must not move with the window's. A knot at which nothing
  /// jumps is left out there.
  void PutInOrder();
  /// What is left behind the first path's knot.
  EdgeGroup Rest() const;
};

/// The first edge after `now` of a sorted list, with those at its instant, which are no farther
/// apart than `rounding` or, if that is more, `width`.
EdgeGroup NextEdges(const std::vector<Edge>& edges, double now, double rounding,
                    double width = 0.0);

/// The edges of windows and the knots at which a rate jumps, on a boundary of steps at `time`.
EdgeGroup EdgesAt(const Model<double>& model, double time);

/// A given time at which what acts on bodies jumps.
struct LoadJump {
  double time;
  std::vector<int> bodies;
  std::string what;            ///< "the window of force push"
  bool is_of_a_joint = false;  ///< whether a joint ends, which an impact meets or not
  int driven = -1;             ///< the body whose speed jumps
};

/// The jumps of loads within [from, to]: windows of forces, steps of signals, ends of joints, and
/// jumps of the rates of paths.
std::vector<LoadJump> LoadJumpsWithin(const Model<double>& model, double from, double to);

/// Whether a signal of the force itself, or the target of its servo, steps within [from, to].
bool OwnSignalSteps(const ModelStructure& structure, const ForceIndex& force, double from,
                    double to);

/// Adds to accelerations at a segment's state the loads (N, N, N m) by which its edges still to
/// come differ from those passed: −F where a window opens, F where it closes.
void AddEdgesToCome(const Model<double>& model, const Segment& segment,
                    ContactProblem<double>* problem);

/// Whether the speed of a driven body jumps at `time` to which a joint holds another body.
bool JumpPullsJoint(const Model<double>& model, double time);

/// Whether the speed of a driven body jumps at `time`.
bool PathJumps(const Model<double>& model, double time);

/// Times at which forces, signals and paths are read for a motion that ends or starts at t.
double JustBefore(const Model<double>& model, double t);
double JustAfter(const Model<double>& model, double t);

/// Empty, or why derivatives along these directions (num_variables x columns) are refused: the time
/// of a jump of a path's rate or of a joint's end and another edge's are the same, though both vary
/// by numbers of their own, and what follows depends on their order. Empty for fixed steps, and of
/// two paths.
std::string CoincidingEdges(const Model<double>& model, const RowMatrixXd& directions);

/// Whether a number of the model is the delay of a path.
bool IsPathsDelay(const ModelStructure& structure, int number);
/// Whether the rates of two paths jump at one instant of the run, whose delays vary apart.
bool HasCoincidingPaths(const Model<double>& model, const RowMatrixXd& directions);
/// Empty, or why derivatives along these directions are refused: the delays `number` and `other` of
/// two paths, which jump at `time` (s) and drive the same bodies, vary apart.
std::string CoupledPaths(const Model<double>& model, const RowMatrixXd& directions, int number,
                         int other, double time);

}  // namespace tangible
