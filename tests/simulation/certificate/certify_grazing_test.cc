// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/certify_grazing.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {
namespace {

// Thrown up with 0.25 m/s at g = 8 m/s² a disc rises by 1/256 m, which takes 1/32 s: to a ceiling
// `higher` than that.
Certificate ThrownUp(double higher, double dt) {
  Scene scene = test_scenes::SceneOf(R"({"gravity": [0, -8], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 1],
       "velocity": [0, 0.25], "restitution": 1},
      {"name": "ceiling", "static": true, "restitution": 1,
       "shape": {"half_plane": {"normal": [0, -1], "offset": -1.50390625}}}],
    "simulation": {"duration": 0.0625, "stepping": "event", "integrator": "trapezoidal"}})");
  scene.simulation.dt = dt;
  for (BasicBody<double>& body : scene.bodies) {
    if (body.name == "ceiling") {
      body.shape.numbers[2] -= higher;
    }
  }
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  return CertifyRollout(model, initial);
}

TEST(CertifyGrazingTest, AThrowThatJustReachesTheCeilingIsNearAKink) {
  // The apex at a step's end, and within a step.
  for (const double dt : {1.0 / 128.0, 1.0 / 100.0}) {
    for (const double higher : {0.0, 1e-10, -1e-10}) {
      const Certificate c = ThrownUp(higher, dt);
      EXPECT_EQ(c.verdict.find("near a kink: "), 0u) << higher << " " << c.verdict;
      EXPECT_NE(c.margin_where.find("grazing"), std::string::npos) << c.margin_where;
    }
    EXPECT_NE(ThrownUp(1e-10, dt).margin_where.find("no touch"), std::string::npos);
    EXPECT_NE(ThrownUp(-1e-10, dt).margin_where.find("touch"), std::string::npos);
    // A tenth of a millimetre off, of 4 mm, is another motion.
    for (const double higher : {1e-4, -1e-4}) {
      EXPECT_EQ(ThrownUp(higher, dt).verdict, "trustworthy") << higher;
    }
  }
}

Certificate CertificateOfThrow(const Scene& scene) {
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  return CertifyRollout(model, initial);
}

// By 1e-10 and by 1e-2, up and down: near a kink, and another motion.
template <typename SceneWith>
void ExpectGrazing(const SceneWith& scene_with, double far) {
  for (const double dt : {1.0 / 128.0, 1.0 / 100.0, 0.25}) {
    for (const double off : {0.0, 1e-10, -1e-10}) {
      Scene scene = scene_with(off);
      scene.simulation.dt = dt;
      const Certificate c = CertificateOfThrow(scene);
      EXPECT_EQ(c.verdict.find("near a kink: "), 0u) << off << " " << dt << " " << c.verdict;
      EXPECT_NE(c.margin_where.find("grazing"), std::string::npos) << c.margin_where;
    }
    for (const double off : {far, -far}) {
      Scene scene = scene_with(off);
      scene.simulation.dt = dt;
      EXPECT_EQ(CertificateOfThrow(scene).verdict, "trustworthy") << off << " " << dt;
    }
  }
}

// The same throw, of a slider that meets its limit.
TEST(CertifyGrazingTest, ASliderThatJustReachesItsLimitIsNearAKink) {
  const auto scene_with = [](double higher) {
    Scene scene = test_scenes::SceneOf(R"({"gravity": [0, -8], "bodies": [
        {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [0, 0.25]}],
      "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
                  "axis": [0, 1], "limits": [-9, 1], "limit_restitution": 1}],
      "simulation": {"duration": 0.0625, "stepping": "event"}})");
    scene.joints[0].limits->second = 1.0 / 256.0 + higher;
    return scene;
  };
  ExpectGrazing(scene_with, 1e-4);
}

// v = v0 − 2 t + 4 t² falls to v0 − 1/4 after 1/4 s.
TEST(CertifyGrazingTest, ABlockThatNearlyStopsIsNearAKink) {
  const auto scene_with = [](double faster) {
    Scene scene = test_scenes::SceneOf(R"({"gravity": [0, -10], "bodies": [
        {"name": "b", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "position": [0, 0.05],
         "velocity": [0.25, 0], "friction": 0.5},
        {"name": "floor", "static": true, "friction": 0.5,
         "shape": {"half_plane": {"normal": [0, 1]}}}],
      "forces": [{"name": "f", "body": "b", "force": [0, 0]}],
      "simulation": {"duration": 0.5, "stepping": "event"}})");
    Signal load;
    load.interpolation = Signal::Interpolation::kLinear;
    load.time = {0.0, 1.0};
    load.x = {3.0, 11.0};
    load.y = {0.0, 0.0};
    scene.forces[0].force_signal = load;
    scene.bodies[0].velocity.x() += faster;
    return scene;
  };
  ExpectGrazing(scene_with, 1e-2);
}

// A disc that slides off a table: the corner at the end of the face takes over from the face, at no
// approach speed, within a step. Nothing new touches, and the derivative has no kink there.
TEST(CertifyGrazingTest, TheCornerAtTheEndOfAFaceDoesNotGraze) {
  // At 0.4 m/s it would be there on a step's end, which the verdict names for another reason.
  for (const double speed : {0.41, 0.7, 1.3}) {
    Scene scene = test_scenes::SceneOf(R"({"gravity": [0, -9.81], "bodies": [
        {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.2, 0.6],
         "friction": 0},
        {"name": "table", "static": true, "shape": {"box": {"size": [1, 1]}}, "position": [0, 0]}],
      "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
    scene.bodies[0].velocity.x() = speed;
    Model<double> model;
    State<double> initial;
    BuildModel(scene, &model, &initial);
    EXPECT_EQ(CertifyRollout(model, initial).verdict, "trustworthy") << speed;
  }
}

TEST(CertifyGrazingTest, MarginsAreThoseOfTheHeight) {
  Model<double> model;
  State<double> before;
  BuildModel(test_scenes::SceneOf(R"({"gravity": [0, -8], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.75],
       "velocity": [0, -2]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.25, "duration": 0.5, "stepping": "event"}})"),
             &model, &before);
  // Held up by 16 m/s² it turns around after 1/8 s, 1/8 m lower: a gap of 1/8 m is left.
  EventRecord record;
  Segment& segment = record.Add()->segment;
  segment.length = 0.25;
  segment.before = segment.after = before;
  const int disc = model.structure->moving[0];
  segment.after.twist[3 * disc + 1] = 2.0;
  std::vector<Graze> grazes;
  FindGrazes(model, record, 10.0, 0.0, &grazes);
  ASSERT_EQ(grazes.size(), 1u);
  EXPECT_FALSE(grazes[0].touches);
  EXPECT_DOUBLE_EQ(grazes[0].time, 0.25);
  // The height by which 16 m/s² move it in a step is 1/2 m.
  EXPECT_NEAR(grazes[0].margin, 0.125 / 0.5, 1e-12);
  FindGrazes(model, record, 0.2, 0.0, &grazes);
  EXPECT_TRUE(grazes.empty());
  // What leaves, and what is held closed, does not graze.
  std::swap(segment.before, segment.after);
  FindGrazes(model, record, 10.0, 0.0, &grazes);
  EXPECT_TRUE(grazes.empty());
}

}  // namespace
}  // namespace tangible
