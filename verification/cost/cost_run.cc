// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_run.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tangible/math/median.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/verification/cost/cost_scene.h"
#include "tangible/verification/cost/tape_gradient.h"

namespace tangible::cost {
namespace {

constexpr CostMethod kMethods[] = {
    CostMethod::kRollout,     CostMethod::kAdjoint,      CostMethod::kAdjointWithCheckpoints,
    CostMethod::kTangent,     CostMethod::kImplicitJets, CostMethod::kUnrolledJets,
    CostMethod::kDifferences, CostMethod::kTape};

// The allowed difference of a gradient from the adjoint's. The unrolled solver's own error is about
// 1e-7 (lib/lcp/README.md); differences of one step are only shown.
double Tolerance(CostMethod method) {
  switch (method) {
    case CostMethod::kDifferences:
      return HUGE_VAL;
    case CostMethod::kUnrolledJets:
    case CostMethod::kTape:
      return 1e-6;
    default:
      return 1e-9;
  }
}

GradientOptions OptionsOf(CostMethod method, const CostOptions& options) {
  GradientOptions gradient;
  gradient.method = GradientMethod::kAdjoint;
  gradient.certificate = CertificatePass::kSkip;
  switch (method) {
    case CostMethod::kTangent:
      gradient.method = GradientMethod::kTangent;
      break;
    case CostMethod::kImplicitJets:
      gradient.method = GradientMethod::kJetImplicit;
      break;
    case CostMethod::kUnrolledJets:
      gradient.method = GradientMethod::kJet;
      break;
    case CostMethod::kDifferences:
      gradient.method = GradientMethod::kFiniteDifference;
      break;
    case CostMethod::kAdjointWithCheckpoints:
      gradient.checkpointing = {Checkpointing::Kind::kBudget, 0, options.tape_budget};
      break;
    default:
      break;
  }
  return gradient;
}

bool IsBuilt(CostMethod method) {
  if (method == CostMethod::kTape) {
    return TapeIsBuilt();
  }
  const bool jets = method == CostMethod::kImplicitJets || method == CostMethod::kUnrolledJets;
  return !jets || WidestJetBuilt() > 0;
}

// A rollout, timed in the same way as a gradient.
GradientResult RolloutAlone(const Scene& scene, int repeat) {
  GradientOptions options;
  options.certificate = CertificatePass::kSkip;
  options.repeat = repeat;
  options.method = GradientMethod::kTangent;
  return LossGradient(scene, {}, {{"ball/x", 0.0, 1.0}}, options);
}

GradientResult Differentiate(CostMethod method, const CostOptions& options, const Scene& scene,
                             const std::vector<ParameterPath>& parameters, int repeat) {
  const std::vector<LossTerm> terms = {{"ball/x", 0.0, 1.0}, {"link9/x", 0.0, 1.0}};
  if (method == CostMethod::kTape) {
    return TapeLossGradient(scene, parameters, terms, repeat);
  }
  GradientOptions gradient = OptionsOf(method, options);
  gradient.repeat = repeat;
  return LossGradient(scene, parameters, terms, gradient);
}

constexpr int kLeastRepeats = 3;
constexpr double kLongRun = 1.0;  // s; longer ones are not repeated

// The data that a child returns: a sequence of numbers, each list after its length.
void Put(const std::vector<double>& list, std::vector<double>* out) {
  out->push_back(static_cast<double>(list.size()));
  out->insert(out->end(), list.begin(), list.end());
}

std::vector<double> Get(const std::vector<double>& values, size_t* at) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(*at) + 1;
  const auto count = static_cast<std::ptrdiff_t>(values[*at]);
  *at += static_cast<size_t>(count) + 1;
  return {begin, begin + count};
}

std::string Budgeted(double amount, const char* unit) {
  std::ostringstream text;
  text << "over " << amount << " " << unit;
  return text.str();
}

// Sets the text that replaces a missing time; true where there is a time.
bool SetInstead(const Budget& budget, const ChildOutcome& outcome, CostCell* cell) {
  switch (outcome.status) {
    case ChildStatus::kOverSeconds:
      cell->instead = Budgeted(budget.seconds, "s");
      return false;
    case ChildStatus::kOverBytes:
      cell->instead = Budgeted(static_cast<double>(budget.bytes) / (1 << 30), "GiB");
      return false;
    case ChildStatus::kFailed:
      cell->instead = outcome.message;
      cell->failed = true;
      return false;
    case ChildStatus::kDone:
      return true;
  }
  return false;
}

}  // namespace

const char* NameOf(CostMethod method) {
  switch (method) {
    case CostMethod::kRollout:
      return "one rollout";
    case CostMethod::kAdjoint:
      return "adjoint";
    case CostMethod::kAdjointWithCheckpoints:
      return "checkpointed adjoint";
    case CostMethod::kTangent:
      return "tangent";
    case CostMethod::kImplicitJets:
      return "implicit Jets";
    case CostMethod::kUnrolledJets:
      return "unrolled Jets";
    case CostMethod::kDifferences:
      return "central differences";
    case CostMethod::kTape:
      return "unrolled ADOL-C";
  }
  return "";
}

int WidestJetBuilt() {
  int widest = 0;
#define TANGIBLE_WIDER(N) widest = std::max(widest, N);
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_WIDER)
#undef TANGIBLE_WIDER
  return widest;
}

double Least(const std::vector<double>& values) {
  return values.empty() ? std::nan("") : *std::min_element(values.begin(), values.end());
}

double CostCell::ratio() const { return Least(seconds) / Least(rollout_seconds); }
double CostCell::median_ratio() const { return Median(seconds) / Median(rollout_seconds); }

double GradientDifference(const std::vector<double>& a, const std::vector<double>& b,
                          const std::vector<double>& scales) {
  double difference = 0.0;
  double size = 0.0;
  for (size_t k = 0; k < b.size(); ++k) {
    difference = std::max(difference, std::abs(a[k] - b[k]) * scales[k]);
    size = std::max(size, std::abs(b[k]) * scales[k]);
    if (!std::isfinite(a[k]) || !std::isfinite(b[k])) {
      return HUGE_VAL;
    }
  }
  return difference == 0.0 ? 0.0 : difference / size;
}

CostCell MeasureCell(const CostOptions& options, CostMethod method, int parameters, long steps,
                     const std::vector<double>& reference, std::vector<double>* gradient) {
  CostCell cell;
  cell.method = method;
  cell.parameters = parameters;
  cell.steps = steps;
  if (!IsBuilt(method)) {
    cell.instead = "not built";
    return cell;
  }
  if (method == CostMethod::kTape && options.stepping == Stepping::kEvent) {
    cell.instead = "fixed alone";
    return cell;
  }
  const Scene scene = ChainAndBall(steps, options.stepping);
  const std::vector<ParameterPath> paths = CostParameters(scene, parameters);
  std::vector<double> scales;
  scales.reserve(paths.size());
  for (const ParameterPath& path : paths) {
    scales.push_back(path.scale);
  }
  const auto work = [&](const ChildLimits& limits, std::string* error) {
    std::vector<double> out;
    const auto run = [&](int repeat) {
      return method == CostMethod::kRollout ? RolloutAlone(scene, repeat)
                                            : Differentiate(method, options, scene, paths, repeat);
    };
    GradientResult result = run(1);
    *error = result.message;
    if (!result.done) {
      return out;
    }
    limits.LiftSeconds();
    const std::vector<double> found(result.gradient.data(),
                                    result.gradient.data() + result.gradient.size());
    const double difference =
        reference.empty() ? 0.0 : GradientDifference(found, reference, scales);
    if (!(difference <= Tolerance(method))) {
      std::ostringstream text;
      text << "differs from the adjoint by " << difference;
      *error = text.str();
      return out;
    }
    const double once = result.seconds + result.rollout_seconds;
    const double wanted = std::min<double>(options.most_repeats, options.repeat_seconds / once);
    // The time of a single run includes the first allocation of memory by the system.
    const int repeats = once < kLongRun ? std::max(kLeastRepeats, static_cast<int>(wanted)) : 1;
    const auto tape_bytes = static_cast<double>(result.tape_bytes);
    const auto again = static_cast<double>(result.steps_again) / static_cast<double>(steps);
    if (repeats > 1) {
      result = run(repeats);
    }
    Put(found, &out);
    Put(method == CostMethod::kRollout ? result.all_rollout_seconds : result.all_seconds, &out);
    Put(result.all_rollout_seconds, &out);
    Put({tape_bytes, again, difference}, &out);
    return out;
  };
  const ChildOutcome outcome = RunInChild(options.budget, work);
  cell.peak_bytes = outcome.peak_bytes;
  if (!SetInstead(options.budget, outcome, &cell)) {
    return cell;
  }
  size_t at = 0;
  *gradient = Get(outcome.values, &at);
  cell.seconds = Get(outcome.values, &at);
  cell.rollout_seconds = Get(outcome.values, &at);
  const std::vector<double> rest = Get(outcome.values, &at);
  cell.tape_bytes = static_cast<size_t>(rest[0]);
  cell.runs_again = rest[1];
  cell.difference = rest[2];
  return cell;
}

long NumCells(const CostOptions& options) {
  return static_cast<long>(options.steps.size() *
                           (1 + (kNumCostMethods - 1) * options.parameters.size()));
}

std::vector<CostCell> RunCosts(const CostOptions& options,
                               const std::function<void(long done)>& progress) {
  std::vector<CostCell> cells;
  for (const long steps : options.steps) {
    std::vector<std::vector<double>> references(options.parameters.size());
    for (const CostMethod method : kMethods) {
      std::string over;
      for (size_t i = 0; i < options.parameters.size(); ++i) {
        if (method == CostMethod::kRollout && i > 0) {
          break;
        }
        const int parameters = method == CostMethod::kRollout ? 0 : options.parameters[i];
        std::vector<double> gradient;
        CostCell cell;
        if (over.empty()) {
          cell = MeasureCell(options, method, parameters, steps, references[i], &gradient);
          over = cell.failed ? "" : cell.instead;
        } else {
          cell = {method, parameters, steps, over, false, {}, {}, 0, 0, 0.0, 0.0};
        }
        if (method == CostMethod::kAdjoint) {
          references[i] = gradient;
        }
        cells.push_back(std::move(cell));
        progress(static_cast<long>(cells.size()));
      }
    }
  }
  return cells;
}

}  // namespace tangible::cost
