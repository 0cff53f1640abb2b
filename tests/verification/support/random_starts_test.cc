// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/random_starts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tangible/scene/scene_json.h"
#include "tangible/simulation/events/event_search.h"

namespace tangible {
namespace {

TEST(RandomStartsTest, ASeedIsAScene) {
  EXPECT_EQ(SceneToJson(RandomStart(5, Stepping::kEvent)),
            SceneToJson(RandomStart(5, Stepping::kEvent)));
  Scene other = RandomStart(6, Stepping::kEvent);
  other.name = "start 5";
  EXPECT_NE(SceneToJson(RandomStart(5, Stepping::kEvent)), SceneToJson(other));
}

TEST(RandomStartsTest, AllTouchAndNothingApproaches) {
  int below = 0, above = 0, sliding = 0, resting = 0;  // of μ |W_nt| / W_nn and of slips
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const Scene scene = RandomStart(seed, Stepping::kEvent);
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    std::vector<ActiveContact> contacts;
    EventSearch(model).FindContacts(model, state, 1e-9, &contacts);
    ASSERT_FALSE(contacts.empty()) << seed;
    for (const ActiveContact& contact : contacts) {
      EXPECT_NEAR(contact.gap, 0.0, 1e-14) << seed;
      const ContactSpeeds speeds = SpeedsOf(model, state, contact);
      EXPECT_NEAR(speeds.normal, 0.0, 1e-13) << seed;
      (std::abs(speeds.slip) > 1e-9 ? sliding : resting) += 1;
    }
    // Of the first body's first contact with the floor, which is level before it is tilted.
    const ActiveContact& contact = contacts.front();
    ContactRows<double> rows;
    EvaluateContactRows(model, state, contact, &rows);
    const BodyIndex& body = model.structure->bodies[1];
    const RowPart<double>& n = contact.a == 1 ? rows.normal_a : rows.normal_b;
    const RowPart<double>& t = contact.a == 1 ? rows.tangent_a : rows.tangent_b;
    const double inertia = model.parameters[body.inertia];
    const double normal = 1.0 / model.parameters[body.mass] + n[2] * n[2] / inertia;
    const double mixed = std::abs(n[2] * t[2]) / inertia;
    const double friction = MixedFriction(model, contact.a, contact.b).value;
    (friction * mixed > normal ? above : below) += 1;
  }
  for (const int count : {below, above, sliding, resting}) EXPECT_GT(count, 40);
}

TEST(RandomStartsTest, ParametersAreWhatOpensSlidesOrTurns) {
  const std::vector<ParameterPath> parameters = StartParameters(RandomStart(1, Stepping::kFixed));
  for (const char* path : {"gravity/y", "bodies/body/velocity/y", "bodies/body/angular_velocity"}) {
    EXPECT_TRUE(std::any_of(parameters.begin(), parameters.end(), [&](const ParameterPath& p) {
      return p.path == path;
    })) << path;
  }
}

}  // namespace
}  // namespace tangible
