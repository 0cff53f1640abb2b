// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The words of fit files and the ranges of their whole numbers.

#include <utility>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

inline constexpr int kMaxSegments = 1000;
inline constexpr int kMaxStarts = 10000;

inline constexpr std::pair<const char*, GradientMethod> kMethods[] = {
    {"tangent", GradientMethod::kTangent},
    {"adjoint", GradientMethod::kAdjoint},
    {"jet", GradientMethod::kJet},
    {"jet_implicit", GradientMethod::kJetImplicit},
    {"finite_difference", GradientMethod::kFiniteDifference}};

// Multiple shooting is asked for by its segments.
inline constexpr std::pair<const char*, FitApproach> kApproaches[] = {
    {"auto", FitApproach::kAuto},
    {"plain", FitApproach::kPlain},
    {"windows", FitApproach::kWindows}};

inline constexpr std::pair<const char*, ParameterScale> kScales[] = {
    {"linear", ParameterScale::kLinear}, {"log", ParameterScale::kLogarithmic}};

/// Whether accelerations are along the axes of the body.
inline constexpr std::pair<const char*, bool> kFrames[] = {{"world", false}, {"body", true}};

inline constexpr std::pair<const char*, ObservedEventKind> kObservedEventKinds[] = {
    {"touch", ObservedEventKind::kTouch},
    {"lift_off", ObservedEventKind::kLiftOff},
    {"stick", ObservedEventKind::kStick},
    {"slip", ObservedEventKind::kSlip},
    {"rest", ObservedEventKind::kRest}};

inline constexpr std::pair<const char*, NoiseCoordinate> kNoiseCoordinates[] = {
    {"x", NoiseCoordinate::kX},
    {"y", NoiseCoordinate::kY},
    {"angle", NoiseCoordinate::kAngle},
    {"displacement", NoiseCoordinate::kDisplacement}};

}  // namespace tangible
