// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a step costs while bodies fall, collide and come to rest, beside one of the same scene at
// rest: CPU time of each step of one thread.

#include <functional>
#include <string>
#include <vector>

#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene.h"

namespace tangible::cost {

struct MotionOptions {
  std::vector<int> discs = {10, 100};  ///< that fall into a box, by fixed steps
  std::vector<int> bouncing = {10};    ///< the same with restitution 0.5, by events
  std::vector<int> pyramids = {10};    ///< boxes at the base, by fixed steps
  int moving_steps = 500;              ///< from the start
  int settling_steps = 2000;           ///< from there to those that are settled
};

/// Times of steps, µs.
struct StepTimes {
  double mean = 0.0;
  double high = 0.0;  ///< the 99th percentile
};

/// Mean and 99th percentile (by nearest rank) of times; 0 of none.
StepTimes TimesOf(std::vector<double> times);

struct MotionRow {
  std::string scene;  ///< "100 discs that fall"
  int bodies = 0;     ///< that move
  StepTimes moving, settled;
  long events = 0;            ///< in the moving steps
  double event_time = 0.0;    ///< µs of all moving steps over `events`; 0: none
  double residual_max = 0.0;  ///< scaled
  std::string message;        ///< empty unless a step was not solved
};

MotionRow MeasureMotion(const std::string& name, const Scene& scene, const MotionOptions& options);

/// A row for each scene; `done` is called with the number of rows so far.
std::vector<MotionRow> MeasureAllMotion(const MotionOptions& options,
                                        const std::function<void(long)>& done);
int NumMotionRows(const MotionOptions& options);

std::string MotionText(const std::vector<MotionRow>& rows);
OrderedJson ToJson(const std::vector<MotionRow>& rows);

}  // namespace tangible::cost
