// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/settings.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

TEST(CheckSettings, AcceptsTheDefaults) {
  std::string error;
  EXPECT_TRUE(CheckSettings(Scene(), &error));
  EXPECT_EQ(error, "");
}

TEST(CheckSettings, AcceptsEventSteppingWithEachIntegrator) {
  std::string error;
  Scene scene;
  SimulationSettings& settings = scene.simulation;
  settings.stepping = Stepping::kEvent;
  for (const Integrator integrator : {Integrator::kTrapezoidal, Integrator::kRungeKutta4}) {
    settings.integrator = integrator;
    EXPECT_TRUE(CheckSettings(scene, &error)) << error;
  }
}

TEST(CheckSettings, AcceptsBothImpactLawsWithEventStepping) {
  std::string error;
  Scene scene;
  SimulationSettings& settings = scene.simulation;
  settings.stepping = Stepping::kEvent;
  for (const ImpactLaw law : {ImpactLaw::kNewton, ImpactLaw::kPoisson}) {
    settings.impact_law = law;
    EXPECT_TRUE(CheckSettings(scene, &error)) << error;
  }
}

TEST(CheckSettings, NamesWhatIsMissing) {
  std::string error;
  Scene scene;
  SimulationSettings& settings = scene.simulation;
  settings.integrator = Integrator::kTrapezoidal;
  EXPECT_FALSE(CheckSettings(scene, &error));
  EXPECT_EQ(error.find("/simulation/integrator: "), 0u) << error;
  EXPECT_NE(error.find("\"stepping\": \"event\""), std::string::npos) << error;
  settings = SimulationSettings();
  settings.stepping = Stepping::kEvent;
  settings.integrator = Integrator::kSemiImplicitEuler;
  EXPECT_FALSE(CheckSettings(scene, &error));
  EXPECT_EQ(error,
            "/simulation/integrator: expected \"runge_kutta_4\" or \"trapezoidal\" with event "
            "stepping (semi_implicit_euler gains energy without bound there), got "
            "\"semi_implicit_euler\"");
  settings = SimulationSettings();
  settings.impact_law = ImpactLaw::kPoisson;
  EXPECT_FALSE(CheckSettings(scene, &error));
  EXPECT_EQ(error,
            "/simulation/impact_law: expected \"newton\" with fixed stepping (the other needs "
            "\"stepping\": \"event\"), got \"poisson\"");
  settings = SimulationSettings();
  BasicJoint<double> joint;
  joint.friction = 2.0;
  scene.joints = {joint, joint};
  EXPECT_TRUE(CheckSettings(scene, &error));
  scene.joints[1].kinetic_friction = 1.5;
  EXPECT_FALSE(CheckSettings(scene, &error));
  EXPECT_EQ(error,
            "/joints/1/kinetic_friction: expected none with fixed stepping (friction that decays "
            "with the speed needs \"stepping\": \"event\"), got 1.5");
  settings.stepping = Stepping::kEvent;
  EXPECT_TRUE(CheckSettings(scene, &error));
}

}  // namespace
}  // namespace tangible
