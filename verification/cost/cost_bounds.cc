// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_bounds.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

namespace tangible::cost {
namespace {

constexpr int kBoundedParameters = 8;

// The largest ratio of a method's cells with at most this many parameters.
CheckedBound LargestRatio(const std::string& what, double limit, CostMethod method,
                          int most_parameters, long least_steps,
                          const std::vector<CostCell>& cells) {
  CheckedBound bound{what, limit, std::nan(""), "no such cell was measured"};
  for (const CostCell& cell : cells) {
    if (cell.method == method && cell.measured() && cell.parameters <= most_parameters &&
        cell.steps >= least_steps) {
      bound.measured =
          bound.why_not.empty() ? std::max(bound.measured, cell.ratio()) : cell.ratio();
      bound.why_not.clear();
    }
  }
  return bound;
}

const CostCell* Find(const std::vector<CostCell>& cells, CostMethod method, int parameters,
                     long steps) {
  for (const CostCell& cell : cells) {
    if (cell.method == method && cell.parameters == parameters && cell.steps == steps &&
        cell.measured()) {
      return &cell;
    }
  }
  return nullptr;
}

Crossover CrossoverOf(const std::vector<CostCell>& cells, long steps, CostMethod method,
                      CostMethod other) {
  Crossover crossover{steps, method, other, std::nan(""), false};
  double last_log = 0.0;    // log of time / other's time, at the last number of parameters
  double last_count = 0.0;  // 0: none yet
  for (const CostCell& cell : cells) {
    if (cell.steps != steps || cell.method != method || !cell.measured()) {
      continue;
    }
    const CostCell* rival = Find(cells, other, cell.parameters, steps);
    if (rival == nullptr) {
      continue;
    }
    // Each time is relative to the rollout of its own run, because the machine's speed varies from
    // cell to cell.
    const double log = std::log(cell.ratio() / rival->ratio());
    if (log < 0.0 && std::isnan(crossover.parameters)) {
      crossover.from_the_first = last_count == 0.0;
      crossover.parameters = last_count == 0.0 ? cell.parameters
                                               : last_count * std::pow(cell.parameters / last_count,
                                                                       last_log / (last_log - log));
    } else if (log >= 0.0) {
      crossover.parameters = std::nan("");
    }
    last_log = log;
    last_count = cell.parameters;
  }
  return crossover;
}

}  // namespace

std::vector<CheckedBound> CheckBounds(const CostBounds& bounds, const std::vector<CostCell>& cells,
                                      const CostCell& long_run) {
  std::vector<CheckedBound> checked;
  checked.push_back(LargestRatio("adjoint, any number of parameters: rollouts", bounds.adjoint,
                                 CostMethod::kAdjoint, 1 << 30, bounds.least_steps, cells));
  checked.push_back(LargestRatio("tangent, 8 parameters: rollouts", bounds.tangent,
                                 CostMethod::kTangent, kBoundedParameters, bounds.least_steps,
                                 cells));
  checked.push_back(LargestRatio("implicit Jets, 8 parameters: rollouts", bounds.implicit_jet,
                                 CostMethod::kImplicitJets, kBoundedParameters, bounds.least_steps,
                                 cells));
  if (WidestJetBuilt() != kBoundedParameters) {
    checked.back().measured = std::nan("");
    checked.back().why_not = "the widest Jet built has " + std::to_string(WidestJetBuilt()) +
                             " derivatives (TANGIBLE_JET_WIDTHS)";
  }
  const std::string run = "adjoint of " + std::to_string(long_run.steps) + " steps: ";
  checked.push_back({run + "MiB of the process", bounds.long_run_mib,
                     static_cast<double>(long_run.peak_bytes) / kMebibyte, long_run.instead});
  checked.push_back(
      {run + "extra rollouts", bounds.runs_again, long_run.runs_again, long_run.instead});
  if (!long_run.measured()) {
    // A budget that does not suffice breaks the bound; it is not a reason not to check it.
    for (size_t i = checked.size() - 2; i < checked.size(); ++i) {
      checked[i].measured = HUGE_VAL;
      checked[i].why_not.clear();
      checked[i].what += " (" + long_run.instead + ")";
    }
  }
  return checked;
}

std::string BrokenBound(const std::vector<CheckedBound>& bounds,
                        const std::vector<CostCell>& cells) {
  for (const CostCell& cell : cells) {
    if (cell.failed) {
      return std::string(NameOf(cell.method)) + ", " + std::to_string(cell.parameters) +
             " parameters, " + std::to_string(cell.steps) + " steps: " + cell.instead;
    }
  }
  for (const CheckedBound& bound : bounds) {
    if (!bound.holds()) {
      std::ostringstream text;
      text << bound.what << " " << bound.measured << ", expected at most " << bound.limit;
      return text.str();
    }
  }
  return "";
}

std::vector<Crossover> Crossovers(const std::vector<CostCell>& cells) {
  std::set<long> steps;
  for (const CostCell& cell : cells) {
    steps.insert(cell.steps);
  }
  std::vector<Crossover> crossovers;
  for (const long count : steps) {
    for (const CostMethod method :
         {CostMethod::kAdjoint, CostMethod::kAdjointWithCheckpoints, CostMethod::kTangent,
          CostMethod::kImplicitJets, CostMethod::kUnrolledJets, CostMethod::kTape}) {
      crossovers.push_back(CrossoverOf(cells, count, method, CostMethod::kDifferences));
    }
    crossovers.push_back(CrossoverOf(cells, count, CostMethod::kAdjoint, CostMethod::kTangent));
  }
  return crossovers;
}

}  // namespace tangible::cost
