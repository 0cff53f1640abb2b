// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/unreached_targets.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/control/tolerances.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

// Motions beside the plan's: that an effect vanishes along a random one by chance has the
// probability 0, and two leave a margin for rounding.
constexpr int kDirections = 2;

// Of one term, over the steps that count for it.
struct Term {
  double distance = 0.0;  // the largest |r|
  double effect = 0.0;    // the largest change
};

// Of all controls: plans beside a plan, which tell whether it is at the end of what a target's
// controls can do, as against a stop.
constexpr double kBeside[] = {0.99, 1.01};

class Effects {
 public:
  Effects(const ControlProblem& problem, const Plan& plan)
      : p_(problem), plan_(plan), terms_(problem.cost->terms().size()) {}

  // False where a step has no derivative.
  bool Find() {
    const long steps = plan_.controls.rows();
    const VectorX<double> sizes = ControlSizes(p_, plan_.controls);
    std::mt19937_64 random = Generator(0, 0);
    MatrixX<double> changes = MatrixX<double>::Zero(p_.map->num_states(), kDirections);
    MatrixX<double> varied(p_.map->num_controls(), kDirections), a, b;
    VectorX<double> next;
    std::string error;
    for (long k = 0; k < steps; ++k) {
      const VectorX<double> x = plan_.states.row(k), u = plan_.controls.row(k);
      Add(x, u, changes, false);
      if (!p_.map->Linearise(p_.first_step + k, x, u, &next, &a, &b, &error)) return false;
      for (Eigen::Index i = 0; i < varied.size(); ++i) varied.data()[i] = Normal(&random);
      changes = a * changes + b * (sizes.asDiagonal() * varied);
      largest_ = std::max(largest_, changes.cwiseAbs().maxCoeff());
    }
    Add(plan_.states.row(steps), VectorX<double>(), changes, true);
    return std::isfinite(largest_);
  }

  UnreachedTargets Unreached() const {
    UnreachedTargets unreached;
    unreached.all = true;
    for (size_t i = 0; i < terms_.size(); ++i) {
      const CostTerm& term = p_.cost->terms()[i];
      const double unit = std::max(1.0, std::abs(term.target));
      if (!IsTarget(term) || terms_[i].distance <= kMetTarget * unit) continue;
      if (terms_[i].effect <= kWithoutEffect * largest_) {
        unreached.terms.push_back(static_cast<int>(i));
      } else {
        unreached.all = false;
      }
    }
    unreached.all = unreached.all && !unreached.terms.empty();
    return unreached;
  }

  // Takes out the terms that change with the plan's controls all a little smaller or larger.
  void TakeOneSided(UnreachedTargets* unreached) {
    std::vector<char> changes(terms_.size(), 0);
    const long steps = plan_.controls.rows();
    const auto compare = [&](const VectorX<double>& own, const VectorX<double>& x,
                             const VectorX<double>& u, bool at_end) {
      for (const int i : unreached->terms) {
        const CostTerm& term = p_.cost->terms()[static_cast<size_t>(i)];
        const double unit = std::max(1.0, std::abs(term.target));
        if (term.at_end != at_end) continue;
        const double change = std::abs(ResidualOf(term, x, u) - ResidualOf(term, own, u));
        if (change > kMetTarget * unit) changes[static_cast<size_t>(i)] = 1;
      }
    };
    for (const double share : kBeside) {
      VectorX<double> x = plan_.states.row(0), next;
      std::string error;
      long k = 0;
      for (; k < steps; ++k) {
        VectorX<double> u = share * plan_.controls.row(k).transpose();
        u = u.cwiseMax(p_.low).cwiseMin(p_.high);
        compare(plan_.states.row(k), x, u, false);
        if (!p_.map->Step(p_.first_step + k, x, u, &next, &error)) break;
        x.swap(next);
      }
      if (k == steps) compare(plan_.states.row(steps), x, VectorX<double>(), true);
    }
    for (const int i : unreached->terms) {
      if (changes[static_cast<size_t>(i)] != 0) unreached->one_sided.push_back(i);
    }
    std::erase_if(unreached->terms, [&](int i) { return changes[static_cast<size_t>(i)] != 0; });
    unreached->all = unreached->all && unreached->one_sided.empty();
  }

 private:
  static bool IsTarget(const CostTerm& term) {
    return term.kind != CostTerm::Kind::kControl && term.weight > 0.0;
  }

  void Add(const VectorX<double>& x, const VectorX<double>& u, const MatrixX<double>& changes,
           bool at_end) {
    for (size_t i = 0; i < terms_.size(); ++i) {
      const CostTerm& term = p_.cost->terms()[i];
      if (!IsTarget(term) || term.at_end != at_end) continue;
      terms_[i].distance = std::max(terms_[i].distance, std::abs(ResidualOf(term, x, u)));
      terms_[i].effect =
          std::max(terms_[i].effect, ChangesOf(term, x, changes).cwiseAbs().maxCoeff());
    }
  }

  const ControlProblem& p_;
  const Plan& plan_;
  std::vector<Term> terms_;
  double largest_ = 0.0;  // change of a number of the state in any step
};

}  // namespace

UnreachedTargets FindUnreachedTargets(const ControlProblem& problem, const Plan& plan) {
  Effects effects(problem, plan);
  if (!effects.Find()) return {};
  UnreachedTargets unreached = effects.Unreached();
  if (!unreached.terms.empty()) effects.TakeOneSided(&unreached);
  return unreached;
}

}  // namespace tangible
