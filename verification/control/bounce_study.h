// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Plans through a bounce: a hammer on a slider strikes a falling ball so that it bounces once and
// is in a cup at the end. From how many random starts is it found, and with which derivatives?
//
//   exact      event stepping: the Jacobians hold the jumps of the impacts
//   extended   the same, and late and early runs are compared with the plan's motion extended
//              across the impact (control/reference_extension.h)
//   surrogate  the same as exact, beginning with means of Jacobians over sampled motions
//              (control/sampled_surrogate.h)
//   starts     the best of several starts, drawn at random, each polished with exact Jacobians
//              (control/plan_search.h)
//   sampling   one start that the cross-entropy method has found, polished likewise
//   fixed      fixed steps: exact Jacobians of a map that is not the motion
//
// Whatever made a plan, it is played by event stepping: what counts is where the ball ends there.

#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "tangible/math/scalar.h"
#include "tangible/scene/scene.h"

namespace tangible::bounce {

/// Empty, or one line: what the scene lacks of bodies "hammer" and "ball" and a joint "slider".
std::string CheckScene(const Scene& scene);

/// A scene as CheckScene expects it.
struct Problem {
  Scene scene;
  double effort = 0.0;             ///< N, held: where plans start
  Vector2<double> cup{0.0, 0.0};   ///< m
  Vector2<double> ball{0.0, 0.0};  ///< m, where it begins to fall
  double ball_speed = 0.0;         ///< m/s, along x
};

/// The ball is uniformly random around the scene's: its position in ±0.1 m and ±0.15 m, its speed
/// along x in ±0.1 m/s. The cup is where random efforts bring it, as far as it is struck: one in
/// [4, 14] N that is held, or with more than one piece one within the bounds in each piece of the
/// time. Plans start at another one in [3, 10] N.
Problem Draw(const Scene& scene, unsigned seed, unsigned number, int pieces = 1);

enum class Method { kExact, kExtended, kSurrogate, kStarts, kSampling, kFixed };
inline constexpr Method kMethods[] = {Method::kExact,  Method::kExtended, Method::kSurrogate,
                                      Method::kStarts, Method::kSampling, Method::kFixed};
/// "exact", "extended", "surrogate", "starts", "sampling", "fixed".
const char* NameOf(Method method);

/// A success: the ball's centre ends so near to the cup's, m.
inline constexpr double kInCup = 0.02;

struct Outcome {
  double distance = 0.0;  ///< m, of the ball from the cup, played by event stepping
  double believed = 0.0;  ///< m, in the steps that the plan was made with
  int iterations = 0;     ///< of the plan that was chosen
  double cpu_seconds = 0.0;
  bool Success() const { return distance <= kInCup; }
};
Outcome Solve(const Problem& problem, Method method, int iterations, int starts = 5);

/// What a short step against the fixed steps' gradient at the start does to the cost of the motion,
/// by the gradient of event stepping.
enum class Direction { kNothing, kDown, kUp };
Direction OfFixedGradient(const Problem& problem);

struct Row {
  Problem problem;                        ///< without the scene
  Outcome outcomes[std::size(kMethods)];  ///< by kMethods
  Direction fixed = Direction::kNothing;
};
struct StudyOptions {
  unsigned seed = 1;
  int problems = 100;   ///< how many are run
  int first = 0;        ///< the number of the first one
  int stride = 1;       ///< from one number to the next
  int pieces = 1;       ///< of the efforts that draw the cups
  int iterations = 60;  ///< of each plan
  int starts = 5;       ///< of the search from several starts
  int threads = 1;
  std::vector<Method> methods{std::begin(kMethods), std::end(kMethods)};  ///< those that are run
};
/// Problems first, first + stride, … of the seed; `progress` is told how many are done.
std::vector<Row> Run(const Scene& scene, const StudyOptions& options,
                     const std::function<void(long)>& progress);

}  // namespace tangible::bounce
