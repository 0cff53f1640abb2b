// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Tangent and adjoint of a solve for new twists: a fixed step's, an impact's, or a projection's.
//
//   K ẋ = −(∂R/∂w) ẇ,   Kᵀ u = x̄,  w̄ −= (∂R/∂w)ᵀ u      (equation_jacobian.h)
//
// with the factorisation that the solve ended with. Between the two halves of each the caller may
// read or change what is solved for: rates().

#include <algorithm>
#include <functional>
#include <vector>

#include "tangible/math/scalar.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

class SolveDerivative {
 public:
  /// Sets rates() to −(∂R/∂w) ẇ. `fixed`: 1 for a variable that no column varies; may be empty.
  void Assemble(const Model<double>& model, const StepRecord& record, const ContactSystem& system,
                const std::vector<char>& fixed, const RowMatrixXd& w_dot);
  /// K⁻¹ of them. Returns the largest relative residual.
  double Solve(const StepRecord& record, ContactSystem* system);
  /// Sets the rows of moving bodies' twists to the rates.
  void SpreadRates(const ModelStructure& structure, RowMatrixXd* w_dot) const;

  /// Moves the rows of moving bodies' twists to rates(), which are 0 elsewhere.
  void GatherRates(const ModelStructure& structure, const ContactSystem& system,
                   RowMatrixXd* w_bar);
  /// Replaces rates() by u and adds its share to w̄.
  void Apply(const Model<double>& model, const StepRecord& record, ContactSystem* system,
             RowMatrixXd* w_bar);

  /// Three rows a block of the system, a column for each of the directions or losses.
  using Rates = Eigen::Map<RowMatrixXd>;
  Rates rates() {
    const auto all = static_cast<Eigen::Index>(rates_.size());
    return Rates(rates_.data(), all / std::max<Eigen::Index>(1, columns_), columns_);
  }

 private:
  void Clear(const ContactSystem& system, Eigen::Index columns);

  std::vector<double> rates_;  ///< keeps its memory as contacts come and go
  Eigen::Index columns_ = 1;
  LocalJacobianScratch scratch_;
};

/// Called with the right-hand sides of the tangent of a fixed step, an impact or a projection, and
/// then with their solution: 3 rows a block of the system, a column for each direction, and by
/// events one more.
enum class SolveStage { kAssembled, kSolved };
using SolveObserver =
    std::function<void(SolveStage stage, const ContactProblem<double>& problem,
                       const ContactSystem& system, const SolveDerivative::Rates& rates)>;

}  // namespace tangible
