// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Contacts of corners. Where a corner meets a corner, for example when a box slides over flush
// tiles and reaches the next tile, rounding chooses the normal of the nearest features. Convex
// bodies touch only where no line separates them: the last line to separate them belongs to the
// features that are nearest right after the corners have met, and its normal is that of the contact
// (the separating axis at the time of impact; Ericson, Real-Time Collision Detection, 2005, 5.5.8).
// Where the bodies do not approach along it there is no impact.

#include "tangible/dynamics/elements/contact.h"

namespace tangible {

/// The contacts that replace an approached one.
struct ContactsAhead {
  ActiveContact contacts[2];  ///< gap set, at the state given
  double speed[2] = {0, 0};   ///< n v, m/s
  int count = 0;              ///< 0: the contact stands
};

/// For a `contact` of two shapes that approach with `approach` < 0 (n v, m/s) at `state`: the
/// contacts that are nearest when the bodies have closed its gap at their twists and moved on by a
/// millionth of `size` (m), if all of these touch at `state` within `tolerance` (m) and their
/// approach is slower by more than `slow` (m/s). Allocates nothing.
ContactsAhead FindContactsAhead(const Model<double>& model, const State<double>& state,
                                const ActiveContact& contact, double approach, double size,
                                double tolerance, double slow);

/// The pose of a body after it has moved with its twist for a time, s.
Pose<double> PoseAfter(const State<double>& state, int body, double time);

/// Whether both bodies of a contact of shapes may have corners.
bool HaveCorners(const ModelStructure& structure, const ActiveContact& contact);

/// Whether a `contact` as above does not close although its gap does: right after that other
/// features are nearest, and the bodies approach along none of them by more than `slow` (m/s). The
/// trailing corner of a box that tips over a table's edge comes down to the table's height as it
/// passes the edge. Allocates nothing.
bool PassesBy(const Model<double>& model, const State<double>& state, const ActiveContact& contact,
              double approach, double size, double slow);

}  // namespace tangible
