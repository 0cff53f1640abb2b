// SPDX-License-Identifier: Apache-2.0
//
// Cases whose bounds do not hold yet, with the reason.

#include "tangible/verification/extremes/known.h"

namespace tangible::extremes {
namespace {

constexpr char kProjection[] =
    "a fixed step of 0.01 s leaves anchors so far apart that the projection, weighted by masses "
    "1e6 apart, does not converge; the run ends with a status";
constexpr char kRounding[] =
    "adjoint and tangent differ by rounding of 20 links that a tension of 1e3 weights or more "
    "couples; the sum of contributions does not look inside event steps";
constexpr char kTaut[] =
    "waves of the taut chain have 1e-4 of dt's period and less: the derivative's stage equation is "
    "solved to few digits, and the certificate does not say so";
constexpr char kCrushed[] =
    "sticking contacts of the light box are redundant, and their solve leaves it accelerations "
    "that "
    "the stage's iteration cannot get below (without friction it does); ends with a status";
constexpr char kLightest[] =
    "accelerations of a body of 1e-12 kg at a hinge and contacts are not resolved beside 1 kg; "
    "ends with a status";
constexpr char kHeaviest[] =
    "1e12 kg hinged to a box of 1 kg on the floor: the contacts' residual stays above "
    "lcp_tolerance, or the stage's iteration above rounding; ends with a status";

constexpr char kConditioned[] =
    "the linear systems have condition 1e20; residuals are small, so the certificate does not say "
    "that differences and tangent are 3e-3 apart";
constexpr char kNeedleEnd[] =
    "a fixed step has rows for the two lowest corners alone: those of one end of the needle, 1e-9 "
    "m "
    "apart, so that the other end turns into the floor and is pushed out again, in turns";

}  // namespace

const std::vector<KnownCase>& KnownCases() {
  static const std::vector<KnownCase> kKnown = {{"20 links swing, end 1e6", "fixed", kProjection},
                                                {"20 links swing, end 1e9", "fixed", kProjection},
                                                {"20 links swing, end 1e3", "event", kRounding},
                                                {"20 links swing, end 1e9", "event", kRounding},
                                                {"100 links hang, end 1e6", "event", kTaut},
                                                {"100 links hang, end 1e9", "event", kTaut},
                                                {"box 1e6 on box 1", "event", kCrushed},
                                                {"box 1e9 on box 1", "event", kCrushed},
                                                {"bar of 1e+12 kg", "fixed", kHeaviest},
                                                {"bar of 1e+12 kg", "event", kHeaviest},
                                                {"box of 1e-12 kg", "fixed", kConditioned},
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
