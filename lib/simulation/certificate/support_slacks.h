// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How far the supports of a fixed step, or of a motion between events, are from holding more, or
// less: the modes of supports are choices of the step, as those of contacts are.

#include <functional>

#include "tangible/simulation/events/event_record.h"

namespace tangible {

struct SupportSlack {
  ActiveContact contact;  ///< names the support
  int support = -1;
  int point = -1;  ///< a point that slides; −1: what the support holds
  bool slides = false;
  double slack = 0.0;   ///< N s: what friction has left, or the momentum of a point that slides
  double scale = 0.0;   ///< N s: the terms of which it is a difference
  double margin = 0.0;  ///< as a share of them
};

/// Visits them in a fixed step, for each support what it holds and then the points that slide. The
/// slack of a body that is held by several points or by a disc is infinite: it is no smooth
/// function, and only its margin is known, to a factor of 2.
void ForEachSupportSlack(const Model<double>& model, const StepRecord& record,
                         const std::function<void(const SupportSlack&)>& visit);

/// What the supports of a motion between events hold at its start, with forces in the place of
/// impulses. What slides comes to rest at an event.
void ForEachHeldSupport(const Model<double>& model, const Segment& segment,
                        const std::function<void(const SupportSlack&)>& visit);

}  // namespace tangible
