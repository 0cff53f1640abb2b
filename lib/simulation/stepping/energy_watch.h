// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a run has exploded: an explicit step amplifies motions that are too stiff for it (a
// spring with ω h > 2, a damper in event steps) by a constant factor in each step, until numbers
// overflow. A scene that nothing drives keeps its energy or loses some, so that ten thousand times
// its greatest possible energy cannot belong to a real motion.

#include "tangible/simulation/stepping/step.h"

namespace tangible {

/// Whether forces, efforts, servos or bodies of given motion drive the scene.
bool IsDriven(const Model<double>& model, const State<double>& state);

class EnergyWatch {
 public:
  /// A watch that examines nothing.
  EnergyWatch() = default;
  EnergyWatch(const Model<double>& model, const State<double>& initial);
  /// Empty, or what has happened: "the energy grew from 1 J to 1e+09 J, though nothing drives the
  /// scene: dt is too large". Always empty where something drives the scene (forces, efforts,
  /// kinematic bodies), or where the energy at the start is not finite.
  std::string Exploded(const Model<double>& model, const State<double>& state) const;
  /// J, by which the energy is above all that the scene had to give; 0 where nothing is examined.
  double Excess(const Model<double>& model, const State<double>& state) const;
  double start() const { return start_; }  ///< J

 private:
  bool watches_ = false;
  double start_ = 0.0;    ///< J
  double allowed_ = 0.0;  ///< J
};

/// Empty, or a line that fixed steps have pushed overlapping bodies apart with more energy than the
/// scene had to give: its own, and that of each body at `recovery_speed`. Bodies of a stack take
/// over the speeds of those before them. `depth`: m, the largest penetration.
std::string EnergyOfOverlap(const Model<double>& model, const State<double>& initial,
                            const State<double>& final, double depth);

/// Empty, or a line that bodies end far faster than those of given motion, which alone drive them:
/// what these press together along a line leaves it at any speed.
std::string EnergyOfSqueeze(const Model<double>& model, const State<double>& initial,
                            const State<double>& final);

/// Empty, or a line that the energy of a run by events has grown, though nothing drives the scene:
/// a step that is too long for the motion. Empty for semi-implicit Euler steps, whose energy
/// varies and which have a warning of their own. `by_impacts`: J, what impacts may have added
/// (Newton's law with friction); `depth`: m, the penetration out of which bodies may have been
/// lifted. Energy that belongs to displacements by the touching tolerance (lengths.h), or by that
/// within a step, is rounding.
std::string EnergyGrown(const Model<double>& model, const State<double>& initial,
                        const State<double>& final, double by_impacts, double depth);

}  // namespace tangible
