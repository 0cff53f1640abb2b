// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Reading and checking the shape of a body.

#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// Reads {"circle": {...}} and so on into `shape`, and checks it.
void ReadShape(const JsonReader& reader, BasicShape<double>* shape);

/// Polygons must be strictly convex, counter-clockwise and go around once, ellipses no needles, and
/// normals have a direction. `place`: that of the shape, whose value is not looked at.
void CheckShape(const BasicShape<double>& shape, const JsonReader& place);

/// Whether the uniform shape's centre of mass is the origin of the body's frame, so that its
/// inertia about the origin is known: always, except that the centroid of polygons may differ from
/// the origin by 1e-9 of their size.
bool IsCentred(const BasicShape<double>& shape);

}  // namespace tangible
