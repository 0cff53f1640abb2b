// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/settings.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

TEST(CheckSettings, AcceptsTheDefaults) {
  std::string error;
  EXPECT_TRUE(CheckSettings(SimulationSettings(), &error));
  EXPECT_EQ(error, "");
}

TEST(CheckSettings, AcceptsEventSteppingWithEachIntegrator) {
  std::string error;
  SimulationSettings settings;
  settings.stepping = Stepping::kEvent;
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kTrapezoidal, Integrator::kRungeKutta4}) {
    settings.integrator = integrator;
    EXPECT_TRUE(CheckSettings(settings, &error)) << error;
  }
}

TEST(CheckSettings, AcceptsBothImpactLawsWithEventStepping) {
  std::string error;
  SimulationSettings settings;
  settings.stepping = Stepping::kEvent;
  for (const ImpactLaw law : {ImpactLaw::kNewton, ImpactLaw::kPoisson}) {
    settings.impact_law = law;
    EXPECT_TRUE(CheckSettings(settings, &error)) << error;
  }
}

TEST(CheckSettings, NamesWhatIsMissing) {
  std::string error;
  SimulationSettings settings;
  settings.integrator = Integrator::kTrapezoidal;
  EXPECT_FALSE(CheckSettings(settings, &error));
  EXPECT_EQ(error.find("/simulation/integrator: "), 0u) << error;
  EXPECT_NE(error.find("\"stepping\": \"event\""), std::string::npos) << error;
  settings = SimulationSettings();
  settings.impact_law = ImpactLaw::kPoisson;
  EXPECT_FALSE(CheckSettings(settings, &error));
  EXPECT_EQ(error,
            "/simulation/impact_law: expected \"newton\" with fixed stepping (the other needs "
            "\"stepping\": \"event\"), got \"poisson\"");
  settings = SimulationSettings();
  settings.stepping = Stepping::kEvent;
  settings.smoothing = 1e-4;
  EXPECT_FALSE(CheckSettings(settings, &error));
  EXPECT_EQ(error,
            "/simulation/smoothing: expected 0 with event stepping (others need \"stepping\": "
            "\"fixed\"), got 0.0001");
}

}  // namespace
}  // namespace tangible
