// SPDX-License-Identifier: Apache-2.0
//
// Motions of ellipses that touch: how the direction of a contact turns, against differences of the
// geometry; slender ellipses that rock and tumble keep their energy and have their derivatives.
#include "tangible/simulation/events/ellipse_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/tolerances.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using test_scenes::Text;
using testing::Jacobian;

/// The angle of a contact's normal in the frame of a body.
double DirectionIn(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact, int body) {
  ContactRows<double> rows;
  EvaluateContactRows(model, state, contact, &rows);
  const Vector2<double>& n = rows.geometry.normal;
  return std::atan2(n.y(), n.x()) - state.pose[3 * body + 2];
}

/// Two bodies at each other's surface, with random twists: the longest motion follows from the
/// turn of the contact's direction in each of the ellipses, which differences of the geometry give.
void ExpectTurnOfDifferences(const std::string& first, const std::string& second,
                             const std::vector<int>& ellipses) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(R"({"bodies": [
      {"name": "a", "mass": 1, "position": [0, 0], "shape": )" +
                     first + R"(}, {"name": "b", "mass": 2, "position": [0, 0], "shape": )" +
                     second + R"(}], "simulation": {"stepping": "event"}})"),
             &model, &state);
  EventSearch search(model);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (int trial = 0; trial < 10; ++trial) {
    for (double& x : state.pose) x = number(random);
    state.pose[1] += 3.0;  // a above b
    for (double& x : state.twist) x = number(random);
    std::vector<ActiveContact> contacts;
    search.FindContacts(model, state, 10.0, &contacts);
    ASSERT_EQ(contacts.size(), 1u);
    ContactRows<double> rows;
    EvaluateContactRows(model, state, contacts[0], &rows);
    for (int i = 0; i < 2; ++i) {
      state.pose[i] -= rows.geometry.gap * rows.geometry.normal[i];
    }
    ContactSolution<double> at_rest;
    at_rest.motion.assign(6, 0.0);
    at_rest.normal_impulse.assign(1, 0.0);
    at_rest.modes.assign(1, ContactMode::kClosed);
    const EllipseMotion motion = LongestEllipseMotion(model, state, contacts, at_rest);
    double longest = HUGE_VAL;
    for (const int body : ellipses) {
      constexpr double kTime = 1e-6;
      State<double> moved[2] = {state, state};
      for (size_t i = 0; i < state.pose.size(); ++i) {
        moved[0].pose[i] -= kTime * state.twist[i];
        moved[1].pose[i] += kTime * state.twist[i];
      }
      const double rate = std::remainder(DirectionIn(model, moved[1], contacts[0], body) -
                                             DirectionIn(model, moved[0], contacts[0], body),
                                         2.0 * M_PI) /
                          (2.0 * kTime);
      const double* axes = &model.parameters[model.structure->bodies[body].shape_numbers];
      const double phi = DirectionIn(model, state, contacts[0], body);
      const double share =
          std::hypot(axes[0] * std::cos(phi), axes[1] * std::sin(phi)) / std::max(axes[0], axes[1]);
      longest = std::min(longest, kEllipseTurn * share / std::abs(rate));
    }
    EXPECT_EQ(motion.contact, 0);
    EXPECT_NEAR(motion.longest, longest, 1e-6 * longest) << trial;
    at_rest.modes[0] = ContactMode::kOpen;
    EXPECT_EQ(LongestEllipseMotion(model, state, contacts, at_rest).longest, HUGE_VAL);
  }
}

TEST(EllipseMotionTest, TheDirectionTurnsAsTheGeometrySays) {
  const std::string ellipse = R"({"ellipse": {"radii": [1, 0.2]}})";
  ExpectTurnOfDifferences(ellipse, R"({"circle": {"radius": 0.3}})", {0});
  ExpectTurnOfDifferences(R"({"circle": {"radius": 0.3}})", ellipse, {1});
  ExpectTurnOfDifferences(ellipse, R"({"ellipse": {"radii": [0.4, 0.7]}})", {0, 1});
  ExpectTurnOfDifferences(ellipse, R"({"box": {"size": [8, 0.5]}})", {0});      // faces
  ExpectTurnOfDifferences(R"({"box": {"size": [0.02, 0.01]}})", ellipse, {1});  // corners
}

// Without twists: φ̈ τ² / 2 = κ h / a; on the flat side the phase of rocking, τ √(λn ρ / I) = κ'.
TEST(EllipseMotionTest, AccelerationsAndForcesCount) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(R"({"bodies": [
      {"name": "e", "mass": 1, "inertia": 0.25, "position": [0, 0.1],
       "shape": {"ellipse": {"radii": [1, 0.1]}}},
      {"name": "f", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}}],
      "simulation": {"stepping": "event"}})"),
             &model, &state);
  std::vector<ActiveContact> contacts;
  EventSearch(model).FindContacts(model, state, 0.1, &contacts);
  ASSERT_EQ(contacts.size(), 1u);
  ContactSolution<double> solution;
  solution.motion = {0.0, 0.0, 40.0};
  solution.normal_impulse = {1e-9};
  solution.modes = {ContactMode::kClosed};
  EXPECT_NEAR(LongestEllipseMotion(model, state, contacts, solution).longest,
              std::sqrt(2.0 * kEllipseTurn * 0.1 / 40.0), 1e-12);
  solution.motion[2] = 0.0;
  solution.normal_impulse[0] = 9.81;
  EXPECT_NEAR(LongestEllipseMotion(model, state, contacts, solution).longest,
              kEllipsePhase / std::sqrt(9.81 * (1.0 / 0.1) / 0.25), 1e-12);
}

/// An ellipse of semi-axes 1 m and 1 / aspect that touches the floor at this angle.
Scene Slender(double aspect, double angle, double friction, double dt, double duration) {
  const double b = 1.0 / aspect;
  return SceneOf(R"({"bodies": [
      {"name": "b", "shape": {"ellipse": {"radii": [1, )" +
                 Text(b) + R"(]}}, "mass": 2, "friction": )" + Text(friction) +
                 R"(, "position": [0, )" + Text(std::hypot(std::sin(angle), b * std::cos(angle))) +
                 R"(], "angle": )" + Text(angle) + R"(},
      {"name": "floor", "static": true, "friction": )" +
                 Text(friction) +
                 R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"stepping": "event", "dt": )" +
                 Text(dt) + R"(, "duration": )" + Text(duration) + "}}");
}

struct RolledEllipse {
  RolloutReport report;
  Model<double> model;
  State<double> start, final;
  double Energy(const State<double>& state) const {
    return KineticEnergy(model, state) + PotentialEnergy(model, state);
  }
};

/// With an angular velocity with which it stays on the floor: y = h(φ), ẏ = h' φ̇.
RolledEllipse RollEllipse(const Scene& scene, double omega = 0.0) {
  RolledEllipse run;
  BuildModel(scene, &run.model, &run.start);
  const double* radii = &run.model.parameters[run.model.structure->bodies[0].shape_numbers];
  const double phi = run.start.pose[2];
  run.start.twist[1] = omega * (radii[0] * radii[0] - radii[1] * radii[1]) * std::sin(phi) *
                       std::cos(phi) / run.start.pose[1];
  run.start.twist[2] = omega;
  run.report = Rollout(run.model, run.start, nullptr, &run.final);
  return run;
}

// In 2 s the contact point runs some five times from one tip to the other, at up to 1000 m/s. The
// stated tolerance of the energy, 1e-6, is thirty times kEllipseTurn⁵. The tumbling one passes its
// tip as well.
TEST(EllipseMotionTest, SlenderEllipsesKeepTheirEnergy) {
  for (const double aspect : {1.0, 10.0, 100.0, 333.0}) {
    for (const double friction : {0.0, 20.0}) {
      const RolledEllipse run = RollEllipse(Slender(aspect, 0.3, friction, 0.005, 2.0));
      ASSERT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
      EXPECT_EQ(run.report.events, 0) << aspect;
      const double energy = run.Energy(run.start);
      EXPECT_NEAR(run.Energy(run.final), energy, 1e-6 * energy) << aspect << " " << friction;
      EXPECT_EQ(run.report.ellipse_motions > 0, aspect > 1.0) << run.report.ellipse_motions;
      // Those of a turn grow as log(aspect).
      EXPECT_LT(run.report.ellipse_motions, 3000);
    }
    // From the tip it falls without friction, lies, and rises to the other tip.
    const RolledEllipse falling = RollEllipse(Slender(aspect, 1.5, 0.0, 0.005, 2.0), -0.1);
    ASSERT_EQ(falling.report.status, StepStatus::kDone) << falling.report.message;
    const double energy = falling.Energy(falling.start);
    EXPECT_NEAR(falling.Energy(falling.final), energy, 1e-6 * energy) << aspect;
    EXPECT_EQ(falling.final.pose[2]<0.0, aspect> 1.0) << falling.final.pose[2];
  }
}

// Without friction the centre moves up and down alone, h(φ) above the floor, so that
//   (I + m h'²) φ̇² / 2 = m g (h_0 − h),   T = 4 ∫ dφ / φ̇ from 0 to φ_0.
// After two periods it is where it was.
TEST(EllipseMotionTest, ASlenderEllipseRocksWithItsPeriod) {
  constexpr double kB = 0.003, kStart = 0.3;
  constexpr int kPoints = 20000;  // the integrand is smooth and even at both ends
  const auto height = [](double phi) { return std::hypot(std::sin(phi), kB * std::cos(phi)); };
  double period = 0.0;
  for (int k = 0; k < kPoints; ++k) {
    const double u = (k + 0.5) * 0.5 * M_PI / kPoints;
    const double phi = kStart * std::sin(u);
    const double slope = (1.0 - kB * kB) * std::sin(phi) * std::cos(phi) / height(phi);
    const double fall = (1.0 - kB * kB) * std::sin(kStart - phi) * std::sin(kStart + phi) /
                        (height(kStart) + height(phi));
    period += 4.0 * (0.5 * M_PI / kPoints) * kStart * std::cos(u) *
              std::sqrt((0.25 * (1.0 + kB * kB) + slope * slope) / (2.0 * kGravity * fall));
  }
  const RolledEllipse run = RollEllipse(Slender(1.0 / kB, kStart, 0.0, 0.005, 2.0 * period));
  EXPECT_GT(run.report.ellipse_motions, 500);
  // The speed changes by less than 2 g / (1 m) in a second; times are right to 1e-5.
  EXPECT_NEAR(run.final.twist[2], 0.0, 1e-5 * 2.0 * period * 2.0 * kGravity);
  EXPECT_NEAR(run.final.pose[2], kStart, 1e-5);
}

// The derivatives are those of the motion: by all methods, of a run in which the ellipse lands and
// then turns over its flat side at 300 m/s, and the certificate calls them trustworthy.
TEST(EllipseMotionTest, SlenderEllipsesHaveTheirDerivatives) {
  for (const double friction : {0.0, 20.0}) {
    Scene scene = Slender(100.0, 0.3, friction, 0.005, 0.4);
    scene.bodies[0].position.y() += 0.01;
    EXPECT_LT(RollEllipse(scene).final.pose[2], -0.1);
    EXPECT_GT(RollEllipse(scene).report.ellipse_motions, 50);
    const std::vector<std::string> paths = {"bodies/b/shape/radii/x", "bodies/b/shape/radii/y",
                                            "bodies/b/angular_velocity", "gravity/y"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_EQ(result.certificate.verdict, "trustworthy");
    testing::ExpectOthersAgree(scene, paths, result);
  }
}

TEST(EllipseMotionTest, ALimitOfMotionsIsAnErrorWithAName) {
  // It would rock at 2e5 rad/s, at any amplitude.
  const RolledEllipse run = RollEllipse(Slender(1e9, 0.0, 0.0, 0.1, 0.1));
  EXPECT_EQ(run.report.status, StepStatus::kUnsolved);
  EXPECT_NE(run.report.message.find("motions in a step"), std::string::npos) << run.report.message;
  EXPECT_NE(run.report.message.find("contact of b and floor"), std::string::npos)
      << run.report.message;
}

// An impact with friction makes the ellipse turn by radians within the step: its next side hits the
// floor in the same one, though the speeds of the contact at both ends of the motion may be equal.
TEST(EllipseMotionTest, AnEllipseThatTurnsFastHitsTheFloorAgainWithinAStep) {
  for (int k = 0; k < 31; ++k) {
    const double angle = 0.1 * k;
    Model<double> model;
    State<double> state, last;
    BuildModel(SceneOf(R"({"bodies": [
        {"name": "e", "shape": {"ellipse": {"radii": [0.3, 0.1]}}, "mass": 1, "position": [0, 0.8],
         "velocity": [0, -14], "friction": 0.3, "restitution": 0.5, "angle": )" +
                       Text(angle) + R"(},
        {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}},
         "friction": 0.3, "restitution": 0.5}],
        "simulation": {"stepping": "event", "dt": 0.1, "duration": 0.5}})"),
               &model, &state);
    const auto above = [&](long, double t, const State<double>& at, Stepper*) {
      const double height = std::hypot(0.3 * std::sin(at.pose[2]), 0.1 * std::cos(at.pose[2]));
      EXPECT_GT(at.pose[1] - height, -1e-9) << angle << " at " << t;
    };
    EXPECT_EQ(Rollout(model, state, above, &last).status, StepStatus::kDone) << angle;
  }
}

// A body on a spring that is too stiff for the step: the energy grows, and no derivative is called
// trustworthy.
TEST(EllipseMotionTest, GrownEnergyIsNotTrustworthy) {
  const auto scene = [](double stiffness) {
    return SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 1, "inertia": 1, "position": [1.1, 0]}],
        "springs": [{"name": "s", "bodies": ["b", "world"], "anchors": [[1.1, 0], [0, 0]],
                     "rest_length": 1, "stiffness": )" +
                   Text(stiffness) + R"(}],
        "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.05}})");
  };
  for (const double stiffness : {1e3, 1e5}) {
    Model<double> model;
    State<double> state;
    BuildModel(scene(stiffness), &model, &state);
    RolloutReport report;
    const Certificate certificate = CertifyRollout(model, state, {}, &report);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    if (stiffness < 1e4) {
      EXPECT_EQ(certificate.verdict, "trustworthy");
    } else {
      EXPECT_NE(certificate.verdict.find("the energy grew"), std::string::npos)
          << certificate.verdict;
    }
  }
}

}  // namespace
}  // namespace tangible
