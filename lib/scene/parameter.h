// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Parameters: numbers of a scene named by paths such as `bodies/link*/mass` (`*` matches within a
// name).
//
// EnumerateNumbers lists every number of a scene outside `simulation` that a path can name, with
// its place, in a fixed order (the order does not depend on the number type). A path that matches
// several numbers is one parameter that sets all of them; its derivative is their sum.

#include <string>
#include <vector>

#include "tangible/scene/number_kind.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// The physical dimension of a number; its unit is UnitOf.
enum class Dimension {
  kNone,              ///< 1
  kLength,            ///< m
  kAngle,             ///< rad
  kTime,              ///< s
  kVelocity,          ///< m/s
  kAngularVelocity,   ///< rad/s
  kAcceleration,      ///< m/s²
  kMass,              ///< kg
  kInertia,           ///< kg m²
  kForce,             ///< N
  kTorque,            ///< N m
  kStiffness,         ///< N/m
  kLinearDamping,     ///< N s/m
  kAngularDamping,    ///< N m s
  kQuadraticDrag,     ///< N s²/m²
  kAngularStiffness,  ///< N m/rad
};

/// "m", "kg m^2" and so on; "1" for kNone.
const char* UnitOf(Dimension dimension);

template <typename T>
struct SceneNumber {
  std::string path;  ///< canonical, without `*` (but pairs keep the names as written)
  T* value;          ///< points into the scene
  NumberKind kind;
  Dimension dimension;
};

/// Every number that a path can name. Pointers stay valid while the scene's containers do not
/// change.
template <typename T>
std::vector<SceneNumber<T>> EnumerateNumbers(BasicScene<T>* scene);

/// The same scene with numbers of type T (derivatives zero).
template <typename T>
BasicScene<T> CastScene(const Scene& scene);

/// A parameter: the indices into EnumerateNumbers that its path matches; never empty.
struct ParameterPath {
  std::string path;
  std::vector<int> numbers;
  NumberKind kind = NumberKind::kFree;     ///< the most restrictive of its numbers
  Dimension dimension = Dimension::kNone;  ///< of its first number
  double value = 0.0;                      ///< of its first number, in the scene
  double scale = 1.0;  ///< typical magnitude, > 0: step of differences is 6e-6 max(|p|, scale)
};

/// Resolves a path. On failure returns false and sets `error` to "where: what, expected, got"
/// without the file's name, e.g. `parameter bodies/bal/mass: matches no number of the scene; bodies
/// are: ball, floor`. A missing inertia (it follows mass and shape) and an angle or rate of a joint
/// in a loop are errors that say what to do.
bool ResolveParameter(const Scene& scene, const std::string& path, ParameterPath* parameter,
                      std::string* error);

}  // namespace tangible
