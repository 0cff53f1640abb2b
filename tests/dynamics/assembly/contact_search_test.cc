// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/assembly/contact_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../../support/scenes.h"

namespace tangible {
namespace {

struct Search {
  Model<double> model;
  State<double> state;
  AssemblyScratch<double> scratch;
  ContactProblem<double> problem;
  std::vector<ActiveContact> contacts;
  std::vector<CoefficientSource> friction, restitution;
};

// The contacts of the first step of a scene.
Search Find(const Scene& scene) {
  Search s;
  BuildModel(scene, &s.model, &s.state);
  const double h = scene.simulation.dt;
  AssembleWithoutContacts(s.model, s.state, 0.0, h, &s.problem, &s.scratch);
  ContactSearch search(s.model);
  search.SetBounds(s.model, s.state, s.problem, s.scratch);
  search.Find(s.model, s.state, h, s.scratch, &s.contacts, &s.friction, &s.restitution);
  EXPECT_EQ(s.contacts.size(), s.friction.size());
  EXPECT_EQ(s.contacts.size(), s.restitution.size());
  return s;
}

// A ball of radius 0.1 above the floor, dt 0.01, threshold 1e-3, recovery speed 3.
Scene Ball(double gap, double speed, double restitution) {
  Scene scene = test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01})"));
  scene.bodies[0].position.y() = 0.1 + gap;
  scene.bodies[0].velocity.y() = speed;
  scene.bodies[0].restitution = scene.bodies[1].restitution = restitution;
  return scene;
}

TEST(ContactSearchTest, LawByGapSpeedAndRestitution) {
  const struct {
    double gap, speed, restitution;
    ContactLaw law;
  } cases[] = {{0.005, -1.0, 0.5, ContactLaw::kRestitution},
               {0.005, -1.0, 0.0, ContactLaw::kGap},      // inelastic
               {0.0, -5e-4, 0.5, ContactLaw::kGap},       // below the threshold
               {0.0, 1.0, 0.5, ContactLaw::kGap},         // separating
               {-0.01, 0.0, 0.5, ContactLaw::kGap},       // gap / h = −1
               {-0.05, 0.0, 0.5, ContactLaw::kRecovery},  // gap / h = −5, held at −3
               {-0.01, -1.0, 0.5, ContactLaw::kGap},      // e v = −0.5 is the weaker
               {-0.01, -4.0, 0.5, ContactLaw::kRestitution},
               {-0.05, -4.0, 0.5, ContactLaw::kRecovery},  // −2 against −3
               {-0.05, -8.0, 0.5, ContactLaw::kRestitution}};
  for (const auto& c : cases) {
    const Search s = Find(Ball(c.gap, c.speed, c.restitution));
    ASSERT_EQ(s.contacts.size(), 1u);
    EXPECT_EQ(s.contacts[0].law, c.law) << c.gap << " " << c.speed;
    EXPECT_NEAR(s.contacts[0].gap, c.gap, 1e-15);
  }
}

TEST(ContactSearchTest, PairsOutOfReachAreNotListed) {
  // Bound: the speed 1 (and 1.0981 after gravity's share) times 0.01, plus the margin 1e-4.
  EXPECT_EQ(Find(Ball(0.0110, -1.0, 0.5)).contacts.size(), 1u);
  EXPECT_EQ(Find(Ball(0.0112, -1.0, 0.5)).contacts.size(), 0u);
  // Away from the floor it is still listed: another impact may drive it back.
  EXPECT_EQ(Find(Ball(0.009, 1.0, 0.5)).contacts.size(), 1u);
}

TEST(ContactSearchTest, AnImpactThatTheFreeMotionDoesNotReachHasNoRestitution) {
  // Listed, as sideways speed widens the bound, but free motion falls short of the margin.
  Scene scene = Ball(0.02, -0.1, 0.5);
  scene.bodies[0].velocity.x() = 4.0;
  const Search s = Find(scene);
  ASSERT_EQ(s.contacts.size(), 1u);
  EXPECT_EQ(s.contacts[0].law, ContactLaw::kGap);
}

TEST(ContactSearchTest, BoundsAreRaisedWhereABodyTurnsOutFaster) {
  const Scene scene = Ball(0.5, -1.0, 0.5);
  Search s = Find(scene);
  EXPECT_TRUE(s.contacts.empty());
  ContactSearch search(s.model);
  search.SetBounds(s.model, s.state, s.problem, s.scratch);
  std::vector<double> twist = s.state.twist;
  EXPECT_FALSE(search.CheckBounds(s.model, twist, s.scratch));
  twist[1] = -60.0;
  EXPECT_TRUE(search.CheckBounds(s.model, twist, s.scratch));
  search.Find(s.model, s.state, 0.01, s.scratch, &s.contacts, &s.friction, &s.restitution);
  EXPECT_EQ(s.contacts.size(), 1u);
}

TEST(ContactSearchTest, AFlatBoxHasTwoContactsAndLimitsComeLast) {
  Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [1, 0.2]}}, "mass": 1, "position": [0, 0.1]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "arm", "shape": {"box": {"size": [0.1, 0.1]}}, "mass": 1, "position": [5, 5]}],
    "joints": [{"name": "j", "type": "revolute", "bodies": ["arm", "world"], "anchor": [5, 5],
                "limits": [0, 1e-4], "rate": 0.1}]})");
  const Search s = Find(scene);
  ASSERT_EQ(s.contacts.size(), 4u);
  EXPECT_EQ(s.contacts[0].joint, -1);
  EXPECT_EQ(s.contacts[1].joint, -1);
  EXPECT_EQ(s.contacts[2].joint, 0);
  EXPECT_EQ(s.contacts[2].side, 1.0);
  EXPECT_EQ(s.contacts[3].side, -1.0);
  EXPECT_NEAR(s.contacts[3].gap, 1e-4, 1e-15);
}

// Bodies that fly, turn and turn back: a search that keeps its boxes lists the contacts of one that
// has none.
TEST(ContactSearchTest, KeptBoxesListWhatNewOnesList) {
  Scene scene = test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01})"));
  const BasicBody<double> ball = scene.bodies[0];
  for (int k = 1; k < 12; ++k) {
    BasicBody<double>& body = scene.bodies.emplace_back(ball);
    body.name += std::to_string(k);
    body.position = Vector2<double>(0.21 * (k % 4), 0.1 + 0.21 * (k / 4));
    if (k % 3 == 0) body.shape = {ShapeType::kBox, {0.2, 0.1}};
  }
  Search s;
  BuildModel(scene, &s.model, &s.state);
  ContactSearch keeps(s.model);
  long compared = 0;
  long compared_anew = 0;
  size_t listed = 0;
  for (int step = 0; step < 400; ++step) {
    for (const int body : s.model.structure->moving) {
      const double phase = 0.02 * step + body;
      const bool rests = step % 100 > 60;
      s.state.twist[3 * body] = rests ? 0.0 : 1.5 * std::sin(phase);
      s.state.twist[3 * body + 1] = rests ? 0.0 : 1.5 * std::cos(1.3 * phase);
      s.state.twist[3 * body + 2] = rests ? 0.0 : 4.0 * std::sin(1.7 * phase);
      for (int i = 0; i < 3; ++i) s.state.pose[3 * body + i] += 0.01 * s.state.twist[3 * body + i];
    }
    AssembleWithoutContacts(s.model, s.state, 0.0, 0.01, &s.problem, &s.scratch);
    ContactSearch anew(s.model);
    std::vector<ActiveContact> expected;
    for (ContactSearch* search : {&anew, &keeps}) {
      search->SetBounds(s.model, s.state, s.problem, s.scratch);
      s.contacts.clear();
      s.friction.clear();
      s.restitution.clear();
      search->Find(s.model, s.state, 0.01, s.scratch, &s.contacts, &s.friction, &s.restitution);
      if (search == &anew) expected = s.contacts;
    }
    ASSERT_EQ(s.contacts.size(), expected.size()) << step;
    for (size_t i = 0; i < expected.size(); ++i) {
      EXPECT_TRUE(s.contacts[i].SameAs(expected[i])) << step;
      EXPECT_EQ(s.contacts[i].gap, expected[i].gap) << step;
    }
    EXPECT_EQ(keeps.num_pairs(), anew.num_pairs()) << step;
    listed += expected.size();
    compared += keeps.num_compared();
    compared_anew += anew.num_compared();
  }
  EXPECT_GT(listed, 1000u);
  EXPECT_LT(compared, compared_anew);
}

}  // namespace
}  // namespace tangible
