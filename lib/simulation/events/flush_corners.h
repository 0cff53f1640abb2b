// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Flush corners of outlines whose points are parameters. What passes one moves as on one face,
// and has no event; but its derivatives by the points are those of the edge that it is on. So
// its motion ends there, at a given instant: the motions before and behind it are the same.

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/model/model.h"

namespace tangible {

/// The place of a contact along a face of such an outline, m.
struct FacePlace {
  bool is_found = false;  ///< else the contact has no such face
  bool of_first = false;  ///< the outline is that of the contact's first body
  int edge = 0;           ///< of the contact
  double along = 0.0;
  double from = 0.0, to = 0.0;  ///< the ends of the edge; infinite where the face ends there
};
FacePlace PlaceOnFace(const Model<double>& model, const State<double>& state,
                      const ActiveContact& contact);

/// How fast it moves along, m/s.
double SpeedAlongFace(const Model<double>& model, const State<double>& state,
                      const ActiveContact& contact);

/// Whether a contact is exactly over a flush corner.
bool IsOverFlushCorner(const Model<double>& model, const State<double>& state,
                       const ActiveContact& contact);

/// Whether two contacts are of one point on one face of an outline, whose edges may differ.
bool AreOnOneFace(const Model<double>& model, const ActiveContact& x, const ActiveContact& y);

/// Makes the edge onto which a contact over a flush corner moves that of the contact.
void TakeEdgeAhead(const Model<double>& model, const State<double>& state, ActiveContact* contact);

}  // namespace tangible
