// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/contact_geometry_inl.h"
#include "tangible/math/dual.h"

namespace tangible {
namespace {

/// The parameters that an edge reads. Boxes and capsules have constant normals, and the edge of a
/// capsule's core lies on its axis.
int EdgeNumbers(ShapeType type, int num_numbers, int edge, int* numbers) {
  switch (type) {
    case ShapeType::kBox:
      numbers[0] = edge % 2 == 0 ? 1 : 0;
      return 1;
    case ShapeType::kCapsule:
      numbers[0] = 1;
      return 1;
    case ShapeType::kPolygon:
    case ShapeType::kPolyline: {
      const int end = edge + 1 == num_numbers / 2 ? 0 : edge + 1;
      numbers[0] = 2 * edge;
      numbers[1] = 2 * edge + 1;
      numbers[2] = 2 * end;
      numbers[3] = 2 * end + 1;
      return 4;
    }
    case ShapeType::kSpline: {
      const int piece = edge / internal::kPlacesOfPiece;
      for (int i = 0; i < 4; ++i) {
        numbers[i] = 2 * piece + i;
        numbers[4 + i] = num_numbers / 2 + 2 * piece + i;
      }
      return 8;
    }
    default:
      return 0;
  }
}

}  // namespace

int FeatureNumbers(ShapeType type, int num_numbers, bool is_edge, int feature,
                   int numbers[kMostFeatureNumbers]) {
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
  const bool has_points =
      type == ShapeType::kPolygon || type == ShapeType::kPolyline || type == ShapeType::kSpline;
  numbers[0] = has_points ? 2 * feature : 0;
  if (type == ShapeType::kCircle) {
    return 1;
  }
  numbers[1] = numbers[0] + 1;
  return 2;
}

#define TANGIBLE_INSTANTIATE_FEATURE(T)                                                         \
  template ContactFeature FeatureAt(const ContactFeature&, const ShapeView<T>&, const Pose<T>&, \
                                    const ShapeView<T>&, const Pose<T>&);
#define TANGIBLE_INSTANTIATE_FEATURE_JET(N) TANGIBLE_INSTANTIATE_FEATURE(Jet<N>)
TANGIBLE_INSTANTIATE_FEATURE(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_FEATURE_JET)
#undef TANGIBLE_INSTANTIATE_FEATURE_JET
#undef TANGIBLE_INSTANTIATE_FEATURE

#define TANGIBLE_INSTANTIATE(T)                                                           \
  template ContactGeometry<T> EvaluateContact(const ContactFeature&, const ShapeView<T>&, \
                                              const Pose<T>&, const ShapeView<T>&,        \
                                              const Pose<T>&);
#define TANGIBLE_INSTANTIATE_JET(N) \
  TANGIBLE_INSTANTIATE(Jet<(N)>)    \
  TANGIBLE_INSTANTIATE(Dual<Jet<(N)>>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_INSTANTIATE(Dual<double>)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)
#undef TANGIBLE_INSTANTIATE_JET
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
