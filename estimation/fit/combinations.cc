// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/combinations.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>

namespace tangible {
namespace {

// Weights that are rounding or derivatives' errors beside the largest of a combination.
constexpr double kSmallWeight = 1e-6;

std::string Short(double x) {
  std::ostringstream text;
  text.precision(4);
  text << x;
  return text.str();
}

/// Brings the rows to reduced row echelon form, the largest entry that is left being the next
/// pivot.
void ReduceRows(Eigen::MatrixXd* rows) {
  std::vector<bool> done(rows->rows(), false);
  for (Eigen::Index step = 0; step < rows->rows(); ++step) {
    Eigen::Index pivot_row = -1;
    Eigen::Index pivot = -1;
    double largest = 0.0;
    for (Eigen::Index i = 0; i < rows->rows(); ++i) {
      for (Eigen::Index j = 0; j < rows->cols() && !done[i]; ++j) {
        if (std::abs((*rows)(i, j)) > largest) {
          largest = std::abs((*rows)(i, j));
          pivot_row = i;
          pivot = j;
        }
      }
    }
    if (pivot_row < 0) {
      return;
    }
    done[pivot_row] = true;
    const double divisor = (*rows)(pivot_row, pivot);
    rows->row(pivot_row) /= divisor;
    for (Eigen::Index i = 0; i < rows->rows(); ++i) {
      if (i != pivot_row) {
        const double share = (*rows)(i, pivot);
        rows->row(i) -= share * rows->row(pivot_row);
        (*rows)(i, pivot) = 0.0;
      }
    }
  }
}

/// A basis, a row each, of the e with eᵀ n = 0.
Eigen::MatrixXd LeftNullSpace(const Eigen::MatrixXd& n) {
  Eigen::FullPivLU<Eigen::MatrixXd> lu(n.transpose());
  lu.setThreshold(kSmallShare);
  if (lu.rank() == n.rows()) {
    return Eigen::MatrixXd(0, n.rows());
  }
  Eigen::MatrixXd rows = lu.kernel().transpose();
  ReduceRows(&rows);
  return rows;
}

void Name(const std::vector<ParameterizedScene::Entry>& entries, DeterminedCombination* c) {
  bool positive = true;
  for (size_t i = 0; i < c->parameters.size(); ++i) {
    const ParameterizedScene::Entry& entry = entries[c->parameters[i]];
    positive = positive && entry.logarithmic;
    const double weight = c->coefficients[i];
    c->sum += i == 0 ? "" : weight < 0.0 ? " - " : " + ";
    c->sum += (i == 0 ? "" : Short(std::abs(weight)) + " ") + "'" + entry.name + "'";
    const double exponent = c->exponents[i];
    c->product += std::string(i == 0 ? "" : " * ") + "'" + entry.name + "'" +
                  (std::abs(exponent - 1.0) < kSmallShare ? "" : "^" + Short(exponent));
  }
  if (!positive) {
    c->product.clear();
  }
}

}  // namespace

Eigen::VectorXd RelativeChanges(const std::vector<ParameterizedScene::Entry>& entries,
                                const Eigen::VectorXd& estimate, const std::vector<int>& free,
                                Eigen::VectorXd direction) {
  for (size_t k = 0; k < free.size(); ++k) {
    const double magnitude = std::abs(estimate[free[k]]);
    direction[static_cast<Eigen::Index>(k)] /= magnitude > 0.0 ? magnitude : entries[free[k]].scale;
  }
  return direction;
}

std::vector<DeterminedCombination> FindDeterminedCombinations(
    const std::vector<ParameterizedScene::Entry>& entries, const Eigen::VectorXd& estimate,
    const std::vector<int>& free, const Decomposition& decomposition, double least,
    const Eigen::MatrixXd& covariance, const RowMatrixXd& robust) {
  std::vector<DeterminedCombination> combinations;
  const Eigen::VectorXd& s = decomposition.singular_values();
  Eigen::Index rank = 0;
  while (rank < s.size() && s[rank] > least * s[0]) {
    ++rank;
  }
  const Eigen::Index size = decomposition.size();
  if (rank == size || rank == 0) {
    return combinations;
  }
  Eigen::MatrixXd none(size, size - rank);
  for (Eigen::Index i = rank; i < size; ++i) {
    none.col(i - rank) =
        RelativeChanges(entries, estimate, free, decomposition.Direction(i)).normalized();
  }
  std::vector<int> involved;  // indices into free
  for (Eigen::Index k = 0; k < size; ++k) {
    if (none.row(k).cwiseAbs().maxCoeff() >= kSmallShare) {
      involved.push_back(static_cast<int>(k));
    }
  }
  const Eigen::MatrixXd part = none(involved, Eigen::all);
  const Eigen::MatrixXd weights = LeftNullSpace(part);
  for (Eigen::Index row = 0; row < weights.rows(); ++row) {
    DeterminedCombination c;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    double first = 0.0;
    double first_coefficient = 0.0;
    const double largest = weights.row(row).cwiseAbs().maxCoeff();
    for (size_t i = 0; i < involved.size(); ++i) {
      const double e = weights(row, static_cast<Eigen::Index>(i));
      if (!(std::abs(e) > kSmallWeight * largest)) {
        continue;
      }
      const int k = free[involved[i]];
      const double p = estimate[k] != 0.0 ? std::abs(estimate[k]) : entries[k].scale;
      first = first == 0.0 ? e : first;
      first_coefficient = first_coefficient == 0.0 ? e / p : first_coefficient;
      c.parameters.push_back(k);
      c.exponents.push_back(e / first);
      c.coefficients.push_back(e / p / first_coefficient);
      c.value += c.coefficients.back() * estimate[k];
      gradient[involved[i]] = c.coefficients.back();
    }
    c.standard_deviation = std::sqrt(gradient.dot(covariance * gradient));
    c.standard_deviation_robust = std::sqrt(gradient.dot(robust * gradient));
    Name(entries, &c);
    combinations.push_back(c);
  }
  return combinations;
}

}  // namespace tangible
