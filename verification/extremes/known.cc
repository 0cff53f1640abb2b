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
    "accelerations of a body of 1e-12 kg at a hinge and contacts are not resolved beside 1 kg; "
    "ends with a status";
constexpr char kHeaviest[] =
    "1e12 kg hinged to a box of 1 kg on the floor: the bar sinks in by a fifth of the ball; speeds "
    "of the box are judged by what the impulses would give it if it were free";
constexpr char kHeaviestStage[] =
    "beside 1e12 kg Newton's method for the implicit stage does not converge: its columns are "
    "refined too little; ends with a status";
constexpr char kLightBetween[] =
    "1 kg presses a box of 1e-12 kg to the floor and sinks in: speeds of the box are judged by "
    "what the impulses would give it if it were free, 1e11 m/s";
constexpr char kNeedleEnd[] =
    "a fixed step has rows for the two lowest corners alone: those of one end of the needle, 1e-9 "
    "m "
    "apart, so that the other end turns into the floor and is pushed out again, in turns";

}  // namespace

const std::vector<KnownCase>& KnownCases() {
  static const std::vector<KnownCase> kKnown = {{"20 links swing, end 1e6", "fixed", kProjection},
                                                {"20 links swing, end 1e9", "fixed", kProjection},
                                                {"bar of 1e+12 kg", "fixed", kHeaviest},
                                                {"box of 1e-12 kg", "fixed", kLightBetween},
                                                {"needle of 1e-09 m falls", "fixed", kNeedleEnd},
                                                {"box of 1e-12 kg", "event", kLightest},
                                                {"bar of 1e-12 kg", "event", kLightest},
                                                {"bar of 1e+12 kg", "event", kHeaviestStage}};
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
