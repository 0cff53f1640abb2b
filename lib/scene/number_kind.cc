// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/number_kind.h"

#include <cmath>

namespace tangible {

bool IsAllowed(NumberKind kind, double value) {
  if (!std::isfinite(value)) return false;
  switch (kind) {
    case NumberKind::kFree:
      return true;
    case NumberKind::kPositive:
      return value > 0.0;
    case NumberKind::kNonNegative:
      return value >= 0.0;
    case NumberKind::kFraction:
      return value >= 0.0 && value <= 1.0;
  }
  return false;
}

const char* Describe(NumberKind kind) {
  switch (kind) {
    case NumberKind::kFree:
      return "a number";
    case NumberKind::kPositive:
      return "a number > 0";
    case NumberKind::kNonNegative:
      return "a number >= 0";
    case NumberKind::kFraction:
      return "a number in [0, 1]";
  }
  return "a number";
}

}  // namespace tangible
