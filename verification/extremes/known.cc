// SPDX-License-Identifier: Apache-2.0
//
// Cases whose bounds do not hold yet, with the reason.

#include "tangible/verification/extremes/known.h"

namespace tangible::extremes {

const std::vector<KnownCase>& KnownCases() {
  static const std::vector<KnownCase> kKnown;  // {name, stepping, reason}
  return kKnown;
}

void MarkKnown(std::vector<ExtremeCase>* cases) {
  for (ExtremeCase& one : *cases) {
    for (const KnownCase& known : KnownCases()) {
      if (known.name == one.name && known.stepping == one.stepping) one.known_reason = known.reason;
    }
  }
}

}  // namespace tangible::extremes
