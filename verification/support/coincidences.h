// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random scenes of round numbers in which something happens exactly on a step's end, at the start,
// at the end of the run, or twice at one instant: a slip ends, turns or begins, a disc begins to
// roll, lands or is lifted, a joint reaches its limit, begins or ceases to slide, a force begins or
// ends, a signal has a corner, a disc passes from one face to the next. Nearly all have a known
// motion (reference_motion.h), and so known derivatives on either side.
//
// They have a generator of their own (as in random_scene.h), so that RandomScene's scenes keep
// their bits.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene.h"
#include "tangible/verification/support/reference_motion.h"

namespace tangible {

/// A number of a scene by its path.
using NumberAt = std::function<Real(const std::string& path)>;

struct Coincidence {
  Scene scene;
  /// What happens, and when: "slip ends", "at a step's end".
  std::vector<std::string> kinds;
  std::vector<ParameterPath> parameters;
  /// The final poses and twists of the moving bodies; empty where they are not known.
  std::function<std::vector<Real>(const NumberAt&)> outputs;
};

Coincidence RandomCoincidence(unsigned seed, Stepping stepping);

/// All that kinds may name.
const std::vector<std::string>& CoincidenceKinds();

/// The derivatives of the known outputs for growing and for shrinking parameters, outputs x
/// parameters; empty where the outputs are not known. They are exact to 1e-16 of their column's
/// largest; NaN where an output jumps.
struct KnownSides {
  MatrixX<double> plus, minus;
  VectorX<double> values;  ///< of the outputs
};
KnownSides SidesOf(const Coincidence& coincidence);

}  // namespace tangible
