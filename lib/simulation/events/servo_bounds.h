// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The bounds of servos as events: a servo with a limit L is held at its bound while |u| > L
// (dynamics/elements/servo.h). The effort is the same on both sides of the event, so that twists
// and accelerations do not jump there.

#include "tangible/simulation/events/segment_flow.h"

namespace tangible {

/// What is left of the limit of servo k, L − sign u, N or N m, with the sum of the magnitudes of
/// its terms.
struct BoundReserve {
  double value = 0.0;
  double terms = 0.0;
};
BoundReserve ReserveOf(const Model<double>& model, const State<double>& state, int servo,
                       double sign, double time, double middle);

/// The rate of this reserve where the moving bodies have given accelerations (three for each).
double ReserveRate(const Model<double>& model, const State<double>& state, int servo, double sign,
                   double time, double middle, const std::vector<double>& accelerations);

/// Sets the modes of the servos over a motion whose contacts and their modes are chosen: those at
/// its start; of a servo on its bound, that into which it goes.
void HoldServos(const Model<double>& model, SegmentFlow* flow, Segment* segment);

/// The contact by which the event of a servo is named and counted.
ActiveContact ContactOfServo(const ModelStructure& structure, int servo);

}  // namespace tangible
