// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The radius of validity of a derivative: per parameter p the distance, to first order, to the
// nearest change of a discrete choice of the run. A choice holds while its slack s(p) is above 0:
//
//   up    min over choices with ds/dp < 0 of  s / −ds/dp
//   down  min over choices with ds/dp > 0 of  s / ds/dp
//
// ds/dp is a central difference of the slacks of two runs with the same choices; where the run has
// other choices however near, the radius is 0.

#include <functional>
#include <vector>

#include "tangible/lcp/certificate/certificate.h"
#include "tangible/simulation/certificate/choices.h"
#include "tangible/simulation/stepping/controlled_model.h"

namespace tangible {

/// The choices of a run from `initial`, by events those up to kBehindEnd beyond its end too; false
/// where it fails before its end, or makes more than kMostChoices.
bool ChoicesOf(const Model<double>& model, const Controls* controls, const State<double>& initial,
               ChoiceList* choices);

/// The choices of the run with a parameter changed by `shift`; false where it may not be there, or
/// the run fails.
using ChoicesAt = std::function<bool(double shift, ChoiceList* choices)>;

/// The radius of one parameter without its name, of the size `size`, without regard to its range.
/// Of a radius beyond kFarthestRadius of the size nothing is known: infinite.
ValidityRadius ValidityRadiusOf(const ModelStructure& structure, const ChoiceList& own,
                                const ChoicesAt& choices_at, double size);

/// Of more moving bodies the growth, whose tangent has 6 columns a body, is not computed.
inline constexpr int kMostGrowthBodies = 20;

/// Certificate::growth, by a tangent with a column for each entry of the state; NaN where the run
/// fails, nothing moves, or more than kMostGrowthBodies do.
double GrowthOf(const Model<double>& model, const Controls* controls, const State<double>& initial);

}  // namespace tangible
