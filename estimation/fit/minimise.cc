// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/minimise.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>

#include "tangible/estimation/fit/block_system.h"
#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/math/decompositions.h"
#include "tangible/math/median.h"
#include "tangible/math/scalar.h"

namespace tangible {
namespace {

// A parameter that this many iterations push against a bound is held there until the others have
// converged.
constexpr int kPushesToHold = 2;
constexpr int kMaxRounds = 10;
// Ceres ends where this many iterations in a row each gain little, but a good part of what the one
// before gained (SlowTail): far from zero residuals Gauss-Newton converges by a constant factor,
// 0.66 in a fit of dry friction, and the accelerated final steps take a third of the runs.
constexpr int kSlowGains = 4;
// The steps that Anderson's acceleration combines.
constexpr size_t kAccelerated = 3;
// A minimum at a kink is looked for with at most so many parameters.
constexpr double kMostAtKink = 20;
// Where a step remains when Ceres ends, Ceres starts again with a new trust region, at most this
// many times.
constexpr int kMaxAttempts = 3;

// The attempts of an iteration with smaller and smaller regions, where it ends at a level.
constexpr int kMostLevels = 4;
constexpr char kNoEffectHere[] = "no parameter has an effect on any residual at these values";

// From this number of parameters on sparse factorisations are faster.
constexpr int kManyParameters = 100;

/// The method of the last steps, and their limits.
struct FinalSteps {
  enum class Kind { kGaussNewton, kNewton } kind;
  int max_steps;
  int max_halvings;
  double slack;  ///< by which the cost may rise, relative
  double limit;  ///< steps that do not shrink to half are rounding, if they are smaller
};
constexpr FinalSteps kPolish{FinalSteps::Kind::kGaussNewton, 20, 0, kEqualCost, kInfinity};
constexpr FinalSteps kNewton{FinalSteps::Kind::kNewton, 15, 3, kPolishedStep, kParameterTolerance};

/// Whether p is at a bound beyond which the cost falls.
bool PushesOut(const ParameterEntry& entry, double p, double gradient) {
  const bool upper = !(p < 0.5 * (entry.lower + entry.upper));  // one of them may be infinite
  return IsAtBound(entry, p) && (upper ? gradient < 0.0 : gradient > 0.0);
}

/// The linear model at q, which Ceres changes, for all its cost functions.
class SharedLinearisation : public ceres::EvaluationCallback {
 public:
  SharedLinearisation(Linearizer* linearizer, HuberBounds huber, const Eigen::VectorXd* q)
      : linearizer_(linearizer), huber_(huber), q_(q) {}

  void PrepareForEvaluation(bool evaluate_jacobians, bool /*new_evaluation_point*/) override {
    // The line search of a bounded problem asks again for earlier points and declares them new.
    const bool same = at_.size() == q_->size() && at_ == *q_;
    if (same && (has_model_ || !evaluate_jacobians || !ok_)) {
      return;
    }
    at_ = *q_;
    ok_ = evaluate_jacobians ? linearizer_->Linearise(*q_, huber_, &model_, &target_)
                             : linearizer_->Cost(*q_, huber_, &block_costs_, &target_.cost);
    has_model_ = ok_ && evaluate_jacobians;
  }

  void SetHuber(double current) {
    huber_.current = current;
    at_.resize(0);
    PrepareForEvaluation(true, true);
  }
  void Update() { PrepareForEvaluation(true, true); }

  bool ok() const { return ok_; }
  const HuberBounds& huber() const { return huber_; }
  /// After an evaluation with Jacobians.
  const Linearisation& model() const { return model_; }
  /// Cost and gradient of the fit's own loss.
  const Linearisation& target() const { return target_; }
  /// At the last point, whether or not Jacobians were evaluated there.
  double BlockCost(int block) const {
    if (!has_model_) {
      return block_costs_[block];
    }
    const BlockFactor& factor = model_.blocks[block];
    return 0.5 * (factor.residuals().squaredNorm() + factor.remainder * factor.remainder);
  }

 private:
  Linearizer* linearizer_;
  HuberBounds huber_;
  const Eigen::VectorXd* q_;
  Eigen::VectorXd at_;
  Linearisation model_, target_;
  Eigen::VectorXd block_costs_;
  bool ok_ = false;
  bool has_model_ = false;
};

/// The factor of a block as residuals. Where no Jacobian is requested, only their sum of squares
/// matters.
class FactorCostFunction : public ceres::CostFunction {
 public:
  FactorCostFunction(const SharedLinearisation* shared, int block, int num_shared, int num_own,
                     int num_factor_rows)
      : shared_(shared), block_(block) {
    set_num_residuals(num_factor_rows + 1);
    for (const int size : {num_own, num_shared}) {
      if (size > 0) {
        mutable_parameter_block_sizes()->push_back(size);
      }
    }
  }

  bool Evaluate(double const* const* /*parameters*/, double* residuals,
                double** jacobians) const override {
    if (!shared_->ok()) {
      return false;
    }
    Eigen::Map<Eigen::VectorXd> values(residuals, num_residuals());
    values.setZero();
    if (jacobians == nullptr) {
      values[0] = std::sqrt(2.0 * shared_->BlockCost(block_));
      return true;
    }
    const BlockFactor& factor = shared_->model().blocks[block_];
    values.head(factor.factor.rows()) = factor.residuals();
    values[num_residuals() - 1] = factor.remainder;
    Eigen::Index first = 0;
    for (size_t i = 0; i < parameter_block_sizes().size(); ++i) {
      const Eigen::Index size = parameter_block_sizes()[i];
      if (jacobians[i] != nullptr) {
        Eigen::Map<RowMatrixXd> columns(jacobians[i], num_residuals(), size);
        columns.setZero();
        columns.topRows(factor.factor.rows()) = factor.jacobian().middleCols(first, size);
      }
      first += size;
    }
    return true;
  }

 private:
  const SharedLinearisation* shared_;
  int block_;
};

/// Ceres logs failures that its summary reports as well; programs print one line about them.
class QuietLog {
 public:
  QuietLog() : before_(FLAGS_minloglevel) { FLAGS_minloglevel = google::GLOG_FATAL; }
  ~QuietLog() { FLAGS_minloglevel = before_; }
  QuietLog(const QuietLog&) = delete;
  QuietLog& operator=(const QuietLog&) = delete;

 private:
  int before_;
};

/// Anderson's acceleration of steps that converge by a constant factor.
class Acceleration {
 public:
  /// The point that a combination of the last steps leads to, from `q` with the step from there:
  /// the one where the steps, were they linear in q, would vanish; empty for the first step.
  Eigen::VectorXd Next(const Eigen::VectorXd& q, const Eigen::VectorXd& step) {
    points_.push_back(q);
    steps_.push_back(step);
    if (points_.size() > kAccelerated + 1) {
      points_.erase(points_.begin());
      steps_.erase(steps_.begin());
    }
    const Eigen::Index count = static_cast<Eigen::Index>(points_.size()) - 1;
    if (count == 0) {
      return {};
    }
    Eigen::MatrixXd moved(q.size(), count);
    Eigen::MatrixXd changed(q.size(), count);
    for (Eigen::Index i = 0; i < count; ++i) {
      moved.col(i) = points_[i + 1] - points_[i];
      changed.col(i) = steps_[i + 1] - steps_[i];
    }
    const Eigen::VectorXd share = PivotedQr(changed).Solve(step);
    return q + step - (moved + changed) * share;
  }

 private:
  std::vector<Eigen::VectorXd> points_, steps_;
};

class Minimiser : public ceres::IterationCallback {
 public:
  Minimiser(const FitOptions& options, const Eigen::VectorXd& start,
            const std::function<double()>& elapsed,
            const std::function<void(int, const FitIteration&)>& progress,
            LeastSquaresProblem* problem, EvaluationLog* log, const Patience& patience)
      : options_(options),
        patience_(patience),
        elapsed_(elapsed),
        progress_(progress),
        linearizer_(problem, options.derivatives, options.threads, log),
        layout_(linearizer_.layout()),
        entries_(problem->entries()),
        q_(ToInternal(entries_, start)),
        shared_(&linearizer_, {options.huber, options.huber}, &q_),
        held_(entries_.size(), false),
        pushed_(entries_.size(), 0) {}

  Minimum Run() {
    shared_.Update();
    if (!shared_.ok()) {
      minimum_.message = "the run at the initial values fails: " + linearizer_.message();
      minimum_.rollouts = linearizer_.rollouts();
      return minimum_;
    }
    ApproachRobustLoss();
    Minimise();
    TakeLevel();
    minimum_.parameters = ToParameters(entries_, q_);
    minimum_.cost = shared_.target().cost;
    minimum_.gave_up = gave_up_;
    minimum_.rollouts = linearizer_.rollouts();
    return minimum_;
  }

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const bool accepted = summary.iteration == 0 || summary.step_is_successful;
    if (summary.iteration > 0 || minimum_.iterations.empty()) {  // else the last round's end again
      Record(accepted);
    }
    if (accepted && IsLevel()) {
      level_radius_ = summary.trust_region_radius;
      if (shared_.target().cost < level_cost_) {
        level_cost_ = shared_.target().cost;
        level_ = q_;
      }
      return ceres::SOLVER_ABORT;
    }
    if (accepted) last_good_ = q_;
    if (accepted && CountPushes()) return End("steps go on leaving the range of a parameter");
    if (accepted && HasNoProgress()) {
      return ceres::SOLVER_ABORT;
    }
    if (accepted && SlowTail()) return End("the last steps gained ever less");
    if (!accepted && summary.step_is_valid && WhatIsLeft().empty()) {
      return End("no step is left that matters");
    }
    return summary.cost < ExactCost() ? End("residuals are rounding") : ceres::SOLVER_CONTINUE;
  }

 private:
  ceres::CallbackReturnType End(const char* reason) {
    minimum_.message = reason;
    return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

  double ExactCost() const {
    return 0.5 * kExactFit * kExactFit * static_cast<double>(layout_.num_rows());
  }

  /// Whether the last accepted iterations gained less and less, by a constant factor.
  bool SlowTail() {
    gains_.push_back(last_cost_ - shared_.model().cost);
    last_cost_ = shared_.model().cost;
    if (gains_.size() < kSlowGains) {
      return false;
    }
    bool slow = !slow_tail_;  // once: where the last steps do not get on, Ceres goes on to its end
    for (size_t i = gains_.size() - kSlowGains + 1; i < gains_.size(); ++i) {
      slow = slow && gains_[i - 1] < kSlowGain * last_cost_ && gains_[i] < gains_[i - 1] &&
             gains_[i] > kSlowRatio * gains_[i - 1];
    }
    slow_tail_ = slow_tail_ || slow;
    return slow;
  }

  /// Whether the first iterations have left most of the cost, where the caller has no patience.
  bool HasNoProgress() {
    ++accepted_;
    const bool none = patience_.iterations > 0 && accepted_ == patience_.iterations + 1 &&
                      shared_.target().cost > patience_.part * minimum_.iterations.front().cost;
    gave_up_ = gave_up_ || none;
    return none;
  }

  /// Counts the consecutive iterations that push each parameter out of its range; returns whether
  /// one is to be held from now on.
  bool CountPushes() {
    bool change = false;
    for (size_t k = 0; k < held_.size(); ++k) {
      pushed_[k] = PushedOut(k) ? pushed_[k] + 1 : 0;
      change = change || (!held_[k] && pushed_[k] >= kPushesToHold);
    }
    return change;
  }

  /// Whether no parameter that is free has an effect on any residual, which are not 0: a step that
  /// has led to where nothing happens, and from which none leads back.
  bool IsLevel() const {
    if (!(shared_.model().cost > ExactCost())) return false;
    for (const BlockFactor& block : shared_.model().blocks) {
      if (!(block.jacobian().array() == 0.0).all()) return false;
    }
    return AnyFree(0, layout_.num_parameters());
  }

  /// Whether the residuals are of the size of sigma: then what no parameter changes may be a
  /// minimum, as where a bounce that was not observed no longer happens.
  bool Explains() const {
    return 2.0 * shared_.target().cost <= kLevelExplains * static_cast<double>(layout_.num_rows());
  }

  /// Goes back to where no parameter has an effect if nothing was found that costs less.
  void TakeLevel() {
    if (level_.size() == 0 || !shared_.ok() || !(level_cost_ <= shared_.target().cost)) return;
    q_ = level_;
    shared_.Update();
    minimum_.status = Explains() ? FitStatus::kConverged : FitStatus::kNotConverged;
    minimum_.message = kNoEffectHere;
  }

  bool PushedOut(size_t k) const {
    const auto i = static_cast<Eigen::Index>(k);
    return PushesOut(entries_[k], ToParameter(entries_[k], q_[i]), shared_.model().gradient[i]);
  }

  /// Holds and releases parameters at bounds; returns false where nothing changes. A step that
  /// Ceres cuts at a bound is no Gauss-Newton step of the other parameters, which would converge
  /// slowly otherwise.
  bool ChangeHeld() {
    bool change = false;
    for (size_t k = 0; k < held_.size(); ++k) {
      const bool hold = PushedOut(k);
      change = change || hold != held_[k];
      held_[k] = hold;
      // A logarithm that has passed the least value would have as far a way back.
      if (hold && entries_[k].logarithmic) {
        double& q = q_[static_cast<Eigen::Index>(k)];
        q = std::max(q, ToInternal(entries_[k], LeastOf(entries_[k])));
      }
      pushed_[k] = 0;
    }
    return change;
  }

  bool HasIterationsLeft() const {
    return static_cast<int>(minimum_.iterations.size()) <= options_.max_iterations;
  }

  /// The cost of the fit's own loss, whichever loss the iteration minimises.
  void Record(bool accepted) {
    if (accepted) {
      cost_ = shared_.target().cost;
      gradient_norm_ = shared_.target().gradient.norm();
    }
    const Eigen::VectorXd p = ToParameters(entries_, q_);
    minimum_.iterations.push_back(
        {cost_, gradient_norm_, std::vector<double>(p.data(), p.data() + p.size()), elapsed_()});
    if (progress_) {
      progress_(static_cast<int>(minimum_.iterations.size()) - 1, minimum_.iterations.back());
    }
  }

  double MedianSize() {
    std::vector<BlockEvaluation> blocks;
    linearizer_.Rows(ToParameters(entries_, q_), BlockDerivatives::kSkip, &blocks);
    std::vector<double> sizes;
    for (int b = 0; b < layout_.num_blocks(); ++b) {
      for (int i = 0; i < linearizer_.problem()->num_observation_rows(b); ++i) {
        sizes.push_back(std::abs(blocks[b].residuals[i]));
      }
    }
    return sizes.empty() ? 0.0 : UpperMedian(std::move(sizes));
  }

  /// Minimises with the bound `huber` of the loss; goes back where that does not lower the robust
  /// cost.
  void Approach(double huber) {
    const Eigen::VectorXd start = q_;
    const double before = shared_.target().cost;
    shared_.SetHuber(huber);
    Solve(kApproachTolerance);
    shared_.SetHuber(options_.huber);
    if (!shared_.ok() || !(shared_.target().cost < before)) {
      q_ = start;
      shared_.Update();
    }
    pushed_.assign(pushed_.size(), 0);
  }

  void ApproachRobustLoss() {
    double median = options_.huber > 0.0 ? MedianSize() : 0.0;
    if (median <= options_.huber) {
      return;
    }
    Approach(0.0);
    median = MedianSize();
    for (double huber = median / kApproachFactor; huber > options_.huber;
         huber /= kApproachFactor) {
      Approach(huber);
    }
  }

  /// Repeats until both tests of convergence hold, or the cost no longer falls.
  void Minimise() {
    for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
      const double before = shared_.model().cost;
      const bool robust = options_.huber > 0.0;
      if (robust) {
        SolveWithinBounds(kRobustTolerance);
      }
      if (!robust || minimum_.status != FitStatus::kConverged || !Refine(kNewton)) {
        SolveWithinBounds(kFunctionTolerance);
      }
      if (minimum_.status != FitStatus::kConverged) {
        // The limit may end iterations that no longer matter.
        if (!gave_up_ && shared_.ok() && !HasIterationsLeft()) {
          if (WhatIsLeft().empty()) {
            minimum_.status = FitStatus::kConverged;
            minimum_.message = "no step is left that matters, at the limit of " +
                               std::to_string(options_.max_iterations) + " iterations";
          } else {
            AcceptKink();
          }
        }
        return;
      }
      Refine(kPolish);
      // The last steps may have reached or left a bound.
      ChangeHeld();
      const std::string left = WhatIsLeft();
      if (left.empty()) {
        return;
      }
      if (AcceptKink()) {
        return;
      }
      const bool gained = shared_.model().cost < before * (1.0 - kFunctionTolerance);
      if (!gained || attempt + 1 == kMaxAttempts || !HasIterationsLeft()) {
        minimum_.status = FitStatus::kNotConverged;
        minimum_.message = HasIterationsLeft() ? left : LimitMessage();
        return;
      }
    }
  }

  void SolveWithinBounds(double function_tolerance) {
    for (int round = 0; round < kMaxRounds; ++round) {
      Solve(function_tolerance);
      if (!ChangeHeld() || !HasIterationsLeft()) {
        return;
      }
    }
  }

  /// Declares those parameters of a block constant that are held.
  void AddParameterBlock(int first, int size, ceres::Problem* problem) {
    if (size == 0) {
      return;
    }
    double* const x = q_.data() + first;
    problem->AddParameterBlock(x, size);
    SetInternalBounds(entries_, first, size, problem, x);
    std::vector<int> constant;
    for (int i = 0; i < size; ++i) {
      if (held_[first + i]) {
        constant.push_back(i);
      }
    }
    if (static_cast<int>(constant.size()) == size) {
      problem->SetParameterBlockConstant(x);
    } else if (!constant.empty()) {
      problem->SetManifold(x, new ceres::SubsetManifold(size, constant));
    }
  }

  void AddBlocks(ceres::Problem* problem) {
    const int num_shared = layout_.num_shared();
    AddParameterBlock(0, num_shared, problem);
    for (int b = 0; b < layout_.num_blocks(); ++b) {
      const int num_own = layout_.num_own(b);
      AddParameterBlock(layout_.own_offset(b), num_own, problem);
      const int rows = std::min(linearizer_.problem()->num_rows(b), layout_.num_local(b) + 1);
      std::vector<double*> parameters;
      if (num_own > 0) {
        parameters.push_back(q_.data() + layout_.own_offset(b));
      }
      if (num_shared > 0) {
        parameters.push_back(q_.data());
      }
      if (rows > 0 && !parameters.empty()) {
        problem->AddResidualBlock(new FactorCostFunction(&shared_, b, num_shared, num_own, rows),
                                  nullptr, parameters);
      }
    }
  }

  bool AnyFree(int first, int last) const {
    return std::find(held_.begin() + first, held_.begin() + last, false) != held_.begin() + last;
  }

  /// Own parameters are eliminated first if there are free parameters of both kinds.
  void ChooseLinearSolver(ceres::Solver::Options* solver) {
    const int num_shared = layout_.num_shared();
    if (AnyFree(0, num_shared) && AnyFree(num_shared, layout_.num_parameters())) {
      solver->linear_solver_type = ceres::DENSE_SCHUR;
      solver->linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
      solver->linear_solver_ordering->AddElementToGroup(q_.data(), 1);
      for (int b = 0; b < layout_.num_blocks(); ++b) {
        if (layout_.num_own(b) > 0) {
          solver->linear_solver_ordering->AddElementToGroup(q_.data() + layout_.own_offset(b), 0);
        }
      }
      return;
    }
    const bool many = num_shared == 0 && layout_.num_parameters() > kManyParameters;
    solver->linear_solver_type = many ? ceres::SPARSE_NORMAL_CHOLESKY : ceres::DENSE_QR;
  }

  void Solve(double function_tolerance) {
    if (!AnyFree(0, layout_.num_parameters())) {
      minimum_.status = FitStatus::kConverged;
      minimum_.message = "every parameter is at a bound";
      return;
    }
    if (!shared_.ok()) {  // with this bound of the loss
      minimum_.status = FitStatus::kNotConverged;
      minimum_.message = linearizer_.message();
      return;
    }
    ceres::Problem::Options problem_options;
    problem_options.evaluation_callback = &shared_;
    ceres::Problem problem(problem_options);
    AddBlocks(&problem);
    ceres::Solver::Options solver;
    solver.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
    ChooseLinearSolver(&solver);
    solver.max_num_iterations = std::max(
        1, options_.max_iterations - std::max(0, static_cast<int>(minimum_.iterations.size()) - 1));
    solver.function_tolerance = function_tolerance;
    solver.parameter_tolerance = kParameterTolerance;
    solver.gradient_tolerance = 0.0;
    solver.max_num_consecutive_invalid_steps = 20;
    // Quadratic interpolation needs no Jacobians along the projected step.
    solver.line_search_interpolation_type = ceres::QUADRATIC;
    solver.logging_type = ceres::SILENT;
    solver.update_state_every_iteration = true;
    solver.callbacks.push_back(this);
    ceres::Solver::Summary summary;
    gave_up_ = false;  // with other parameters held it goes on
    const QuietLog quiet;
    for (int attempt = 0; attempt < kMostLevels; ++attempt) {
      gains_.clear();
      last_cost_ = kInfinity;
      level_radius_ = 0.0;
      ceres::Solve(solver, &problem, &summary);
      if (level_radius_ == 0.0 || last_good_.size() == 0) break;
      q_ = last_good_;
      solver.initial_trust_region_radius =
          kSmallerRegion * std::min(level_radius_, solver.initial_trust_region_radius);
    }
    if (summary.termination_type != ceres::USER_SUCCESS) minimum_.message = summary.message;
    if (gave_up_) {
      minimum_.message = "no progress in the first iterations";
    } else if (summary.termination_type == ceres::NO_CONVERGENCE) {
      minimum_.message = LimitMessage();  // Ceres counts those of its last start alone
    }
    const bool converged = summary.termination_type == ceres::CONVERGENCE ||
                           summary.termination_type == ceres::USER_SUCCESS;
    minimum_.status = converged ? FitStatus::kConverged : FitStatus::kNotConverged;
    shared_.Update();
  }

  /// The linear system for Gauss-Newton's or Newton's step of the parameters that are not held.
  BlockSystem System(FinalSteps::Kind kind) const {
    std::vector<RowMatrixXd> blocks;
    for (const BlockFactor& block : shared_.model().blocks) {
      blocks.push_back(kind == FinalSteps::Kind::kNewton ? block.curved
                                                         : RowMatrixXd(block.jacobian()));
    }
    return BlockSystem(layout_, blocks, held_);
  }

  /// With Huber's weights, Gauss-Newton's steps have the minimum of the cost as their fixed point.
  /// The Hessian of Newton's step is that of the residuals within the bound only.
  Eigen::VectorXd StepOf(FinalSteps::Kind kind) const {
    const BlockSystem system = System(kind);
    if (kind == FinalSteps::Kind::kNewton) {
      return system.Newton(shared_.model().gradient);
    }
    std::vector<Eigen::VectorXd> residuals;
    for (const BlockFactor& block : shared_.model().blocks) {
      residuals.emplace_back(block.residuals());
    }
    return system.LeastSquares(residuals);
  }

  /// Moves to q, or as near as the bounds allow, and returns the cost, which is infinite where a
  /// run fails.
  double MoveTo(const Eigen::VectorXd& q) {
    q_ = ToInternal(entries_, ToParameters(entries_, q));
    shared_.Update();
    return shared_.ok() ? shared_.model().cost : kInfinity;
  }

  /// Takes steps until they are rounding; returns false where they do not become that small.
  bool Refine(const FinalSteps& how) {
    double last = kInfinity;
    double cost = shared_.model().cost;
    Acceleration history;
    for (int i = 0; i < how.max_steps; ++i) {
      Eigen::VectorXd step = StepOf(how.kind);
      double size = step.cwiseAbs().maxCoeff();
      const double plain_size = size;
      // An accelerated convergence by a constant factor is no rounding.
      const double limit = slow_tail_ ? std::min(how.limit, kParameterTolerance) : how.limit;
      if (!(size > kPolishedStep) || (size > 0.5 * last && size <= limit)) {
        return true;
      }
      const Eigen::VectorXd before = q_;
      const double highest = cost * (1.0 + how.slack) + ExactCost();
      double next = kInfinity;
      const Eigen::VectorXd faster = history.Next(before, step);
      if (plain_size > kSlowRatio * last && faster.size() > 0) {
        next = MoveTo(faster);
      }
      if (!(next <= cost)) {
        next = MoveTo(before + step);
      }
      for (int halving = 0; halving < how.max_halvings && !(next <= highest); ++halving) {
        step *= 0.5;
        size *= 0.5;
        next = MoveTo(before + step);
      }
      if (!(next <= highest)) {
        q_ = before;
        shared_.Update();
        return last <= kParameterTolerance;
      }
      cost = next;
      last = size;
      Record(true);
    }
    return last <= kParameterTolerance;
  }

  std::string LimitMessage() const {
    return "the limit of " + std::to_string(options_.max_iterations) +
           " iterations is reached before the minimum";
  }

  /// Where derivatives do not describe the cost the minimum may be at a kink, as where an impact
  /// falls on an observation. There the cost itself is compared: it has to rise both ways along
  /// each parameter, and along the Gauss-Newton step and the gradient, near and less near.
  bool AcceptKink() {
    const Eigen::VectorXd lengths = System(FinalSteps::Kind::kGaussNewton).lengths();
    const double num_free = static_cast<double>((lengths.array() > 0.0).count());
    if (num_free == 0.0 || num_free > kMostAtKink) {
      return false;
    }
    const double rows = static_cast<double>(layout_.num_rows());
    const double unit =
        std::sqrt(2.0 * shared_.model().cost / (rows > num_free ? rows - num_free : rows));
    std::vector<Eigen::VectorXd> directions;
    for (Eigen::Index k = 0; k < lengths.size(); ++k) {
      if (lengths[k] > 0.0) {
        directions.push_back(unit / lengths[k] * Eigen::VectorXd::Unit(lengths.size(), k));
      }
    }
    for (const Eigen::VectorXd& direction :
         {StepOf(FinalSteps::Kind::kGaussNewton),
          Eigen::VectorXd(
              (lengths.array() > 0.0)
                  .select(shared_.model().gradient.array() / lengths.array().square(), 0.0))}) {
      const double size = direction.cwiseProduct(lengths).norm();
      if (size > 0.0) directions.push_back(unit / size * direction);
    }
    const double cost = shared_.model().cost;
    std::string no_run;
    for (const Eigen::VectorXd& direction : directions) {
      for (const double part : {-kKinkSteps[0], kKinkSteps[0], -kKinkSteps[1], kKinkSteps[1]}) {
        const Eigen::VectorXd q =
            ToInternal(entries_, ToParameters(entries_, q_ + part * direction));
        Eigen::VectorXd blocks;
        double target = 0.0;
        const bool done = linearizer_.Cost(q, shared_.huber(), &blocks, &target);
        if (done && q != q_ && target < cost - kKinkGain * unit * unit) return false;
        if (!done && no_run.empty()) no_run = linearizer_.message();
      }
    }
    minimum_.status = FitStatus::kConverged;
    // A cost with kinks may fall between directions that each rise.
    minimum_.message =
        !no_run.empty() ? "the cost rises, or there is no run: " + no_run
        : num_free == 1.0
            ? "a minimum at a kink: the cost rises both ways, and its derivative jumps"
            : "at a kink: the cost rises both ways along each parameter, and its derivative jumps";
    return true;
  }

  /// Returns an empty text where the tests of minimise.h hold, else one line.
  std::string WhatIsLeft() const {
    const Linearisation& model = shared_.model();
    if (model.cost <= ExactCost()) {
      return "";
    }
    if (IsLevel()) return Explains() ? "" : kNoEffectHere;
    const auto kind =
        options_.huber > 0.0 ? FinalSteps::Kind::kNewton : FinalSteps::Kind::kGaussNewton;
    const Eigen::VectorXd lengths = System(FinalSteps::Kind::kGaussNewton).lengths();
    const Eigen::VectorXd step = StepOf(kind);
    const double num_free = static_cast<double>((lengths.array() > 0.0).count());
    const double num_rows = static_cast<double>(layout_.num_rows());
    const double freedom = num_rows > num_free ? num_rows - num_free : num_rows;
    const double unit = std::sqrt(2.0 * model.cost / freedom) * std::sqrt(std::max(1.0, num_free));
    const double offset = std::sqrt(std::max(0.0, -model.gradient.dot(step))) / unit;
    Eigen::Index worst = 0;
    const double gradient = (lengths.array() > 0.0)
                                .select(model.gradient.cwiseAbs().cwiseQuotient(lengths), 0.0)
                                .maxCoeff(&worst) /
                            unit;
    if (offset <= kRelativeOffset && gradient <= kRelativeOffset) {
      return "";
    }
    std::ostringstream text;
    text.precision(3);
    text << "no further progress, but a step of " << offset
         << " standard deviations is left, and a gradient of " << gradient << " along '"
         << entries_[worst].name << "' (at most " << kRelativeOffset
         << "): the derivatives do not describe the cost here";
    return text.str();
  }

  const FitOptions& options_;
  const Patience patience_;
  const std::function<double()>& elapsed_;
  const std::function<void(int, const FitIteration&)>& progress_;
  Linearizer linearizer_;
  const BlockLayout& layout_;
  const std::vector<ParameterEntry>& entries_;
  Eigen::VectorXd q_;
  SharedLinearisation shared_;
  std::vector<bool> held_;     ///< parameters at a bound, without a part in the steps
  std::vector<int> pushed_;    ///< iterations in a row that the cost falls beyond the bound
  std::vector<double> gains_;  ///< of accepted iterations
  double last_cost_ = kInfinity;
  int accepted_ = 0;       ///< iterations, with the initial point
  Eigen::VectorXd level_;  ///< q of the least cost at which none had an effect
  double level_cost_ = kInfinity;
  Eigen::VectorXd last_good_;  ///< q of the last one where some parameter had an effect
  double level_radius_ = 0.0;  ///< of the region whose step has led to where none has; 0: none
  bool gave_up_ = false;
  bool slow_tail_ = false;  ///< whether Ceres was ended by SlowTail
  double cost_ = 0.0;       ///< of the fit's own loss, at the last accepted point
  double gradient_norm_ = 0.0;
  Minimum minimum_;
};

}  // namespace

void SetInternalBounds(const std::vector<ParameterEntry>& entries, int first, int size,
                       ceres::Problem* problem, double* x) {
  for (int i = 0; i < size; ++i) {
    const ParameterEntry& entry = entries[first + i];
    const double low = ToInternal(entry, entry.lower);
    const double high = ToInternal(entry, entry.upper);
    if (std::isfinite(low)) {
      problem->SetParameterLowerBound(x, i, low);
    }
    if (std::isfinite(high)) {
      problem->SetParameterUpperBound(x, i, high);
    }
    x[i] = std::clamp(x[i], low, high);
  }
}

Minimum Minimise(const FitOptions& options, const Eigen::VectorXd& start,
                 const std::function<double()>& elapsed,
                 const std::function<void(int iteration, const FitIteration&)>& progress,
                 LeastSquaresProblem* problem, EvaluationLog* log, const Patience& patience) {
  return Minimiser(options, start, elapsed, progress, problem, log, patience).Run();
}

}  // namespace tangible
