// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Bodies that follow recorded paths. Their poses and twists are no states but functions of the time
// and of a few numbers of the model,
//
//   q(t) = offset + scale · path(t − delay)         (the angle: offset_angle + path's angle)
//   v(t) = scale · path'(t − delay),   a(t) = scale · path''(t − delay)
//
// which overwrite the state wherever the equations are evaluated, so that nothing accumulates:
//
//   by events       at every instant, with the exact twist and acceleration, of the side of a knot
//                   that an interior time of the motion tells; of several bodies' knots at one
//                   instant, as in recordings of one camera, it tells how many have been passed
//   by fixed steps  at the start of a step, with the twist (q(t + h) − q(t)) / h, which takes them
//                   to q(t + h): contacts and joints of the discrete map see where they go
//
// The derivatives are those of these functions. The delay's is one-sided at a knot at which the
// rate jumps: by events the knot is an edge (event_edges.h) whose time is knot + delay; by fixed
// steps the mean of both sides is taken where it falls on a step's end.

#include <vector>

#include "tangible/dynamics/model/model.h"

namespace tangible {

/// Places of a path's numbers, counted from PathIndex::numbers.
enum PathNumber { kPathDelay = 0, kPathScale, kPathOffsetX, kPathOffsetY, kPathOffsetAngle };
inline constexpr int kNumPathNumbers = 5;

/// Which one-sided rate a time on a knot has.
enum class PathSide { kBefore, kAfter };

/// A time inside the piece on the given side of `time`, beyond the knots that fall on that instant.
double BesideInstant(const ModelStructure& structure, double time, PathSide side);
/// A time at which of the knots that fall on the instant of `time` those of the first paths, up to
/// and with this one, are passed: knots of several paths at one instant are passed in their order.
double BehindPath(const ModelStructure& structure, double time, int path);
/// Times that differ by no more than this are one instant there, s.
double InstantWidth(const ModelStructure& structure, double time);
/// Whether two times are one instant: knots and the ends of steps differ by rounding.
bool IsSameInstant(const ModelStructure& structure, double a, double b);

/// Sets poses and twists of driven bodies to those at `time`, on the piece of `inside`.
template <typename T>
void FollowPathsAt(const Model<T>& model, const T& time, double inside, State<T>* state);
template <typename T>
void FollowPaths(const Model<T>& model, const T& time, double inside, State<T>* state) {
  if (!model.structure->paths.empty()) FollowPathsAt(model, time, inside, state);
}

/// The same for a fixed step of [t, t + h].
template <typename T>
void FollowPathsOverStep(const Model<T>& model, double t, double h, State<T>* state);

/// The accelerations of all bodies whose motion is given, 0 but for driven ones.
template <typename T>
void GivenAccelerations(const Model<T>& model, const T& time, double inside,
                        std::vector<T>* accelerations);

/// The tangent of FollowPaths: sets the rows of driven bodies from those of the time (the one after
/// all variables; a matrix without it has the time given) and of their numbers.
void FollowPathsTangent(const Model<double>& model, double time, double inside, RowMatrixXd* w_dot);
/// The adjoint: moves the rows of driven bodies to those of the time and of their numbers.
void FollowPathsAdjoint(const Model<double>& model, double time, double inside, RowMatrixXd* w_bar);
/// Those of FollowPathsOverStep.
void FollowStepTangent(const Model<double>& model, double t, double h, RowMatrixXd* w_dot);
void FollowStepAdjoint(const Model<double>& model, double t, double h, RowMatrixXd* w_bar);

/// A derivative of a component of a driven body's acceleration by a variable, of which the time is
/// the one after all others.
struct GivenEntry {
  int component;
  int variable;
  double value;
};
/// Lists those of one body; none of a body that is not driven.
void AccelerationEntries(const Model<double>& model, int body, double time, double inside,
                         std::vector<GivenEntry>* entries);

/// The place of a body in ModelStructure::paths; −1: it is not driven.
int PathOfBody(const ModelStructure& structure, int body);

/// Whether a body follows a path that has angles.
bool TurnsAlongPath(const ModelStructure& structure, int body);

/// A bound on the speed (m/s) of the fastest point within `radius` of a driven body's origin over
/// [from, to]; of its turning (rad/s). 0 of other bodies.
double LargestGivenSpeed(const Model<double>& model, int body, double from, double to,
                         double radius);
double LargestGivenTurn(const Model<double>& model, int body, double from, double to);

}  // namespace tangible
