// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The certificate of a derivative as JSON, as in the results of the programs.

#include "tangible/lcp/certificate/certificate.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

OrderedJson ToJson(const Certificate& certificate);

}  // namespace tangible
