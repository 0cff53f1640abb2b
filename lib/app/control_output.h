// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tables and the page of what control_run.h has made.

#include <string>

#include "tangible/app/control_run.h"

namespace tangible {

/// The controls, a row a step, as the key `initial` of a problem reads them.
std::string PlanCsv(const ControlFile& file, const ControlRun& run);

/// The motion as a table, and as an animated page with the controls and, of a plan, its verdict.
struct DrawnMotion {
  std::string trajectory, page;
};
/// Empty, or why the motion cannot be drawn, one line.
std::string DrawMotion(const ControlFile& file, const ControlRun& run, DrawnMotion* drawn);

}  // namespace tangible
