// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/plan_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "tangible/control/engine_step.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

// Rollouts of each start beside its polish, which costs as much as some hundred of them.
constexpr int kDrawsOfStart = 16;
// Iterations of the first round of a polish.
constexpr int kFirstIterations = 6;
// The best share of samples is one of so many.
constexpr int kShareOfBest = 10;

constexpr double kNever = std::numeric_limits<double>::infinity();

class Searcher {
 public:
  Searcher(const SearchProblem& problem, const SearchOptions& options, Eigen::Index steps)
      : p_(problem),
        o_(options),
        steps_(steps),
        m_(problem.low.size()),
        pieces_(std::min<Eigen::Index>(options.starts.pieces, steps)) {}

  // Empty, or why nothing can be rolled out.
  std::string Prepare() {
    std::vector<std::string> paths;
    for (const ParameterPath& path : p_.function->controls()) paths.push_back(path.path);
    std::vector<long> records(static_cast<size_t>(steps_) + 1);
    std::iota(records.begin(), records.end(), 0L);
    return rolled_.Create(p_.function->scene(), {}, paths, records);
  }

  SearchResult Search(const RowMatrixXd& initial) {
    starts_ = {initial};
    if (o_.sampling.samples > 0) Sample(initial);
    if (o_.starts.count > static_cast<int>(starts_.size())) Draw();
    if (o_.starts.count < static_cast<int>(starts_.size())) KeepTheBest();
    result_.start_costs = CostsOf(starts_);
    Polish();
    return std::move(result_);
  }

 private:
  using Pieces = RowMatrixXd;  // a row a piece, a column a control

  // Controls of each step that are constant in pieces of equal length, as far as steps divide.
  RowMatrixXd ControlsOf(const Pieces& pieces) const {
    RowMatrixXd controls(steps_, m_);
    for (Eigen::Index k = 0; k < steps_; ++k) {
      controls.row(k) = pieces.row(k * pieces.rows() / steps_);
    }
    return controls;
  }

  // The costs of rollouts; infinite where one fails.
  std::vector<double> CostsOf(const std::vector<RowMatrixXd>& controls) {
    std::vector<double> costs(controls.size(), kNever);
    ForEachRollout(
        rolled_, static_cast<long>(controls.size()), o_.threads,
        [&](RolloutWorker* worker, long i) {
          const RowMatrixXd& u = controls[static_cast<size_t>(i)];
          const RolloutOutput run = worker->Run({VectorX<double>(), VectorX<double>(), u});
          if (run.status != RolloutStatus::kDone) return;
          double cost = p_.cost->EndValue(run.states.row(steps_));
          for (Eigen::Index k = 0; k < steps_; ++k) {
            cost += p_.cost->Value(run.states.row(k), u.row(k));
          }
          if (std::isfinite(cost)) costs[static_cast<size_t>(i)] = cost;
        });
    return costs;
  }

  static std::vector<size_t> Ascending(const std::vector<double>& costs) {
    std::vector<size_t> order(costs.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return costs[a] < costs[b]; });
    return order;
  }

  void Draw() {
    const auto wanted = static_cast<size_t>(o_.starts.count) - starts_.size();
    std::vector<RowMatrixXd> drawn(wanted * kDrawsOfStart);
    for (size_t i = 0; i < drawn.size(); ++i) {
      std::mt19937_64 random = Generator(o_.starts.seed, static_cast<unsigned>(i));
      Pieces pieces(pieces_, m_);
      for (Eigen::Index k = 0; k < pieces_; ++k) {
        for (Eigen::Index j = 0; j < m_; ++j) {
          pieces(k, j) = Uniform(p_.low[j], p_.high[j], &random);
        }
      }
      drawn[i] = ControlsOf(pieces);
    }
    const std::vector<size_t> order = Ascending(CostsOf(drawn));
    for (size_t i = 0; i < wanted; ++i) starts_.push_back(drawn[order[i]]);
    result_.drawn += static_cast<long>(drawn.size());
  }

  // Where fewer starts are polished than there are: those with the least costs.
  void KeepTheBest() {
    const std::vector<size_t> order = Ascending(CostsOf(starts_));
    std::vector<RowMatrixXd> kept;
    kept.reserve(static_cast<size_t>(o_.starts.count));
    for (int i = 0; i < o_.starts.count; ++i)
      kept.push_back(starts_[order[static_cast<size_t>(i)]]);
    starts_ = std::move(kept);
  }

  // The mean of the initial controls in each piece.
  Pieces PiecesOf(const RowMatrixXd& controls) const {
    Pieces sum = Pieces::Zero(pieces_, m_);
    VectorX<double> counts = VectorX<double>::Zero(pieces_);
    for (Eigen::Index k = 0; k < steps_; ++k) {
      sum.row(k * pieces_ / steps_) += controls.row(k);
      counts[k * pieces_ / steps_] += 1.0;
    }
    return counts.cwiseInverse().asDiagonal() * sum;
  }

  void Sample(const RowMatrixXd& initial) {
    Pieces mean = PiecesOf(initial);
    Pieces deviation = (0.5 * (p_.high - p_.low)).transpose().replicate(pieces_, 1);
    const auto count = static_cast<size_t>(o_.sampling.samples);
    std::vector<Pieces> pieces(count);
    std::vector<RowMatrixXd> controls(count);
    Pieces best = mean;
    double least = kNever;
    for (int round = 0; round < o_.sampling.iterations; ++round) {
      for (size_t i = 0; i < count; ++i) {
        const size_t task = static_cast<size_t>(round) * count + i;
        std::mt19937_64 random = Generator(o_.sampling.seed, static_cast<unsigned>(task));
        pieces[i] = mean;
        for (Eigen::Index k = 0; k < pieces_; ++k) {
          for (Eigen::Index j = 0; j < m_; ++j) {
            const double z = mean(k, j) + deviation(k, j) * Normal(&random);
            pieces[i](k, j) = std::clamp(z, p_.low[j], p_.high[j]);
          }
        }
        controls[i] = ControlsOf(pieces[i]);
      }
      const std::vector<double> costs = CostsOf(controls);
      result_.drawn += static_cast<long>(count);
      const std::vector<size_t> order = Ascending(costs);
      if (costs[order[0]] == kNever) continue;
      if (costs[order[0]] < least) {
        least = costs[order[0]];
        best = pieces[order[0]];
      }
      Move(pieces, costs, order, &mean, &deviation);
    }
    if (least < kNever) starts_.push_back(ControlsOf(best));
  }

  // Moves the distribution to the better samples.
  void Move(const std::vector<Pieces>& pieces, const std::vector<double>& costs,
            const std::vector<size_t>& order, Pieces* mean, Pieces* deviation) const {
    const size_t tenth = std::max<size_t>(2, order.size() / kShareOfBest);
    const size_t used = o_.sampling.method == SamplingMethod::kMppi ? order.size() : tenth;
    const double span = costs[order[std::min(tenth, order.size()) - 1]] - costs[order[0]];
    Pieces sum = Pieces::Zero(pieces_, m_), squares = sum;
    double total = 0.0;
    for (size_t i = 0; i < std::min(used, order.size()); ++i) {
      const double above = costs[order[i]] - costs[order[0]];
      double weight = above < kNever ? 1.0 : 0.0;
      if (o_.sampling.method == SamplingMethod::kMppi && above > 0.0) {
        weight = span > 0.0 ? std::exp(-above / span) : 0.0;
      }
      if (weight == 0.0) continue;
      total += weight;
      sum += weight * pieces[order[i]];
      squares += weight * pieces[order[i]].cwiseAbs2();
    }
    *mean = sum / total;
    if (o_.sampling.method == SamplingMethod::kMppi) return;
    *deviation = (squares / total - mean->cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  }

  // Polishes by successive halving. A start that has converged, or cannot be improved, rests.
  void Polish() {
    polished_.resize(starts_.size());
    std::vector<size_t> going(starts_.size());
    std::iota(going.begin(), going.end(), size_t{0});
    for (int budget = kFirstIterations; going.size() > 1; budget *= 2) {
      Continue(going, budget);
      std::vector<double> costs;
      costs.reserve(going.size());
      for (const size_t i : going) costs.push_back(CostOf(i));
      std::vector<size_t> kept;
      const std::vector<size_t> order = Ascending(costs);
      for (size_t i = 0; i < (going.size() + 1) / 2; ++i) kept.push_back(going[order[i]]);
      going = std::move(kept);
    }
    Continue(going, o_.ilqr.max_iterations);
    Choose();
  }

  double CostOf(size_t i) const {
    return polished_[i].status == IlqrStatus::kFailed ? kNever : polished_[i].plan.cost;
  }

  void Continue(const std::vector<size_t>& which, int budget) {
    ForEachRollout(*p_.function, static_cast<long>(which.size()), o_.threads,
                   [&](RolloutWorker*, long i) {
                     const size_t start = which[static_cast<size_t>(i)];
                     Continue(start, budget, &polished_[start]);
                   });
  }

  // At most `budget` further iterations of one start.
  void Continue(size_t start, int budget, IlqrResult* result) const {
    const bool begun = result->rollouts > 0;
    if (begun && result->status != IlqrStatus::kIterationLimit) return;
    const int done = static_cast<int>(result->iterations.size());
    IlqrOptions options = o_.ilqr;
    options.max_iterations = std::min(budget, o_.ilqr.max_iterations - done);
    if (options.max_iterations <= 0) return;
    if (begun) options.surrogate.samples = 0;
    options.progress = ProgressAfter(o_.ilqr.progress, static_cast<int>(start), done);
    EngineStep map(*p_.function);
    const ControlProblem problem{&map, p_.cost, map.initial(), p_.low, p_.high};
    IlqrResult more = SolveIlqr(problem, begun ? result->plan.controls : starts_[start], options);
    more.iterations.insert(more.iterations.begin(), result->iterations.begin(),
                           result->iterations.end());
    more.rollouts += result->rollouts;
    more.linearisations += result->linearisations;
    more.surrogate_iterations += result->surrogate_iterations;
    more.left_maximum |= result->left_maximum;
    *result = std::move(more);
  }

  void Choose() {
    long rollouts = 0, linearisations = 0;
    for (size_t i = 0; i < polished_.size(); ++i) {
      result_.polished_costs.push_back(CostOf(i));
      rollouts += polished_[i].rollouts;
      linearisations += polished_[i].linearisations;
    }
    result_.chosen = static_cast<int>(Ascending(result_.polished_costs)[0]);
    result_.best = std::move(polished_[static_cast<size_t>(result_.chosen)]);
    result_.best.rollouts = rollouts;
    result_.best.linearisations = linearisations;
  }

  const SearchProblem& p_;
  const SearchOptions& o_;
  const Eigen::Index steps_, m_, pieces_;
  RolloutFunction rolled_;  // with the states of all steps
  std::vector<RowMatrixXd> starts_;
  std::vector<IlqrResult> polished_;
  SearchResult result_;
};

}  // namespace

const char* NameOf(SamplingMethod method) {
  return method == SamplingMethod::kCrossEntropy ? "cross_entropy" : "mppi";
}

SearchResult SearchPlan(const SearchProblem& problem, const RowMatrixXd& initial,
                        const SearchOptions& options) {
  SearchResult failed;
  failed.best.status = IlqrStatus::kFailed;
  for (Eigen::Index i = 0; i < problem.low.size() && options.searches(); ++i) {
    if (std::isfinite(problem.high[i] - problem.low[i])) continue;
    failed.best.message = "bounds of control " + std::to_string(i) +
                          ": expected finite ones, between which starts are drawn, got none";
    return failed;
  }
  Searcher searcher(problem, options, initial.rows());
  failed.best.message = searcher.Prepare();
  return failed.best.message.empty() ? searcher.Search(initial) : failed;
}

}  // namespace tangible
