// SPDX-License-Identifier: Apache-2.0
//
// Jets, in passes of their width.
#include <algorithm>
#include <limits>

#include "tangible/dynamics/model/state_variable.h"
#include "tangible/simulation/gradient/jet_passes.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

template <int N>
bool RolloutWorker::JetPass(JetRoute route, Eigen::Index first, RowMatrixXd* jacobian,
                            RolloutOutput* output) {
  Model<Jet<N>> model;
  State<Jet<N>> state;
  BuildModelWithStructure(
      SeededScene<Jet<N>>(scene_, f_.directions_,
                          static_cast<int>(std::min<Eigen::Index>(first, f_.num_parameters()))),
      f_.structure_, &model, &state);
  // The columns after the parameters are initial states, and then controls.
  const auto seed = [&](Eigen::Index column, Jet<N>* value) {
    if (column >= first && column < first + N) value->v[column - first] += 1.0;
  };
  for (int i = 0; i < f_.num_states(); ++i) {
    Jet<N>& value = StateNumber(&state, f_.outputs_[i]);
    if (own_state_) value = Jet<N>(StateNumber(initial_, f_.outputs_[i]));
    seed(f_.num_parameters() + i, &value);
  }
  BasicControls<Jet<N>> controls{controls_.numbers, controls_.values.template cast<Jet<N>>()};
  for (Eigen::Index k = 0; k < controls.values.rows(); ++k) {
    for (size_t j = 0; j < controls.numbers.size(); ++j) {
      seed(f_.num_parameters() + f_.num_states() + k * f_.num_controls() + f_.control_of_number_[j],
           &controls.values(k, static_cast<Eigen::Index>(j)));
    }
  }
  ControlledModel<Jet<N>> plain(model);
  ControlledModel<Jet<N>> controlled(model, controls);
  StartRows(&output->states);
  const JetObserver<Jet<N>> keep = [&](long k, double, const State<Jet<N>>& now, Stepper*) {
    f_.samples_.Add(k, now, output->states.data());
    f_.samples_.AddJets(k, now, first, jacobian);
  };
  long fallbacks = 0;
  State<Jet<N>> final;
  output->SetReport(RolloutJets<Jet<N>>(f_.num_controls() == 0 ? &plain : &controlled, state, route,
                                        keep, &final, &fallbacks));
  output->fallbacks += fallbacks;
  output->final = ValuesOf(final);
  FinishRows(output->report, &output->states);
  return output->status == RolloutStatus::kDone;
}

void RolloutWorker::JacobianByJets(JetRoute route, RowMatrixXd* jacobian, RolloutOutput* output) {
  // The widest, for all numbers of columns: what is solved for several at once has other rounding.
  const int width = JetWidthFor(std::numeric_limits<Eigen::Index>::max());
  if (width == 0) {
    output->status = RolloutStatus::kRefused;
    output->message =
        "methods jet and jet_implicit: no width of Jets was built (TANGIBLE_JET_WIDTHS is empty)";
    return;
  }
  StartRows(jacobian);
  ForEachJetPass(width, jacobian->cols(), [&](auto widest, Eigen::Index first) {
    return JetPass<widest.value>(route, first, jacobian, output);
  });
  FinishRows(output->report, jacobian);
}

}  // namespace tangible
