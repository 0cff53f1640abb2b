// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The names in a scene file for the enumerations of scene.h, used for reading and writing.

#include <cstddef>
#include <string>
#include <utility>

#include "tangible/scene/scene.h"

namespace tangible {

inline constexpr std::pair<const char*, JointType> kJointTypeNames[] = {
    {"revolute", JointType::kRevolute},
    {"prismatic", JointType::kPrismatic},
    {"weld", JointType::kWeld},
    {"distance", JointType::kDistance},
    {"fixed_angle", JointType::kFixedAngle},
    {"coupling", JointType::kCoupling}};
inline constexpr std::pair<const char*, ShapeType> kShapeTypeNames[] = {
    {"circle", ShapeType::kCircle},     {"ellipse", ShapeType::kEllipse},
    {"box", ShapeType::kBox},           {"capsule", ShapeType::kCapsule},
    {"polygon", ShapeType::kPolygon},   {"half_plane", ShapeType::kHalfPlane},
    {"polyline", ShapeType::kPolyline}, {"spline", ShapeType::kSpline}};
inline constexpr std::pair<const char*, SolidSide> kSolidSideNames[] = {
    {"left", SolidSide::kLeft}, {"right", SolidSide::kRight}};
inline constexpr std::pair<const char*, Signal::Interpolation> kInterpolationNames[] = {
    {"constant", Signal::Interpolation::kConstant}, {"linear", Signal::Interpolation::kLinear}};
inline constexpr std::pair<const char*, PathInterpolation> kPathInterpolationNames[] = {
    {"linear", PathInterpolation::kLinear}, {"cubic", PathInterpolation::kCubic}};
inline constexpr std::pair<const char*, Stepping> kSteppingNames[] = {{"fixed", Stepping::kFixed},
                                                                      {"event", Stepping::kEvent}};
inline constexpr std::pair<const char*, Integrator> kIntegratorNames[] = {
    {"semi_implicit_euler", Integrator::kSemiImplicitEuler},
    {"trapezoidal", Integrator::kTrapezoidal},
    {"runge_kutta_4", Integrator::kRungeKutta4}};
inline constexpr std::pair<const char*, JointCorrection> kJointCorrectionNames[] = {
    {"none", JointCorrection::kNone}, {"projection", JointCorrection::kProjection}};
inline constexpr std::pair<const char*, Mixing> kMixingNames[] = {
    {"average", Mixing::kAverage}, {"geometric_mean", Mixing::kGeometricMean}};
inline constexpr std::pair<const char*, ImpactLaw> kImpactLawNames[] = {
    {"newton", ImpactLaw::kNewton}, {"poisson", ImpactLaw::kPoisson}};

/// The word of an enumerator; "" if the table lacks it.
template <typename Enum, std::size_t N>
std::string NameOf(Enum value, const std::pair<const char*, Enum> (&table)[N]) {
  for (const auto& entry : table) {
    if (entry.second == value) return entry.first;
  }
  return "";
}

/// Whether this is a name: at least one character, each a letter, a digit, `_`, `.`, `-` or one of
/// `extra`.
inline bool IsName(const std::string& name, const std::string& extra = "") {
  if (name.empty()) return false;
  for (const char c : name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!letter && std::string("_.-" + extra).find(c) == std::string::npos) return false;
  }
  return true;
}

}  // namespace tangible
