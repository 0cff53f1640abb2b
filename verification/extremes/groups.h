// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The groups of cases; the function of each group appends its cases.

#include <vector>

#include "tangible/verification/extremes/extreme_case.h"

namespace tangible::extremes {

void AddMassRatios(std::vector<ExtremeCase>* cases);   ///< mass_ratios.cc
void AddResting(std::vector<ExtremeCase>* cases);      ///< resting.cc
void AddScales(std::vector<ExtremeCase>* cases);       ///< scales.cc: dt, lengths, gravity
void AddSpeeds(std::vector<ExtremeCase>* cases);       ///< speeds.cc: thin walls
void AddGeometry(std::vector<ExtremeCase>* cases);     ///< geometry.cc: overlaps, slivers
void AddFriction(std::vector<ExtremeCase>* cases);     ///< friction.cc
void AddRestitution(std::vector<ExtremeCase>* cases);  ///< restitution.cc
void AddParadoxes(std::vector<ExtremeCase>* cases);    ///< paradoxes.cc: Painlevé, wedges
void AddJoints(std::vector<ExtremeCase>* cases);       ///< joints.cc: loops, redundancy, limits
void AddLongRuns(std::vector<ExtremeCase>* cases);     ///< long_runs.cc: spin, flight
void AddOptimiser(std::vector<ExtremeCase>* cases);    ///< optimiser.cc: what an optimiser tries

}  // namespace tangible::extremes
