// SPDX-License-Identifier: Apache-2.0
//
// iLQR beside a direct transcription that Ipopt solves: multiple shooting of the same step map,
//
//   min Σ_k ℓ(x_k, u_k) + ℓ_N(x_N)   over x_1 … x_N, u_0 … u_{N−1},   x_{k+1} = f(x_k, u_k),
//
// with the steps' exact Jacobians, and second derivatives of the Lagrangian by central differences
// of them. A swing-up has several minima: the best of each are compared.

#include <gtest/gtest.h>

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "../support/scenes.h"
#include "tangible/control/engine_step.h"
#include "tangible/control/ilqr.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

using Ipopt::Index;
using Ipopt::Number;

constexpr double kDifference = 6e-6;  // of exact Jacobians, for second derivatives

// Variables: for each k < N u_k, then x_{k+1}.
class Transcription : public Ipopt::TNLP {
 public:
  Transcription(const ControlProblem& problem, const RowMatrixXd& controls)
      : p_(problem),
        steps_(static_cast<int>(controls.rows())),
        n_(problem.map->num_states()),
        m_(problem.map->num_controls()),
        plan_{RowMatrixXd::Zero(controls.rows() + 1, n_), controls, {}, 0.0} {
    plan_.states.row(0) = p_.initial.transpose();
    for (int k = 0; k < steps_; ++k) {
      VectorX<double> next;
      std::string error;
      EXPECT_TRUE(p_.map->Step(k, plan_.states.row(k), plan_.controls.row(k), &next, &error));
      plan_.states.row(k + 1) = next.transpose();
    }
  }

  const RowMatrixXd& controls() const { return plan_.controls; }
  double cost() const { return cost_; }
  double violation() const { return violation_; }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hessian,
                    IndexStyleEnum& style) override {
    n = steps_ * (n_ + m_);
    m = steps_ * n_;
    nnz_jac = steps_ * n_ * (m_ + 1) + (steps_ - 1) * n_ * n_;
    nnz_hessian = 0;
    for (int k = 0; k <= steps_; ++k) nnz_hessian += HessianSize(k) * (HessianSize(k) + 1) / 2;
    style = TNLP::C_STYLE;
    return true;
  }
  bool get_bounds_info(Index n, Number* low, Number* high, Index m, Number* g_low,
                       Number* g_high) override {
    const double none = 2e19;  // Ipopt's infinity is 1e19
    for (Index i = 0; i < n; ++i) {
      const int j = i % (n_ + m_);
      low[i] = j < m_ ? std::max(-none, p_.low[j]) : -none;
      high[i] = j < m_ ? std::min(none, p_.high[j]) : none;
    }
    std::fill_n(g_low, m, 0.0);
    std::fill_n(g_high, m, 0.0);
    return true;
  }
  bool get_starting_point(Index, bool, Number* x, bool, Number*, Number*, Index, bool,
                          Number*) override {
    for (int k = 0; k < steps_; ++k) {
      for (int i = 0; i < m_; ++i) x[At(k) + i] = plan_.controls(k, i);
      for (int i = 0; i < n_; ++i) x[At(k) + m_ + i] = plan_.states(k + 1, i);
    }
    return true;
  }
  bool eval_f(Index, const Number* x, bool, Number& value) override {
    Read(x);
    value = p_.cost->EndValue(plan_.states.row(steps_));
    for (int k = 0; k < steps_; ++k) {
      value += p_.cost->Value(plan_.states.row(k), plan_.controls.row(k));
    }
    return true;
  }
  bool eval_grad_f(Index n, const Number* x, bool, Number* gradient) override {
    Read(x);
    std::fill_n(gradient, n, 0.0);
    CostExpansion cost;
    for (int k = 0; k <= steps_; ++k) {
      Expand(k, &cost);
      for (int i = 0; i < m_ && k < steps_; ++i) gradient[At(k) + i] += cost.u[i];
      for (int i = 0; i < n_ && k > 0; ++i) gradient[At(k - 1) + m_ + i] += cost.x[i];
    }
    return true;
  }
  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    Read(x);
    VectorX<double> next;
    std::string error;
    for (int k = 0; k < steps_; ++k) {
      if (!p_.map->Step(k, plan_.states.row(k), plan_.controls.row(k), &next, &error)) return false;
      for (int i = 0; i < n_; ++i) g[k * n_ + i] = plan_.states(k + 1, i) - next[i];
    }
    return true;
  }
  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* columns,
                  Number* values) override {
    if (x != nullptr) Read(x);
    VectorX<double> next;
    MatrixX<double> a, b;
    std::string error;
    int entry = 0;
    const auto add = [&](int row, int column, double value) {
      if (values == nullptr) {
        rows[entry] = row;
        columns[entry] = column;
      } else {
        values[entry] = value;
      }
      ++entry;
    };
    for (int k = 0; k < steps_; ++k) {
      if (values != nullptr && !p_.map->Linearise(k, plan_.states.row(k), plan_.controls.row(k),
                                                  &next, &a, &b, &error)) {
        return false;
      }
      for (int i = 0; i < n_; ++i) {
        add(k * n_ + i, At(k) + m_ + i, 1.0);
        for (int j = 0; j < m_; ++j) {
          add(k * n_ + i, At(k) + j, values == nullptr ? 0.0 : -b(i, j));
        }
        for (int j = 0; j < n_ && k > 0; ++j) {
          add(k * n_ + i, At(k - 1) + m_ + j, values == nullptr ? 0.0 : -a(i, j));
        }
      }
    }
    return true;
  }
  bool eval_h(Index, const Number* x, bool, Number factor, Index, const Number* lambda, bool, Index,
              Index* rows, Index* columns, Number* values) override {
    if (x != nullptr) Read(x);
    int entry = 0;
    MatrixX<double> h;
    for (int k = 0; k <= steps_; ++k) {
      // Variables in the order (x_k, u_k); x_0 is given, u_N none.
      if (values != nullptr && !StepHessian(k, factor, lambda, &h)) return false;
      const int first = k == 0 ? n_ : 0;
      for (int i = 0; i < HessianSize(k); ++i) {
        for (int j = 0; j <= i; ++j) {
          if (values == nullptr) {
            const Index one = VariableOf(k, first + i), other = VariableOf(k, first + j);
            rows[entry] = std::max(one, other);
            columns[entry] = std::min(one, other);
          } else {
            values[entry] = h(first + i, first + j);
          }
          ++entry;
        }
      }
    }
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const Number* x, const Number*, const Number*,
                         Index m, const Number* g, const Number*, Number value,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    Read(x);
    cost_ = value;
    violation_ = 0.0;
    for (Index i = 0; i < m; ++i) violation_ = std::max(violation_, std::abs(g[i]));
  }

 private:
  int At(int k) const { return k * (n_ + m_); }
  int HessianSize(int k) const { return (k > 0 ? n_ : 0) + (k < steps_ ? m_ : 0); }
  Index VariableOf(int k, int i) const { return i < n_ ? At(k - 1) + m_ + i : At(k) + i - n_; }
  void Read(const Number* x) {
    for (int k = 0; k < steps_; ++k) {
      for (int i = 0; i < m_; ++i) plan_.controls(k, i) = x[At(k) + i];
      for (int i = 0; i < n_; ++i) plan_.states(k + 1, i) = x[At(k) + m_ + i];
    }
  }
  void Expand(int k, CostExpansion* cost) const {
    if (k < steps_) {
      p_.cost->Expand(plan_.states.row(k), plan_.controls.row(k), true, cost);
    } else {
      p_.cost->ExpandEnd(plan_.states.row(k), true, cost);
    }
  }
  bool StepHessian(int k, double factor, const Number* lambda, MatrixX<double>* h) {
    CostExpansion cost;
    Expand(k, &cost);
    h->setZero(n_ + m_, n_ + m_);
    h->topLeftCorner(n_, n_) = factor * cost.xx;
    h->bottomLeftCorner(m_, n_) = factor * cost.ux;
    h->topRightCorner(n_, m_) = factor * cost.ux.transpose();
    h->bottomRightCorner(m_, m_) = factor * cost.uu;
    if (k == steps_) return true;
    const Eigen::Map<const VectorX<double>> multiplier(lambda + k * n_, n_);
    VectorX<double> next;
    MatrixX<double> a, b, second(n_ + m_, n_ + m_);
    std::string error;
    for (int j = 0; j < n_ + m_; ++j) {
      VectorX<double> sides[2];
      for (const int side : {0, 1}) {
        VectorX<double> x = plan_.states.row(k), u = plan_.controls.row(k);
        (j < n_ ? x[j] : u[j - n_]) += side == 0 ? -kDifference : kDifference;
        if (!p_.map->Linearise(k, x, u, &next, &a, &b, &error)) return false;
        sides[side].resize(n_ + m_);
        sides[side] << a.transpose() * multiplier, b.transpose() * multiplier;
      }
      second.col(j) = (sides[1] - sides[0]) / (2.0 * kDifference);
    }
    *h -= 0.5 * (second + second.transpose());
    return true;
  }

  const ControlProblem& p_;
  int steps_, n_, m_;
  Plan plan_;
  double cost_ = std::numeric_limits<double>::infinity();
  double violation_ = std::numeric_limits<double>::infinity();
};

struct Found {
  double cost = std::numeric_limits<double>::infinity();
  RowMatrixXd controls;
};

Found ByIpopt(const ControlProblem& problem, const RowMatrixXd& start) {
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication();
  application->Options()->SetIntegerValue("print_level", 0);
  application->Options()->SetStringValue("sb", "yes");
  application->Options()->SetNumericValue("tol", 1e-8);
  application->Options()->SetIntegerValue("max_iter", 300);
  EXPECT_EQ(application->Initialize(), Ipopt::Solve_Succeeded);
  Ipopt::SmartPtr<Transcription> transcription = new Transcription(problem, start);
  application->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(GetRawPtr(transcription)));
  // A motion that breaks its own steps is none.
  if (transcription->violation() > 1e-6) return {};
  return {transcription->cost(), transcription->controls()};
}

Found ByIlqr(const ControlProblem& problem, const RowMatrixXd& start) {
  IlqrOptions options;
  options.max_iterations = 500;
  options.second_order = true;
  const IlqrResult result = SolveIlqr(problem, start, options);
  EXPECT_NE(result.status, IlqrStatus::kFailed) << result.message;
  return {result.plan.cost, result.plan.controls};
}

void Better(Found one, Found* best) {
  if (one.cost < best->cost) *best = std::move(one);
}

// Of the pendulum of data/control, with `steps` of `dt`.
void CompareBest(int steps, double dt, int random_starts) {
  Scene scene;
  std::string error;
  ASSERT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/control/pendulum.json", &scene, &error))
      << error;
  // By fixed steps: both solve the same discrete map, and Ipopt needs many more of its steps.
  scene.simulation.stepping = Stepping::kFixed;
  scene.simulation.joint_correction = JointCorrection::kProjection;
  scene.simulation.dt = dt;
  scene.simulation.duration = steps * dt;
  RolloutFunction function;
  ASSERT_EQ(function.Create(scene, {}, {"joints/motor/effort"}, {}), "");
  EngineStep map(function);
  using Kind = CostTerm::Kind;
  const Cost cost(6, 1, dt,
                  {{Kind::kControl, 0, 0, {0, 0}, 0.0, 0.05, false},
                   {Kind::kState, 2, 0, {0, 0}, std::numbers::pi, 100.0, true},
                   {Kind::kState, 5, 0, {0, 0}, 0.0, 20.0, true}});
  const VectorX<double> bound = VectorX<double>::Constant(1, 2.5);
  const ControlProblem problem{&map, &cost, map.initial(), -bound, bound};
  Found ilqr, ipopt;
  std::mt19937_64 random = Generator(18, 0);
  for (int i = 0; i < random_starts; ++i) {
    RowMatrixXd start(steps, 1);
    // A few swings: steps of their own would cancel.
    const double size = Uniform(0.5, 2.5, &random), rate = Uniform(2.0, 6.0, &random);
    const double phase = Uniform(0.0, 2.0 * std::numbers::pi, &random);
    for (int k = 0; k < steps; ++k) start(k, 0) = size * std::sin(rate * k * dt + phase);
    const Found one = ByIlqr(problem, start), other = ByIpopt(problem, start);
    std::printf("start %d: iLQR %.8f, Ipopt %.8f\n", i, one.cost, other.cost);
    Better(one, &ilqr);
    Better(other, &ipopt);
  }
  const Found from_ipopt = ByIlqr(problem, ipopt.controls);
  const Found from_ilqr = ByIpopt(problem, ilqr.controls);
  std::printf("each from the other's best: iLQR %.8f, Ipopt %.8f\n", from_ipopt.cost,
              from_ilqr.cost);
  Better(from_ipopt, &ilqr);
  Better(from_ilqr, &ipopt);
  std::printf("best: iLQR %.8f, Ipopt %.8f\n", ilqr.cost, ipopt.cost);
  // It is a swing-up: hanging costs 500.
  EXPECT_LT(ipopt.cost, 50.0);
  EXPECT_NEAR(ilqr.cost, ipopt.cost, 1e-4 * ipopt.cost);
}

TEST(DirectTranscription, AgreesWithIlqrOnAShortSwingUp) { CompareBest(60, 0.05, 2); }

// Run by a test of its own, labelled slow.
TEST(DirectTranscription, DISABLED_AgreesWithIlqrFromTenStarts) { CompareBest(150, 0.02, 10); }

}  // namespace
}  // namespace tangible
