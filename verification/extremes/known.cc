// SPDX-License-Identifier: Apache-2.0
//
// Cases whose bounds do not hold yet, with the reason.

#include "tangible/verification/extremes/known.h"

namespace tangible::extremes {
namespace {

constexpr char kProjection[] =
    "a fixed step of 0.01 s leaves anchors so far apart that the projection, weighted by masses "
    "1e6 apart, does not converge; the run ends with a status";
constexpr char kLightest[] =
    "a hinge's damping of 0.01 N m s on the inertia of 1e-12 kg is a rate of 1e12 1/s, to be "
    "resolved by a step of 0.01 s: the implicit stage's iteration ends in rounding of 1e-7 of its "
    "terms; ends with a status";
constexpr char kNeedleEnd[] =
    "a fixed step has rows for the two lowest corners alone: those of one end of the needle, 1e-9 "
    "m "
    "apart, so that the other end turns into the floor and is pushed out again, in turns";

}  // namespace

const std::vector<KnownCase>& KnownCases() {
  static const std::vector<KnownCase> kKnown = {{"20 links swing, end 1e6", "fixed", kProjection},
                                                {"20 links swing, end 1e9", "fixed", kProjection},
                                                {"needle of 1e-09 m falls", "fixed", kNeedleEnd},
                                                {"box of 1e-12 kg", "event", kLightest},
                                                {"bar of 1e-12 kg", "event", kLightest}};
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
