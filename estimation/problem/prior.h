// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Prior knowledge about a parameter, as a further residual of the fit:
//
//   Gaussian       r = (p − mean) / σ
//   log-normal     r = (ln p − ln median) / σ            p > 0; σ is that of ln p
//
// It is a row like those of the observations, and σ has the same meaning. The estimate is then the
// mode of the posterior density (of ln p for a log-normal prior), and (JᵀJ)⁻¹ its covariance there.

namespace tangible {

enum class PriorKind { kGaussian, kLogNormal };

struct Prior {
  PriorKind kind = PriorKind::kGaussian;
  double center = 0.0;  ///< mean, or median > 0; in the parameter's unit
  double sigma = 1.0;   ///< > 0; in the parameter's unit, or of ln p
};

/// r and dr/dp; p > 0 for a log-normal prior.
struct PriorResidual {
  double residual = 0.0;
  double derivative = 0.0;
};
PriorResidual EvaluatePrior(const Prior& prior, double p);

}  // namespace tangible
