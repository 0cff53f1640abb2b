// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A fit with what is estimated beside its parameters: the standard deviation of sensors' noise
// (sensor_noise.h) and the spread of parameters that vary from recording to recording
// (random_effects.h). Each has an equation at the estimate of a fit with given values; fits and
// equations alternate until no value changes any more.

#include <functional>
#include <vector>

#include "tangible/estimation/fit/random_effects.h"
#include "tangible/estimation/fit/sensor_noise.h"

namespace tangible {

struct VarianceComponents {
  std::vector<SensorNoise> noise;
  std::vector<SpreadEstimate> spreads;  ///< of all parameters that vary, as in effects()

  bool empty() const { return noise.empty() && spreads.empty(); }
};

/// The log of the next fit, or null.
using NextLog = std::function<FitLog*()>;

/// The fit of recordings with the components that ask to be estimated; one fit where none does. The
/// observations and effects of `problem` have what was found when it ends. Costs are in multiples
/// of the sigma of the time, and iterations those of all fits. Where a fit does not converge, or
/// the components do not settle (20 fits), the status says so, and no estimated spread has an
/// interval; a warning says why one has none.
FitResult FitWithComponents(const FitOptions& options, RecordingsProblem* problem,
                            const FitProgress& progress, VarianceComponents* components,
                            const NextLog& next_log = {});

}  // namespace tangible
