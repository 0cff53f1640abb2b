// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The problem file of tangible-lcp: {"M", "p", "A", "b", "G", "F", "c", "dl_dv", "dl_dz", "dl_dy"}.

#include <string>

#include "tangible/lcp/dense/mode_system.h"
#include "tangible/lcp/dense/problem.h"
#include "tangible/scene/json_reader.h"

namespace tangible {

struct LcpFile {
  MixedLcp<double> problem;
  LcpVector loss_gradient;
  bool has_loss = false;
};

/// Reads a problem from parsed JSON; returns what is wrong with it as one line that begins with
/// `name` and the place, or empty.
std::string ReadLcp(const Json& json, const std::string& name, LcpFile* input);

/// The same from a file.
std::string ReadLcpFile(const std::string& file, LcpFile* input);

}  // namespace tangible
