// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/design.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "tangible/estimation/fit/observed_state.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/decompositions.h"
#include "tangible/scene/set_parameters.h"

namespace tangible {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// More observations of a take are refused: each has a row of the Jacobian.
constexpr double kMostTakeRows = 1e7;

std::vector<int> NumbersOf(const Scene& scene, const std::string& path) {
  ParameterPath resolved;
  std::string error;
  return ResolveParameter(scene, path, &resolved, &error) ? resolved.numbers : std::vector<int>();
}

// The parameter that sets the number of a path, with its set; −1: none.
struct SetBy {
  int parameter = -1;
  const ParameterSet* set = nullptr;
};

SetBy FindSet(const FitProblem& run, const std::vector<int>& numbers) {
  for (size_t k = 0; k < run.parameters.size(); ++k) {
    for (const ParameterSet& set : run.parameters[k].sets) {
      for (const int number : NumbersOf(run.scene, set.path)) {
        if (std::find(numbers.begin(), numbers.end(), number) == numbers.end()) continue;
        return {static_cast<int>(k), &set};
      }
    }
  }
  return {};
}

// The scene of a candidate; what is wrong with it or empty.
std::string SetValues(const DesignCandidate& candidate, Scene* scene) {
  std::vector<ParameterPath> paths(candidate.values.size());
  std::vector<double> values;
  std::string error;
  for (size_t i = 0; i < paths.size(); ++i) {
    if (!ResolveParameter(*scene, candidate.values[i].first, &paths[i], &error)) return error;
    values.push_back(candidate.values[i].second);
  }
  if (!CheckApart(*scene, paths, &error)) return error;
  return SetParameters(paths, values.data(), scene);
}

double LastTime(const FitProblem& run) {
  double last = 0.0;
  for (const Observation& one : run.observations) {
    last = std::max(last, RunTime(run.instruments, run.channels[one.channel], one.time));
  }
  return last;
}

// The mean distance of a series' times, by its recording's clock; 0: it has one time.
double Distance(const std::vector<Observation>& observations, const std::vector<int>& series_of,
                int series, double* last) {
  std::vector<double> times;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (series_of[i] == series) times.push_back(observations[i].time);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  *last = times.back();
  return times.size() < 2 ? 0.0
                          : (times.back() - times.front()) / static_cast<double>(times.size() - 1);
}

// Cuts the observations at a duration, or continues them up to it. False: there are too many.
bool Stretch(double duration, FitProblem* run) {
  const std::vector<Observation> old = run->observations;
  const ObservationSeries series = IndexSeries(old);
  const auto run_time = [run](const Observation& one) {
    return RunTime(run->instruments, run->channels[one.channel], one.time);
  };
  const double end = duration * (1.0 + kSameTakeTime);
  std::vector<Observation>& kept = run->observations;
  kept.erase(std::remove_if(kept.begin(), kept.end(),
                            [&](const Observation& one) { return run_time(one) > end; }),
             kept.end());
  for (int k = 0; k < series.size(); ++k) {
    Observation next = old[static_cast<size_t>(series.first[static_cast<size_t>(k)])];
    double last = 0.0;
    const double distance = Distance(old, series.of, k, &last);
    if (next.coordinate == Coordinate::kTime || distance == 0.0) continue;
    if ((duration - last) / distance > kMostTakeRows / series.size()) return false;
    for (long i = 1;; ++i) {
      next.time = last + static_cast<double>(i) * distance;
      if (run_time(next) > end) break;
      kept.push_back(next);
    }
  }
  run->scene.simulation.duration = duration;
  return true;
}

// A take of a candidate, as a fit of one recording; what is wrong or empty.
std::string MakeTake(const FitInput& input, const DesignCandidate& candidate, FitInput* take) {
  *take = {{input.recordings.front()}, input.scopes};
  FitProblem& run = take->recordings.front().problem;
  if (run.channels.empty()) run.channels.emplace_back();
  std::string error = SetValues(candidate, &run.scene);
  if (!error.empty()) return error;
  for (Channel& channel : run.channels) {
    if (candidate.camera >= 0) channel.camera = candidate.camera;
  }
  const double duration = candidate.duration.value_or(LastTime(run));
  if (candidate.duration && !Stretch(duration, &run)) {
    return "expected a duration with at most 1e7 observations";
  }
  return run.observations.empty() ? "expected a duration with an observation in it, got none" : "";
}

// Σ w JᵀJ of some blocks, without own parameters of the blocks (Schur complement).
class Informer {
 public:
  Informer(const FitInput& input, std::vector<int> keep, std::vector<int> drop)
      : input_(input), keep_(std::move(keep)), drop_(std::move(drop)) {}

  enum class What { kPresent, kTake };

  // Over the parameters that stay; false with a message where a run fails.
  bool Of(LeastSquaresProblem* problem, What what, const VectorXd& p, MatrixXd* information,
          std::string* message) const {
    const BlockLayout layout(*problem);
    const int shared = layout.num_shared();
    MatrixXd sum = MatrixXd::Zero(shared, shared);
    for (int b = 0; b < layout.num_blocks(); ++b) {
      BlockEvaluation block;
      if (!problem->EvaluateBlock(b, layout.Local(b, p), input_.options().derivatives,
                                  BlockDerivatives::kCompute, &block)) {
        *message = problem->BlockName(b) + block.message;
        return false;
      }
      if (what == What::kPresent) DropOutliers(problem->num_observation_rows(b), &block);
      MatrixXd all = problem->weight(b) * (block.jacobian.transpose() * block.jacobian);
      // Of priors on shared parameters a take has those of its own start.
      if (what == What::kTake && problem->num_observation_rows(b) == 0) all = OfNuisance(all);
      std::vector<int> of_all, own;
      for (int k = 0; k < layout.num_local(b); ++k) {
        const int i = layout.ParameterOf(b, k);
        if (k < shared) {
          of_all.push_back(k);
        } else if (!IsAtBound(problem->entries()[static_cast<size_t>(i)], p[i])) {
          own.push_back(k);
        }
      }
      sum += Eliminate(all, of_all, own);
    }
    *information = Eliminate(sum, keep_, drop_);
    return true;
  }

 private:
  // Residuals that the robust loss takes linearly have no curvature.
  void DropOutliers(Eigen::Index rows, BlockEvaluation* block) const {
    const double bound = input_.options().huber;
    for (Eigen::Index i = 0; i < rows && bound > 0.0; ++i) {
      if (std::abs(block->residuals[i]) > bound) block->jacobian.row(i).setZero();
    }
  }

  MatrixXd OfNuisance(const MatrixXd& all) const {
    MatrixXd part = MatrixXd::Zero(all.rows(), all.cols());
    for (const int i : drop_) part(i, i) = all(i, i);
    return part;
  }

  // The information about `keep` where `drop` are unknown too. What is not determined of those
  // tells nothing.
  static MatrixXd Eliminate(const MatrixXd& all, const std::vector<int>& keep,
                            const std::vector<int>& drop) {
    MatrixXd kept = all(keep, keep);
    if (drop.empty()) return kept;
    const MatrixXd inner = all(drop, drop);
    const VectorXd size =
        inner.diagonal().cwiseSqrt().unaryExpr([](double x) { return x > 0.0 ? 1.0 / x : 0.0; });
    const SymmetricEigen solver(size.asDiagonal() * inner * size.asDiagonal());
    const MatrixXd cross = solver.vectors().transpose() * (size.asDiagonal() * all(drop, keep));
    for (Eigen::Index i = 0; i < cross.rows(); ++i) {
      const double value = solver.values()[i];
      if (value <= kDesignRank * solver.values().maxCoeff()) continue;
      kept -= cross.row(i).transpose() * cross.row(i) / value;
    }
    return 0.5 * (kept + kept.transpose());
  }

  const FitInput& input_;
  const std::vector<int> keep_, drop_;  // of the shared parameters
};

struct Spread {
  VectorXd deviations;                 // NaN: not determined
  double log_determinant = -INFINITY;  // of the information; −inf: not all are determined
};

Spread SpreadOf(const MatrixXd& information) {
  const Eigen::Index n = information.rows();
  Spread spread{VectorXd::Constant(n, NAN)};
  const VectorXd size = information.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd inverse = size.unaryExpr([](double x) { return x > 0.0 ? 1.0 / x : 0.0; });
  if (n == 0 || !(size.maxCoeff() > 0.0)) return spread;
  const SymmetricEigen solver(inverse.asDiagonal() * information * inverse.asDiagonal());
  VectorXd variance = VectorXd::Zero(n);
  std::vector<bool> determined(static_cast<size_t>(n), true);
  double log_determinant = 0.0;
  bool all = true;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double value = solver.values()[i];
    const VectorXd direction = solver.vectors().col(i);
    if (value > kDesignRank * solver.values().maxCoeff()) {
      variance += direction.cwiseAbs2() / value;
      log_determinant += std::log(value);
      continue;
    }
    all = false;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (std::abs(direction[k]) > kSmallShare) determined[static_cast<size_t>(k)] = false;
    }
  }
  for (Eigen::Index k = 0; k < n; ++k) {
    if (determined[static_cast<size_t>(k)] && size[k] > 0.0) {
      spread.deviations[k] = inverse[k] * std::sqrt(variance[k]);
    }
  }
  if (all) spread.log_determinant = log_determinant + 2.0 * size.array().log().sum();
  return spread;
}

double WidthOf(double deviation) { return 2.0 * kNormalQuantile * deviation; }

// The least number of takes after which a parameter's interval is at most so wide. Widths fall with
// takes.
std::optional<long> TakesFor(const MatrixXd& now, const MatrixXd& take, Eigen::Index k,
                             double width) {
  const auto enough = [&](long n) {
    const double deviation = SpreadOf(now + static_cast<double>(n) * take).deviations[k];
    return WidthOf(deviation) <= width;
  };
  if (enough(0)) return 0;
  long high = 1;
  while (!enough(high)) {
    if (high >= kMostTakes) return std::nullopt;
    high = std::min(2 * high, kMostTakes);
  }
  long low = high / 2;
  while (high - low > 1) {
    const long middle = (low + high) / 2;
    (enough(middle) ? high : low) = middle;
  }
  return high;
}

// The values of a take's parameters: those of the fit's first recording, and of its start what the
// candidate sets.
VectorXd ValuesOfTake(const FitInput& input, const DesignCandidate& candidate,
                      const RecordingsProblem& problem, const RecordingsProblem& take,
                      const VectorXd& estimate) {
  VectorXd p = InitialOf(take.entries());
  p.head(take.num_shared()) = estimate.head(problem.num_shared());
  const FitProblem& run = input.recordings.front().problem;
  for (size_t i = 0; i < run.parameters.size(); ++i) {
    const int k = static_cast<int>(i);
    p[take.ParameterOf(0, k)] = estimate[problem.ParameterOf(0, k)];
  }
  for (const auto& [path, value] : candidate.values) {
    const SetBy by = FindSet(run, NumbersOf(run.scene, path));
    if (by.parameter < 0) continue;
    p[take.ParameterOf(0, by.parameter)] = (value - by.set->offset) / by.set->scale;
  }
  return p;
}

// Compares the candidates.
class Designer {
 public:
  Designer(const FitInput& input, const DesignRequest& request, const VectorXd& estimate,
           RecordingsProblem* problem, Design* design)
      : input_(input), request_(request), estimate_(estimate), problem_(*problem), d_(*design) {}

  std::string Make() {
    std::vector<int> nuisance;
    for (int k = 0; k < problem_.num_shared(); ++k) {
      if (IsAtBound(problem_.entries()[static_cast<size_t>(k)], estimate_[k])) continue;
      (StaysOverTakes(input_, problem_, k) ? d_.parameters : nuisance).push_back(k);
    }
    if (d_.parameters.empty()) {
      return "expected a parameter that stays from take to take, and is not at its bound, got none";
    }
    const Informer informer(input_, d_.parameters, nuisance);
    ProblemWithPriors present(&problem_, problem_.effects());
    std::string message;
    if (!informer.Of(&present, Informer::What::kPresent, estimate_, &now_, &message))
      return message;
    const Spread spread = SpreadOf(now_);
    d_.widths = spread.deviations.unaryExpr(&WidthOf);
    d_.wanted = request_.wanted;
    for (const DesignCandidate& candidate : request_.candidates) {
      d_.candidates.push_back(Judge(informer, candidate, spread.log_determinant));
    }
    Choose();
    return "";
  }

 private:
  CandidateWorth Judge(const Informer& informer, const DesignCandidate& candidate,
                       double log_determinant) const {
    CandidateWorth worth;
    worth.widths = VectorXd::Constant(d_.widths.size(), NAN);
    worth.takes.resize(d_.wanted.size());
    FitInput input;
    worth.message = MakeTake(input_, candidate, &input);
    if (!worth.message.empty()) return worth;
    ParameterError error;
    int fault = 0;
    const std::unique_ptr<RecordingsProblem> take = MakeProblem(input, &error, &fault);
    worth.message = error.what;
    if (take == nullptr) return worth;
    worth.observations = take->num_rows(0);
    ProblemWithPriors with_priors(take.get(), EffectsOf(*take));
    MatrixXd information;
    if (!informer.Of(&with_priors, Informer::What::kTake,
                     ValuesOfTake(input_, candidate, problem_, *take, estimate_), &information,
                     &worth.message)) {
      return worth;
    }
    const Spread after = SpreadOf(now_ + information);
    worth.widths = after.deviations.unaryExpr(&WidthOf);
    worth.log_determinant = after.log_determinant;
    worth.relative_variance = 0.0;
    for (size_t i = 0; i < d_.parameters.size(); ++i) {
      const auto k = static_cast<size_t>(d_.parameters[i]);
      const double scale = problem_.entries()[k].scale;
      const double deviation = after.deviations[static_cast<Eigen::Index>(i)];
      worth.log_determinant += 2.0 * std::log(scale);
      worth.relative_variance += deviation * deviation / (scale * scale);
    }
    if (std::isnan(worth.relative_variance)) worth.relative_variance = INFINITY;
    if (std::isfinite(log_determinant)) {
      worth.gain = 0.5 * (after.log_determinant - log_determinant);
    }
    for (size_t i = 0; i < d_.wanted.size(); ++i) {
      const auto at = std::find(d_.parameters.begin(), d_.parameters.end(), d_.wanted[i].parameter);
      if (at == d_.parameters.end()) continue;
      worth.takes[i] = TakesFor(now_, information, at - d_.parameters.begin(), d_.wanted[i].width);
    }
    return worth;
  }

  // The effects of a take with the spreads that were found.
  std::vector<RandomEffect> EffectsOf(const RecordingsProblem& take) const {
    std::vector<RandomEffect> effects = take.effects();
    for (size_t i = 0; i < effects.size(); ++i) effects[i].spread = problem_.effects()[i].spread;
    return effects;
  }

  void Choose() {
    d_.narrowest.assign(d_.parameters.size(), -1);
    for (size_t c = 0; c < d_.candidates.size(); ++c) {
      const CandidateWorth& worth = d_.candidates[c];
      const int index = static_cast<int>(c);
      const auto better = [&](int best, auto&& value) {
        return best < 0 || value(worth) < value(d_.candidates[static_cast<size_t>(best)]);
      };
      const auto by_d = [](const CandidateWorth& one) { return -one.log_determinant; };
      const auto by_a = [](const CandidateWorth& one) { return one.relative_variance; };
      if (std::isfinite(by_d(worth)) && better(d_.best_d, by_d)) d_.best_d = index;
      if (std::isfinite(by_a(worth)) && better(d_.best_a, by_a)) d_.best_a = index;
      for (size_t i = 0; i < d_.narrowest.size(); ++i) {
        const auto width = [i](const CandidateWorth& one) {
          return one.widths[static_cast<Eigen::Index>(i)];
        };
        if (std::isfinite(width(worth)) && better(d_.narrowest[i], width)) {
          d_.narrowest[i] = index;
        }
      }
    }
  }

  const FitInput& input_;
  const DesignRequest& request_;
  const VectorXd& estimate_;
  RecordingsProblem& problem_;
  Design& d_;
  MatrixXd now_;
};

}  // namespace

std::string CheckCandidate(const FitInput& input, const DesignCandidate& candidate) {
  const FitProblem& run = input.recordings.front().problem;
  for (const auto& [path, value] : candidate.values) {
    ParameterPath resolved;
    std::string error;
    if (!ResolveParameter(run.scene, path, &resolved, &error)) return error;
    const SetBy by = FindSet(run, resolved.numbers);
    if (by.parameter < 0) continue;
    const FitParameter& parameter = run.parameters[static_cast<size_t>(by.parameter)];
    if (!IsOfInitialState(run.scene, parameter)) {
      return path + ": expected a number that is not to be found, got that of parameter " +
             parameter.name;
    }
    if (parameter.sets.size() != 1 || by.set->mode != SetMode::kAssign) {
      return path + ": expected a number that a parameter sets alone, got one of several of " +
             parameter.name;
    }
  }
  if (candidate.camera >= 0) {
    for (const Channel& channel : run.channels) {
      if (channel.camera < 0) {
        return "expected a camera where all observations are made by one, as sigma is in its units";
      }
    }
    if (run.channels.empty()) {
      return "expected a camera where all observations are made by one, as sigma is in its units";
    }
  }
  FitInput take;
  return MakeTake(input, candidate, &take);
}

bool StaysOverTakes(const FitInput& input, const RecordingsProblem& problem, int parameter) {
  if (problem.RecordingOf(parameter) >= 0) return false;
  const auto index = static_cast<size_t>(problem.IndexInRecording(parameter));
  if (input.scopes[index].kind == ParameterScope::Kind::kVaries) return true;
  const FitProblem& run = input.recordings.front().problem;
  return !IsOfInitialState(run.scene, run.parameters[index]);
}

std::string MakeDesign(const FitInput& input, const DesignRequest& request,
                       const Eigen::VectorXd& estimate, RecordingsProblem* problem,
                       Design* design) {
  return Designer(input, request, estimate, problem, design).Make();
}

}  // namespace tangible
