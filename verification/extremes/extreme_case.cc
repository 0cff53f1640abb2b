// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/extreme_case.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/known.h"

namespace tangible::extremes {
namespace {

using nlohmann::json;

// JSON has no NaN; hexadecimal keeps every bit.
std::string Bits(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%a", value);
  return text;
}

double FromBits(const json& text) { return std::strtod(text.get<std::string>().c_str(), nullptr); }

}  // namespace

double GradientFinding::adjoint_bound() const {
  constexpr double kMostByCondition = 1e-6;
  return std::clamp(std::numeric_limits<double>::epsilon() * condition, kAdjointTolerance,
                    kMostByCondition);
}

bool GradientFinding::holds() const {
  if (!taken) return true;
  if (!message.empty() || !finite) return false;
  if (!trustworthy()) return true;
  return adjoint <= adjoint_bound() &&
         (std::isnan(differences) || differences <= kDifferenceTolerance);
}

bool Finding::holds() const {
  for (const Figure& figure : figures) {
    if (!figure.holds()) return false;
  }
  return gradient.holds();
}

std::vector<ExtremeCase> AllCases() {
  std::vector<ExtremeCase> cases;
  for (const auto& add : {AddMassRatios, AddResting, AddScales, AddSpeeds, AddGeometry, AddFriction,
                          AddRestitution, AddParadoxes, AddJoints, AddLongRuns, AddOptimiser}) {
    add(&cases);
  }
  MarkKnown(&cases);
  return cases;
}

std::string Serialise(const Finding& finding) {
  json figures = json::array();
  for (const Figure& figure : finding.figures) {
    figures.push_back(
        {figure.what, Bits(figure.value), Bits(figure.bound), figure.unit, figure.reason});
  }
  const GradientFinding& gradient = finding.gradient;
  return json{{"figures", figures},
              {"gradient",
               {gradient.taken, gradient.message, gradient.finite, Bits(gradient.adjoint),
                Bits(gradient.differences), gradient.verdict, Bits(gradient.condition)}},
              {"note", finding.note}}
      .dump();
}

bool Deserialise(const std::string& text, Finding* finding) {
  const json all = json::parse(text, nullptr, false);
  if (!all.is_object()) return false;
  try {
    *finding = Finding();
    for (const json& figure : all.at("figures")) {
      finding->figures.push_back({figure.at(0), FromBits(figure.at(1)), FromBits(figure.at(2)),
                                  figure.at(3), figure.at(4)});
    }
    const json& gradient = all.at("gradient");
    finding->gradient = {gradient.at(0),           gradient.at(1),           gradient.at(2),
                         FromBits(gradient.at(3)), FromBits(gradient.at(4)), gradient.at(5),
                         FromBits(gradient.at(6))};
    finding->note = all.at("note");
  } catch (const json::exception&) {
    return false;
  }
  return true;
}

}  // namespace tangible::extremes
