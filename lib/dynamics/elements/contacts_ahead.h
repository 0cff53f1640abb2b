// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Contacts of corners. Where a corner meets a corner, as that of a box that slides over flush tiles
// meets the next tile's, the nearest features have a normal that rounding chooses. Convex bodies
// touch only where no line separates them: of two that touch within the tolerance, the one whose
// features are nearest right after the corners have met is the last to be crossed, and its normal
// is the contact's (the separating axis of the time of impact; Ericson, Real-Time Collision
// Detection, 2005, 5.5.8). Without an approach along it there is no impact.

#include "tangible/dynamics/elements/contact.h"

namespace tangible {

/// What an approached contact is replaced by.
struct ContactsAhead {
  ActiveContact contacts[2];  ///< gap set, at the state given
  double speed[2] = {0, 0};   ///< n v, m/s
  int count = 0;              ///< 0: the contact stands
};

/// For `contact` of two shapes, approached with `approach` < 0 (n v, m/s) at `state`: the contacts
/// nearest when the bodies have closed its gap at their twists and gone on by a millionth of `size`
/// (m), if all of them touch at `state` within `tolerance` (m) and are approached by more than
/// `slow` (m/s) less fast. Allocates nothing.
ContactsAhead FindContactsAhead(const Model<double>& model, const State<double>& state,
                                const ActiveContact& contact, double approach, double size,
                                double tolerance, double slow);

}  // namespace tangible
