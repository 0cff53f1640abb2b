// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/profile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/scalar.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

// Of the minimisation at one value, which begins at that of the value beside it.
constexpr int kProfileIterations = 15;
// Steps beyond an end where no bound is near.
constexpr int kStepsBeyond = 3;
// Steps in a row at the same cost: there is no end on that side.
constexpr int kFlatSteps = 6;
// Steps at most on one side: the last is 1e12 deviations off.
constexpr int kMostSteps = 60;
constexpr int kMostBisections = 14;
// Points whose other values are tried at one that is not within the interval.
constexpr size_t kMostOthers = 4;
// Profiles that are made without being asked for, of fits with at most so many recordings.
constexpr size_t kMostProfiles = 4;
constexpr int kMostBlocks = 30;

/// Searches one profile.
class Profiler {
 public:
  Profiler(const FitOptions& options, const FitResult& result, int parameter, long budget,
           LeastSquaresProblem* problem)
      : options_(options),
        budget_(budget),
        entry_(problem->entries()[parameter]),
        parameter_(parameter),
        problem_(problem) {
    options_.max_iterations = kProfileIterations;
    lowest_ = result.final_cost;
    rounding_ = kEqualProfile * std::max(1.0, lowest_);
    profile_.parameter = parameter;
    profile_.rise = ProfileRise(result.uncertainty, parameter);
    const double p = result.estimate[parameter];
    middle_ = ToInternal(entry_, entry_.logarithmic ? std::max(p, LeastOf(entry_)) : p);
    points_[middle_] = {result.final_cost, result.estimate};
    const double deviation =
        result.uncertainty.standard_deviation[parameter] / ParameterByInternal(entry_, p);
    const double ratio = std::sqrt(2.0 * profile_.rise) / kNormalQuantile;
    step_ = std::isfinite(deviation) && deviation > 0.0 ? deviation * ratio : kBlindStep;
  }

  Profile Run(Eigen::VectorXd* better, long* rollouts) {
    better->resize(0);
    for (const double side : {-1.0, 1.0}) {
      if (better_.size() == 0) Walk(side);
    }
    if (better_.size() == 0 && !IsOver()) FindEnds();
    if (IsOver()) profile_.branches.clear();
    *rollouts += rollouts_;
    *better = better_;
    for (const auto& [q, point] : points_) {
      profile_.points.push_back({ToParameter(entry_, q), point.cost});
    }
    return profile_;
  }

 private:
  struct Point {
    double cost = kInfinity;
    Eigen::VectorXd all;  ///< empty where no run is possible
  };

  bool IsOver() const { return rollouts_ > budget_; }
  bool Accepted(const Point& point) const { return point.cost <= lowest_ + profile_.rise; }

  /// The point nearest to q at which a run is possible.
  const Point& Nearest(double q) const {
    const Point* nearest = nullptr;
    double distance = kInfinity;
    for (const auto& [at, point] : points_) {
      if (point.all.size() > 0 && std::abs(at - q) < distance) {
        distance = std::abs(at - q);
        nearest = &point;
      }
    }
    return *nearest;
  }

  const Point& Evaluate(double q) {
    const auto known = points_.find(q);
    if (known != points_.end()) {
      return known->second;
    }
    ProblemWithHeld held(parameter_, ToParameter(entry_, q), problem_);
    const Eigen::VectorXd start = held.Left(Nearest(q).all);
    Point point;
    if (start.size() == 0) {
      Linearizer linearizer(&held, options_.derivatives, options_.threads, nullptr);
      Eigen::VectorXd blocks;
      double cost = 0.0;
      if (linearizer.Cost(start, {options_.huber, options_.huber}, &blocks, &cost)) {
        point = {cost, held.All(start)};
      }
      rollouts_ += linearizer.rollouts();
    } else {
      const Minimum minimum = Minimise(
          options_, start, [] { return 0.0; }, {}, &held);
      rollouts_ += minimum.rollouts;
      if (minimum.status != FitStatus::kFailed) {
        point = {minimum.cost, held.All(minimum.parameters)};
      }
      if (!Accepted(point)) TryOthers(&held, &point);
    }
    if (point.cost < lowest_ - rounding_ && (better_.size() == 0 || point.cost < better_cost_)) {
      better_ = point.all;
      better_cost_ = point.cost;
    }
    return points_[q] = std::move(point);
  }

  /// Where the cost has jumps, as by fixed steps through impacts, a minimisation from the nearest
  /// values may stop at one: those of other values, the lowest first, may be better already.
  void TryOthers(ProblemWithHeld* held, Point* point) {
    std::vector<const Point*> others;
    for (const auto& [at, other] : points_) {
      if (other.all.size() > 0) others.push_back(&other);
    }
    std::sort(others.begin(), others.end(),
              [](const Point* x, const Point* y) { return x->cost < y->cost; });
    if (others.size() > kMostOthers) others.resize(kMostOthers);
    Linearizer linearizer(held, options_.derivatives, options_.threads, nullptr);
    Eigen::VectorXd blocks, best;
    for (const Point* other : others) {
      const Eigen::VectorXd start = held->Left(other->all);
      double cost = 0.0;
      const Eigen::VectorXd q = ToInternal(held->entries(), start);
      if (linearizer.Cost(q, {options_.huber, options_.huber}, &blocks, &cost) &&
          cost < point->cost - rounding_) {
        *point = {cost, held->All(start)};
        best = start;
      }
    }
    rollouts_ += linearizer.rollouts();
    if (best.size() == 0) return;
    const Minimum minimum = Minimise(
        options_, best, [] { return 0.0; }, {}, held);
    rollouts_ += minimum.rollouts;
    if (minimum.status != FitStatus::kFailed && minimum.cost < point->cost) {
      *point = {minimum.cost, held->All(minimum.parameters)};
    }
  }

  /// The values on one side of the estimate.
  void Walk(double side) {
    const bool up = side > 0.0;
    const double bound = ToInternal(entry_, up ? entry_.upper : LeastOf(entry_));
    const bool bounded = std::isfinite(bound);
    double reach = 1.0;
    double reach_before = 0.0;
    int beyond = 0;
    int flat = 0;
    double before = lowest_;
    for (int i = 0; i < kMostSteps && better_.size() == 0 && !IsOver(); ++i) {
      double q = middle_ + side * reach * step_;
      const bool last = bounded && (up ? q >= bound : q <= bound);
      q = last ? bound : q;
      if (q == middle_) return;
      const Point& point = Evaluate(q);
      if (last) return;
      beyond = Accepted(point) ? 0 : beyond + 1;
      flat = std::abs(point.cost - before) <= rounding_ ? flat + 1 : 0;
      before = point.cost;
      const bool far = flat >= kFlatSteps && !bounded && reach * step_ > kLevelFor;
      if (far || (beyond >= kStepsBeyond && !(bounded && reach * step_ < kNearBound))) {
        return;
      }
      // 1, 2, 3, 5, 8, ...
      const double next = i == 0 ? 2.0 : reach + reach_before;
      reach_before = reach;
      reach = next;
    }
  }

  /// The ends of the branches, and with them the interval.
  void FindEnds() {
    std::vector<std::pair<double, bool>> found;  // q, accepted
    for (const auto& [q, point] : points_) {
      found.emplace_back(q, Accepted(point));
    }
    bool open = false;
    for (size_t i = 0; i < found.size(); ++i) {
      if (found[i].second && !open) {
        open = true;
        ProfileBranch branch;
        if (i > 0) {
          branch.low = ToParameter(entry_, Crossing(found[i].first, found[i - 1].first));
        } else if (AtBound(found[i].first)) {
          branch.low = ToParameter(entry_, found[i].first);
        }
        profile_.branches.push_back(branch);
      } else if (!found[i].second && open) {
        open = false;
        profile_.branches.back().high =
            ToParameter(entry_, Crossing(found[i - 1].first, found[i].first));
      }
    }
    if (open && AtBound(found.back().first)) {
      profile_.branches.back().high = ToParameter(entry_, found.back().first);
    }
  }

  bool AtBound(double q) const { return IsAtBound(entry_, ToParameter(entry_, q)); }

  /// The end between a value that is accepted and one that is not: by secants of sqrt(c − lowest),
  /// which is linear for a parabola, and by halves where that does not get on, as at a jump.
  double Crossing(double inside, double outside) {
    double root_in = Root(points_.at(inside));
    double root_out = Root(points_.at(outside));
    const double wanted = std::sqrt(profile_.rise);
    for (int i = 0; i < kMostBisections && !IsOver(); ++i) {
      if (std::abs(outside - inside) <= kProfileEnd * step_) {
        break;
      }
      double part = std::isfinite(root_out) ? (wanted - root_in) / (root_out - root_in) : 0.5;
      part = i % 3 == 2 ? 0.5 : std::clamp(part, 0.02, 0.98);
      const double q = inside + part * (outside - inside);
      const double root = Root(Evaluate(q));
      if (std::abs(root - wanted) <= kProfileEnd * wanted) {
        return q;
      }
      (root <= wanted ? inside : outside) = q;
      (root <= wanted ? root_in : root_out) = root;
    }
    return 0.5 * (inside + outside);
  }

  double Root(const Point& point) const { return std::sqrt(std::max(0.0, point.cost - lowest_)); }

  FitOptions options_;
  long budget_;
  const ParameterEntry& entry_;
  int parameter_;
  LeastSquaresProblem* problem_;
  double lowest_ = 0.0, rounding_ = 0.0, middle_ = 0.0, step_ = 0.0;
  std::map<double, Point> points_;
  Eigen::VectorXd better_;
  double better_cost_ = kInfinity;
  long rollouts_ = 0;
  Profile profile_;
};

constexpr char kNoParabola[] = "the cost across the interval is no parabola";
constexpr char kNoRunThere[] = "the model cannot be run across the interval";

/// Empty where the cost at both ends of the interval, along the direction in which the others
/// follow, rises as a parabola does, and rises there; else why not.
std::string WhyNoParabola(const FitOptions& options, const FitResult& result, int k,
                          LeastSquaresProblem* problem, long* rollouts) {
  const Uncertainty& u = result.uncertainty;
  // How the others follow is known only where all are determined.
  if (k >= u.covariance.rows() || !(u.covariance(k, k) > 0.0) || !u.covariance.allFinite()) {
    return "";
  }
  const std::vector<ParameterEntry>& entries = problem->entries();
  const double rise = ProfileRise(u, k);
  const double length = std::sqrt(2.0 * rise / u.covariance(k, k));
  Linearizer linearizer(problem, options.derivatives, options.threads, nullptr);
  std::string why;
  // NaN where there is no run.
  const auto risen_at = [&](double way) {
    Eigen::VectorXd p = result.estimate;
    for (Eigen::Index i = 0; i < u.covariance.rows(); ++i) p[i] += way * u.covariance(i, k);
    Eigen::VectorXd blocks;
    double cost = 0.0;
    const bool done =
        linearizer.Cost(ToInternal(entries, p), {options.huber, options.huber}, &blocks, &cost);
    return done ? cost - result.final_cost : std::numeric_limits<double>::quiet_NaN();
  };
  for (const double side : {-length, length}) {
    const double at_end = risen_at(side);
    const double before = risen_at((1.0 - kLastOfWay) * side);
    // What a parabola gains over the last part of its way.
    const double last = (2.0 - kLastOfWay) * kLastOfWay * rise;
    const bool parabola = at_end < rise * kParabola && at_end > rise / kParabola &&
                          at_end - before > last * kStillRises;
    why = std::isnan(at_end) ? kNoRunThere : parabola ? "" : kNoParabola;
    if (!why.empty()) break;
  }
  *rollouts += linearizer.rollouts();
  return why;
}

}  // namespace

ProblemWithHeld::ProblemWithHeld(int parameter, double value, LeastSquaresProblem* problem)
    : parameter_(parameter),
      value_(value),
      problem_(problem),
      layout_(*problem),
      entries_(problem->entries()) {
  entries_.erase(entries_.begin() + parameter);
}

ProblemWithHeld::ProblemWithHeld(int parameter, double value,
                                 std::unique_ptr<LeastSquaresProblem> problem)
    : ProblemWithHeld(parameter, value, problem.get()) {
  owned_ = std::move(problem);
}

std::unique_ptr<LeastSquaresProblem> ProblemWithHeld::Window(double part) const {
  std::unique_ptr<LeastSquaresProblem> window = problem_->Window(part);
  if (window == nullptr) return nullptr;
  return std::unique_ptr<LeastSquaresProblem>(
      new ProblemWithHeld(parameter_, value_, std::move(window)));
}

Eigen::VectorXd ProblemWithHeld::All(const Eigen::VectorXd& left) const {
  Eigen::VectorXd all(left.size() + 1);
  all << left.head(parameter_), value_, left.tail(left.size() - parameter_);
  return all;
}

Eigen::VectorXd ProblemWithHeld::Left(const Eigen::VectorXd& all) const {
  Eigen::VectorXd left(all.size() - 1);
  left << all.head(parameter_), all.tail(left.size() - parameter_);
  return left;
}

int ProblemWithHeld::num_shared() const {
  return problem_->num_shared() - (parameter_ < problem_->num_shared() ? 1 : 0);
}

int ProblemWithHeld::num_own(int block) const {
  const bool own = LocalIndex(block) >= problem_->num_shared();
  return problem_->num_own(block) - (own ? 1 : 0);
}

int ProblemWithHeld::LocalIndex(int block) const {
  for (int i = 0; i < layout_.num_local(block); ++i) {
    if (layout_.ParameterOf(block, i) == parameter_) return i;
  }
  return -1;
}

bool ProblemWithHeld::EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                                    BlockDerivatives derivatives, BlockEvaluation* evaluation) {
  const int at = LocalIndex(block);
  if (at < 0) {
    return problem_->EvaluateBlock(block, p, method, derivatives, evaluation);
  }
  Eigen::VectorXd local(p.size() + 1);
  local << p.head(at), value_, p.tail(p.size() - at);
  if (!problem_->EvaluateBlock(block, local, method, derivatives, evaluation)) {
    return false;
  }
  if (derivatives == BlockDerivatives::kCompute) {
    RowMatrixXd left(evaluation->jacobian.rows(), p.size());
    left << evaluation->jacobian.leftCols(at), evaluation->jacobian.rightCols(p.size() - at);
    evaluation->jacobian = std::move(left);
  }
  return true;
}

double ProfileRise(const Uncertainty& uncertainty, int parameter) {
  const double trusting = 0.5 * kNormalQuantile * kNormalQuantile;
  const double sigma = uncertainty.standard_deviation[parameter];
  const double robust = uncertainty.standard_deviation_robust[parameter];
  const double freedom = uncertainty.degrees_of_freedom[parameter];
  if (!uncertainty.DoesNotFit()) {
    return trusting;
  }
  if (robust > 0.0 && sigma > 0.0 && freedom > 0.0) {
    const double ratio = StudentQuantile(freedom) * robust / sigma;
    return std::max(trusting, 0.5 * ratio * ratio);
  }
  // Of a parameter at a bound only the size of the residuals is known.
  return trusting * std::max(1.0, std::isfinite(uncertainty.reduced_chi_square)
                                      ? uncertainty.reduced_chi_square
                                      : 1.0);
}

Profile MakeProfile(const FitOptions& options, const FitResult& result, int parameter, long budget,
                    LeastSquaresProblem* problem, Eigen::VectorXd* better, long* rollouts) {
  return Profiler(options, result, parameter, budget, problem).Run(better, rollouts);
}

std::vector<std::pair<int, std::string>> NeedProfiles(const FitOptions& options,
                                                      const FitResult& result,
                                                      LeastSquaresProblem* problem,
                                                      long* rollouts) {
  const std::vector<ParameterEntry>& entries = problem->entries();
  std::vector<std::pair<int, std::string>> needed;
  std::vector<std::pair<int, std::string>> proposed;
  const Certificate& certificate = result.certificate;
  const bool kink = !certificate.verdict.empty() && !IsTrustworthyMap(certificate);
  const bool few = problem->num_blocks() <= kMostBlocks;
  const std::vector<ConfidenceInterval>& intervals = result.uncertainty.confidence_95;
  const auto num_undetermined =
      std::count_if(intervals.begin(), intervals.end(),
                    [](const ConfidenceInterval& interval) { return !interval; });
  bool one_at_bound = false;
  for (int k = 0; k < problem->num_shared() && few; ++k) {
    one_at_bound = one_at_bound || IsAtBound(entries[static_cast<size_t>(k)], result.estimate[k]);
  }
  for (int k = 0; k < static_cast<int>(entries.size()); ++k) {
    const ParameterEntry& entry = entries[static_cast<size_t>(k)];
    const auto& asked = options.profiles;
    if (std::find(asked.begin(), asked.end(), entry.name) != asked.end()) {
      needed.emplace_back(k, kAskedFor);
      continue;
    }
    if (options.profile_pass == ProfilePass::kSkip || !few || k >= problem->num_shared() ||
        result.status != FitStatus::kConverged) {
      continue;
    }
    const ConfidenceInterval& robust = result.uncertainty.confidence_95_robust[k];
    const ConfidenceInterval& trusting = result.uncertainty.confidence_95[k];
    const auto meets = [&entry](const ConfidenceInterval& interval) {
      return interval && (interval->first < entry.lower || interval->second > entry.upper);
    };
    if (IsAtBound(entry, result.estimate[k])) {
      proposed.emplace_back(k, "at a bound");
    } else if (one_at_bound && trusting) {
      // Its interval is that with the other one held there, from which it may leave to one side.
      proposed.emplace_back(k, "another parameter is at a bound");
    } else if (!trusting) {
      // What is not determined has no profile, unless it alone is not: then it may have one side.
      if (num_undetermined == 1) proposed.emplace_back(k, "no effect at the estimate");
    } else if (kink) {
      proposed.emplace_back(k, "the certificate names a kink");
    } else if (meets(result.uncertainty.DoesNotFit() ? robust : trusting) || meets(robust)) {
      proposed.emplace_back(k, "the interval meets a bound");
    } else if (const std::string why = WhyNoParabola(options, result, k, problem, rollouts);
               !why.empty()) {
      proposed.emplace_back(k, why);
    }
  }
  proposed.resize(std::min(proposed.size(), kMostProfiles));
  needed.insert(needed.end(), proposed.begin(), proposed.end());
  return needed;
}

std::vector<FinalInterval> FinalIntervals(const std::vector<ParameterEntry>& entries,
                                          const FitResult& result) {
  std::vector<FinalInterval> all(entries.size());
  for (size_t k = 0; k < entries.size() && result.estimate.size() > 0; ++k) {
    const ConfidenceInterval& robust = result.uncertainty.confidence_95_robust[k];
    const ConfidenceInterval& interval = robust ? robust : result.uncertainty.confidence_95[k];
    if (interval) {
      all[k] = {true, std::max(interval->first, entries[k].lower),
                std::min(interval->second, entries[k].upper), robust ? "robust" : "sigma"};
    }
  }
  for (const Profile& profile : result.profiles) {
    if (!profile.branches.empty()) {
      all[profile.parameter] = {true, profile.branches.front().low, profile.branches.back().high,
                                "profile"};
    }
  }
  return all;
}

std::string Describe(const FinalInterval& interval) {
  if (!interval.exists) {
    return "none";
  }
  const std::string low = interval.low ? CompactNumber(*interval.low, 8) : "unbounded below";
  const std::string high = interval.high ? CompactNumber(*interval.high, 8) : "unbounded above";
  return low + (interval.low || interval.high ? " to " : ", ") + high;
}

}  // namespace tangible
