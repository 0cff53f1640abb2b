// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/parameter_effects.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tangible/estimation/fit/block_system.h"
#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/fit/profile.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/fit/windows.h"

namespace tangible {

Eigen::VectorXd EffectsOf(const BlockLayout& layout, const Linearisation& model) {
  std::vector<RowMatrixXd> blocks;
  for (const BlockFactor& block : model.blocks) {
    blocks.emplace_back(block.jacobian());
  }
  return BlockSystem(layout, blocks,
                     std::vector<bool>(static_cast<size_t>(layout.num_parameters()), false))
      .lengths();
}

int FindNoEffect(const Eigen::VectorXd& effect) {
  for (Eigen::Index k = 0; k < effect.size(); ++k) {
    if (!(effect[k] > kNoEffect)) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

namespace {

/// Whether a move of a parameter by its own magnitude leaves the cost as it is, although its
/// derivative, as small as it is, would change it: then that is the rounding of terms that cancel.
bool ChangesNothing(const Eigen::VectorXd& p, Eigen::Index k,
                    const std::vector<ParameterEntry>& entries, Linearizer* linearizer) {
  const ParameterEntry& entry = entries[static_cast<size_t>(k)];
  const double step = std::max(std::abs(p[k]), entry.scale);
  if (entry.logarithmic || !(p[k] + step < entry.upper)) return false;
  const HuberBounds plain{0.0, 0.0};
  Linearisation model, target;
  Eigen::VectorXd moved = p, blocks;
  moved[k] += step;
  double cost = 0.0;
  if (!linearizer->Linearise(ToInternal(entries, p), plain, &model, &target) ||
      !linearizer->Cost(ToInternal(entries, moved), plain, &blocks, &cost)) {
    return false;
  }
  const double expected = std::abs(target.gradient[k] * step);
  return expected > kSeenInCost * target.cost &&
         std::abs(cost - target.cost) < kShareOfExpected * expected;
}

}  // namespace

void LeaveOutRounding(const Eigen::VectorXd& p, const std::vector<ParameterEntry>& entries,
                      Linearizer* linearizer, Eigen::VectorXd* effect) {
  const HuberBounds plain{0.0, 0.0};
  const Eigen::VectorXd all = *effect;
  // Beside random forces that explain nearly all, other effects are small and real.
  const LeastSquaresProblem& problem = *linearizer->problem();
  for (int block = 0; block < problem.num_blocks(); ++block) {
    if (problem.num_noise_rows(block) > 0) return;
  }
  const auto effect_of = [&](Eigen::Index k) {
    const ParameterEntry& entry = entries[static_cast<size_t>(k)];
    return all[k] * (entry.logarithmic ? 1.0 : std::max(std::abs(p[k]), entry.scale));
  };
  double largest = 0.0;
  for (Eigen::Index k = 0; k < all.size(); ++k) largest = std::max(largest, effect_of(k));
  for (Eigen::Index k = 0; k < all.size(); ++k) {
    bool is_rounding = effect_of(k) < std::min(kRoundingBeside * largest, kNotSeen);
    if (!is_rounding && effect_of(k) < kMayBeRounding) {
      const ParameterEntry& entry = entries[static_cast<size_t>(k)];
      const double step = kBesideStep * std::max(std::abs(p[k]), entry.scale);
      Eigen::VectorXd beside = p;
      beside[k] += p[k] + step < entry.upper ? step : -step;
      Linearisation model;
      Linearisation target;
      is_rounding = linearizer->Linearise(ToInternal(entries, beside), plain, &model, &target) &&
                    std::abs(EffectsOf(linearizer->layout(), model)[k] - all[k]) >
                        kChangesAsRounding * all[k];
    }
    if (!is_rounding && effect_of(k) < kMayBeRounding) {
      is_rounding = ChangesNothing(p, k, entries, linearizer);
    }
    if (is_rounding) (*effect)[k] = 0.0;
  }
}

Eigen::VectorXd WithoutParameter(const FitOptions& options, int parameter, bool by_windows,
                                 const Eigen::VectorXd& p, LeastSquaresProblem* problem,
                                 long* rollouts) {
  if (problem->entries().size() < 2) return {};
  ProblemWithHeld held(parameter, p[parameter], problem);
  if (by_windows) {
    const FitApproachResult grown = GrowWindows(options, held.Left(p), &held, nullptr);
    *rollouts += grown.rollouts;
    return grown.iterations > 0 ? held.All(grown.parameters) : Eigen::VectorXd();
  }
  const Minimum minimum = Minimise(
      options, held.Left(p), [] { return 0.0; }, {}, &held);
  *rollouts += minimum.rollouts;
  return minimum.status == FitStatus::kFailed ? Eigen::VectorXd() : held.All(minimum.parameters);
}

}  // namespace tangible
