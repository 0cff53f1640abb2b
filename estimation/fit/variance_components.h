// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A fit that also estimates variances: the standard deviation of sensors' noise (sensor_noise.h),
// the spread of parameters that vary from recording to recording (random_effects.h) and the
// intensity of random forces (noise_intensity.h), which are integrated out (noise_slope.h). Each
// has an equation at the estimate of a fit with given values; fits and equations alternate until no
// value changes any more.

#include <functional>
#include <vector>

#include "tangible/estimation/fit/noise_intensity.h"
#include "tangible/estimation/fit/random_effects.h"
#include "tangible/estimation/fit/sensor_noise.h"

namespace tangible {

struct VarianceComponents {
  std::vector<SensorNoise> noise;
  std::vector<SpreadEstimate> spreads;  ///< of all parameters that vary, as in effects()

  std::vector<NoiseIntensity> forces;  ///< random ones, all of them
  std::vector<SmoothedRun> smoothed;   ///< of each recording, where there are random forces
  std::vector<std::string> rough;      ///< parameters of UpdateSlopes

  bool empty() const { return noise.empty() && spreads.empty() && forces.empty(); }
};

/// The log of the next fit, or null.
using NextLog = std::function<FitLog*()>;

/// The options of a fit with random forces: what assumes a run without them is left out.
FitOptions OptionsFor(FitOptions options, const RecordingsProblem& problem);

/// Fits recordings and estimates the components for which this is requested; it is a single fit
/// where none is. At the end the observations and effects of `problem` have the estimated values.
/// Costs are in multiples of the sigma of their fit, and iterations are those of all fits. If a fit
/// does not converge, or the components still change after 20 fits, the status says so, no
/// estimated spread has an interval, and a warning gives the reason.
FitResult FitWithComponents(const FitOptions& options, RecordingsProblem* problem,
                            const FitProgress& progress, VarianceComponents* components,
                            const NextLog& next_log = {});

}  // namespace tangible
