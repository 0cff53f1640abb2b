// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Results as a table and as JSON.

#include <string>

#include "tangible/scene/json_writer.h"
#include "tangible/verification/corpus/corpus_run.h"

namespace tangible::corpus {

/// A line for each kind and way, then the names of the problems with a wrong answer and a sum.
std::string TableText(const CorpusResult& result);

OrderedJson ToJson(const CorpusResult& result);

}  // namespace tangible::corpus
