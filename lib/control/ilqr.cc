// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/ilqr.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tangible/control/box_quadratic.h"
#include "tangible/control/reference_extension.h"
#include "tangible/control/tolerances.h"

namespace tangible {
namespace {

// Number of the fractions of a step that a line search tries: 1.1^(−j²).
constexpr int kShares = 11;
// With secants a line search begins so many fractions above the last one that was accepted: where
// steps stay small the whole ones would be rolled out in vain, five or six in each iteration.
constexpr int kLargerShares = 2;
double ShareOf(int j) { return std::pow(1.1, -j * j); }

// Q of a step without the shift.
struct StepQuadratic {
  VectorX<double> x, u;
  MatrixX<double> xx, ux, uu;
};

// Changes a symmetric H by a matrix of rank one to one with H change = gradient_change.
void LearnFromSecant(const VectorX<double>& change, const VectorX<double>& gradient_change,
                     MatrixX<double>* h) {
  const VectorX<double> missing = gradient_change - *h * change;
  const double along = missing.dot(change);
  if (std::abs(along) <= kSecantAngle * missing.norm() * change.norm()) return;
  *h += missing * missing.transpose() / along;
}

// A plan's steps to first order, and its cost to second order.
struct Linearisation {
  std::vector<MatrixX<double>> a, b;
  std::vector<CostExpansion> cost;  // of each step, then of the end
};

class Solver {
 public:
  Solver(const ControlProblem& problem, const IlqrOptions& options)
      : p_(problem),
        options_(options),
        secants_(options.secants && !options.second_order),
        n_(problem.map->num_states()),
        m_(problem.map->num_controls()) {}

  IlqrResult Solve(const RowMatrixXd& controls) {
    if (!Start(controls)) return std::move(result_);
    for (int i = 0; i < options_.max_iterations; ++i) {
      if (!Iterate()) return std::move(result_);
      if (options_.stop && options_.stop()) {
        Finish(IlqrStatus::kStopped, "stopped");
        return std::move(result_);
      }
    }
    if (Measure()) Converge();
    return std::move(result_);
  }

  // Fills the plan's linearisation; false with the result's message.
  bool Linearise(const Plan& plan, Linearisation* at) {
    const long steps = plan.controls.rows();
    at->a.resize(steps);
    at->b.resize(steps);
    at->cost.resize(steps + 1);
    VectorX<double> next;
    for (long k = 0; k < steps; ++k) {
      const VectorX<double> x = plan.states.row(k);
      const VectorX<double> u = plan.controls.row(k);
      if (!p_.map->Linearise(p_.first_step + k, x, u, &next, &at->a[k], &at->b[k],
                             &result_.message)) {
        return false;
      }
      p_.cost->Expand(x, u, options_.second_order, &at->cost[k]);
    }
    p_.cost->ExpandEnd(plan.states.row(steps), options_.second_order, &at->cost[steps]);
    if (options_.surrogate.samples > 0) {
      AverageJacobians(p_, plan, options_.surrogate, &at->a, &at->b);
    }
    ++result_.linearisations;
    return true;
  }

  // Computes λ and ∂J/∂u.
  void Gradient(const Linearisation& at, RowMatrixXd* costates, RowMatrixXd* gradient) const {
    const long steps = static_cast<long>(at.a.size());
    costates->resize(steps + 1, n_);
    gradient->resize(steps, m_);
    costates->row(steps) = at.cost[steps].x.transpose();
    for (long k = steps - 1; k >= 0; --k) {
      gradient->row(k) = at.cost[k].u.transpose() + costates->row(k + 1) * at.b[k];
      costates->row(k) = at.cost[k].x.transpose() + costates->row(k + 1) * at.a[k];
    }
  }

  const std::string& message() const { return result_.message; }

 private:
  void Finish(IlqrStatus status, std::string message) {
    result_.status = status;
    result_.message = std::move(message);
  }

  void Converge() {
    Finish(IlqrStatus::kConverged,
           IsAtMaximum() ? "an angle that wraps is half a turn from its target, where its cost is "
                           "largest and has no gradient"
                         : "");
  }

  bool Start(const RowMatrixXd& controls) {
    Plan& plan = result_.plan;
    plan.controls = controls;
    for (long k = 0; k < controls.rows(); ++k) {
      plan.controls.row(k) =
          controls.row(k).cwiseMax(p_.low.transpose()).cwiseMin(p_.high.transpose());
    }
    plan.states.resize(controls.rows() + 1, n_);
    plan.states.row(0) = p_.initial.transpose();
    plan.gains.assign(controls.rows(), MatrixX<double>::Zero(m_, n_));
    if (options_.reference_extension) plan.impacts.resize(controls.rows());
    met_ = kNoCost * p_.cost->ValueOfUnits(controls.rows());
    if (Follow() && Measure() && IsAtMaximum()) {
      result_.left_maximum = true;
      LeaveMaximum();
      Follow();
    }
    return result_.status != IlqrStatus::kFailed;
  }

  // Rolls out the plan's own controls and linearises there; false with the status where that fails.
  bool Follow() {
    Plan& plan = result_.plan;
    if (RollOut(plan, nullptr, 0.0, &plan) && Linearise(plan, &at_)) return true;
    result_.status = IlqrStatus::kFailed;
    return false;
  }

  // Whether the cost has no gradient because an angle that wraps is half a turn from its target.
  bool IsAtMaximum() const {
    const Plan& plan = result_.plan;
    return std::abs(plan.cost) > met_ && p_.cost->HasAngleAtMaximum(plan.states);
  }

  void LeaveMaximum() {
    RowMatrixXd& controls = result_.plan.controls;
    const VectorX<double> offset = kStartOffset * ControlSizes(p_, controls);
    for (long k = 0; k < controls.rows(); ++k) {
      for (int i = 0; i < m_; ++i) {
        double& u = controls(k, i);
        u = u + offset[i] <= p_.high[i] ? u + offset[i] : std::max(u - offset[i], p_.low[i]);
      }
    }
  }

  // One iteration; false where the work is done.
  bool Iterate() {
    if (Measure()) {
      Converge();
      return false;
    }
    if (options_.second_order && !curvature_valid_ && !FindCurvature()) {
      result_.status = IlqrStatus::kNoDescent;
      return false;
    }
    IlqrIteration iteration{result_.plan.cost, result_.gradient, 0.0, 0.0};
    bool convex = Backward();
    if (convex && shift_ == 0.0 &&
        -(linear_ + quadratic_) <= kNoDecrease * std::abs(result_.plan.cost)) {
      Converge();
      return false;
    }
    if (convex) iteration.step = Search();
    if (iteration.step == 0.0 && secants_ && !curvature_.empty()) {
      curvature_.clear();
      convex = Backward();
      if (convex) iteration.step = Search();
    }
    iteration.shift = shift_;
    if (options_.progress) {
      options_.progress(0, static_cast<long>(result_.iterations.size()), iteration);
    }
    result_.iterations.push_back(iteration);
    if (iteration.step > 0.0) {
      Decrease();
      curvature_valid_ = false;
      return true;
    }
    Increase();
    if (shift_ > kLargestShift) {
      Finish(IlqrStatus::kNoDescent,
             convex ? "no step decreases the cost: its gradient may be one of a kink, or rounding"
                    : "the cost is not convex in the controls, whatever the shift");
      return false;
    }
    return true;
  }

  // Twice the second-order term of the cost's change along its gradient by a control.
  double CurvatureAlong(int control) const {
    const long steps = result_.plan.controls.rows();
    VectorX<double> change = VectorX<double>::Zero(n_);
    double curvature = 0.0;
    for (long k = 0; k < steps; ++k) {
      const CostExpansion& cost = at_.cost[k];
      const double u = gradient_(k, control);
      curvature += change.dot(cost.xx * change) + 2.0 * u * cost.ux.row(control).dot(change) +
                   u * u * cost.uu(control, control);
      change = at_.a[k] * change + u * at_.b[k].col(control);
    }
    return curvature + change.dot(at_.cost[steps].xx * change);
  }

  // The range of each control; of one without bounds, at which values are large by the scene's
  // units alone, at least the way along the gradient to the least cost.
  VectorX<double> Ranges() const {
    VectorX<double> sizes = ControlSizes(p_, result_.plan.controls);
    for (int i = 0; i < m_; ++i) {
      if (std::isfinite(p_.low[i]) && std::isfinite(p_.high[i])) continue;
      const double curvature = CurvatureAlong(i);
      if (!(curvature > 0.0)) continue;
      const double way = gradient_.col(i).squaredNorm() / curvature;
      sizes[i] = std::max(sizes[i], way * gradient_.col(i).cwiseAbs().maxCoeff());
    }
    return sizes;
  }

  // Whether the plan is stationary, or the target is met.
  bool Measure() {
    Gradient(at_, &costates_, &gradient_);
    const Plan& plan = result_.plan;
    double sum = 0.0;
    const VectorX<double> sizes = Ranges();
    for (int i = 0; i < m_; ++i) {
      for (long k = 0; k < plan.controls.rows(); ++k) {
        const double g = gradient_(k, i);
        const bool held = (g > 0.0 && plan.controls(k, i) <= p_.low[i]) ||
                          (g < 0.0 && plan.controls(k, i) >= p_.high[i]);
        if (!held) sum += std::abs(g) * sizes[i];
      }
    }
    // Where the target is met, what is left of the gradient is rounding.
    const bool met = std::abs(plan.cost) <= met_;
    result_.gradient = met || sum == 0.0 ? 0.0 : sum / std::abs(plan.cost);
    return met || result_.gradient <= options_.gradient_tolerance;
  }

  // Σ λᵢ ∂²fᵢ of each step, symmetric in (x, u).
  bool FindCurvature() {
    const Plan& plan = result_.plan;
    const long steps = plan.controls.rows();
    curvature_.resize(steps);
    VectorX<double> next;
    MatrixX<double> a, b;
    for (long k = 0; k < steps; ++k) {
      const VectorX<double> costate = costates_.row(k + 1);
      MatrixX<double>& h = curvature_[k];
      h.resize(n_ + m_, n_ + m_);
      for (int j = 0; j < n_ + m_; ++j) {
        VectorX<double> x = plan.states.row(k);
        VectorX<double> u = plan.controls.row(k);
        double& value = j < n_ ? x[j] : u[j - n_];
        const double middle = value;
        const double step = kSecondDifference * std::max(1.0, std::abs(middle));
        for (const double side : {1.0, -1.0}) {
          value = middle + side * step;
          if (!p_.map->Linearise(p_.first_step + k, x, u, &next, &a, &b, &result_.message)) {
            return false;
          }
          VectorX<double> row(n_ + m_);
          row << a.transpose() * costate, b.transpose() * costate;
          if (side > 0.0) {
            h.col(j) = row;
          } else {
            h.col(j) = (h.col(j) - row) / (2.0 * step);
          }
        }
      }
      h = 0.5 * (h + h.transpose()).eval();
    }
    curvature_valid_ = true;
    return true;
  }

  // Steps k and gains K of all of the horizon; false where the quadratic is not convex.
  bool Backward() {
    const long steps = result_.plan.controls.rows();
    forward_.resize(steps);
    new_gains_.resize(steps);
    linear_ = quadratic_ = 0.0;
    VectorX<double> v_x = at_.cost[steps].x;
    MatrixX<double> v_xx = at_.cost[steps].xx;
    const double largest = LargestCurvature();
    const VectorX<double> effects = LargestEffects();
    for (long k = steps - 1; k >= 0; --k) {
      const MatrixX<double>& b = at_.b[k];
      StepQuadratic q = QuadraticOf(k, v_x, v_xx);
      const double shift = shift_ * largest;
      BoxQuadraticSolution box = SolveStep(k, effects, q.uu + shift * b.transpose() * b, q.u);
      if (secants_ && !curvature_.empty() && box.status != BoxQuadraticStatus::kSolved) {
        curvature_[k].setZero();
        q = QuadraticOf(k, v_x, v_xx);
        box = SolveStep(k, effects, q.uu + shift * b.transpose() * b, q.u);
      }
      if (box.status != BoxQuadraticStatus::kSolved || !box.x.allFinite()) return false;
      MatrixX<double> gain = MatrixX<double>::Zero(m_, n_);
      if (!box.free.empty()) {
        const MatrixX<double> shifted_ux = q.ux + shift * b.transpose() * at_.a[k];
        gain(box.free, Eigen::all) =
            -box.factor.Solve(MatrixX<double>(shifted_ux(box.free, Eigen::all)));
      }
      linear_ += box.x.dot(q.u);
      quadratic_ += 0.5 * box.x.dot(q.uu * box.x);
      v_x = q.x + gain.transpose() * (q.uu * box.x + q.u) + q.ux.transpose() * box.x;
      v_xx =
          q.xx + gain.transpose() * q.uu * gain + gain.transpose() * q.ux + q.ux.transpose() * gain;
      v_xx = 0.5 * (v_xx + v_xx.transpose()).eval();
      forward_[k] = box.x;
      new_gains_[k] = gain;
    }
    return std::isfinite(linear_) && std::isfinite(quadratic_);
  }

  // Q of step k, with V' of the step after it.
  StepQuadratic QuadraticOf(long k, const VectorX<double>& v_x, const MatrixX<double>& v_xx) const {
    const MatrixX<double>& a = at_.a[k];
    const MatrixX<double>& b = at_.b[k];
    const CostExpansion& cost = at_.cost[k];
    StepQuadratic q{cost.x + a.transpose() * v_x, cost.u + b.transpose() * v_x,
                    cost.xx + a.transpose() * v_xx * a, cost.ux + b.transpose() * v_xx * a,
                    cost.uu + b.transpose() * v_xx * b};
    if (!curvature_.empty()) {
      q.xx += curvature_[k].topLeftCorner(n_, n_);
      q.ux += curvature_[k].bottomLeftCorner(m_, n_);
      q.uu += curvature_[k].bottomRightCorner(m_, m_);
    }
    return q;
  }

  // The controls of step k. Controls that neither move nor cost anything in it stay as they are:
  // the quadratic does not determine them. Where controls move the same it determines their sum
  // alone, and a share of its diagonal decides between them.
  BoxQuadraticSolution SolveStep(long k, const VectorX<double>& effects,
                                 const MatrixX<double>& q_uu, const VectorX<double>& q_u) const {
    const VectorX<double> u = result_.plan.controls.row(k);
    VectorX<double> low = p_.low - u, high = p_.high - u;
    for (int i = 0; i < m_; ++i) {
      const bool moves = at_.b[k].col(i).cwiseAbs().maxCoeff() > kMovesNothing * effects[i];
      if (!moves && at_.cost[k].uu(i, i) == 0.0) low[i] = high[i] = 0.0;
    }
    const VectorX<double> none = VectorX<double>::Zero(m_);
    BoxQuadraticSolution box = SolveBoxQuadratic(q_uu, q_u, low, high, none);
    if (box.status != BoxQuadraticStatus::kIndefinite) return box;
    MatrixX<double> decided = q_uu;
    decided.diagonal() += kRedundantShare * q_uu.diagonal().cwiseAbs();
    return SolveBoxQuadratic(decided, q_u, low, high, none);
  }

  // The largest entry of any B_k in the column of each control.
  VectorX<double> LargestEffects() const {
    VectorX<double> effects = VectorX<double>::Zero(m_);
    for (const MatrixX<double>& b : at_.b) {
      effects = effects.cwiseMax(b.cwiseAbs().colwise().maxCoeff().transpose());
    }
    return effects;
  }

  // The largest entry of V, to which shifts are relative.
  double LargestCurvature() const {
    double largest = 0.0;
    for (const CostExpansion& cost : at_.cost) {
      largest += cost.xx.size() == 0 ? 0.0 : cost.xx.cwiseAbs().maxCoeff();
    }
    return largest > 0.0 ? largest : 1.0;
  }

  // Rolls out the fraction `share` of the step (without gains where `gains` is null); false where a
  // step cannot be made or the cost is not finite.
  bool RollOut(const Plan& plan, const std::vector<MatrixX<double>>* gains, double share,
               Plan* rolled) {
    const long steps = plan.controls.rows();
    ++result_.rollouts;
    double cost = 0.0;
    VectorX<double> x = plan.states.row(0);
    VectorX<double> next;
    std::string error;
    std::vector<int> impacts;
    for (long k = 0; k < steps; ++k) {
      VectorX<double> u = plan.controls.row(k);
      if (gains != nullptr) {
        u += share * forward_[k] + Feedback(*gains, k, plan, impacts, x);
        u = u.cwiseMax(p_.low).cwiseMin(p_.high);
      }
      if (!p_.map->Step(p_.first_step + k, x, u, &next, &error)) {
        if (gains == nullptr) result_.message = error;
        return false;
      }
      if (options_.reference_extension) {
        rolled->impacts[k] = p_.map->impacts();
        impacts.insert(impacts.end(), rolled->impacts[k].begin(), rolled->impacts[k].end());
      }
      cost += p_.cost->Value(x, u);
      rolled->controls.row(k) = u.transpose();
      rolled->states.row(k + 1) = next.transpose();
      x = next;
    }
    rolled->cost = cost + p_.cost->EndValue(x);
    if (std::isfinite(rolled->cost)) return true;
    if (gains == nullptr) result_.message = "the cost of the initial controls is not finite";
    return false;
  }

  // K (x − x̄) of step k in a run that has had `impacts`.
  VectorX<double> Feedback(const std::vector<MatrixX<double>>& gains, long k, const Plan& plan,
                           const std::vector<int>& impacts, const VectorX<double>& x) {
    if (!reference_) return gains[k] * (x - plan.states.row(k).transpose());
    const ExtendedReference::Point& point = reference_->At(k, impacts);
    if (point.gain < 0) return VectorX<double>::Zero(m_);
    return gains[point.gain] * (x - point.state);
  }

  // Returns the accepted fraction of the step; 0: none.
  double Search() {
    Plan& plan = result_.plan;
    Plan tried = plan;
    const double rounding = kCostRounding * std::abs(plan.cost);
    if (options_.reference_extension) reference_.emplace(p_.map, p_.first_step, plan);
    for (int j = secants_ ? std::max(0, last_share_ - kLargerShares) : 0; j < kShares; ++j) {
      const double share = ShareOf(j);
      const double expected = share * linear_ + share * share * quadratic_;
      if (!(expected < 0.0) || !RollOut(plan, &new_gains_, share, &tried)) continue;
      const double change = tried.cost - plan.cost;
      // Where the decrease is rounding, only the gradient tells whether the step is an improvement.
      const bool decreases = change <= kSufficientDecrease * expected;
      if (!decreases && !(-expected <= rounding && change <= rounding)) continue;
      Linearisation there;
      if (!Linearise(tried, &there)) continue;
      if (!decreases && !Improves(there, tried)) return 0.0;
      if (secants_) LearnCurvature(share, tried, there);
      last_share_ = j;
      plan = tried;
      plan.gains = new_gains_;
      at_ = std::move(there);
      return share;
    }
    last_share_ = 0;
    return 0.0;
  }

  // What H is missing along the step to another plan, with its costates.
  void LearnCurvature(double share, const Plan& tried, const Linearisation& there) {
    if (share < kSecantShare) {
      curvature_.clear();
      return;
    }
    const Plan& plan = result_.plan;
    const long steps = plan.controls.rows();
    if (curvature_.empty()) curvature_.assign(steps, MatrixX<double>::Zero(n_ + m_, n_ + m_));
    RowMatrixXd costates, gradient;
    Gradient(there, &costates, &gradient);
    VectorX<double> change(n_ + m_), gradient_change(n_ + m_);
    for (long k = 0; k < steps; ++k) {
      const VectorX<double> costate = costates.row(k + 1);
      const VectorX<double> dx = (tried.states.row(k) - plan.states.row(k)).transpose();
      const VectorX<double> du = (tried.controls.row(k) - plan.controls.row(k)).transpose();
      const CostExpansion& cost = there.cost[k];
      change << dx, du;
      gradient_change << (there.a[k] - at_.a[k]).transpose() * costate + cost.x - at_.cost[k].x -
                             cost.xx * dx - cost.ux.transpose() * du,
          (there.b[k] - at_.b[k]).transpose() * costate + cost.u - at_.cost[k].u - cost.ux * dx -
              cost.uu * du;
      LearnFromSecant(change, gradient_change, &curvature_[k]);
    }
  }

  // Whether the gradient at another plan is smaller.
  bool Improves(const Linearisation& there, const Plan& tried) {
    RowMatrixXd costates, gradient;
    Gradient(there, &costates, &gradient);
    const auto size = [this](const RowMatrixXd& g, const Plan& plan) {
      double sum = 0.0;
      for (long k = 0; k < g.rows(); ++k) {
        for (int i = 0; i < m_; ++i) {
          const bool held = (g(k, i) > 0.0 && plan.controls(k, i) <= p_.low[i]) ||
                            (g(k, i) < 0.0 && plan.controls(k, i) >= p_.high[i]);
          if (!held) sum += std::abs(g(k, i));
        }
      }
      return sum;
    };
    return size(gradient, tried) < size(gradient_, result_.plan);
  }

  // The schedule of Tassa et al.: quadratic in the number of successes or failures in a row.
  void Increase() {
    growth_ = std::max(kGrowth, growth_ * kGrowth);
    shift_ = std::max(kLeastShift, shift_ * growth_);
  }
  void Decrease() {
    growth_ = std::min(1.0 / kGrowth, growth_ / kGrowth);
    shift_ = shift_ * growth_ >= kLeastShift ? shift_ * growth_ : 0.0;
  }

  static constexpr double kGrowth = 2.0;

  const ControlProblem& p_;
  const IlqrOptions& options_;
  const bool secants_;
  int n_, m_;
  IlqrResult result_;
  Linearisation at_;
  RowMatrixXd costates_, gradient_;
  std::vector<MatrixX<double>> curvature_;  // of each step; empty: left out
  bool curvature_valid_ = false;
  std::optional<ExtendedReference> reference_;  // of the plan, in a search
  std::vector<VectorX<double>> forward_;
  std::vector<MatrixX<double>> new_gains_;
  int last_share_ = 0;                     // the number of the last fraction that was accepted
  double linear_ = 0.0, quadratic_ = 0.0;  // of the expected change of the cost
  double shift_ = 0.0, growth_ = 1.0;
  double met_ = 0.0;  // the cost below which the target is met
};

}  // namespace

const char* NameOf(IlqrStatus status) {
  switch (status) {
    case IlqrStatus::kConverged:
      return "converged";
    case IlqrStatus::kIterationLimit:
      return "iteration_limit";
    case IlqrStatus::kNoDescent:
      return "no_descent";
    case IlqrStatus::kStopped:
      return "stopped";
    case IlqrStatus::kFailed:
      return "failed";
  }
  return "";
}

std::string CheckProblem(const ControlProblem& problem, const RowMatrixXd& controls) {
  const int n = problem.map->num_states();
  const int m = problem.map->num_controls();
  const auto expected = [](const std::string& what, long size, long got) {
    return what + ": expected " + std::to_string(size) + ", got " + std::to_string(got);
  };
  if (m < 1) return "controls: expected at least one, got none";
  if (controls.rows() < 1) return "horizon: expected at least one step, got none";
  if (controls.cols() != m) return expected("columns of the controls", m, controls.cols());
  if (problem.initial.size() != n) return expected("initial state", n, problem.initial.size());
  if (problem.low.size() != m) return expected("lower bounds", m, problem.low.size());
  if (problem.high.size() != m) return expected("upper bounds", m, problem.high.size());
  if (problem.cost->num_states() != n || problem.cost->num_controls() != m) {
    return expected("states of the cost", n, problem.cost->num_states());
  }
  for (int i = 0; i < m; ++i) {
    if (!(problem.low[i] <= problem.high[i])) {
      return "bounds of control " + std::to_string(i) + ": expected low <= high, got " +
             std::to_string(problem.low[i]) + " and " + std::to_string(problem.high[i]);
    }
  }
  if (!controls.allFinite()) return "controls: expected finite numbers";
  if (!problem.initial.allFinite()) return "initial state: expected finite numbers";
  return "";
}

IlqrProgress ProgressAfter(const IlqrProgress& progress, int start, long done) {
  if (!progress) return {};
  return [progress, start, done](int, long number, const IlqrIteration& iteration) {
    progress(start, done + number, iteration);
  };
}

IlqrResult SolveIlqr(const ControlProblem& problem, const RowMatrixXd& controls,
                     const IlqrOptions& options) {
  IlqrResult result;
  result.message = CheckProblem(problem, controls);
  if (result.message.empty() && options.surrogate.samples > 0) {
    result.message = CheckSurrogate(problem);
  }
  if (!result.message.empty()) {
    result.status = IlqrStatus::kFailed;
    return result;
  }
  IlqrOptions exact = options;
  exact.surrogate.samples = 0;
  if (options.surrogate.samples == 0) return Solver(problem, exact).Solve(controls);
  IlqrOptions sampled = options;
  sampled.max_iterations = std::max(1, options.max_iterations / 2);
  sampled.secants = false;  // sampled Jacobians are not the derivatives of one function
  const IlqrResult first = Solver(problem, sampled).Solve(controls);
  const auto spent = static_cast<long>(first.iterations.size());
  if (first.status == IlqrStatus::kFailed || first.status == IlqrStatus::kStopped) {
    result = first;
  } else {
    exact.max_iterations = std::max(1, options.max_iterations - static_cast<int>(spent));
    exact.progress = ProgressAfter(options.progress, 0, spent);
    result = Solver(problem, exact).Solve(first.plan.controls);
    result.iterations.insert(result.iterations.begin(), first.iterations.begin(),
                             first.iterations.end());
    result.rollouts += first.rollouts;
    result.linearisations += first.linearisations;
    result.left_maximum |= first.left_maximum;
  }
  result.surrogate_iterations = spent;
  return result;
}

RowMatrixXd CostGradient(const ControlProblem& problem, const Plan& plan, RowMatrixXd* costates,
                         std::string* error) {
  const IlqrOptions options;
  Solver solver(problem, options);
  Linearisation at;
  RowMatrixXd gradient;
  if (solver.Linearise(plan, &at)) {
    solver.Gradient(at, costates, &gradient);
  } else {
    *error = solver.message();
  }
  return gradient;
}

}  // namespace tangible
