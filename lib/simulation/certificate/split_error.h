// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tangible/simulation/events/event_record.h"

namespace tangible {

/// The difference that a motion gets if an event splits it in two parts, as a fraction of the
/// motion: the integrator's error, which occurs once in each part.
double SplitError(const Model<double>& model, const Segment& segment);

}  // namespace tangible
