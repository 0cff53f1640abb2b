// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/certificate_json.h"

namespace tangible {

OrderedJson ToJson(const Certificate& certificate) {
  return {{"margin_min", certificate.margin_min},
          {"margin_where", certificate.margin_where},
          {"degenerate_rows", certificate.degenerate_rows},
          {"redundant_rows", certificate.redundant_rows},
          {"condition", certificate.condition},
          {"linear_residual", certificate.linear_residual},
          {"mode_switches", certificate.mode_switches},
          {"events", certificate.events},
          {"fallbacks", certificate.fallbacks},
          {"discrete_map", !certificate.discrete_map.empty()},
          {"advice", AdviceOf(certificate)},
          {"verdict", certificate.verdict}};
}

}  // namespace tangible
