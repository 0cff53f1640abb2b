// SPDX-License-Identifier: Apache-2.0
//
// Drag and joint springs: motions and derivatives against closed forms, by every method.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::Jacobian;

struct Expected {
  double value = 0.0;
  std::vector<double> derivatives;
};

/// A number of the final state and its derivatives; the other methods agree.
void Expect(const Scene& scene, const std::vector<std::string>& paths, int output,
            const Expected& expected, double tolerance) {
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  EXPECT_NEAR(result.values[output], expected.value, tolerance);
  for (size_t k = 0; k < paths.size(); ++k) {
    EXPECT_NEAR(result.jacobian(output, static_cast<Eigen::Index>(k)), expected.derivatives[k],
                tolerance)
        << paths[k];
  }
  testing::ExpectOthersAgree(scene, paths, result);
}

std::string Simulation(const char* stepping, double dt) {
  return std::string(R"("simulation": {"duration": 1, "stepping": ")") + stepping + R"(", "dt": )" +
         std::to_string(dt) + "}}";
}

// d|v|/dt = −(c/m) |v|²:  v = v_0 / (1 + c |v_0| t / m), along v_0.
TEST(MechanismsTest, DragSlowsAsInTheClosedForm) {
  const std::string body = R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.1, "position": [0, 0], "velocity": [3, 4],
       "quadratic_drag": 0.5}], )";
  const double q = 1.0 + 0.5 * 5.0 / 2.0;
  const Expected exact = {3.0 / q, {-3.0 * 5.0 / 2.0 / (q * q), 3.0 * 0.5 * 5.0 / 4.0 / (q * q)}};
  const std::vector<std::string> paths = {"bodies/b/quadratic_drag", "bodies/b/mass"};
  Expect(SceneOf(body + Simulation("event", 0.005)), paths, 3, exact, 1e-9);
  // v⁺ = v / (1 + h c |v| / m) is this form's own recursion.
  Expect(SceneOf(body + Simulation("fixed", 0.01)), paths, 3, exact, 1e-13);
}

// At rest the drag has no derivative by its coefficient, and nothing is divided by the speed.
TEST(MechanismsTest, DragOfABodyAtRestIsNothing) {
  for (const char* stepping : {"fixed", "event"}) {
    const Scene scene = SceneOf(std::string(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.1, "position": [0, 0], "quadratic_drag": 0.5}], )") +
                                Simulation(stepping, 0.01));
    Expect(scene, {"bodies/b/quadratic_drag", "bodies/b/velocity/x"}, 3, {0.0, {0.0, 1.0}}, 1e-15);
  }
}

// θ = r + (θ_0 − r) cos(w t), w² = k / (I + m l²).
TEST(MechanismsTest, ASpringAtAHingeSwingsAsInTheClosedForm) {
  const std::string body = R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.1, "position": [0, -1]}],
    "joints": [{"name": "h", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                "angle": 0.3, "stiffness": 8, "rest_angle": 0.1}], )";
  const double w = std::sqrt(8.0 / 2.1);
  const Expected exact = {0.1 + 0.2 * std::cos(w),
                          {-0.2 * std::sin(w) * w / 16.0, 1.0 - std::cos(w), std::cos(w)}};
  const std::vector<std::string> paths = {"joints/h/stiffness", "joints/h/rest_angle",
                                          "joints/h/angle"};
  Expect(SceneOf(body + Simulation("event", 0.005)), paths, 2, exact, 1e-9);
  Expect(SceneOf(body + Simulation("fixed", 0.0002)), paths, 2, exact, 1e-3);
}

// x = x_0 cos(w t) about the rest, between two bodies: the reduced mass.
TEST(MechanismsTest, ASpringAtASliderMovesBothBodies) {
  const std::string bodies = R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.1, "position": [0.5, 0]},
      {"name": "b", "mass": 3, "inertia": 0.1, "position": [0, 0]}],
    "joints": [{"name": "s", "type": "prismatic", "bodies": ["a", "b"], "anchor": [0.5, 0],
                "axis": [1, 0], "stiffness": 6, "rest_displacement": -0.2}], )";
  const double w = std::sqrt(6.0 / 1.2);
  // The centre of mass stays; a moves by 3/5 of the displacement d = −0.2 + 0.2 cos(w t).
  const Expected exact = {0.5 + 0.6 * 0.2 * (std::cos(w) - 1.0),
                          {-0.6 * 0.2 * std::sin(w) * w / 12.0, 0.6 * (1.0 - std::cos(w))}};
  const std::vector<std::string> paths = {"joints/s/stiffness", "joints/s/rest_displacement"};
  Expect(SceneOf(bodies + Simulation("event", 0.005)), paths, 0, exact, 1e-9);
}

}  // namespace
}  // namespace tangible
