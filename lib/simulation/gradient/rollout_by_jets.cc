// SPDX-License-Identifier: Apache-2.0
//
// Jets, in passes of the widest that is built.
#include <algorithm>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

namespace {

constexpr int WidestJet() {
  int widest = 0;
#define TANGIBLE_WIDER(N) widest = N > widest ? N : widest;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_WIDER)
#undef TANGIBLE_WIDER
  return widest;
}

}  // namespace

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
  const int poses = static_cast<int>(state.pose.size());
  for (int i = 0; i < f_.num_states(); ++i) {
    const int variable = f_.outputs_[i];
    Jet<N>& value = variable < poses ? state.pose[variable] : state.twist[variable - poses];
    if (own_state_) {
      value = Jet<N>(variable < poses ? initial_.pose[variable] : initial_.twist[variable - poses]);
    }
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
  size_t next = 0;
  const JetObserver<Jet<N>> keep = [&](long k, double, const State<Jet<N>>& now) {
    if (next == f_.records_.size() || f_.records_[next] != k) return;
    for (int i = 0; i < f_.num_states(); ++i) {
      const int variable = f_.outputs_[i];
      const Jet<N>& x = variable < poses ? now.pose[variable] : now.twist[variable - poses];
      output->states(static_cast<Eigen::Index>(next), i) = x.a;
      for (int d = 0; d < N && first + d < jacobian->cols(); ++d) {
        (*jacobian)(static_cast<Eigen::Index>(next) * f_.num_states() + i, first + d) = x.v[d];
      }
    }
    ++next;
  };
  long fallbacks = 0;
  State<Jet<N>> final;
  output->SetReport(RolloutJets<Jet<N>>(f_.num_controls() == 0 ? &plain : &controlled, state, route,
                                        keep, &final, &fallbacks));
  output->fallbacks += fallbacks;
  output->final = ValuesOf(final);
  return output->status == RolloutStatus::kDone;
}

void RolloutWorker::JacobianByJets(JetRoute route, RowMatrixXd* jacobian, RolloutOutput* output) {
  constexpr int kWidth = WidestJet();
  if constexpr (kWidth == 0) {
    output->status = RolloutStatus::kRefused;
    output->message =
        "methods jet and jet_implicit: no width of Jets was built (TANGIBLE_JET_WIDTHS is empty)";
  } else {
    bool good = true;
    // Without columns one pass gives the states.
    for (Eigen::Index first = 0; good && (first == 0 || first < jacobian->cols());
         first += kWidth) {
      good = JetPass<kWidth>(route, first, jacobian, output);
    }
  }
}

}  // namespace tangible
