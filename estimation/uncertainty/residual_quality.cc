// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/residual_quality.h"

#include <limits>

#include "tangible/estimation/uncertainty/tolerances.h"

namespace tangible {
ResidualQuality JudgeResiduals(const LeastSquaresProblem& problem,
                               const std::vector<BlockEvaluation>& blocks, int num_free) {
  ResidualQuality quality;
  std::vector<ResidualPlace> places;
  std::vector<double> values;
  double squares = 0.0;  // of random forces
  for (size_t b = 0; b < blocks.size(); ++b) {
    const int block = static_cast<int>(b);
    const std::vector<RowPlace> rows = problem.Places(block);
    const int observed = problem.num_observation_rows(block);
    const int forces = problem.num_noise_rows(block);
    squares += blocks[b].residuals.segment(observed, forces).squaredNorm();
    quality.has_forces = quality.has_forces || forces > 0;
    for (int i = 0; i < observed; ++i) {
      values.push_back(blocks[b].residuals[i]);
      if (i < static_cast<int>(rows.size())) {
        places.push_back({block, rows[i].series, rows[i].time, rows[i].least});
      }
    }
  }
  const Eigen::Map<const Eigen::VectorXd> data(values.data(),
                                               static_cast<Eigen::Index>(values.size()));
  const double count = static_cast<double>(data.size());
  const double freedom = count - static_cast<double>(num_free);
  quality.residual_rms = std::sqrt(data.squaredNorm() / count);
  quality.reduced_chi_square = freedom > 0.0 ? (data.squaredNorm() + squares) / freedom
                                             : std::numeric_limits<double>::quiet_NaN();
  quality.too_large =
      quality.reduced_chi_square > 1.0 + kChiSquareDeviations * std::sqrt(2.0 / freedom);
  // Smoothed residuals are correlated where the model is right.
  if (places.size() == values.size() && !quality.has_forces) {
    quality.whiteness = TestWhiteness(data, places);
    quality.correlated = quality.whiteness.p_value < kWhitenessProbability &&
                         std::abs(quality.whiteness.correlation) > kWhitenessCorrelation;
  }
  return quality;
}

}  // namespace tangible
