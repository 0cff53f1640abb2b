// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The fitted scene as a separate scene file.

#include <string>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// The problem's scene with the values of `estimate`, as the text of a file in `folder`: its signal
/// files are named as seen from there. False, with one line, where a value is not allowed.
bool FittedScene(const FitProblem& problem, const Eigen::VectorXd& estimate,
                 const std::string& folder, std::string* text, std::string* error);

}  // namespace tangible
