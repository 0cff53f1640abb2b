// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A thrown ball, of which tangible-fit finds the gravity g and the initial speed.

#include <nlohmann/json.hpp>
#include <string>

#include "run_program.h"

namespace tangible {

class FitProgramTest : public ProgramTest {
 protected:
  using json = nlohmann::json;

  /// `observations`: the table o.csv.
  void SetUpWith(const std::string& observations) {
    ProgramTest::SetUp();
    Write("scene.json", R"({"bodies": [
  {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "inertia": 0.005,
   "position": [0, 1], "velocity": [2, 3]}],
  "gravity": [0, -9.5], "simulation": {"dt": 0.01, "duration": 0.5}})");
    Write("o.csv", observations);
  }

  /// y of semi-implicit Euler's parabola at t = k dt: 1 + 3 t - g dt² k (k + 1) / 2.
  static double Height(int k, double g = 9.5) {
    return 1.0 + 0.03 * k - g * 1e-4 * 0.5 * k * (k + 1);
  }

  /// A fit of g and the initial speed; `changes` are merged into it.
  static json Problem(const json& changes = json::object()) {
    json fit =
        json::parse(R"({"scene": "scene.json", "observations": [{"file": "o.csv", "sigma": 0.01}],
      "parameters": [{"name": "g", "initial": 8, "lower": 1, "upper": 20,
                      "sets": [{"path": "gravity/y", "scale": -1}]},
                     {"name": "speed", "initial": 1, "sets": [{"path": "bodies/ball/velocity/x"}]}]})");
    fit.merge_patch(changes);
    return fit;
  }

  ProgramRun Fit(const json& fit, const std::string& flags = "") const {
    return Run("tangible-fit", "'" + Write("fit.json", fit.dump()) + "' " + flags);
  }
};

}  // namespace tangible
