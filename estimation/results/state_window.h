// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The window of a state: how many of the observations before a time the state at that time is
// fitted to. Where the model is right all of them say something about it. Where it is wrong, early
// ones spoil it: the run that agrees best with all of them is not where the last ones are.
//
// The window is chosen by prediction of what is known. Of the observations up to T those up to half
// and to three quarters of T take the place of the first part, and the rest of those up to T is
// predicted, by states that are fitted to all of them or to those within T / 4, T / 8, ... before.
// Taken is the window with the least mean of ln(error) over recordings and cuts, if it is better
// than all observations by more than the standard error of the difference.
//
// The run of a window begins at its first observation. That is possible where nothing of the scene
// depends on time, where the parameters of the start make every motion that joints allow, and where
// they do not move anchors: without springs, and beside joints by coordinates of these alone.

#include <Eigen/Core>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct HeldOutRecording;  // held_out.h
struct HeldOutRun;

/// What a window predicts.
struct WindowError {
  double seconds = 0.0;  ///< 0: all observations
  double error = 0.0;    ///< the geometric mean of the rms, in multiples of sigma
};

struct StateWindow {
  double seconds = 0.0;            ///< 0: all observations
  std::vector<WindowError> tried;  ///< empty: none was looked for
};

/// The recording with the observations at most `seconds` before T, whose run begins at the first of
/// them, as far as is seen in `observations`; times count from there.
struct LateStart {
  double begins = 0.0;              ///< s, of the recording's time
  FitProblem problem;               ///< with these observations
  std::vector<Observation> before;  ///< others, as they were
};
LateStart BeginLate(const FitProblem& problem, double from, double seconds);

/// Whether the run of a recording may begin later than it does.
bool MayBeginLate(const HeldOutRecording& recording, const HeldOutRun& run);

/// The window for recordings whose starts were fitted to all of their first parts: `runs`. None is
/// looked for where the residuals of all of these are what sigma explains.
StateWindow ChooseStateWindow(const FitInput& input, const RecordingsProblem& problem,
                              const Eigen::VectorXd& estimate,
                              const std::vector<HeldOutRecording>& recordings,
                              const std::vector<HeldOutRun>& runs);

}  // namespace tangible
