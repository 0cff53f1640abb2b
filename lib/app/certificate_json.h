// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The certificate of a derivative as JSON, as the results of the programs have it.

#include "tangible/lcp/dense/certificate.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

OrderedJson ToJson(const Certificate& certificate);

}  // namespace tangible
