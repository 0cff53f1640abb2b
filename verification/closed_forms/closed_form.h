// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Motions that are known in closed form (or as the solution of a reduced ordinary differential
// equation), each with a scene that has this motion.
//
// A case has physical parameters p (a height, a slope, a time T of observation). They enter
//
//   exact   outputs(p): the formula
//   scene   numbers of the scene, by path: n(p)
//   read    outputs from p and the engine's final state
//
// and all three are written in Jets over p, so that they carry every derivative: those of the
// formula, the chain dn/dp from physical parameters to numbers of the scene, and with the engine's
// d state/dn its derivative of the outputs. T is not a number of a scene, so that the engine's
// derivative with respect to it is not compared.
//
// A derivative of `exact` that is NaN does not exist on both sides (friction at rest, v = 0).

#include <ceres/jet.h>

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/scene.h"

namespace tangible::closed_forms {

inline constexpr int kMaxParameters = 16;

/// A number with its derivatives with respect to the parameters of a case.
using Number = ceres::Jet<double, kMaxParameters>;
using NumberMap = std::map<std::string, Number>;

/// The kind of motion, which determines what an integrator can compute exactly.
enum class Kind {
  kBallistic,   ///< constant accelerations between impacts
  kFrictional,  ///< constant accelerations between changes of the contacts' modes
  kSmooth,      ///< accelerations vary: the integrator's order shows
};

/// Six numbers for each moving body: x, y, angle, vx, vy, omega, in the scene's order.
using FinalState = std::vector<Number>;

struct ClosedForm {
  std::string name;
  Kind kind = Kind::kBallistic;
  std::vector<std::pair<std::string, double>> parameters;  ///< physical; "T" is the duration
  std::vector<std::string> outputs;
  std::function<std::vector<Number>(const NumberMap& p)> exact;
  std::string scene_json;  ///< bodies, joints; its numbers are placeholders where `numbers` has one
  /// Path and value of the numbers that the parameters set.
  std::function<std::vector<std::pair<std::string, Number>>(const NumberMap& p)> numbers;
  std::function<std::vector<Number>(const NumberMap& p, const FinalState& state)> read;
  double instant = 0.0;  ///< s; a case without "T": length of its only step
};

using Inputs = std::map<std::string, double>;

// Each function takes its parameters by name, in SI units. `T` is the time of observation, not that
// of an event.

/// y0, v0, e, g, r, T: a disc that falls on a floor; as many bounces as there are before T.
ClosedForm Drop(const std::string& name, const Inputs& inputs);
/// x0, y0, vx0, vy0, e, phi, d, r, g, T: a disc that bounces from the wall n·x = d, n at angle phi.
ClosedForm ObliqueWall(const std::string& name, const Inputs& inputs);
/// m1, m2, e, r1, r2, x1, y1, x2, y2, vx1, vy1, vx2, vy2, g, T.
ClosedForm TwoDiscs(const std::string& name, const Inputs& inputs);
/// m1, m2, m3, e12, e23, r, x1, x2, x3, v1, v2, v3, T: balls on a line, one collision after
/// another.
ClosedForm ThreeBalls(const std::string& name, const Inputs& inputs);
/// x0, y0, th0, vx0, vy0, w0, e, mu, g, r, m, I, T: a spinning disc that hits a rough floor once.
ClosedForm FrictionalImpact(const std::string& name, const Inputs& inputs);

/// x0, v0, mu, g, m, T: a block slides on a floor and stops.
ClosedForm SlidingBlock(const std::string& name, const Inputs& inputs);
/// s0, v0, alpha, mu, g, m, T: a block on a slope; s, v downhill.
ClosedForm Incline(const std::string& name, const Inputs& inputs);
/// x0, th0, v0, w0, mu, g, m, r, I, T: a disc that slips, then rolls.
ClosedForm SlideToRoll(const std::string& name, const Inputs& inputs);
/// s0, th0, v0, w0, alpha, mu, g, m, r, I, T: a disc that rolls down a slope from v0 = −w0 r.
ClosedForm Rolling(const std::string& name, const Inputs& inputs);
/// w, h, m, mu, g, F, hp: accelerations at rest of a box that F pushes at height hp: it stands,
/// slides, tips, or does both.
ClosedForm BoxPush(const std::string& name, const Inputs& inputs);

/// m, L, Ic, g, theta0, T: released at rest; Jacobi's elliptic functions. With Ic = 0 the scene has
/// no derivative with respect to it.
ClosedForm PhysicalPendulum(const std::string& name, const Inputs& inputs);
/// m1, m2, l1, l2, c1, c2, I1, I2, g, th1_0, th2_0, w1_0, w2_0, T; angles from the downward
/// vertical. With I1 = I2 = 0 point masses (c = l): c1, c2, I1, I2 are then no parameters.
/// Reference: extrapolation of order 16 of the two equations of motion.
ClosedForm DoublePendulum(const std::string& name, const Inputs& inputs);
/// w, h, m, mu, g, F, T: a box tips from rest about its front lower corner, pushed at its rear
/// upper one. Reference: as for the double pendulum.
ClosedForm BoxTip(const std::string& name, const Inputs& inputs);

/// All of the above, each with values for its parameters.
std::vector<ClosedForm> AllClosedForms();

/// Values of the parameters with unit derivatives.
NumberMap SeededParameters(const ClosedForm& form);

/// The named inputs, in that order. All of `names` must be there.
std::vector<std::pair<std::string, double>> Take(const Inputs& inputs,
                                                 const std::vector<std::string>& names);

/// Makes the derivatives of `numbers` with respect to the parameter `p` NaN: they do not exist.
void DropDerivative(const Number& p, std::vector<Number>* numbers);

/// The scene in doubles, and the weights of the parameters on its numbers.
struct PreparedScene {
  Scene scene;
  /// A direction for each parameter: (index into EnumerateNumbers, dn/dp).
  std::vector<std::vector<std::pair<int, double>>> directions;
};

/// CHECKs that every path names one number: a programmer's error otherwise.
PreparedScene Prepare(const ClosedForm& form);

}  // namespace tangible::closed_forms
