// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What might be missing in a model: candidates for the cause of its residuals.
//
// Each is one or several numbers that no parameter sets, with the change of a problem that gives
// them a place where they have none. At the numbers' initial values the changed problem is the same
// as before (a clock of rate 1, a friction of 0), except for joints made softer, which have no
// finite number at which they are rigid: these are tried at several values.

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

enum class MissingKind {
  kNumber,      ///< of the scene or its instruments, held at a value
  kForce,       ///< a key or force that the scene does not have
  kInstrument,  ///< a clock, camera or sensor that the observations do not have
  kMarker,      ///< a place in the body that is observed
  kJoint,       ///< a joint made softer
};

/// "number", "force", "instrument", "marker", "joint".
const char* NameOf(MissingKind kind);

struct MissingCandidate {
  std::string name;  ///< a path, or what is made softer
  MissingKind kind = MissingKind::kNumber;
  std::vector<FitParameter> parameters;  ///< at least one, shared by all recordings
  /// Makes place for them in a problem; empty: they are there.
  std::function<void(FitProblem*)> change{};
  /// Candidates with the same number are there together in one run, which none of them changes; −1:
  /// it needs a run of its own.
  int together = -1;
  /// Values of the parameters at which it is tried, one after the other; empty: its initial ones.
  std::vector<Eigen::VectorXd> tries{};
};

/// Of a problem whose scene, points and instruments have the values of the estimate, and whose
/// parameters are those of the fit. At most `most` numbers of the scene: none of them where there
/// are more.
std::vector<MissingCandidate> FindMissingCandidates(const FitProblem& fitted, int most);

}  // namespace tangible
