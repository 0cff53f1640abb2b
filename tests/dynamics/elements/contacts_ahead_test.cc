// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contacts_ahead.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"

namespace tangible {
namespace {

// A box of 0.4 m x 0.2 m whose lower right corner is `ahead` before the upper left corner of a tile
// and `above` it, and moves at (2, vy).
struct BeforeATile {
  BeforeATile(double ahead, double above, double vy = 0.0) {
    Scene scene = test_scenes::SceneOf(R"({"bodies": [
        {"name": "box", "mass": 1, "shape": {"box": {"size": [0.4, 0.2]}}, "position": [0, 0]},
        {"name": "tile", "static": true, "shape": {"box": {"size": [1, 1]}},
         "position": [0.5, -0.5]}]})");
    scene.bodies[0].position = {-0.2 - ahead, 0.1 + above};
    scene.bodies[0].velocity = {2.0, vy};
    BuildModel(scene, &model, &state);
    contact.a = 0;
    contact.b = 1;
    contact.feature = {FeatureKind::kVertexVertex, 1, 3};  // lower right, upper left
    contact.gap = std::hypot(ahead, above);
  }
  ContactsAhead Find() const {
    return FindContactsAhead(model, state, contact, -2.0, 0.2, 1e-9, 1e-9);
  }
  Model<double> model;
  State<double> state;
  ActiveContact contact;
};

TEST(ContactsAheadTest, AFlushCornerIsPassedOverTheFace) {
  for (const double ahead : {0.0, 1e-12, 0.01}) {
    for (const double above : {0.0, 1e-16, -1e-16, 1e-12, -1e-12}) {
      const BeforeATile scene(ahead, above);
      const ContactsAhead found = scene.Find();
      ASSERT_GE(found.count, 1) << ahead << " " << above;
      for (int k = 0; k < found.count; ++k) {
        ContactRows<double> rows;
        EvaluateContactRows(scene.model, scene.state, found.contacts[k], &rows);
        EXPECT_NEAR(rows.geometry.normal.y(), 1.0, 1e-14);
        EXPECT_NEAR(found.contacts[k].gap, above, 1e-15);
        EXPECT_NEAR(found.speed[k], 0.0, 1e-14);
      }
    }
  }
}

// Beyond the tolerance it stands: a step in the floor is hit, what is above it is not yet touched.
TEST(ContactsAheadTest, ACornerThatIsNotFlushStands) {
  for (const double above : {1e-6, -1e-6, 0.01, -0.01}) {
    EXPECT_EQ(BeforeATile(0.001, above).Find().count, 0) << above;
  }
}

// Downwards it meets the face with that speed, and not with that of the line between the corners.
TEST(ContactsAheadTest, TheFaceIsApproachedWithItsOwnSpeed) {
  const ContactsAhead found = BeforeATile(0.0, 0.0, -0.25).Find();
  ASSERT_GE(found.count, 1);
  EXPECT_NEAR(found.speed[0], -0.25, 1e-14);
}

}  // namespace
}  // namespace tangible
