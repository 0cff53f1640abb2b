// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/prior.h"

#include <cmath>

namespace tangible {

PriorResidual EvaluatePrior(const Prior& prior, double p) {
  if (prior.kind == PriorKind::kGaussian) {
    return {(p - prior.center) / prior.sigma, 1.0 / prior.sigma};
  }
  return {std::log(p / prior.center) / prior.sigma, 1.0 / (p * prior.sigma)};
}

}  // namespace tangible
