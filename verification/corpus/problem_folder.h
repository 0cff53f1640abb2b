// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A folder of problem files: those of tangible-lcp, whose answer is not known, and published plain
// LCPs w = M z + q with what is known about them, {"M", "q", "status", "props", ...}.

#include <string>
#include <vector>

#include "tangible/lcp/dense/problem.h"
#include "tangible/verification/corpus/contact_case.h"

namespace tangible::corpus {

struct FileCase {
  std::string kind;  ///< "file, monotone or P"
  std::string name;  ///< the file's
  Known known = Known::kUnknown;
  MixedLcp<double> problem;
};

/// All *.json of a folder by name; returns an error as one line, or empty.
std::string ReadProblemFolder(const std::string& folder, std::vector<FileCase>* cases);

}  // namespace tangible::corpus
