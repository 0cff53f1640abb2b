// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The checkpoint of a training as a file: a line of magic, the training's fingerprint, a line with
// the iteration and a checksum, then the weights as torch writes them. The checksum is that of all
// other bytes behind the magic.

#include <string>

namespace tangible {

struct TrainingFile {
  std::string fingerprint;  ///< of data and options; one line
  long iteration = 0;       ///< >= 1
  std::string weights;
};

std::string SerializeTraining(const TrainingFile& training);
/// Returns false, with one line, if `bytes` are not a complete file: empty, damaged, cut off, or of
/// another kind.
bool ParseTraining(const std::string& bytes, const std::string& name_for_messages,
                   TrainingFile* training, std::string* error);

}  // namespace tangible
