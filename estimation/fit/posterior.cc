// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/posterior.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <mutex>
#include <utility>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/uncertainty/nuts.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/math/decompositions.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

// Chains begin at draws of so many deviations.
constexpr double kDispersion = 2.0;
// Over the number of draws: by so much R-hat of chains that agree is larger by chance. Of the eight
// halves of four chains it is that in one of a thousand cases (chi-square of 7 degrees).
constexpr double kMixedByChance = 10.0;
// Of a matrix of more parameters the factor takes longer than the runs.
constexpr Eigen::Index kMostParameters = 2000;

// Of the size of a parameter, or of its standard deviation: where the density far out is looked at.
constexpr std::array<double, 2> kFarOut = {1e4, 1e8};
// Of more parameters this would take longer than the draws.
constexpr size_t kMostOpenSides = 50;

// The random numbers of starts within bounds are not those of the chains.
constexpr std::uint32_t kWithinBounds = 1U << 20;

int DrawsOfChain(const PosteriorOptions& options) {
  const int all = std::max(options.draws, options.least_draws);
  return (all + options.chains - 1) / options.chains;
}

/// The density of x of one problem, with what the information matrix needs.
class PosteriorDensity {
 public:
  PosteriorDensity(std::shared_ptr<LeastSquaresProblem> problem, const FitOptions& options,
                   const std::vector<FreeCoordinate>& coordinates, int threads)
      : problem_(std::move(problem)),
        layout_(*problem_),
        options_(options),
        coordinates_(coordinates),
        threads_(threads) {}

  std::vector<FreeCoordinate::Value> ValuesAt(const Eigen::VectorXd& x) const {
    std::vector<FreeCoordinate::Value> values;
    values.reserve(coordinates_.size());
    for (size_t k = 0; k < coordinates_.size(); ++k) {
      values.push_back(coordinates_[k].At(x[static_cast<Eigen::Index>(k)]));
    }
    return values;
  }
  Eigen::VectorXd ParametersAt(const Eigen::VectorXd& x) const {
    Eigen::VectorXd p(x.size());
    Eigen::Index k = 0;
    for (const FreeCoordinate::Value& value : ValuesAt(x)) p[k++] = value.p;
    return p;
  }
  /// The cost, from ln π(x).
  double CostFrom(const Eigen::VectorXd& x, double log_density) const {
    for (const FreeCoordinate::Value& value : ValuesAt(x)) log_density -= value.log_factor;
    return -log_density;
  }

  /// Cost and gradient by p; the information by p too unless that is null.
  bool Evaluate(const Eigen::VectorXd& p, double* cost, Eigen::VectorXd* gradient,
                Eigen::MatrixXd* information) {
    const int blocks = layout_.num_blocks();
    std::vector<Part> parts(static_cast<size_t>(blocks));
    ForEachOnThreads(threads_, blocks, [&](int block) {
      EvaluatePart(block, layout_.Local(block, p), information != nullptr, &parts[block]);
    });
    *cost = 0.0;
    gradient->setZero(p.size());
    if (information != nullptr) information->setZero(p.size(), p.size());
    for (int block = 0; block < blocks; ++block) {
      const Part& part = parts[static_cast<size_t>(block)];
      if (!part.done) {
        message_ = problem_->BlockName(block) + part.message;
        return false;
      }
      *cost += part.cost;
      for (int i = 0; i < layout_.num_local(block); ++i) {
        const int k = layout_.ParameterOf(block, i);
        (*gradient)[k] += part.gradient[i];
        for (int j = 0; information != nullptr && j < layout_.num_local(block); ++j) {
          (*information)(k, layout_.ParameterOf(block, j)) += part.information(i, j);
        }
      }
    }
    return std::isfinite(*cost) && gradient->allFinite();
  }

  /// ln π and its gradient by x.
  bool operator()(const Eigen::VectorXd& x, double* value, Eigen::VectorXd* gradient) {
    const std::vector<FreeCoordinate::Value> values = ValuesAt(x);
    Eigen::VectorXd p(x.size());
    for (Eigen::Index k = 0; k < x.size(); ++k) p[k] = values[static_cast<size_t>(k)].p;
    double cost = 0.0;
    if (!p.allFinite() || !Evaluate(p, &cost, gradient, nullptr)) return false;
    *value = -cost;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const FreeCoordinate::Value& at = values[static_cast<size_t>(k)];
      *value += at.log_factor;
      (*gradient)[k] = at.log_factor_first - (*gradient)[k] * at.first;
    }
    return true;
  }

  const std::string& message() const { return message_; }

 private:
  struct Part {
    bool done = false;
    std::string message;
    double cost = 0.0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd information;
  };

  void EvaluatePart(int block, const Eigen::VectorXd& p, bool with_information, Part* part) {
    BlockEvaluation evaluation;
    part->done = problem_->EvaluateBlock(block, p, options_.derivatives, BlockDerivatives::kCompute,
                                         &evaluation);
    if (!part->done) {
      part->message = evaluation.message;
      return;
    }
    const Eigen::VectorXd& r = evaluation.residuals;
    const Eigen::Index observed = problem_->num_observation_rows(block);
    const double weight = problem_->weight(block);
    part->cost = weight * (RobustCost(r.head(observed), options_.huber) +
                           RobustCost(r.tail(r.size() - observed), 0.0));
    Eigen::VectorXd weights = Eigen::VectorXd::Constant(r.size(), weight);
    for (Eigen::Index i = 0; i < observed; ++i) weights[i] *= RobustWeight(r[i], options_.huber);
    const RowMatrixXd& jacobian = evaluation.jacobian;
    part->gradient = jacobian.transpose() * weights.cwiseProduct(r);
    if (with_information) {
      part->information = jacobian.transpose() * weights.asDiagonal() * jacobian;
    }
  }

  std::shared_ptr<LeastSquaresProblem> problem_;
  BlockLayout layout_;
  const FitOptions& options_;
  const std::vector<FreeCoordinate>& coordinates_;
  int threads_;
  std::string message_;
};

/// The estimate, moved inside where it is at a bound, as x.
Eigen::VectorXd InsideOf(const std::vector<FreeCoordinate>& coordinates,
                         const Eigen::VectorXd& estimate, const Eigen::VectorXd& gradient,
                         const Eigen::MatrixXd& information) {
  Eigen::VectorXd x(estimate.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const FreeCoordinate& coordinate = coordinates[static_cast<size_t>(k)];
    const double width = coordinate.upper - coordinate.lower;
    // Where the cost has risen by 1/2 or 1, as far as others do not follow.
    double distance = std::min(0.5 * width, std::max(std::abs(estimate[k]), 1.0));
    if (information(k, k) > 0.0) distance = std::min(distance, 1.0 / std::sqrt(information(k, k)));
    if (gradient[k] != 0.0) distance = std::min(distance, 1.0 / std::abs(gradient[k]));
    double p = estimate[k];
    if (std::isfinite(coordinate.lower)) p = std::max(p, coordinate.lower + distance);
    if (std::isfinite(coordinate.upper)) p = std::min(p, coordinate.upper - distance);
    x[k] = coordinate.From(p);
  }
  return x;
}

/// L with L Lᵀ = H⁻¹, lower triangular, of (2).
Eigen::MatrixXd FactorOf(const std::vector<FreeCoordinate::Value>& values,
                         const Eigen::VectorXd& gradient, Eigen::MatrixXd information) {
  const Eigen::Index n = information.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    const FreeCoordinate::Value& at = values[static_cast<size_t>(k)];
    information.row(k) *= at.first;
    information.col(k) *= at.first;
    information(k, k) += std::max(0.0, gradient[k] * at.second) - at.log_factor_second;
  }
  Eigen::VectorXd lengths = information.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (double& length : lengths) length = length > 0.0 ? length : 1.0;
  const Eigen::MatrixXd scaled =
      lengths.cwiseInverse().asDiagonal() * information * lengths.cwiseInverse().asDiagonal();
  // With P the reverse order and P H P = C Cᵀ, H⁻¹ = (P C⁻ᵀ P) (P C⁻¹ P), the first of which is
  // lower triangular.
  for (double ridge = kLeastInformation;; ridge *= 100.0) {
    Eigen::MatrixXd reversed = scaled.reverse();
    reversed.diagonal().array() += ridge;
    const Cholesky cholesky(reversed);
    if (!cholesky.succeeded()) continue;
    const Eigen::MatrixXd inverse = cholesky.SolveUpper(Eigen::MatrixXd::Identity(n, n));
    return lengths.cwiseInverse().asDiagonal() * Eigen::MatrixXd(inverse.reverse());
  }
}

/// A start of a chain: dispersed, and nearer to the middle where the density there is next to none.
Eigen::VectorXd StartOf(const Eigen::VectorXd& middle, double highest,
                        const Eigen::MatrixXd& factor, PosteriorDensity* density,
                        RandomStream* random) {
  constexpr int kHalvings = 8;
  const double size = static_cast<double>(middle.size());
  // A normal density at so many deviations has fallen by half of the square of these a parameter.
  const double most = 20.0 + 2.5 * kDispersion * kDispersion * 0.5 * size;
  const Eigen::VectorXd offset = factor * (kDispersion * random->Normals(middle.size()));
  double part = 1.0;
  for (int i = 0; i < kHalvings; ++i, part *= 0.5) {
    Eigen::VectorXd start = middle + part * offset;
    double value = 0.0;
    Eigen::VectorXd gradient;
    if ((*density)(start, &value, &gradient) && value > highest - most) return start;
  }
  return middle;
}

/// The same of every second chain: the first of some draws of what has two bounds, from all of its
/// range, at which the density is not next to nothing. A mode far from the estimate is found so,
/// and R-hat tells that chains do not agree. Empty where there is none.
Eigen::VectorXd StartWithinBounds(const std::vector<FreeCoordinate>& coordinates,
                                  const Eigen::VectorXd& middle, double highest,
                                  PosteriorDensity* density, RandomStream* random) {
  constexpr int kDraws = 32;
  constexpr double kMostBelow = 20.0;
  const auto is_bounded = [](const FreeCoordinate& one) {
    return std::isfinite(one.lower) && std::isfinite(one.upper);
  };
  if (std::none_of(coordinates.begin(), coordinates.end(), is_bounded)) return {};
  for (int i = 0; i < kDraws; ++i) {
    Eigen::VectorXd start = middle;
    for (size_t k = 0; k < coordinates.size(); ++k) {
      const FreeCoordinate& one = coordinates[k];
      if (!is_bounded(one)) continue;
      start[static_cast<Eigen::Index>(k)] =
          one.From(one.lower + random->Uniform() * (one.upper - one.lower));
    }
    double value = 0.0;
    Eigen::VectorXd gradient;
    if (start.allFinite() && (*density)(start, &value, &gradient) && value > highest - kMostBelow) {
      return start;
    }
  }
  return {};
}

/// The name of the first parameter whose density would have no finite integral; or empty.
std::string FindImproper(const FitResult& result, const std::vector<FreeCoordinate>& coordinates,
                         const std::vector<ParameterEntry>& entries) {
  for (size_t k = 0; k < entries.size(); ++k) {
    const FreeCoordinate& coordinate = coordinates[k];
    const bool bounded = std::isfinite(coordinate.lower) && std::isfinite(coordinate.upper);
    const bool told = k < result.uncertainty.confidence_95.size() &&
                      !result.uncertainty.confidence_95[k] &&
                      !result.uncertainty.messages[k].empty();
    if (told && !bounded && !entries[k].prior &&
        !IsAtBound(entries[k], result.estimate[static_cast<Eigen::Index>(k)])) {
      return entries[k].name;
    }
  }
  return "";
}

/// Empty, or why the density has no finite integral: it does not fall, however far a parameter goes
/// on a side without a bound, as that of a mass which the rest of the scene no longer moves.
std::string FindOpenSide(const FitResult& result, const std::vector<FreeCoordinate>& coordinates,
                         const std::vector<ParameterEntry>& entries, double cost,
                         const Eigen::MatrixXd& information, PosteriorDensity* density) {
  if (entries.size() > kMostOpenSides) return "";
  for (size_t k = 0; k < entries.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    double scale = std::abs(result.estimate[at]);
    if (information(at, at) > 0.0) scale = std::max(scale, 1.0 / std::sqrt(information(at, at)));
    for (const double side : {1.0, -1.0}) {
      const double bound = side > 0.0 ? coordinates[k].upper : coordinates[k].lower;
      if (entries[k].prior || std::isfinite(bound) || !(scale > 0.0)) continue;
      std::array<double, 2> costs;
      bool runs = true;
      for (size_t i = 0; i < costs.size() && runs; ++i) {
        Eigen::VectorXd far = result.estimate, gradient;
        far[at] += side * kFarOut[i] * scale;
        runs = density->Evaluate(far, &costs[i], &gradient, nullptr);
      }
      if (!runs || !(std::abs(costs[1] - costs[0]) <= kFlatFarOut) ||
          !(costs[1] - cost <= kReached)) {
        continue;
      }
      return "the observations do not determine '" + entries[k].name + "' towards " +
             (side > 0.0 ? "large" : "small") + " values, at which the cost stays at " +
             CompactNumber(costs[1], 6) + " (" + CompactNumber(cost, 6) +
             " at the estimate): expected a prior of it, or " + (side > 0.0 ? "upper" : "lower");
    }
  }
  return "";
}

void AddWarnings(const std::vector<ParameterEntry>& entries, const FitResult& result,
                 double least_cost, Posterior* posterior) {
  std::vector<std::string>& warnings = posterior->warnings;
  const std::string all = std::to_string(posterior->transitions);
  if (posterior->divergences > 0) {
    warnings.push_back("posterior: " + std::to_string(posterior->divergences) + " of " + all +
                       " transitions diverged: draws may be missing where the density changes "
                       "within a step; a higher --posterior_target makes shorter ones");
  }
  if (posterior->saturated > 0) {
    warnings.push_back("posterior: " + std::to_string(posterior->saturated) + " of " + all +
                       " transitions had no room to turn; a longer --posterior_warm_up may find a "
                       "better mass matrix");
  }
  const auto worst = [&](const auto& worse) {
    size_t at = 0;
    for (size_t k = 1; k < entries.size(); ++k) at = worse(k, at) ? k : at;
    return at;
  };
  const std::vector<ChainStatistics>& of = posterior->parameters;
  const size_t apart = worst([&](size_t a, size_t b) { return !(of[a].r_hat <= of[b].r_hat); });
  const double most = kMixed + kMixedByChance / posterior->transitions;
  if (!(of[apart].r_hat <= most)) {
    warnings.push_back(
        "posterior: the chains do not agree: R-hat of '" + entries[apart].name + "' is " +
        CompactNumber(of[apart].r_hat, 4) + ", expected at most " + CompactNumber(most, 4) +
        (posterior->options.temperatures == 1
             ? "; where there are several modes --posterior_temperatures lets chains "
               "pass between them"
             : ""));
  }
  if (posterior->exchanged < kLeastExchanged) {
    warnings.push_back(
        "posterior: replicas at neighbouring temperatures exchange their points in " +
        CompactNumber(100.0 * posterior->exchanged, 2) +
        " % of the cases only: modes may be missing");
  }
  const auto least = [&](size_t k) { return std::min(of[k].ess_bulk, of[k].ess_tail); };
  const size_t few = worst([&](size_t a, size_t b) { return !(least(a) >= least(b)); });
  if (!(least(few) >= kLeastEffective)) {
    warnings.push_back("posterior: the draws of '" + entries[few].name + "' are worth " +
                       CompactNumber(least(few), 3) +
                       " independent ones, expected at least 400: a larger --posterior makes more");
  }
  if (result.uncertainty.DoesNotFit()) {
    warnings.push_back(
        "posterior: it trusts model and sigma, which do not explain these residuals: its intervals "
        "are too narrow");
  }
  if (least_cost < result.final_cost - kAgree) {
    warnings.push_back("posterior: a draw costs " + CompactNumber(least_cost, 6) +
                       ", less than the estimate's " + CompactNumber(result.final_cost, 6) +
                       ": the estimate is not the global minimum");
  }
}

/// Where chains begin, and their first mass matrix.
struct ChainSetup {
  Eigen::VectorXd middle;  ///< near the estimate, as x
  double highest = 0.0;    ///< the logarithm of the density there
  Eigen::MatrixXd factor;  ///< L of nuts.h
};

/// Chains, on several threads.
class ChainRunner {
 public:
  ChainRunner(const PosteriorOptions& options, const FitOptions& fit,
              const std::vector<FreeCoordinate>& coordinates, const ProblemMaker& maker,
              const std::function<void(long)>& show)
      : options_(options), fit_(fit), coordinates_(coordinates), maker_(maker), show_(show) {}

  std::vector<FinishedChain> Run(const ChainSetup& setup, const Eigen::VectorXd& estimate,
                                 const std::vector<int>& numbers) {
    std::vector<FinishedChain> chains(numbers.size());
    const int threads = NumThreads(options_.threads);
    const int count = static_cast<int>(numbers.size());
    const int inner = std::max(1, threads / std::max(1, count));
    ForEachOnThreads(threads, count, [&](int at) {
      const int number = numbers[static_cast<size_t>(at)];
      PosteriorDensity density(maker_(), fit_, coordinates_, inner);
      RandomStream random(options_.seed, static_cast<std::uint32_t>(number));
      NutsOptions nuts;
      nuts.warm_up = options_.warm_up;
      nuts.draws = DrawsOfChain(options_);
      nuts.target = options_.target;
      nuts.temperatures = options_.temperatures;
      nuts.progress = [this] {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (show_) show_(++done_);
        return true;
      };
      const LogDensity function = [&density](const Eigen::VectorXd& x, double* value,
                                             Eigen::VectorXd* gradient) {
        return density(x, value, gradient);
      };
      Eigen::VectorXd start;
      if (number % 2 == 1) {
        RandomStream within(options_.seed, static_cast<std::uint32_t>(number) + kWithinBounds);
        start = StartWithinBounds(coordinates_, setup.middle, setup.highest, &density, &within);
      }
      if (start.size() == 0) {
        start = StartOf(setup.middle, setup.highest, setup.factor, &density, &random);
      }
      const NutsChain made = SampleNuts(function, start, setup.factor, nuts, &random);
      FinishedChain& chain = chains[static_cast<size_t>(at)];
      chain = {estimate,
               Eigen::MatrixXd(made.draws.rows(), made.draws.cols()),
               Eigen::VectorXd(made.draws.rows()),
               made.divergences,
               made.saturated,
               made.step,
               made.acceptance,
               made.exchanged,
               made.evaluations,
               made.message};
      for (Eigen::Index i = 0; i < chain.costs.size(); ++i) {
        const Eigen::VectorXd x = made.draws.row(i);
        chain.costs[i] = density.CostFrom(x, made.log_density[i]);
        chain.parameters.row(i) = density.ParametersAt(x);
      }
    });
    return chains;
  }

 private:
  const PosteriorOptions& options_;
  const FitOptions& fit_;
  const std::vector<FreeCoordinate>& coordinates_;
  const ProblemMaker& maker_;
  const std::function<void(long)>& show_;
  std::mutex mutex_;
  long done_ = 0;
};

/// False with one line where there is no density to be sampled.
bool SetUpChains(const PosteriorOptions& options, const FitOptions& fit, const FitResult& result,
                 const std::vector<FreeCoordinate>& coordinates,
                 const std::shared_ptr<LeastSquaresProblem>& problem, ChainSetup* setup,
                 std::string* error) {
  if (result.estimate.size() == 0 || result.estimate.size() > kMostParameters) {
    *error = "expected 1 to " + std::to_string(kMostParameters) +
             " parameters with an estimate, got " + std::to_string(result.estimate.size());
    return false;
  }
  const std::string improper = FindImproper(result, coordinates, problem->entries());
  if (!improper.empty()) {
    *error = "the observations do not determine '" + improper +
             "': expected a prior of it, or lower and upper";
    return false;
  }
  PosteriorDensity density(problem, fit, coordinates, options.threads);
  double cost = 0.0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd information;
  if (!density.Evaluate(result.estimate, &cost, &gradient, &information)) {
    *error = "the run at the estimate fails: " + density.message();
    return false;
  }
  *error = FindOpenSide(result, coordinates, problem->entries(), cost, information, &density);
  if (!error->empty()) return false;
  setup->middle = InsideOf(coordinates, result.estimate, gradient, information);
  const std::vector<FreeCoordinate::Value> values = density.ValuesAt(setup->middle);
  if (!density.Evaluate(density.ParametersAt(setup->middle), &cost, &gradient, &information)) {
    *error = "the run beside the estimate fails: " + density.message();
    return false;
  }
  setup->highest = -cost;
  for (const FreeCoordinate::Value& value : values) setup->highest += value.log_factor;
  setup->factor = FactorOf(values, gradient, information);
  return true;
}

/// N of all draws, at equal distances.
void KeepDraws(const std::vector<FinishedChain>& chains, Posterior* posterior) {
  const int wanted = posterior->options.draws;
  const int of_chain = static_cast<int>(chains.front().costs.size());
  posterior->draws.resize(wanted, chains.front().parameters.cols());
  posterior->costs.resize(wanted);
  for (int i = 0; i < wanted; ++i) {
    const auto at = static_cast<int>((i + 0.5) * posterior->transitions / wanted);
    const int chain = at / of_chain;
    const FinishedChain& of = chains[static_cast<size_t>(chain)];
    posterior->draws.row(i) = of.parameters.row(at % of_chain);
    posterior->costs[i] = of.costs[at % of_chain];
    posterior->chain_of.push_back(chain);
  }
}

}  // namespace

FreeCoordinate::Value FreeCoordinate::At(double x) const {
  Value value{x, 1.0, 0.0, 0.0, 0.0, 0.0};
  if (std::isfinite(lower) && std::isfinite(upper)) {
    const double tail = std::exp(-std::abs(x));  // of the nearer bound
    const double share = tail / (1.0 + tail);
    const double width = upper - lower;
    const double slope = tail / ((1.0 + tail) * (1.0 + tail));         // s (1 − s)
    const double turn = (x < 0.0 ? 1.0 : -1.0) * (1.0 - 2.0 * share);  // 1 − 2 s
    value.p = x < 0.0 ? lower + width * share : upper - width * share;
    value.first = width * slope;
    value.second = width * slope * turn;
    value.log_factor = std::log(width) - std::abs(x) - 2.0 * std::log1p(tail);
    value.log_factor_first = turn;
    value.log_factor_second = -2.0 * slope;
  } else if (std::isfinite(lower) || std::isfinite(upper)) {
    const double side = std::isfinite(lower) ? 1.0 : -1.0;
    const double distance = std::exp(x);
    value.p = (side > 0.0 ? lower : upper) + side * distance;
    value.first = value.second = side * distance;
    value.log_factor = x;
    value.log_factor_first = 1.0;
  }
  if (of_logarithm) {
    // p > 0; of a lower bound 0 this cancels the factor.
    const double relative = value.first / value.p;
    value.log_factor -= std::log(value.p);
    value.log_factor_first -= relative;
    value.log_factor_second -= value.second / value.p - relative * relative;
  }
  return value;
}

double FreeCoordinate::From(double p) const {
  if (std::isfinite(lower) && std::isfinite(upper)) return std::log((p - lower) / (upper - p));
  if (std::isfinite(lower)) return std::log(p - lower);
  return std::isfinite(upper) ? std::log(upper - p) : p;
}

std::vector<FreeCoordinate> FreeCoordinates(const std::vector<ParameterEntry>& entries,
                                            const std::vector<RandomEffect>& effects) {
  std::vector<FreeCoordinate> coordinates;
  coordinates.reserve(entries.size() + effects.size());
  for (const ParameterEntry& entry : entries) {
    coordinates.push_back(
        {entry.lower, entry.upper, entry.prior && entry.prior->kind == PriorKind::kLogNormal});
  }
  for (const RandomEffect& effect : effects) {
    for (const int own : effect.own) {
      if (own >= 0 && effect.kind == PriorKind::kLogNormal) coordinates[own].of_logarithm = true;
    }
  }
  return coordinates;
}

ProblemMaker MakerOf(const FitInput& input, const RecordingsProblem& problem) {
  struct Both {
    std::unique_ptr<RecordingsProblem> recordings;
    std::unique_ptr<ProblemWithPriors> with_priors;
  };
  return [&input, &problem]() -> std::shared_ptr<LeastSquaresProblem> {
    const auto both = std::make_shared<Both>();
    ParameterError error;
    int fault = 0;
    both->recordings = MakeProblem(input, &error, &fault);
    for (size_t e = 0; e < problem.effects().size(); ++e) {
      both->recordings->SetSpread(static_cast<int>(e), problem.effects()[e].spread);
    }
    both->with_priors =
        std::make_unique<ProblemWithPriors>(both->recordings.get(), both->recordings->effects());
    return {both, both->with_priors.get()};
  };
}

long TransitionsOf(const PosteriorOptions& options) {
  return static_cast<long>(options.chains) * (options.warm_up + DrawsOfChain(options));
}

bool MakeChains(const PosteriorOptions& options, const FitOptions& fit, const FitResult& result,
                const std::vector<FreeCoordinate>& coordinates, const ProblemMaker& maker,
                const std::vector<int>& numbers, std::vector<FinishedChain>* chains,
                std::string* error) {
  ChainSetup setup;
  if (!SetUpChains(options, fit, result, coordinates, maker(), &setup, error)) return false;
  *chains =
      ChainRunner(options, fit, coordinates, maker, nullptr).Run(setup, result.estimate, numbers);
  return true;
}

bool SamplePosterior(const PosteriorOptions& options, const FitOptions& fit,
                     const FitResult& result, const std::vector<FreeCoordinate>& coordinates,
                     const ProblemMaker& maker, const std::function<void(long)>& show,
                     const std::map<int, FinishedChain>& done, Posterior* posterior,
                     std::string* error) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point began = Clock::now();
  const std::shared_ptr<LeastSquaresProblem> problem = maker();
  ChainSetup setup;
  if (!SetUpChains(options, fit, result, coordinates, problem, &setup, error)) return false;
  std::vector<FinishedChain> chains(static_cast<size_t>(options.chains));
  std::vector<int> to_make;
  for (int number = 0; number < options.chains; ++number) {
    const auto one = done.find(number);
    if (one != done.end() && one->second.estimate == result.estimate) {
      chains[static_cast<size_t>(number)] = one->second;
    } else {
      to_make.push_back(number);
    }
  }
  std::vector<FinishedChain> made =
      ChainRunner(options, fit, coordinates, maker, show).Run(setup, result.estimate, to_make);
  for (size_t i = 0; i < made.size(); ++i) {
    chains[static_cast<size_t>(to_make[i])] = std::move(made[i]);
  }
  *posterior = Posterior();
  posterior->options = options;
  double least_cost = HUGE_VAL;
  for (size_t j = 0; j < chains.size(); ++j) {
    if (!chains[j].message.empty()) {
      *error = "chain " + std::to_string(j) + ": " + chains[j].message;
      return false;
    }
    posterior->transitions += static_cast<int>(chains[j].costs.size());
    posterior->divergences += chains[j].divergences;
    posterior->saturated += chains[j].saturated;
    posterior->steps.push_back(chains[j].step);
    posterior->acceptance += chains[j].acceptance / options.chains;
    posterior->exchanged = std::min(posterior->exchanged, chains[j].exchanged);
    posterior->evaluations += chains[j].evaluations;
    least_cost = std::min(least_cost, chains[j].costs.minCoeff());
  }
  for (Eigen::Index k = 0; k < result.estimate.size(); ++k) {
    Eigen::MatrixXd draws(chains.front().costs.size(), static_cast<Eigen::Index>(chains.size()));
    for (size_t j = 0; j < chains.size(); ++j) {
      draws.col(static_cast<Eigen::Index>(j)) = chains[j].parameters.col(k);
    }
    posterior->parameters.push_back(DescribeChains(draws));
  }
  KeepDraws(chains, posterior);
  AddWarnings(problem->entries(), result, least_cost, posterior);
  posterior->seconds = std::chrono::duration<double>(Clock::now() - began).count();
  return true;
}

void TakeIntervals(const Posterior& posterior, FitResult* result) {
  result->intervals.resize(posterior.parameters.size());
  for (size_t k = 0; k < posterior.parameters.size(); ++k) {
    const ChainStatistics& of = posterior.parameters[k];
    result->intervals[k] = {true, of.low, of.high, "posterior"};
  }
  // What has an interval now is not said to have none.
  std::vector<std::string>& warnings = result->uncertainty.warnings;
  for (std::string& message : result->uncertainty.messages) {
    constexpr char kNone[] = ": no interval";
    const size_t at = message.rfind(kNone);
    if (at == std::string::npos) continue;
    for (std::string& warning : warnings) {
      if (warning.ends_with(message)) warning.erase(warning.rfind(kNone));
    }
    message.erase(at);
  }
  warnings.insert(warnings.end(), posterior.warnings.begin(), posterior.warnings.end());
}

}  // namespace tangible
