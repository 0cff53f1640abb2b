// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/combinations.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

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

void Name(const std::vector<ParameterEntry>& entries, DeterminedCombination* c) {
  bool positive = true;
  for (size_t i = 0; i < c->parameters.size(); ++i) {
    const ParameterEntry& entry = entries[c->parameters[i]];
    positive = positive && entry.logarithmic;
    const double weight = c->coefficients[i];
    c->sum += i == 0 ? "" : weight < 0.0 ? " - " : " + ";
    c->sum += (i == 0 ? "" : CompactNumber(std::abs(weight), 4) + " ") + "'" + entry.name + "'";
    const double exponent = c->exponents[i];
    c->product += std::string(i == 0 ? "" : " * ") + "'" + entry.name + "'" +
                  (std::abs(exponent - 1.0) < kSmallShare ? "" : "^" + CompactNumber(exponent, 4));
  }
  if (!positive) {
    c->product.clear();
  }
}

}  // namespace

std::vector<DeterminedCombination> FindDeterminedCombinations(
    const std::vector<ParameterEntry>& entries, const Eigen::VectorXd& estimate,
    const Eigen::MatrixXd& none, const RowMatrixXd& covariance, const RowMatrixXd& robust) {
  std::vector<DeterminedCombination> combinations;
  std::vector<int> involved;
  for (Eigen::Index k = 0; k < none.rows() && none.cols() > 0; ++k) {
    if (none.row(k).cwiseAbs().maxCoeff() >= kSmallShare) {
      involved.push_back(static_cast<int>(k));
    }
  }
  if (involved.empty()) {
    return combinations;
  }
  const Eigen::MatrixXd weights = LeftNullSpace(none(involved, Eigen::all));
  for (Eigen::Index row = 0; row < weights.rows(); ++row) {
    DeterminedCombination c;
    double first = 0.0;
    double first_coefficient = 0.0;
    const double largest = weights.row(row).cwiseAbs().maxCoeff();
    for (size_t i = 0; i < involved.size(); ++i) {
      const double e = weights(row, static_cast<Eigen::Index>(i));
      if (!(std::abs(e) > kSmallWeight * largest)) {
        continue;
      }
      const int k = involved[i];
      const double p = estimate[k] != 0.0 ? std::abs(estimate[k]) : entries[k].scale;
      first = first == 0.0 ? e : first;
      first_coefficient = first_coefficient == 0.0 ? e / p : first_coefficient;
      c.parameters.push_back(k);
      c.exponents.push_back(e / first);
      c.coefficients.push_back(e / p / first_coefficient);
      c.value += c.coefficients.back() * estimate[k];
    }
    const Eigen::Map<const Eigen::VectorXd> gradient(
        c.coefficients.data(), static_cast<Eigen::Index>(c.coefficients.size()));
    c.standard_deviation =
        std::sqrt(gradient.dot(covariance(c.parameters, c.parameters) * gradient));
    c.standard_deviation_robust =
        std::sqrt(gradient.dot(robust(c.parameters, c.parameters) * gradient));
    Name(entries, &c);
    combinations.push_back(c);
  }
  return combinations;
}

}  // namespace tangible
