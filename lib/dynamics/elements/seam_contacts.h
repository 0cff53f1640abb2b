// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Contacts of one body with two others at one place of a seam.

#include "tangible/dynamics/elements/contact.h"

namespace tangible {

/// Whether two contacts are of one body, exactly above a flush seam of the two others: their places
/// and normals are equal, and one contact acts in the place of both. `of_x`, `of_y`: the contacts.
bool AreOfOneSeam(const Model<double>& model, const ActiveContact& x,
                  const ContactGeometry<double>& of_x, const ActiveContact& y,
                  const ContactGeometry<double>& of_y);

}  // namespace tangible
