// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether two sets of contacts act on each other (events/coupled_contacts.h), at a state and beside
// it. Events of contacts that do not act on each other may happen in any order. Where they do not
// act on each other at a state alone (a ball that meets two others at right angles), either order
// has the same result at one instant, but the order matters beside it: that is a kink.

#include <vector>

#include "tangible/dynamics/assembly/assembly.h"

namespace tangible {

enum class Coupling {
  kNone,    ///< neither at the state nor beside it
  kBeside,  ///< at states beside it
  kActs,
};

/// Whether rows of friction count in the first set. A contact that another impact does not load has
/// none.
enum class FrictionOfFirst { kCounts, kLeftOut };

/// Whether contacts of the two sets act on each other, directly or through `others`. The states
/// beside this one have moving bodies in any other place that joints allow. Bodies that do not move
/// and parameters are changed where `directions` (of [poses | twists | parameters], one a column)
/// change them.
Coupling CouplingOf(const Model<double>& model, const State<double>& state, double t,
                    const std::vector<ActiveContact>& first,
                    const std::vector<ActiveContact>& second,
                    const std::vector<ActiveContact>& others, const RowMatrixXd& directions,
                    FrictionOfFirst friction = FrictionOfFirst::kCounts);

}  // namespace tangible
