// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Lengths of links as one parameter each.
//
// A link is the line from the anchor a of one joint to the anchor b of another joint of the same
// body, or to a point b of it, L = ‖b − a‖, u = (b − a) / L, in the scene as it is written, before
// joints turn. Its length ℓ moves everything that hangs at b along u,
//
//   b = b_0 + (ℓ − L) u,    and so do the bodies beyond b, the anchors of their joints and springs,
//                           and points of the link's body that are at b
//
// where ℓ = scale p + offset of a parameter p. All these numbers are linear in p: the length is
// written as the sets of numbers that add (parameterized_scene.h). The centre of mass of the link's
// body stays where it is, with its inertia and shape, unless it is at b: the bob of a pendulum
// moves along, and its other points stay. The bodies beyond b must hang from b alone.

#include <string>
#include <vector>

#include "tangible/estimation/problem/parameterized_scene.h"

namespace tangible {

struct Link {
  std::string name;
  int from = -1;      ///< joint
  int to_joint = -1;  ///< −1: it ends at a point
  int to_point = -1;
};

/// The number "links/NAME/length" of a link.
std::string LengthPath(const Link& link);

/// Replaces lengths among the sets of the parameters by what they move; a parameter that begins
/// with a length has, where these are not given, its value in the scene as initial value and 0 as
/// lower bound. Returns false with what is wrong and its place.
bool ExpandLengths(const Scene& scene, const std::vector<BodyPoint>& points,
                   const std::vector<Link>& links, std::vector<FitParameter>* parameters,
                   ParameterError* error);

/// Why a link is none: empty, or one line.
std::string CheckLink(const Scene& scene, const std::vector<BodyPoint>& points, const Link& link);

}  // namespace tangible
