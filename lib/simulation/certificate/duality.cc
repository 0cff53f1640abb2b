// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/duality.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/derivatives/rollout_adjoint.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"

namespace tangible {

double DualityGap(const Model<double>& model, const State<double>& initial,
                  const RowMatrixXd& directions) {
  if (directions.cols() == 0) {
    return 0.0;
  }
  RowMatrixXd w_dot = directions;
  State<double> final;
  if (RolloutTangent(model, initial, {}, &w_dot, &final).status != StepStatus::kDone) {
    return HUGE_VAL;
  }
  const Eigen::Index outputs = static_cast<Eigen::Index>(2 * initial.pose.size());
  // Entries differ by orders of magnitude, and a sum would show the largest alone.
  VectorX<double> weights(outputs);
  for (Eigen::Index i = 0; i < outputs; ++i) {
    const double size = w_dot.row(i).cwiseAbs().maxCoeff();
    weights[i] = size > 0.0 ? (i % 2 == 0 ? 1.0 : -1.0) / size : 0.0;
  }
  RolloutTape tape;
  tape.Record(model, initial, Factorisations::kKeep, {}, &final);
  const long last = tape.steps();
  RowMatrixXd w_bar;
  tape.Adjoint(
      model, 1,
      [&](long k, RowMatrixXd* w) {
        if (k == last) {
          w->topRows(outputs).col(0) += weights;
        }
      },
      &w_bar);
  double worst = 0.0;
  for (Eigen::Index c = 0; c < directions.cols(); ++c) {
    const double by_tangent = weights.dot(w_dot.col(c).head(outputs));
    const double by_adjoint = w_bar.col(0).dot(directions.col(c));
    const double terms = std::max(weights.cwiseAbs().dot(w_dot.col(c).head(outputs).cwiseAbs()),
                                  w_bar.col(0).cwiseAbs().dot(directions.col(c).cwiseAbs()));
    const double gap = std::abs(by_tangent - by_adjoint);
    if (gap > 0.0) {
      worst = std::max(worst, std::isfinite(terms) ? gap / terms : HUGE_VAL);
    }
  }
  return std::isfinite(worst) ? worst : HUGE_VAL;
}

bool HasWideMasses(const Model<double>& model) {
  constexpr double kWide = 999.0;
  const ModelStructure& s = *model.structure;
  double least[2] = {HUGE_VAL, HUGE_VAL};
  double most[2] = {0.0, 0.0};
  for (const int body : s.moving) {
    const double of_body[2] = {model.numbers[s.bodies[body].mass],
                               model.numbers[s.bodies[body].inertia]};
    for (int k = 0; k < 2; ++k) {
      least[k] = std::min(least[k], of_body[k]);
      most[k] = std::max(most[k], of_body[k]);
    }
  }
  return most[0] > kWide * least[0] || most[1] > kWide * kWide * least[1];
}

}  // namespace tangible
