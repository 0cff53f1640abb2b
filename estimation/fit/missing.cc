// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/missing.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <utility>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/estimation/uncertainty/score_rows.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/decompositions.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

// A refit begins at a minimum of the other parameters.
constexpr int kMissingIterations = 30;

/// A candidate, and what it explains.
struct Explained {
  const MissingCandidate* candidate = nullptr;
  Eigen::VectorXd part;    ///< e, in rows
  Eigen::VectorXd held;    ///< the initial values of its parameters
  Eigen::VectorXd values;  ///< to first order
  double share = 0.0;

  int columns() const { return static_cast<int>(candidate->parameters.size()); }
};

/// A problem with the parameters of a candidate, the last of the shared ones.
struct ChangedProblem {
  std::unique_ptr<RecordingsProblem> recordings;
  std::unique_ptr<ProblemWithPriors> with_priors;
};

/// The values of all parameters after those of a candidate are inserted at `at`.
Eigen::VectorXd Inserted(const Eigen::VectorXd& estimate, int at, const Eigen::VectorXd& values) {
  Eigen::VectorXd all(estimate.size() + values.size());
  all << estimate.head(at), values, estimate.tail(estimate.size() - at);
  return all;
}

class MissingSearch {
 public:
  MissingSearch(const MissingOptions& options, const FitInput& input, const FitResult& result,
                RecordingsProblem* problem)
      : options_(options),
        input_(input),
        fit_(result),
        problem_(problem),
        with_priors_(problem, problem->effects()),
        score_(result.estimate, input.options().derivatives, &with_priors_, RootWeight()) {}

  MissingResult Run() {
    if (problem_->HasNoise()) {
      found_.message = "with random forces nothing else is asked for what the residuals lack";
      return std::move(found_);
    }
    if (!score_.Evaluate() || !SetScenes()) {
      found_.message = "the run at the estimate fails";
      return std::move(found_);
    }
    const std::vector<MissingCandidate> candidates =
        FindMissingCandidates(fitted_.front(), options_.most_numbers);
    std::vector<Explained> all = Screen(candidates);
    found_.tested = static_cast<int>(all.size());
    Rank(&all);
    Fit();
    return std::move(found_);
  }

 private:
  std::function<double(double)> RootWeight() const {
    const double huber = input_.options().huber;
    if (!(huber > 0.0)) return {};
    return [huber](double r) { return std::sqrt(RobustWeight(r, huber)); };
  }

  // The problems of the recordings with the values of the estimate.
  bool SetScenes() {
    for (int b = 0; b < problem_->num_blocks(); ++b) {
      FitProblem one = input_.recordings[static_cast<size_t>(b)].problem;
      ParameterizedScene scene;
      ParameterError error;
      if (!scene.Create(one.scene, one.points, one.parameters, &error, one.instruments) ||
          !scene.Set(problem_->ParametersOf(b, fit_.estimate))) {
        return false;
      }
      one.scene = scene.scene();
      one.points = scene.points();
      one.instruments = scene.instruments();
      fitted_.push_back(std::move(one));
    }
    return true;
  }

  std::vector<Explained> Screen(const std::vector<MissingCandidate>& candidates) {
    std::vector<Explained> all;
    std::map<int, std::vector<const MissingCandidate*>> together;
    for (const MissingCandidate& one : candidates) {
      if (!one.tries.empty()) {
        Explained tried;
        if (Try(one, &tried)) all.push_back(std::move(tried));
      } else if (one.together >= 0) {
        together[one.together].push_back(&one);
      } else {
        AddColumns({&one}, &all);
      }
    }
    for (const auto& [number, of] : together) {
      if (AddColumns(of, &all)) continue;
      for (const MissingCandidate* one : of) AddColumns({one}, &all);
    }
    return all;
  }

  // (1) of candidates that are there together; false where a run with them fails.
  bool AddColumns(const std::vector<const MissingCandidate*>& candidates,
                  std::vector<Explained>* all) {
    std::vector<FitParameter> parameters;
    for (const MissingCandidate* one : candidates) {
      parameters.insert(parameters.end(), one->parameters.begin(), one->parameters.end());
    }
    const BlockLayout& layout = score_.layout();
    RowMatrixXd columns =
        RowMatrixXd::Zero(layout.num_rows(), static_cast<Eigen::Index>(parameters.size()));
    std::vector<ParameterEntry> entries;
    for (size_t b = 0; b < fitted_.size(); ++b) {
      FitProblem changed = fitted_[b];
      changed.parameters = parameters;
      for (const MissingCandidate* one : candidates) {
        if (one->change) one->change(&changed);
      }
      ParameterError error;
      std::optional<RolloutResiduals> run = MakeRun(changed, &error);
      Eigen::VectorXd residuals;
      RowMatrixXd jacobian;
      if (!run || !run->Evaluate(InitialOf(run->entries()), input_.options().derivatives,
                                 &residuals, &jacobian)) {
        return false;
      }
      found_.rollouts += run->rollouts();
      const int block = static_cast<int>(b);
      const RowMatrixXd left = score_.WithoutOwn(block, jacobian);
      columns.middleRows(layout.row_offset(block), left.rows()) = left;
      if (b == 0) entries = run->entries();
      // One value for all recordings would change a number that differs between them.
      for (size_t k = 0; k < entries.size(); ++k) {
        if (run->entries()[k].initial != entries[k].initial) {
          columns.col(static_cast<Eigen::Index>(k)).setConstant(NAN);
        }
      }
    }
    const RowMatrixXd own = score_.WithoutShared(columns);
    Eigen::Index first = 0;
    for (const MissingCandidate* one : candidates) {
      const auto count = static_cast<Eigen::Index>(one->parameters.size());
      Explained explained;
      explained.candidate = one;
      if (Explain(columns.middleCols(first, count), own.middleCols(first, count),
                  {entries.begin() + first, entries.begin() + first + count}, &explained)) {
        all->push_back(std::move(explained));
      }
      first += count;
    }
    return true;
  }

  // False where the columns cannot be distinguished from those of the free parameters, or the
  // number may not change that way.
  bool Explain(const RowMatrixXd& columns, const RowMatrixXd& own,
               const std::vector<ParameterEntry>& entries, Explained* explained) const {
    if (!columns.allFinite()) return false;
    Eigen::MatrixXd unit = own;
    Eigen::VectorXd lengths(own.cols());
    for (Eigen::Index k = 0; k < own.cols(); ++k) {
      // A column that the others can do is none: the least squares leave it out.
      const double length = own.col(k).norm();
      lengths[k] = length > kSeparable * columns.col(k).norm() ? length : HUGE_VAL;
      unit.col(k) /= lengths[k];
    }
    const OrthogonalDecomposition solver(unit);
    if (solver.rank() == 0 || unit.norm() == 0.0) return false;
    const Eigen::VectorXd steps = -solver.Solve(score_.residuals());
    explained->part = -unit * steps;
    explained->share = explained->part.squaredNorm() / score_.square();
    explained->held = InitialOf(entries);
    explained->values = explained->held;
    for (Eigen::Index k = 0; k < steps.size(); ++k) {
      const ParameterEntry& entry = entries[static_cast<size_t>(k)];
      double& value = explained->values[k];
      value += steps[k] / lengths[k];
      const double largest = kLargestChange * std::max(std::abs(entry.initial), entry.scale);
      if (!(std::abs(value - entry.initial) <= largest)) return false;
      if (entries.size() == 1 && ((entry.initial <= entry.lower && value < entry.lower) ||
                                  (entry.initial >= entry.upper && value > entry.upper))) {
        return false;
      }
      value = std::clamp(value, entry.lower, entry.upper);
    }
    return true;
  }

  // (2): the best of the candidate's tries; false where none runs.
  bool Try(const MissingCandidate& candidate, Explained* best) {
    const ChangedProblem changed = Change(input_, candidate);
    if (changed.recordings == nullptr) return false;
    for (const Eigen::VectorXd& values : candidate.tries) {
      ScoreRows rows(Inserted(fit_.estimate, problem_->num_shared(), values),
                     input_.options().derivatives, changed.with_priors.get(), RootWeight());
      const bool runs = rows.Evaluate();
      found_.rollouts += rows.rollouts();
      if (!runs) continue;
      const double share = 1.0 - rows.residuals().squaredNorm() / score_.square();
      if (best->candidate != nullptr && !(share > best->share)) continue;
      best->candidate = &candidate;
      best->share = std::max(0.0, share);
      best->part = score_.residuals() - rows.residuals();
      best->held = Eigen::VectorXd::Constant(values.size(), INFINITY);
      best->values = values;
    }
    return best->candidate != nullptr;
  }

  // Null where the candidate has no place in some recording.
  ChangedProblem Change(const FitInput& input, const MissingCandidate& candidate) const {
    FitInput changed = input;
    for (RecordingInput& recording : changed.recordings) {
      FitProblem& one = recording.problem;
      if (candidate.change) candidate.change(&one);
      one.parameters.insert(one.parameters.end(), candidate.parameters.begin(),
                            candidate.parameters.end());
    }
    changed.scopes.resize(changed.scopes.size() + candidate.parameters.size());
    ParameterError error;
    int fault = 0;
    ChangedProblem result;
    result.recordings = MakeProblem(changed, &error, &fault);
    if (result.recordings == nullptr) return result;
    const std::vector<RandomEffect>& effects = problem_->effects();
    for (size_t e = 0; e < effects.size(); ++e) {
      result.recordings->SetSpread(static_cast<int>(e), effects[e].spread);
    }
    result.with_priors =
        std::make_unique<ProblemWithPriors>(result.recordings.get(), result.recordings->effects());
    return result;
  }

  // The rows, the best first, of those that explain the same one row.
  void Rank(std::vector<Explained>* all) {
    const auto count = static_cast<double>(score_.residuals().size());
    double most = 0.0;
    for (const Explained& one : *all) most = std::max(most, one.share);
    const double noise = std::max(0.0, 1.0 - most) * score_.square() / count;
    found_.chance = options_.least_deviations * options_.least_deviations / count;
    const auto worth = [&](const Explained& one) {
      return one.share - kWorthOfColumn * one.columns() * noise / score_.square();
    };
    std::stable_sort(all->begin(), all->end(),
                     [&](const Explained& a, const Explained& b) { return worth(a) > worth(b); });
    for (Explained& one : *all) {
      if (!(one.share > Chance(one.columns()))) continue;
      const double length = one.part.norm();
      const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const Explained& other) {
        return (one.part - other.part).squaredNorm() <=
               std::max(kSameExplained * length * other.part.norm(), kNoiseOfOne * noise);
      });
      if (same != groups_.end()) {
        found_.rows[static_cast<size_t>(same - groups_.begin())].equivalent.push_back(
            one.candidate->name);
      } else if (static_cast<int>(groups_.size()) < options_.most_rows) {
        found_.rows.push_back(RowOf(one));
        groups_.push_back(std::move(one));
      }
    }
  }

  // The share that chance may give so many columns.
  double Chance(int columns) const {
    return found_.chance +
           kWorthOfColumn * (columns - 1) / static_cast<double>(score_.residuals().size());
  }

  static MissingRow RowOf(const Explained& one) {
    MissingRow row;
    row.candidate = one.candidate->name;
    row.kind = one.candidate->kind;
    for (const FitParameter& parameter : one.candidate->parameters) {
      row.parameters.push_back(parameter.name);
    }
    row.held.assign(one.held.begin(), one.held.end());
    row.first_order.assign(one.values.begin(), one.values.end());
    row.cost_share = std::min(1.0, one.share);
    return row;
  }

  // Fits the best, until enough of them are confirmed.
  void Fit() {
    int fitted = 0, confirmed = 0;
    if (groups_.empty()) return;
    const double before = HeldOut(problem_, fit_.estimate, &with_priors_);
    for (size_t i = 0; i < groups_.size(); ++i) {
      if (fitted == options_.most_fitted || confirmed == options_.most_confirmed) break;
      MissingRow& row = found_.rows[i];
      FitOne(groups_[i], before, &row);
      fitted += row.refitted ? 1 : 0;
      confirmed += row.confirmed ? 1 : 0;
    }
    const auto share = [](const MissingRow& row) {
      return row.confirmed ? 1.0 + row.refitted_share : row.cost_share;
    };
    std::stable_sort(found_.rows.begin(), found_.rows.end(),
                     [&](const MissingRow& a, const MissingRow& b) { return share(a) > share(b); });
  }

  void FitOne(const Explained& one, double held_out_before, MissingRow* row) {
    const ChangedProblem changed = Change(input_, *one.candidate);
    if (changed.recordings == nullptr) return;
    const int at = problem_->num_shared();
    Minimum best;
    std::vector<Eigen::VectorXd> starts = {one.values};
    if (one.held.allFinite()) starts.push_back(one.held);
    for (const Eigen::VectorXd& start : starts) {
      const Minimum minimum =
          MinimiseFrom(Inserted(fit_.estimate, at, start), changed.with_priors.get());
      if (minimum.status == FitStatus::kFailed) continue;
      if (best.status == FitStatus::kFailed || minimum.cost < best.cost) best = minimum;
      // From the first-order values the fit is nearly there, unless these led astray.
      if (best.cost <= fit_.final_cost) break;
    }
    if (best.status == FitStatus::kFailed) return;
    row->refitted = true;
    const Eigen::VectorXd values =
        best.parameters.segment(at, static_cast<Eigen::Index>(one.columns()));
    row->values.assign(values.begin(), values.end());
    row->refitted_share = 1.0 - best.cost / fit_.final_cost;
    const double after =
        HeldOut(changed.recordings.get(), best.parameters, changed.with_priors.get());
    row->held_out_gain = 1.0 - after / held_out_before;
    row->confirmed = row->refitted_share > Chance(one.columns()) && row->held_out_gain > 0.0;
  }

  Minimum MinimiseFrom(const Eigen::VectorXd& start, LeastSquaresProblem* problem) {
    FitOptions few = input_.options();
    few.max_iterations = kMissingIterations;
    Minimum minimum = Minimise(
        few, start, [] { return 0.0; }, {}, problem);
    found_.rollouts += minimum.rollouts;
    return minimum;
  }

  // The cost of the observations after the first part of each recording, with the parameters of
  // that part; NaN where there is none.
  double HeldOut(RecordingsProblem* problem, const Eigen::VectorXd& from,
                 LeastSquaresProblem* whole) {
    const std::unique_ptr<LeastSquaresProblem> window = whole->Window(options_.fitted_part);
    if (window == nullptr) return NAN;
    const Minimum early = MinimiseFrom(from, window.get());
    if (early.status == FitStatus::kFailed) return NAN;
    const BlockLayout layout(*problem);
    double sum = 0.0;
    for (int b = 0; b < problem->num_blocks(); ++b) {
      BlockEvaluation all;
      if (!problem->EvaluateBlock(b, layout.Local(b, early.parameters),
                                  input_.options().derivatives, BlockDerivatives::kSkip, &all)) {
        return NAN;
      }
      found_.rollouts += all.rollouts;
      const std::vector<RowPlace> places = problem->Places(b);
      const auto by_time = [](const RowPlace& x, const RowPlace& y) { return x.time < y.time; };
      const auto [first, last] = std::minmax_element(places.begin(), places.end(), by_time);
      const double end = first->time + options_.fitted_part * (last->time - first->time);
      std::vector<double> late;
      for (size_t i = 0; i < places.size(); ++i) {
        if (places[i].time > end) late.push_back(all.residuals[static_cast<Eigen::Index>(i)]);
      }
      sum +=
          problem->weight(b) * RobustCost(Eigen::Map<const Eigen::VectorXd>(
                                              late.data(), static_cast<Eigen::Index>(late.size())),
                                          input_.options().huber);
    }
    return sum;
  }

  const MissingOptions& options_;
  const FitInput& input_;
  const FitResult& fit_;
  RecordingsProblem* problem_;
  ProblemWithPriors with_priors_;
  ScoreRows score_;
  std::vector<FitProblem> fitted_;
  std::vector<Explained> groups_;  ///< of the rows
  MissingResult found_;
};

}  // namespace

MissingResult FindMissing(const MissingOptions& options, const FitInput& input,
                          const FitResult& result, RecordingsProblem* problem) {
  using Clock = std::chrono::steady_clock;
  const auto began = Clock::now();
  MissingResult found = MissingSearch(options, input, result, problem).Run();
  found.seconds = std::chrono::duration<double>(Clock::now() - began).count();
  return found;
}

std::string Conclusion(const MissingResult& missing) {
  if (!missing.message.empty()) return missing.message;
  if (missing.rows.empty()) {
    return "none of " + std::to_string(missing.tested) +
           " candidates explains more of the residuals than chance";
  }
  const MissingRow& first = missing.rows.front();
  std::string name = "'" + first.candidate + "'";
  if (!first.equivalent.empty()) {
    name += " (or " + first.equivalent.front() + (first.equivalent.size() > 1 ? ", ..." : "") +
            ", which cannot be told apart from it)";
  }
  if (first.confirmed) {
    return name + " explains " + CompactNumber(100.0 * first.refitted_share, 3) +
           " % of the cost in a real fit, and the sum of squares of what was held back falls by " +
           CompactNumber(100.0 * first.held_out_gain, 3) + " %";
  }
  return "to first order " + name + " would explain " + CompactNumber(100.0 * first.cost_share, 3) +
         " % of the cost, but no real fit confirms a candidate";
}

}  // namespace tangible
