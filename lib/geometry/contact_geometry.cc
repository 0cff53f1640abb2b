// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/contact_geometry_inl.h"

namespace tangible {
namespace {

/// Numbers of an edge: boxes and capsules have constant normals, and a capsule's edge lies on the
/// axis.
int EdgeNumbers(ShapeType type, int num_numbers, int edge, int numbers[4]) {
  switch (type) {
    case ShapeType::kBox:
      numbers[0] = edge % 2 == 0 ? 1 : 0;
      return 1;
    case ShapeType::kCapsule:
      numbers[0] = 1;
      return 1;
    case ShapeType::kPolygon: {
      const int end = edge + 1 == num_numbers / 2 ? 0 : edge + 1;
      numbers[0] = 2 * edge;
      numbers[1] = 2 * edge + 1;
      numbers[2] = 2 * end;
      numbers[3] = 2 * end + 1;
      return 4;
    }
    default:
      return 0;
  }
}

}  // namespace

int FeatureNumbers(ShapeType type, int num_numbers, bool is_edge, int feature, int numbers[4]) {
  if (type == ShapeType::kHalfPlane) {
    for (int i = 0; i < 3; ++i) {
      numbers[i] = i;
    }
    return 3;
  }
  if (is_edge) {
    return EdgeNumbers(type, num_numbers, feature, numbers);
  }
  if (type == ShapeType::kNone) {
    return 0;
  }
  numbers[0] = type == ShapeType::kPolygon ? 2 * feature : 0;
  if (type == ShapeType::kCircle) {
    return 1;
  }
  numbers[1] = numbers[0] + 1;
  return 2;
}

template ContactGeometry<double> EvaluateContact(const ContactFeature&, const ShapeView<double>&,
                                                 const Pose<double>&, const ShapeView<double>&,
                                                 const Pose<double>&);
#define TANGIBLE_INSTANTIATE(N)                                                 \
  template ContactGeometry<Jet<(N)>> EvaluateContact(                           \
      const ContactFeature&, const ShapeView<Jet<(N)>>&, const Pose<Jet<(N)>>&, \
      const ShapeView<Jet<(N)>>&, const Pose<Jet<(N)>>&);
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
