// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/minimise.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/estimation/problem/cost_function.h"

namespace tangible {
namespace {

// Ceres stops where the cost changes by less than this, or q by less than that, relative; the
// polish goes on from there.
constexpr double kFunctionTolerance = 1e-10;
constexpr double kParameterTolerance = 1e-9;
// Far from the optimum Huber's loss is linear in nearly all residuals, and steps of Gauss-Newton
// creep: where the median residual is beyond its bound, plain squares lead the way, until an
// iteration gains less than this. Outliers then cost nothing, for the robust loss has the last
// word.
constexpr double kApproachTolerance = 1e-2;
constexpr double kApproachFactor = 4.0;
// With Huber's loss Ceres goes on to this; then Newton's method takes over, which unlike its steps
// counts no curvature where the loss is linear (0.75 a step where half of the residuals are).
constexpr double kRobustTolerance = 1e-4;
constexpr int kMaxNewtonSteps = 15;
constexpr int kMaxHalvings = 3;
// Root mean square of residuals, in sigma, below which the observations are free of noise and met
// to rounding.
constexpr double kExactFit = 1e-8;

// A parameter that is pushed against a bound by so many iterations is held there until the others
// have converged.
constexpr int kPushesToHold = 2;
constexpr int kMaxRounds = 10;

constexpr int kMaxPolishSteps = 8;
constexpr double kPolishedStep = 1e-13;  // of q
// Directions of J with less than this share are left alone by the polish.
constexpr double kPolishRank = 1e-9;

/// ρ'(r²): 1, or b / |r| where Huber's loss is linear.
double RobustWeight(double residual, double huber) {
  const double size = std::abs(residual);
  return huber > 0.0 && size > huber ? huber / size : 1.0;
}

/// Whether the cost falls beyond a bound that p stands on.
bool PushesOut(const ParameterizedScene::Entry& entry, double p, double gradient) {
  const bool upper = p > entry.lower + 0.5 * (entry.upper - entry.lower);
  return IsAtBound(entry, p) && (upper ? gradient < 0.0 : gradient > 0.0);
}

class Minimiser : public ceres::IterationCallback {
 public:
  Minimiser(const FitOptions& options, const Eigen::VectorXd& start,
            const std::function<double()>& elapsed,
            const std::function<void(int, const FitIteration&)>& progress,
            RolloutResiduals* residuals)
      : options_(options),
        elapsed_(elapsed),
        progress_(progress),
        residuals_(residuals),
        q_(ToInternal(residuals->entries(), start)),
        shared_([this](const Eigen::VectorXd& q, Eigen::VectorXd* values,
                       RowMatrixXd* jacobian) { return Evaluate(q, values, jacobian); },
                &q_),
        held_(start.size(), false),
        pushed_(start.size(), 0),
        huber_(options.huber) {}

  Minimum Run() {
    shared_.PrepareForEvaluation(true, true);
    if (!shared_.ok()) {
      minimum_.message = "the run at the initial values fails: " + residuals_->message();
      return minimum_;
    }
    ApproachRobustLoss();
    if (options_.huber > 0.0) {
      SolveWithinBounds(kRobustTolerance);
    }
    if (!(options_.huber > 0.0) || minimum_.status != FitStatus::kConverged || !Newton()) {
      SolveWithinBounds(kFunctionTolerance);
    }
    if (minimum_.status == FitStatus::kConverged) {
      Polish();
    }
    minimum_.parameters = ToParameters(residuals_->entries(), q_);
    minimum_.residuals = shared_.values();
    minimum_.jacobian =
        shared_.jacobian() * ParametersByInternal(residuals_->entries(), minimum_.parameters)
                                 .cwiseInverse()
                                 .asDiagonal();
    minimum_.cost = RobustCost(shared_.values(), options_.huber);
    return minimum_;
  }

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const bool accepted = summary.iteration == 0 || summary.step_is_successful;
    if (summary.iteration > 0 || minimum_.iterations.empty()) {  // else the last round's end again
      Record(accepted);
    }
    if (accepted && CountPushes()) {
      return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    }
    const double exact = 0.5 * kExactFit * kExactFit * residuals_->num_residuals();
    return summary.cost < exact ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  bool Evaluate(const Eigen::VectorXd& q, Eigen::VectorXd* values, RowMatrixXd* jacobian) {
    const ParameterizedScene& scene = residuals_->scene();
    if (!residuals_->Evaluate(ToParameters(scene.entries(), q), options_.derivatives, values,
                              jacobian)) {
      return false;
    }
    if (jacobian == nullptr) {
      return true;
    }
    *jacobian *=
        ParametersByInternal(scene.entries(), ToParameters(scene.entries(), q)).asDiagonal();
    gradient_ = RobustGradient(*values, *jacobian, huber_);
    for (size_t k = 0; k < held_.size(); ++k) {
      if (held_[k]) {
        jacobian->col(static_cast<Eigen::Index>(k)).setZero();
      }
    }
    return true;
  }

  /// Counts the iterations in a row that each parameter is pushed out; true if one is to be held
  /// from now on.
  bool CountPushes() {
    const Eigen::VectorXd p = ToParameters(residuals_->entries(), q_);
    bool change = false;
    for (int k = 0; k < p.size(); ++k) {
      const bool out = PushesOut(residuals_->scene().entries()[k], p[k], gradient_[k]);
      pushed_[k] = out ? pushed_[k] + 1 : 0;
      change = change || (!held_[k] && pushed_[k] >= kPushesToHold);
    }
    return change;
  }

  /// Holds and releases parameters at bounds; false where nothing changes. Steps that Ceres cuts at
  /// a bound are no Gauss-Newton steps of the other parameters: without this they converge slowly.
  bool ChangeHeld() {
    const Eigen::VectorXd p = ToParameters(residuals_->entries(), q_);
    bool change = false;
    for (int k = 0; k < p.size(); ++k) {
      const bool hold = PushesOut(residuals_->scene().entries()[k], p[k], gradient_[k]);
      change = change || hold != held_[k];
      held_[k] = hold;
      pushed_[k] = 0;
    }
    return change && static_cast<int>(minimum_.iterations.size()) <= options_.max_iterations;
  }

  /// Of the robust cost, whichever loss the iteration minimises.
  void Record(bool accepted) {
    if (accepted) {
      cost_ = RobustCost(shared_.values(), options_.huber);
      gradient_norm_ = RobustGradient(shared_.values(), shared_.jacobian(), options_.huber).norm();
    }
    const Eigen::VectorXd p = ToParameters(residuals_->entries(), q_);
    minimum_.iterations.push_back(
        {cost_, gradient_norm_, std::vector<double>(p.data(), p.data() + p.size()), elapsed_()});
    if (progress_) {
      progress_(static_cast<int>(minimum_.iterations.size()) - 1, minimum_.iterations.back());
    }
  }

  void SolveWithinBounds(double function_tolerance) {
    for (int round = 0; round < kMaxRounds; ++round) {
      Solve(function_tolerance);
      shared_.PrepareForEvaluation(true, true);
      if (!ChangeHeld()) {
        return;
      }
    }
  }

  double MedianSize() const {
    Eigen::VectorXd sizes = shared_.values().cwiseAbs();
    const auto middle = sizes.begin() + sizes.size() / 2;
    std::nth_element(sizes.begin(), middle, sizes.end());
    return *middle;
  }

  /// Minimises with `huber` in the loss's place; back where that does not lower the robust cost.
  void Approach(double huber) {
    const Eigen::VectorXd start = q_;
    const double before = RobustCost(shared_.values(), options_.huber);
    huber_ = huber;
    Solve(kApproachTolerance);
    huber_ = options_.huber;
    shared_.PrepareForEvaluation(true, true);
    if (!shared_.ok() || !(RobustCost(shared_.values(), options_.huber) < before)) {
      q_ = start;
      shared_.PrepareForEvaluation(true, true);
    }
    pushed_.assign(pushed_.size(), 0);
  }

  void ApproachRobustLoss() {
    if (!(options_.huber > 0.0) || MedianSize() <= options_.huber) {
      return;
    }
    Approach(0.0);
    for (double huber = MedianSize() / kApproachFactor; huber > options_.huber;
         huber /= kApproachFactor) {
      Approach(huber);
    }
  }

  void Solve(double function_tolerance) {
    ceres::Problem::Options problem_options;
    problem_options.evaluation_callback = &shared_;
    ceres::Problem problem(problem_options);
    const int num_parameters = residuals_->num_parameters();
    for (int i = 0; i < residuals_->num_residuals(); ++i) {
      problem.AddResidualBlock(new CoordinateCostFunction(&shared_, i, num_parameters),
                               huber_ > 0.0 ? new ceres::HuberLoss(huber_) : nullptr, q_.data());
    }
    SetInternalBounds(residuals_->scene(), &problem, &q_);
    ceres::Solver::Options solver;
    solver.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
    solver.linear_solver_type = ceres::DENSE_QR;
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
    ceres::Solve(solver, &problem, &summary);
    minimum_.message = summary.message;
    const bool converged = summary.termination_type == ceres::CONVERGENCE ||
                           summary.termination_type == ceres::USER_SUCCESS;
    minimum_.status = converged ? FitStatus::kConverged : FitStatus::kNotConverged;
    if (!std::isfinite(summary.final_cost)) {
      // Of which Ceres says that it does not change any more.
      minimum_.status = FitStatus::kNotConverged;
      minimum_.message = "the cost is not finite: an observation or its sigma is beyond all bounds";
    }
  }

  /// The Gauss-Newton step of the free parameters with Huber's weights, which has the cost's own
  /// fixed point.
  Eigen::VectorXd GaussNewtonStep() const {
    const auto& scene = residuals_->scene();
    const Eigen::VectorXd p = ToParameters(scene.entries(), q_);
    RowMatrixXd jacobian = shared_.jacobian();
    Eigen::VectorXd right = shared_.values();
    for (Eigen::Index i = 0; i < right.size(); ++i) {
      const double root = std::sqrt(RobustWeight(right[i], options_.huber));
      jacobian.row(i) *= root;
      right[i] *= root;
    }
    for (int k = 0; k < scene.size(); ++k) {
      if (IsAtBound(scene.entries()[k], p[k])) {
        jacobian.col(k).setZero();
      }
    }
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
    qr.setThreshold(kPolishRank);
    qr.compute(jacobian);
    return -qr.solve(right);
  }

  /// Newton's step of the robust cost: its Hessian has the rows of residuals within the bound
  /// alone.
  Eigen::VectorXd NewtonStep() const {
    const auto& scene = residuals_->scene();
    const Eigen::VectorXd p = ToParameters(scene.entries(), q_);
    const Eigen::VectorXd& values = shared_.values();
    RowMatrixXd jacobian = shared_.jacobian();
    for (int k = 0; k < scene.size(); ++k) {
      if (IsAtBound(scene.entries()[k], p[k])) {
        jacobian.col(k).setZero();
      }
    }
    const Eigen::VectorXd gradient = RobustGradient(values, jacobian, options_.huber);
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (std::abs(values[i]) > options_.huber) {
        jacobian.row(i).setZero();
      }
    }
    // H = Jᵀ J = V S² Vᵀ.
    Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::ColPivHouseholderQRPreconditioner> svd(
        jacobian, Eigen::ComputeThinU | Eigen::ComputeThinV);
    svd.setThreshold(kPolishRank);
    const Eigen::Index rank = svd.rank();
    const auto v = svd.matrixV().leftCols(rank);
    return -(v * svd.singularValues().head(rank).array().pow(-2).matrix().asDiagonal() *
             (v.transpose() * gradient));
  }

  /// Newton's method from where Ceres left off; false where it does not converge.
  bool Newton() {
    double cost = RobustCost(shared_.values(), options_.huber);
    double last = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kMaxNewtonSteps; ++i) {
      Eigen::VectorXd step = NewtonStep();
      double size = step.cwiseAbs().maxCoeff();
      const Eigen::VectorXd before = q_;
      double next = std::numeric_limits<double>::infinity();
      for (int halving = 0; halving <= kMaxHalvings; ++halving) {
        q_ = ToInternal(residuals_->entries(), ToParameters(residuals_->entries(), before + step));
        shared_.PrepareForEvaluation(true, true);
        if (shared_.ok()) {
          next = RobustCost(shared_.values(), options_.huber);
        }
        if (next <= cost * (1.0 + kPolishedStep)) {
          break;
        }
        step *= 0.5;
        size *= 0.5;
      }
      if (!(next <= cost * (1.0 + kPolishedStep))) {
        q_ = before;
        shared_.PrepareForEvaluation(true, true);
        return last <= kParameterTolerance;
      }
      cost = next;
      Record(true);
      if (size <= kPolishedStep || (size <= kParameterTolerance && size > 0.5 * last)) {
        return true;
      }
      last = size;
    }
    return last <= kParameterTolerance;
  }

  void Polish() {
    double last = std::numeric_limits<double>::infinity();
    double cost = RobustCost(shared_.values(), options_.huber);
    for (int i = 0; i < kMaxPolishSteps; ++i) {
      const Eigen::VectorXd step = GaussNewtonStep();
      const double size = step.cwiseAbs().maxCoeff();
      // Steps that no longer shrink are rounding.
      if (!(size > kPolishedStep) || size > 0.5 * last) {
        return;
      }
      const Eigen::VectorXd before = q_;
      q_ += step;
      q_ = ToInternal(residuals_->entries(), ToParameters(residuals_->entries(), q_));
      shared_.PrepareForEvaluation(true, true);
      const double next = shared_.ok() ? RobustCost(shared_.values(), options_.huber)
                                       : std::numeric_limits<double>::infinity();
      // Costs that are equal to rounding do not tell which point is better: the shrinking step
      // does.
      const double exact = 0.5 * kExactFit * kExactFit * residuals_->num_residuals();
      if (next > cost * (1.0 + 1e-9) + exact) {
        q_ = before;
        shared_.PrepareForEvaluation(true, true);
        return;
      }
      cost = next;
      last = size;
      Record(true);
    }
  }

  const FitOptions& options_;
  const std::function<double()>& elapsed_;
  const std::function<void(int, const FitIteration&)>& progress_;
  RolloutResiduals* residuals_;
  Eigen::VectorXd q_;
  SharedEvaluation shared_;
  std::vector<bool> held_;    ///< parameters at a bound, without a part in the steps
  std::vector<int> pushed_;   ///< iterations in a row that the cost falls beyond the bound
  Eigen::VectorXd gradient_;  ///< dcost/dq at the last evaluation with Jacobians, of held ones too
  double huber_;              ///< of the loss that is minimised now
  double cost_ = 0.0;         ///< robust, at the last accepted point
  double gradient_norm_ = 0.0;
  Minimum minimum_;
};

}  // namespace

void SetInternalBounds(const ParameterizedScene& scene, ceres::Problem* problem,
                       Eigen::VectorXd* x) {
  for (int k = 0; k < scene.size(); ++k) {
    const double low = ToInternal(scene.entries()[k], scene.entries()[k].lower);
    const double high = ToInternal(scene.entries()[k], scene.entries()[k].upper);
    if (std::isfinite(low)) {
      problem->SetParameterLowerBound(x->data(), k, low);
    }
    if (std::isfinite(high)) {
      problem->SetParameterUpperBound(x->data(), k, high);
    }
    (*x)[k] = std::clamp((*x)[k], low, high);
  }
}

double RobustCost(const Eigen::VectorXd& residuals, double huber) {
  double sum = 0.0;
  for (const double r : residuals) {
    const double size = std::abs(r);
    sum += huber > 0.0 && size > huber ? 2.0 * huber * size - huber * huber : r * r;
  }
  return 0.5 * sum;
}

Eigen::VectorXd RobustGradient(const Eigen::VectorXd& residuals, const RowMatrixXd& jacobian,
                               double huber) {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(jacobian.cols());
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    gradient += RobustWeight(residuals[i], huber) * residuals[i] * jacobian.row(i).transpose();
  }
  return gradient;
}

Minimum Minimise(const FitOptions& options, const Eigen::VectorXd& start,
                 const std::function<double()>& elapsed,
                 const std::function<void(int iteration, const FitIteration&)>& progress,
                 RolloutResiduals* residuals) {
  return Minimiser(options, start, elapsed, progress, residuals).Run();
}

}  // namespace tangible
