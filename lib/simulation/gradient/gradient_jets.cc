// SPDX-License-Identifier: Apache-2.0
//
// Jacobians by Jets, in passes of the widest width that is built.
#include "tangible/simulation/gradient/gradient_methods.h"

namespace tangible::internal {
namespace {

constexpr int WidestJet() {
  int widest = 0;
#define TANGIBLE_WIDER(N) widest = N > widest ? N : widest;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_WIDER)
#undef TANGIBLE_WIDER
  return widest;
}

template <int N>
bool RunPasses(const GradientProblem& problem, JetRoute route, GradientResult* result) {
  if constexpr (N == 0) {
    result->message =
        "methods jet and jet_implicit: no width of Jets was built (TANGIBLE_JET_WIDTHS is empty)";
    return false;
  } else {
    const int num_parameters = static_cast<int>(problem.directions.size());
    result->jacobian.setZero(static_cast<Eigen::Index>(problem.output_variables.size()),
                             num_parameters);
    for (int first = 0; first == 0 || first < num_parameters; first += N) {
      Model<Jet<N>> model;
      State<Jet<N>> state;
      BuildModelWithStructure(SeededScene<Jet<N>>(problem.scene, problem.directions, first),
                              problem.structure, &model, &state);
      long fallbacks = 0;
      State<Jet<N>> final;
      const RolloutReport report = RolloutJets<Jet<N>>(model, state, route, {}, &final, &fallbacks);
      result->message = FailureOf(problem, report);
      if (!result->message.empty()) {
        return false;
      }
      result->fallbacks += fallbacks;
      result->values = problem.Outputs(ValuesOf(final));
      const int poses = 3 * problem.structure->num_bodies();
      for (size_t i = 0; i < problem.output_variables.size(); ++i) {
        const int variable = problem.output_variables[i];
        const Jet<N>& output =
            variable < poses ? final.pose[variable] : final.twist[variable - poses];
        for (int k = 0; k < N && first + k < num_parameters; ++k) {
          result->jacobian(static_cast<Eigen::Index>(i), first + k) = output.v[k];
        }
      }
    }
    if (result->fallbacks > 0) {
      result->notes.push_back(
          std::to_string(result->fallbacks) +
          " steps by the implicit derivative: the unrolled interior point failed");
    }
    return true;
  }
}

}  // namespace

bool JacobianByJets(const GradientProblem& problem, JetRoute route, GradientResult* result) {
  return RunPasses<WidestJet()>(problem, route, result);
}

}  // namespace tangible::internal
