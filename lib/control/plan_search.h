// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Plans from many starts, for costs with many minima, of which descent finds the nearest: a ball
// that is missed, a pendulum that has to gather momentum first.
//
//   draw    u(t) constant in each of P pieces of the horizon, uniform within the bounds; the first
//           start is the initial controls, the others are the best of kDrawsOfStart draws each, by
//           the cost of their rollouts
//   sample  before that: draws around a mean that moves to the best ones; the best of all is a
//           start. In pieces z = (z_1 … z_P), z ~ N(m, s²), clamped to the bounds,
//             cross-entropy  m, s ← mean and deviation of the best tenth
//             MPPI           m ← Σ w z / Σ w,  w = exp(−(J − J_least) / λ),  λ: the J that a tenth
//                            is below, above J_least
//           (Rubinstein, Kroese, "The cross-entropy method", 2004; Williams, Aldrich, Theodorou,
//           "Model predictive path integral control", 2017)
//   polish  iLQR with exact Jacobians from each start, by successive halving: the better half goes
//           on with twice the iterations, until one is left and has all of them
//
// Each draw has a generator of its own, and each polish a system of its own: results have the same
// bits for any number of threads.

#include <string>
#include <vector>

#include "tangible/control/ilqr.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

struct StartOptions {
  int count = 1;   ///< >= 1; 1: the initial controls alone
  int pieces = 4;  ///< P >= 1, of draws and of samples
  unsigned seed = 0;
};

enum class SamplingMethod { kCrossEntropy, kMppi };
/// "cross_entropy", "mppi".
const char* NameOf(SamplingMethod method);

struct SamplingOptions {
  SamplingMethod method = SamplingMethod::kCrossEntropy;
  int samples = 0;  ///< of each iteration; 0: no sampling
  int iterations = 5;
  unsigned seed = 0;
};

struct SearchOptions {
  StartOptions starts{};
  SamplingOptions sampling{};
  IlqrOptions ilqr{};
  int threads = 0;  ///< 0: one for each core
  /// Whether anything but the initial controls is tried.
  bool searches() const { return starts.count > 1 || sampling.samples > 0; }
};

struct SearchResult {
  /// Of the best start, but for `rollouts` and `linearisations`, which are those of all.
  IlqrResult best;
  long drawn = 0;                      ///< draws and samples that were rolled out
  std::vector<double> start_costs;     ///< of each start, before it was polished
  std::vector<double> polished_costs;  ///< and after as many iterations as it had
  int chosen = 0;
};

/// What a search needs of a problem; initial controls are steps x m.
struct SearchProblem {
  const RolloutFunction* function = nullptr;  ///< its scene, over the horizon, and its controls
  const Cost* cost = nullptr;
  VectorX<double> low, high;
};

/// Plans from the starts of the options; what fails in all of them is the result's message.
SearchResult SearchPlan(const SearchProblem& problem, const RowMatrixXd& initial,
                        const SearchOptions& options);

}  // namespace tangible
