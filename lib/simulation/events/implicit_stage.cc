// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/implicit_stage.h"

namespace tangible {

void ImplicitStage::Factor(const Model<double>& model, const Segment& segment, SolvedNode* node,
                           double a_tau, double a_hat_tau2) {
  const ModelStructure& s = *model.structure;
  const int size = 3 * s.num_blocks();
  place_.setZero(s.num_variables() + 1, size);
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      place_(s.PoseVariable(s.moving[k], i), 3 * k + i) = a_hat_tau2;
      place_(s.TwistVariable(s.moving[k], i), 3 * k + i) = a_tau;
    }
  }
  solved_.setZero(3 * static_cast<Eigen::Index>(node->system.num_blocks()), size);
  VisitJacobian(model, ViewOf(segment, *node, false), JacobianRoute::kByHand, &scratch_,
                TangentSink{place_.data(), solved_.data(), size});
  node->system.Solve(node->problem, node->solution.modes, solved_.data(), size);
  lu_.compute(Eigen::MatrixXd::Identity(size, size) - solved_.topRows(size));
}

void ImplicitStage::Solve(RowMatrixXd* x) const {
  const Eigen::MatrixXd solved = lu_.solve(Eigen::MatrixXd(*x));
  *x = solved;
}

void ImplicitStage::SolveTransposed(RowMatrixXd* x) const {
  const Eigen::MatrixXd solved = lu_.transpose().solve(Eigen::MatrixXd(*x));
  *x = solved;
}

}  // namespace tangible
