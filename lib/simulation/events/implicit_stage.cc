// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/implicit_stage.h"

#include <cmath>

#include "tangible/simulation/events/segment_flow.h"

namespace tangible {

double ImplicitStage::SolveDerivative(const Model<double>& model, Segment* segment,
                                      Direction direction, const Map& map, RowMatrixXd* x) {
  double last = HUGE_VAL, share = 0.0;
  int evaluations = 0;
  const auto evaluate = [&](const RowMatrixXd& at, RowMatrixXd* next) {
    map(at, next);
    return true;
  };
  const auto arrived = [&](const RowMatrixXd& next, const RowMatrixXd& at, int) {
    const double change = (next - at).cwiseAbs().maxCoeff();
    const double size = next.cwiseAbs().maxCoeff();
    const bool falls = change < last;
    last = change;
    share = change / size;
    ++evaluations;
    return change <= kStageDerivative * size ||
           (!falls && change <= kStageDerivativeRounding * size) ||
           (evaluations > kMostFixedPoints + 1 && change <= kStageDerivativeLate * size) ||
           (evaluations > kMostFixedPoints + 2 && !falls);
  };
  const auto newton = [&](const RowMatrixXd& next, int iteration, RowMatrixXd* at) {
    if (iteration == kMostFixedPoints) {
      Factor(model, segment);
    }
    RowMatrixXd step = next - *at;
    Solve(direction, &step);
    *at += step;
  };
  return IterateStage(evaluate, arrived, newton, x) == StageOutcome::kSolved ? 0.0 : share;
}

void ImplicitStage::Factor(const Model<double>& model, Segment* segment) {
  const ModelStructure& s = *model.structure;
  const NystromTableau& tableau = NystromTableau::Of(IntegratorOf(s.settings));
  const int last = tableau.stages - 1;
  const double tau = segment->length;
  SolvedNode* node = &segment->stages[last];
  const int size = 3 * s.num_blocks();
  place_.setZero(s.num_variables() + 1, size);
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      place_(s.PoseVariable(s.moving[k], i), 3 * k + i) = tau * tau * tableau.a_hat[last][last];
      place_(s.TwistVariable(s.moving[k], i), 3 * k + i) = tau * tableau.a[last][last];
    }
  }
  solved_.setZero(3 * static_cast<Eigen::Index>(node->system.num_blocks()), size);
  VisitJacobian(model, ViewOf(*segment, *node, false), JacobianRoute::kByHand, &scratch_,
                TangentSink{place_.data(), solved_.data(), size});
  node->system.Solve(node->problem, node->solution.modes, solved_.data(), size);
  lu_.Compute(Eigen::MatrixXd::Identity(size, size) - solved_.topRows(size));
}

void ImplicitStage::Solve(Direction direction, RowMatrixXd* x) const {
  if (direction == Direction::kForward) {
    lu_.SolveInPlace(x);
  } else {
    lu_.SolveTransposedInPlace(x);
  }
}

}  // namespace tangible
