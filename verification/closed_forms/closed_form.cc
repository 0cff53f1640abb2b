// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/closed_forms/closed_form.h"

#include <glog/logging.h>

#include <limits>
#include <sstream>

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"

namespace tangible::closed_forms {

std::vector<std::pair<std::string, double>> Take(const Inputs& inputs,
                                                 const std::vector<std::string>& names) {
  std::vector<std::pair<std::string, double>> taken;
  for (const std::string& name : names) {
    CHECK_EQ(inputs.count(name), 1U) << "no input " << name;
    taken.emplace_back(name, inputs.at(name));
  }
  return taken;
}

void DropDerivative(const Number& p, std::vector<Number>* numbers) {
  for (Number& number : *numbers) {
    for (int k = 0; k < kMaxParameters; ++k) {
      if (p.v[k] != 0.0) number.v[k] = std::numeric_limits<double>::quiet_NaN();
    }
  }
}

NumberMap SeededParameters(const ClosedForm& form) {
  CHECK_LE(form.parameters.size(), static_cast<size_t>(kMaxParameters));
  NumberMap p;
  for (size_t k = 0; k < form.parameters.size(); ++k) {
    p[form.parameters[k].first] = Number(form.parameters[k].second, static_cast<int>(k));
  }
  return p;
}

PreparedScene Prepare(const ClosedForm& form) {
  PreparedScene prepared;
  std::string error;
  CHECK(ParseScene(form.scene_json, form.name, ".", &prepared.scene, &error)) << error;
  const NumberMap p = SeededParameters(form);
  prepared.directions.resize(form.parameters.size());
  const std::vector<SceneNumber<double>> places = EnumerateNumbers(&prepared.scene);
  for (const auto& [path, number] : form.numbers(p)) {
    ParameterPath place;
    CHECK(ResolveParameter(prepared.scene, path, &place, &error)) << form.name << ": " << error;
    CHECK_EQ(place.numbers.size(), 1U) << form.name << ": " << path;
    *places[place.numbers[0]].value = number.a;
    for (size_t k = 0; k < form.parameters.size(); ++k) {
      if (number.v[static_cast<int>(k)] != 0.0) {
        prepared.directions[k].emplace_back(place.numbers[0], number.v[static_cast<int>(k)]);
      }
    }
  }
  const auto duration = p.find("T");
  prepared.scene.simulation.duration = duration == p.end() ? form.instant : duration->second.a;
  prepared.scene.path.clear();
  prepared.scene.name = form.name;
  return prepared;
}

namespace {

// Inputs written as "name=value name=value".
Inputs Values(const std::string& text) {
  Inputs inputs;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const size_t at = word.find('=');
    inputs[word.substr(0, at)] = std::stod(word.substr(at + 1));
  }
  return inputs;
}

}  // namespace

std::vector<ClosedForm> AllClosedForms() {
  return {
      Drop("drop, one bounce", Values("y0=1.3 v0=0.2 e=0.75 g=9.81 r=0.12 T=0.85")),
      Drop("drop, elastic", Values("y0=1.1 v0=0 e=1 g=9.81 r=0.1 T=0.6")),
      Drop("drop, three bounces", Values("y0=1.1 v0=-0.4 e=0.65 g=9.81 r=0.08 T=1.5")),
      Drop("drop, lands and rests", Values("y0=0.9 v0=0.3 e=0 g=9.81 r=0.1 T=0.8")),
      ObliqueWall("wall, vertical",
                  Values("x0=0.5 y0=0.1 vx0=-2.2 vy0=1.4 e=0.8 phi=0 d=-0.6 r=0.15 g=9.81 T=0.9")),
      ObliqueWall("wall, oblique", Values("x0=-0.4 y0=1.8 vx0=0.5 vy0=-0.2 e=0.7 "
                                          "phi=1.1707963267948966 d=0.2 r=0.2 g=9.81 T=0.75")),
      TwoDiscs("two discs, equal, elastic", Values("m1=1 m2=1 e=1 r1=0.25 r2=0.25 x1=0 y1=0 x2=1.3 "
                                                   "y2=0 vx1=2 vy1=0 vx2=0 vy2=0 g=0 T=0.9")),
      TwoDiscs("two discs, oblique",
               Values("m1=1.4 m2=0.6 e=0.7 r1=0.2 r2=0.15 x1=-0.5 y1=0.05 x2=0.6 y2=0.25 vx1=2 "
                      "vy1=0.4 vx2=-1.2 vy2=-0.1 g=9.81 T=0.8")),
      ThreeBalls(
          "three balls, equal",
          Values("m1=1 m2=1 m3=1 e12=1 e23=1 r=0.1 x1=0 x2=0.55 x3=0.95 v1=2.1 v2=0 v3=0 T=0.9")),
      ThreeBalls("three balls, unequal", Values("m1=2.5 m2=1.2 m3=0.6 e12=0.85 e23=0.75 r=0.1 x1=0 "
                                                "x2=0.5 x3=0.92 v1=1.9 v2=0.1 v3=-0.2 T=0.8")),
      FrictionalImpact("frictional impact, sticks",
                       Values("x0=0.1 y0=1.1 th0=0.2 vx0=1.4 vy0=-0.8 w0=1.5 e=0.55 mu=0.5 g=9.81 "
                              "r=0.16 m=1.3 I=0.015 T=0.7")),
      FrictionalImpact("frictional impact, slides",
                       Values("x0=0.1 y0=1.1 th0=0.2 vx0=3 vy0=-0.8 w0=-1.5 e=0.4 mu=0.06 g=9.81 "
                              "r=0.16 m=4 I=0.05 T=0.65")),
      SlidingBlock("block, stops", Values("x0=0.2 v0=2.8 mu=0.45 g=9.81 m=1.7 T=1.3")),
      Incline("slope, slips from rest",
              Values("s0=0.1 v0=0 alpha=0.55 mu=0.28 g=9.81 m=1.7 T=1.1")),
      Incline("slope, up and back", Values("s0=0.1 v0=-1.6 alpha=0.5 mu=0.25 g=9.81 m=1.7 T=1.2")),
      Incline("slope, stops", Values("s0=0 v0=1.2 alpha=0.22 mu=0.5 g=9.81 m=1.7 T=1.1")),
      SlideToRoll("disc slides, then rolls",
                  Values("x0=0.1 th0=0.3 v0=2.2 w0=-1.3 mu=0.28 g=9.81 m=1.4 r=0.22 I=0.03 T=0.9")),
      Rolling("disc rolls down",
              Values("s0=0.1 th0=0.3 v0=0 w0=0 alpha=0.45 mu=0.55 g=9.81 m=1.4 r=0.22 I=0.03 T=1")),
      BoxPush("box pushed, stands", Values("w=0.5 h=0.9 m=3.5 mu=0.5 g=9.81 F=7 hp=0.8")),
      BoxPush("box pushed, slides", Values("w=0.8 h=0.9 m=3.5 mu=0.2 g=9.81 F=12 hp=0.6")),
      BoxPush("box pushed, tips", Values("w=0.5 h=0.9 m=3.5 mu=0.9 g=9.81 F=14 hp=0.85")),
      BoxPush("box pushed, tips and slides",
              Values("w=0.5 h=0.9 m=3.5 mu=0.05 g=9.81 F=38 hp=0.9")),
      PhysicalPendulum("pendulum", Values("m=1.3 L=0.7 Ic=0.09 g=9.81 theta0=1.9 T=1.2")),
      DoublePendulum("double pendulum",
                     Values("m1=1.2 m2=0.8 l1=0.9 l2=1 c1=0.45 c2=0.5 I1=0.081 I2=0.066 g=9.81 "
                            "th1_0=1.7 th2_0=0.9 w1_0=0.3 w2_0=-0.2 T=1")),
      BoxTip("box tips", Values("w=0.5 h=0.9 m=3.5 mu=0.8 g=9.81 F=11 T=0.3")),
  };
}

}  // namespace tangible::closed_forms
