// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The kinds of shape: shared by scene (what the user wrote) and geometry (what it means), which do
// not know each other.

namespace tangible {

enum class ShapeType {
  kNone,
  kCircle,
  kBox,
  kCapsule,
  kPolygon,
  kHalfPlane,
  kEllipse,
  kPolyline,
  kSpline
};

}  // namespace tangible
