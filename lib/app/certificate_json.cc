// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/certificate_json.h"

#include <cmath>

namespace tangible {

namespace {

OrderedJson Finite(double x) { return std::isfinite(x) ? OrderedJson(x) : OrderedJson(nullptr); }

OrderedJson ToJson(const ValidityRadius& radius) {
  return {{"down", Finite(radius.down)},
          {"up", Finite(radius.up)},
          {"down_where", radius.down_where},
          {"up_where", radius.up_where}};
}

}  // namespace

OrderedJson ToJson(const Certificate& certificate) {
  OrderedJson text = {{"margin_min", certificate.margin_min},
                      {"margin_where", certificate.margin_where},
                      {"degenerate_rows", certificate.degenerate_rows},
                      {"redundant_rows", certificate.redundant_rows},
                      {"condition", certificate.condition},
                      {"linear_residual", certificate.linear_residual},
                      {"mode_switches", certificate.mode_switches},
                      {"events", certificate.events},
                      {"bounces_ended", certificate.bounces_ended},
                      {"fallbacks", certificate.fallbacks},
                      {"discrete_map", !certificate.discrete_map.empty()},
                      {"advice", AdviceOf(certificate)},
                      {"verdict", certificate.verdict}};
  if (!certificate.radius.empty()) {
    OrderedJson& radii = text["radius"] = OrderedJson::object();
    for (const ValidityRadius& radius : certificate.radius) {
      radii[radius.parameter] = ToJson(radius);
    }
  }
  if (!std::isnan(certificate.growth)) text["growth"] = Finite(certificate.growth);
  return text;
}

}  // namespace tangible
