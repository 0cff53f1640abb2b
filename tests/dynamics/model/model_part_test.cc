// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/model_part.h"

#include <gtest/gtest.h>

#include <numeric>

#include "../../support/scenes.h"
#include "tangible/dynamics/assembly/assembly.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// Two mechanisms and a free body, with every kind of number that a scene can have, interleaved.
Scene ManyKinds() {
  return SceneOf(R"({"bodies": [
      {"name": "wall", "static": true, "position": [5, 0], "shape": {"box": {"size": [1, 2]}},
       "friction": 0.4},
      {"name": "a", "shape": {"box": {"size": [0.1, 1]}}, "mass": 2, "position": [0, -0.5],
       "velocity": [0.3, -0.2], "angular_velocity": 0.3, "friction": 0.2, "restitution": 0.5,
       "quadratic_drag": 0.03, "support": {"friction": 0.1, "points": [[0, 0.1], [0, -0.2]]}},
      {"name": "p", "shape": {"circle": {"radius": 0.2}}, "mass": 1.5, "position": [9, 1],
       "angular_velocity": 2, "linear_damping": 0.1, "angular_damping": 0.05},
      {"name": "b", "shape": {"polygon": {"vertices": [[-0.1, -0.1], [0.2, -0.1], [-0.1, 0.2]]}},
       "mass": 3, "inertia": 0.7, "position": [0.1, -1.5], "angle": 0.2,
       "contact_points": [[0.1, 0.3], [0.2, -0.4]]},
      {"name": "free", "shape": {"capsule": {"length": 0.4, "radius": 0.1}}, "mass": 1,
       "position": [-4, 3], "velocity": [1, 2]},
      {"name": "q", "shape": {"circle": {"radius": 0.3}}, "mass": 4, "position": [9, 3]}],
    "joints": [
      {"name": "j0", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0], "damping": 0.1,
       "limits": [-2, 2], "stiffness": 3, "rest_angle": 0.1, "friction": 0.05, "effort": 0.7},
      {"name": "k0", "type": "prismatic", "bodies": ["p", "world"], "anchor": [9, 1],
       "axis": [0, 1], "damping": 0.3, "effort": 2},
      {"name": "j1", "type": "revolute", "bodies": ["b", "a"], "anchor": [0.05, -1],
       "friction": 0.02, "kinetic_friction": 0.01, "stribeck_speed": 0.3},
      {"name": "k1", "type": "distance", "bodies": ["q", "p"], "anchors": [[9, 3], [9, 1]]}],
    "springs": [
      {"name": "s0", "bodies": ["q", "world"], "anchors": [[9, 3], [9, 5]], "stiffness": 10,
       "damping": 0.2, "rest_length": 1},
      {"name": "s1", "bodies": ["b", "wall"], "anchors": [[0.1, -1.5], [4, 0]], "stiffness": 7,
       "rest_length": 2}],
    "forces": [
      {"name": "f0", "body": "p", "force": [1, 0], "torque": 0.2, "at": [0.1, 0], "start": 0,
       "end": 0.5},
      {"name": "f1", "body": "b", "force": [0, 2], "at": [0.1, 0.1], "end": 2}],
    "pairs": [{"bodies": ["p", "q"], "restitution": 0.3},
              {"bodies": ["b", "wall"], "friction": 0.6, "restitution": 0.1}],
    "no_contact": [["a", "wall"]]})");
}

TEST(ModelPart, ThePartOfAllBodiesIsTheModel) {
  Model<double> model;
  State<double> state;
  BuildModel(ManyKinds(), &model, &state);
  const ModelStructure& whole = *model.structure;
  std::vector<int> bodies(static_cast<size_t>(whole.world()));
  std::iota(bodies.begin(), bodies.end(), 0);
  const ModelPart part = TakePart(whole, bodies);
  std::vector<int> all(static_cast<size_t>(whole.num_parameters));
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(part.numbers, all);
  EXPECT_TRUE(IsDivisible(whole));
  EXPECT_EQ(part.structure->moving, whole.moving);
  EXPECT_EQ(part.structure->joined, whole.joined);
  EXPECT_EQ(part.structure->num_variables(), whole.num_variables());
}

// Accelerations of a part are those of the whole, and so its numbers and bodies stand in the right
// places; coefficients of pairs and the pairs that may collide too.
TEST(ModelPart, APartAcceleratesAsTheWhole) {
  Model<double> model;
  State<double> state;
  BuildModel(ManyKinds(), &model, &state);
  const auto named = [&](int body) { return model.structure->bodies[body].name; };
  const auto assemble = [](const Model<double>& of, const State<double>& at) {
    ContactProblem<double> problem;
    AssemblyScratch<double> scratch;
    AssembleAcceleration(of, at, 0.1, 0.1, {}, {}, &scratch, &problem);
    return problem;
  };
  const ContactProblem<double> whole = assemble(model, state);
  size_t joints = 0;
  for (const std::vector<int>& bodies :
       {std::vector<int>{0, 1, 3}, std::vector<int>{2, 5}, std::vector<int>{4}}) {
    const ModelPart part = TakePart(*model.structure, bodies);
    Model<double> own{part.structure, {}};
    State<double> own_state;
    part.GatherNumbers(model.parameters, &own.parameters);
    part.GatherState(state, &own_state);
    const ContactProblem<double> problem = assemble(own, own_state);
    joints += part.structure->joints.size();
    for (int k = 0; k < part.structure->num_blocks(); ++k) {
      const int body = part.bodies[part.structure->moving[k]];
      EXPECT_EQ(part.structure->bodies[part.structure->moving[k]].name, named(body));
      const int block = model.structure->bodies[body].block;
      for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(problem.mass[3 * k + i], whole.mass[3 * block + i]) << named(body);
        EXPECT_EQ(problem.load[3 * k + i], whole.load[3 * block + i]) << named(body);
      }
    }
    // Blocks of supports come after those of joints.
    for (size_t j = 0; j < part.structure->joints.size(); ++j) {
      const JointBlock<double>& of_whole = whole.joints[part.joints[j]];
      for (int r = 0; r < of_whole.rows; ++r) {
        EXPECT_EQ(problem.joints[j].rhs[r], of_whole.rhs[r]);
        EXPECT_EQ(problem.joints[j].row_a[r], of_whole.row_a[r]);
      }
    }
    for (size_t i = 0; i < bodies.size(); ++i) {
      for (size_t j = i + 1; j < bodies.size(); ++j) {
        const int a = static_cast<int>(i), b = static_cast<int>(j);
        EXPECT_EQ(part.structure->MayCollide(a, b),
                  model.structure->MayCollide(bodies[i], bodies[j]));
        EXPECT_EQ(MixedFriction(own, a, b).value, MixedFriction(model, bodies[i], bodies[j]).value);
        EXPECT_EQ(MixedRestitution(own, a, b).value,
                  MixedRestitution(model, bodies[i], bodies[j]).value);
      }
    }
    State<double> back = state;
    for (double& x : back.pose) x = -1.0;
    part.ScatterState(own_state, &back);
    for (const int k : part.structure->moving) {
      EXPECT_EQ(back.pose[3 * part.bodies[k]], state.pose[3 * part.bodies[k]]);
    }
    EXPECT_EQ(back.pose[3 * model.structure->world()], -1.0);
    EXPECT_EQ(part.LocalBody(bodies.back()), static_cast<int>(bodies.size()) - 1);
    EXPECT_EQ(part.LocalBody(6), static_cast<int>(bodies.size()));  // the world
  }
  EXPECT_EQ(joints, model.structure->joints.size());
}

}  // namespace
}  // namespace tangible
