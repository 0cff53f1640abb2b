// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/solve_derivative.h"

#include <algorithm>

namespace tangible {

void SolveDerivative::Clear(const ContactSystem& system, Eigen::Index columns) {
  columns_ = columns;
  rates_.assign(3 * static_cast<size_t>(system.num_blocks()) * static_cast<size_t>(columns), 0.0);
}

void SolveDerivative::Assemble(const Model<double>& model, const StepRecord& record,
                               const ContactSystem& system, const std::vector<char>& fixed,
                               const RowMatrixXd& w_dot) {
  const int columns = static_cast<int>(w_dot.cols());
  Clear(system, columns);
  VisitJacobian(
      model, record.View(system.contact_block()), JacobianRoute::kByHand, &scratch_,
      TangentSink{w_dot.data(), rates_.data(), columns, fixed.empty() ? nullptr : fixed.data()});
}

double SolveDerivative::Solve(const StepRecord& record, ContactSystem* system) {
  return system->Solve(record.problem, record.solution.modes, rates_.data(),
                       static_cast<int>(columns_));
}

void SolveDerivative::SpreadRates(const ModelStructure& s, RowMatrixXd* w_dot) const {
  for (int k = 0; k < s.num_blocks(); ++k) {
    std::copy_n(rates_.data() + 3 * k * columns_, 3 * columns_,
                w_dot->data() + s.TwistVariable(s.moving[k], 0) * columns_);
  }
}

void SolveDerivative::GatherRates(const ModelStructure& s, const ContactSystem& system,
                                  RowMatrixXd* w_bar) {
  Clear(system, w_bar->cols());
  for (int k = 0; k < s.num_blocks(); ++k) {
    double* twist = w_bar->data() + s.TwistVariable(s.moving[k], 0) * columns_;
    std::copy_n(twist, 3 * columns_, rates_.data() + 3 * k * columns_);
    std::fill_n(twist, 3 * columns_, 0.0);
  }
}

void SolveDerivative::Apply(const Model<double>& model, const StepRecord& record,
                            ContactSystem* system, RowMatrixXd* w_bar) {
  const int columns = static_cast<int>(w_bar->cols());
  system->SolveTransposed(record.problem, record.solution.modes, rates_.data(), columns);
  const SolvedEquations solved = record.View(system->contact_block());
  if (columns == 1) {
    VisitJacobian(model, solved, JacobianRoute::kByHand, &scratch_,
                  SingleAdjointSink{rates_.data(), w_bar->data()});
  } else {
    VisitJacobian(model, solved, JacobianRoute::kByHand, &scratch_,
                  AdjointSink{rates_.data(), w_bar->data(), columns});
  }
}

}  // namespace tangible
