// SPDX-License-Identifier: Apache-2.0
//
// Jacobians of the residuals by Jets, in passes of the Jets' width.
#include <algorithm>

#include "tangible/estimation/problem/residual_events.h"
#include "tangible/simulation/gradient/jet_passes.h"

namespace tangible {

template <int N>
bool RolloutResiduals::JetPass(int first, JetRoute route, RowMatrixXd* sample_derivatives) {
  Model<Jet<N>> model;
  State<Jet<N>> initial;
  State<Jet<N>> final;
  scene_.SeededModel(first, &model, &initial);
  event_times_.Start();
  State<Jet<N>> last;  // the state before, where forces read it
  const auto dot_of = [&](const State<Jet<N>>& state) {
    return [&state, &model](int variable) -> Eigen::RowVectorXd {
      const auto index = static_cast<size_t>(variable);
      const size_t num_poses = state.pose.size();
      const Jet<N>& number = index < num_poses       ? state.pose[index]
                             : index < 2 * num_poses ? state.twist[index - num_poses]
                                                     : model.parameters[index - 2 * num_poses];
      return number.v.transpose();
    };
  };
  const Eigen::Index used = std::min<Eigen::Index>(N, sample_derivatives->cols() - first);
  const JetObserver<Jet<N>> observer = [&](long k, double, const State<Jet<N>>& state,
                                           Stepper* stepper) {
    plan_.numbers().AddJets(k, state, first, sample_derivatives);
    event_times_.Add(k, stepper);
    AddForces(k, stepper);
    forces_.ForEachDot(
        k, N, dot_of(last), dot_of(state), [&](int row, const Eigen::RowVectorXd& dot) {
          sample_derivatives->row(ForceRow(row)).segment(first, used) = dot.head(used);
        });
    if (!forces_.ReadAt(k + 1).empty()) last = state;
  };
  long fallbacks = 0;
  if (!Accept(RolloutJets(model, initial, route, observer, &final, &fallbacks))) return false;
  FinishEvents(ValuesOf(final));
  FinishEventDerivatives(first, N, dot_of(final), sample_derivatives);
  return true;
}

bool RolloutResiduals::Jets([[maybe_unused]] JetRoute route, RowMatrixXd* jacobian) {
  const int width = JetWidthFor(num_parameters());
  if (width == 0) {
    message_ = "built without Jets: use tangent, adjoint or finite_difference";
    return false;
  }
  RowMatrixXd sample_derivatives = RowMatrixXd::Zero(num_sample_rows(), num_parameters());
  const bool done = ForEachJetPass(width, num_parameters(), [&](auto built, Eigen::Index first) {
    return JetPass<built.value>(static_cast<int>(first), route, &sample_derivatives);
  });
  if (!done) return false;
  *jacobian = FromSampleDerivatives(samples_, rates_, sample_derivatives,
                                    Eigen::VectorXd::Ones(num_parameters()));
  return true;
}

}  // namespace tangible
