// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How near the motion of an event step is to a grazing touch: a gap that turns around just above 0,
// or that closes at hardly any speed; of shapes, and of joints and their limits. On the other side
// of the kink the derivative is of order 1 / √distance. The same of a slip whose speed hardly
// reaches 0, or hardly does not.

#include <vector>

#include "tangible/simulation/events/event_record.h"
#include "tangible/simulation/events/event_search.h"

namespace tangible {

/// A contact of shapes, or a joint and its limit, that nearly graze each other.
struct Graze {
  double margin = 0.0;  ///< relative, like other margins: the change of data that is needed
  double time = 0.0;    ///< s
  ActiveContact contact;
  bool touches = false;
  /// The height of a miss, or the depth to which bodies that touch would go without the contact, m;
  /// infinite where they would not turn around.
  double slack = 0.0;
  bool is_slip = false;  ///< of a slip's speed, m/s for m
};

/// A touch at the end of a segment with ġ1 < 0, after ġ0 at its start: margin (ġ1 / v)², because
/// depth grows with the square of speed, v = max(|ġ0| + |ġ1|, |a| dt) with the relative
/// acceleration a (only where the contact approaches from above, because the rebounds of a body
/// that comes to rest are slow). A gap g* at which an approach turns around: margin g* / h,
/// h = max(ġ0² / 2a, a dt² / 2) the height that it falls from, or falls in a step. Only those below
/// `most` are listed. What turns around within `missed`, by which the motions until now may have
/// missed their place (of a body's size, or rad), has at most the margin kNearKinkMargin.
void FindGrazes(const Model<double>& model, const EventRecord& record, double most, double missed,
                std::vector<Graze>* grazes);

/// What a motion of a joint's bodies may miss of its place, of a body's size, or rad: (ω τ)⁵ / 20,
/// its terms of fifth order in the turn of the body that turns fastest.
double MissedBy(const Segment& motion);

}  // namespace tangible
