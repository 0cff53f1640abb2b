// SPDX-License-Identifier: Apache-2.0
//
// The derivatives with respect to the edges of further windows at the start of a segment
// (event_edges.h): K (v̇, λ̇) = Σ load (ṡᵢ − ṡ₁), with the system K of its first stage.
#include "tangible/simulation/events/event_derivative.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/events/event_rows_inl.h"

namespace tangible {

double EventDerivative::FurtherEdgesTangent(const Model<double>& model, Segment* segment,
                                            RowMatrixXd* x) {
  if (segment->further_edges.empty()) return 0.0;
  const ModelStructure& s = *model.structure;
  SolvedNode& node = segment->stages[0];
  RowMatrixXd rhs =
      RowMatrixXd::Zero(3 * static_cast<Eigen::Index>(node.system.num_blocks()), x->cols());
  for (const WindowEdge& window : segment->further_edges) {
    const int block = s.bodies[s.forces[window.force].body].block;
    if (block < 0) continue;
    double load[3];
    EdgeLoad(model, *segment, window, load);
    BlockRows(block, rhs) += Eigen::Map<const Eigen::Vector3d>(load) *
                             (x->row(s.ParameterVariable(window.number)) -
                              x->row(s.ParameterVariable(segment->first_edge)));
  }
  const double residual = node.system.Solve(node.problem, node.solution.modes, rhs.data(),
                                            static_cast<int>(rhs.cols()));
  for (int block = 0; block < s.num_blocks(); ++block) {
    TwistRows(s, s.moving[block], *x) += BlockRows(block, rhs);
  }
  return residual;
}

void EventDerivative::FurtherEdgesAdjoint(const Model<double>& model, Segment* segment,
                                          RowMatrixXd* w_bar) {
  if (segment->further_edges.empty()) return;
  const ModelStructure& s = *model.structure;
  SolvedNode& node = segment->stages[0];
  RowMatrixXd seed =
      RowMatrixXd::Zero(3 * static_cast<Eigen::Index>(node.system.num_blocks()), w_bar->cols());
  for (int block = 0; block < s.num_blocks(); ++block) {
    BlockRows(block, seed) = TwistRows(s, s.moving[block], *w_bar);
  }
  node.system.SolveTransposed(node.problem, node.solution.modes, seed.data(),
                              static_cast<int>(seed.cols()));
  for (const WindowEdge& window : segment->further_edges) {
    const int block = s.bodies[s.forces[window.force].body].block;
    if (block < 0) continue;
    double load[3];
    EdgeLoad(model, *segment, window, load);
    const Eigen::RowVectorXd share =
        Eigen::Map<const Eigen::Vector3d>(load).transpose() * BlockRows(block, seed);
    w_bar->row(s.ParameterVariable(window.number)) += share;
    w_bar->row(s.ParameterVariable(segment->first_edge)) -= share;
  }
}

}  // namespace tangible
