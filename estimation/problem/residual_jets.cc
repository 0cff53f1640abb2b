// SPDX-License-Identifier: Apache-2.0
//
// Jacobians of the residuals by Jets, in passes of the Jets' width.
#include <algorithm>

#include "tangible/estimation/problem/residual.h"

namespace tangible {
namespace {

/// The widths of this build.
std::vector<int> Widths() {
  return {
#define TANGIBLE_LIST_WIDTH(N) N,
      TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_LIST_WIDTH)
#undef TANGIBLE_LIST_WIDTH
  };
}

/// The smallest width that takes all parameters in one pass, else the largest; 0 without Jets.
int ChooseWidth(int num_parameters) {
  int best = 0;
  for (const int width : Widths()) {
    const bool enough = width >= num_parameters;
    const bool best_enough = best >= num_parameters;
    if (best == 0 || (enough && (!best_enough || width < best)) ||
        (!enough && !best_enough && width > best)) {
      best = width;
    }
  }
  return best;
}

}  // namespace

template <typename T>
bool RolloutResiduals::JetPass(int first, JetRoute route, RowMatrixXd* sample_derivatives) {
  Model<T> model;
  State<T> initial;
  State<T> final;
  scene_.SeededModel(first, &model, &initial);
  const int count = std::min(NumDerivatives<T>::value, num_parameters() - first);
  const JetObserver<T> observer = [&](long k, double, const State<T>& state) {
    for (const SampleShare& share : plan_.SharesAt(k)) {
      const int body = plan_.samples()[share.sample].body;
      for (int i = 0; i < plan_.width(); ++i) {
        const T& number = i < 3 ? state.pose[3 * body + i] : state.twist[3 * body + i - 3];
        sample_derivatives->row(plan_.width() * share.sample + i).segment(first, count) +=
            share.weight * number.v.head(count).transpose();
      }
    }
  };
  long fallbacks = 0;
  return Accept(RolloutJets(model, initial, route, observer, &final, &fallbacks));
}

bool RolloutResiduals::Jets([[maybe_unused]] JetRoute route, RowMatrixXd* jacobian) {
  const int width = ChooseWidth(num_parameters());
  if (width == 0) {
    message_ = "built without Jets: use tangent, adjoint or finite_difference";
    return false;
  }
  RowMatrixXd sample_derivatives = RowMatrixXd::Zero(
      plan_.width() * static_cast<Eigen::Index>(plan_.num_samples()), num_parameters());
  for (int first = 0; first < num_parameters(); first += width) {
    bool done = false;
#define TANGIBLE_PASS_IF_WIDTH(N) \
  if (width == (N)) done = JetPass<Jet<N>>(first, route, &sample_derivatives);
    TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_PASS_IF_WIDTH)
#undef TANGIBLE_PASS_IF_WIDTH
    if (!done) {
      return false;
    }
  }
  *jacobian = FromSampleDerivatives(samples_, rates_, sample_derivatives,
                                    Eigen::VectorXd::Ones(num_parameters()));
  return true;
}

}  // namespace tangible
