// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/settings.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

TEST(CheckSettings, AcceptsTheDefaults) {
  std::string error;
  EXPECT_TRUE(CheckSettings(SimulationSettings(), &error));
  EXPECT_EQ(error, "");
}

TEST(CheckSettings, NamesWhatIsMissing) {
  std::string error;
  SimulationSettings settings;
  settings.stepping = Stepping::kEvent;
  EXPECT_FALSE(CheckSettings(settings, &error));
  EXPECT_EQ(error,
            "/simulation/stepping: expected \"fixed\" (the only one available), got \"event\"");
  settings = SimulationSettings();
  settings.integrator = Integrator::kTrapezoidal;
  EXPECT_FALSE(CheckSettings(settings, &error));
  EXPECT_EQ(error.find("/simulation/integrator: "), 0u) << error;
  settings = SimulationSettings();
  settings.impact_law = ImpactLaw::kPoisson;
  EXPECT_FALSE(CheckSettings(settings, &error));
  EXPECT_EQ(error.find("/simulation/impact_law: "), 0u) << error;
}

}  // namespace
}  // namespace tangible
