// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/rollout_adjoint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// A loss that reads poses and twists all along the run: Σ_k c_k · state_k, c_k pseudo-random.
double Weight(long k, int variable) { return std::sin(1.7 * k + 0.9 * variable); }

TEST(RolloutAdjointTest, LossesAlongTheRunAgreeWithTheTangent) {
  double largest = 0.0;
  int done = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    RandomSceneOptions options;
    options.max_steps = 25;
    Model<double> model;
    State<double> initial, final;
    Scene scene = RandomScene(seed, options);
    BuildModel(scene, &model, &initial);
    const ModelStructure& s = *model.structure;
    const int states = 6 * s.num_bodies();
    RolloutTape tape;
    if (tape.Record(model, initial, Factorisations::kKeep, {}, &final).status !=
        StepStatus::kDone) {
      continue;
    }
    RowMatrixXd w_bar;
    tape.Adjoint(
        model, 1,
        [&](long k, RowMatrixXd* w) {
          for (int i = 0; i < states; ++i) (*w)(i, 0) += Weight(k, i);
        },
        &w_bar);
    // A direction that numbers of the scene can take: it keeps redundant rows consistent.
    ParameterDirection numbers;
    const int count = static_cast<int>(EnumerateNumbers(&scene).size());
    for (int i = 0; i < count; ++i) numbers.push_back({i, Weight(i, seed)});
    RowMatrixXd w_dot = VariableJacobian(scene, model.structure, {numbers});
    const RowMatrixXd direction = w_dot;
    double expected = 0.0;
    double magnitude = 0.0;
    RolloutTangent(
        model, initial,
        [&](long k, double, const State<double>&, const RowMatrixXd& w) {
          for (int i = 0; i < states; ++i) {
            expected += Weight(k, i) * w(i, 0);
            magnitude += std::abs(Weight(k, i) * w(i, 0));
          }
        },
        &w_dot, &final);
    const double actual = (w_bar.transpose() * direction)(0, 0);
    magnitude += w_bar.cwiseAbs().sum();
    EXPECT_NEAR(actual, expected, 1e-11 * magnitude) << seed;
    largest = std::max(largest, std::abs(actual));
    ++done;
  }
  EXPECT_EQ(done, 30);
  EXPECT_GT(largest, 1.0);
}

TEST(RolloutAdjointTest, RecomputedFactorisationsGiveTheSame) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RowMatrixXd w_bar[2];
  size_t bytes[2];
  for (int k = 0; k < 2; ++k) {
    RolloutTape tape;
    tape.Record(model, initial, k == 0 ? Factorisations::kKeep : Factorisations::kRecompute, {},
                &final);
    EXPECT_EQ(tape.steps(), 63);
    bytes[k] = tape.bytes();
    tape.Adjoint(
        model, 2,
        [&](long step, RowMatrixXd* w) {
          if (step == 63) (*w)(0, 0) += 1.0;
          if (step == 40) (*w)(4, 1) += 1.0;
        },
        &w_bar[k]);
  }
  EXPECT_GT(w_bar[0].norm(), 1.0);
  EXPECT_LT((w_bar[0] - w_bar[1]).norm(), 1e-13 * w_bar[0].norm());
  EXPECT_LT(bytes[1], bytes[0]);
}

Scene LoadData(const std::string& name) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(LoadScene(std::string(TANGIBLE_SOURCE_DIR) + "/data/scenes/" + name, &scene, &error))
      << error;
  return scene;
}

struct SweptTape {
  RowMatrixXd w_bar;
  size_t peak = 0;
  double runs_again = 0.0;
};

// Two losses, of the end and of a state on the way.
SweptTape Sweep(const Scene& scene, const TapeOptions& options) {
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RolloutTape tape;
  EXPECT_EQ(tape.Record(model, initial, options, {}, &final).status, StepStatus::kDone);
  const long steps = NumSteps(scene.simulation);
  EXPECT_EQ(tape.steps(), steps);
  SweptTape swept;
  tape.Adjoint(
      model, 2,
      [&](long k, RowMatrixXd* w) {
        if (k == steps) (*w)(0, 0) += 1.0;
        if (k == steps / 2) (*w)(4, 1) += 1.0;
      },
      &swept.w_bar);
  swept.peak = tape.peak_bytes();
  swept.runs_again = static_cast<double>(tape.steps_again()) / static_cast<double>(steps);
  return swept;
}

Checkpointing Every(long steps) { return {Checkpointing::Kind::kEvery, steps, 0}; }
Checkpointing Budget(size_t bytes) { return {Checkpointing::Kind::kBudget, 0, bytes}; }

Scene MixtureByEvents() {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  scene.simulation.stepping = Stepping::kEvent;
  scene.simulation.integrator = Integrator::kTrapezoidal;
  return scene;
}

Scene MixtureThatDrifts() {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  scene.simulation.joint_correction = JointCorrection::kNone;
  return scene;
}

// They land one after another.
Scene FallingDiscs(int count) {
  Scene scene = test_scenes::SceneOf(R"({"bodies": [)" + std::string(test_scenes::kFloor) + "]}");
  for (int i = 0; i < count; ++i) {
    BasicBody<double> disc;
    disc.name = "disc" + std::to_string(i);
    disc.motion = Motion::kMoving;
    disc.shape = {ShapeType::kCircle, {0.1}};
    disc.mass = 1.0;
    disc.friction = 0.5;
    disc.position = {0.21 * i, 0.15 + 0.1 * i};
    scene.bodies.push_back(disc);
  }
  scene.simulation.dt = 0.01;
  scene.simulation.duration = 1.0;
  return scene;
}

TEST(RolloutAdjointTest, CheckpointsGiveTheSameBits) {
  for (const Scene& scene : {test_scenes::SceneOf(test_scenes::Mixture()), MixtureThatDrifts(),
                             MixtureByEvents(), LoadData("bouncing_ball.json")}) {
    for (const Factorisations factorisations :
         {Factorisations::kKeep, Factorisations::kRecompute}) {
      const SweptTape all = Sweep(scene, {factorisations, {}});
      EXPECT_EQ(all.runs_again, 0.0);
      EXPECT_GT(all.w_bar.norm(), 1.0);
      for (const long every : {1L, 2L, 7L, 62L, 63L, 1000L}) {
        const SweptTape swept = Sweep(scene, {factorisations, Every(every)});
        EXPECT_EQ(swept.w_bar, all.w_bar) << every;
        EXPECT_LE(swept.runs_again, 1.0) << every;
        if (every == 7) {
          EXPECT_GT(swept.runs_again, 0.5);
          EXPECT_LT(swept.peak, all.peak / 2);
        }
      }
    }
  }
}

TEST(RolloutAdjointTest, ABudgetIsKeptWithTheSameBits) {
  for (const Scene& scene :
       {test_scenes::SceneOf(test_scenes::Mixture()), MixtureThatDrifts(), MixtureByEvents()}) {
    const SweptTape all = Sweep(scene, {});
    for (const double share : {0.3, 0.45, 0.6, 0.8, 0.95, 1.5}) {
      const auto budget = static_cast<size_t>(share * static_cast<double>(all.peak));
      const SweptTape swept = Sweep(scene, {Factorisations::kKeep, Budget(budget)});
      EXPECT_EQ(swept.w_bar, all.w_bar) << share;
      EXPECT_LE(swept.peak, budget) << share;
      EXPECT_LE(swept.runs_again, 2.0) << share;
      // In between records may fit where their factorisations do not.
      if (share > 1.0 || share < 0.4) {
        EXPECT_EQ(swept.runs_again == 0.0, share > 1.0) << share;
      }
    }
  }
}

// Contacts come after the first step, by which the checkpoints are planned.
TEST(RolloutAdjointTest, ABudgetIsKeptWhereStepsGrow) {
  const Scene scene = FallingDiscs(20);
  const SweptTape all = Sweep(scene, {});
  for (const double share : {0.2, 0.3, 0.5, 0.7}) {
    const auto budget = static_cast<size_t>(share * static_cast<double>(all.peak));
    const SweptTape swept = Sweep(scene, {Factorisations::kKeep, Budget(budget)});
    EXPECT_EQ(swept.w_bar, all.w_bar) << share;
    EXPECT_LE(swept.peak, budget) << share;
    EXPECT_GT(swept.runs_again, 0.0) << share;
    EXPECT_LE(swept.runs_again, 2.0) << share;
  }
}

TEST(RolloutAdjointTest, ALongRunNeedsLittleMemory) {
  constexpr size_t kBudget = 64 * 1048576;
  Scene scene = LoadData("chain.json");
  scene.simulation.duration = 10000 * scene.simulation.dt;
  const SweptTape swept = Sweep(scene, {Factorisations::kKeep, Budget(kBudget)});
  EXPECT_LE(swept.peak, kBudget);
  EXPECT_LE(swept.runs_again, 2.0);
  EXPECT_TRUE(swept.w_bar.allFinite());
}

TEST(RolloutAdjointTest, ATapeMayBeUsedAgain) {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RolloutTape tape, fresh;
  const auto seed = [](long k, RowMatrixXd* w) {
    if (k == 63) (*w)(0, 0) += 1.0;
  };
  RowMatrixXd first, again;
  tape.Record(model, initial, Factorisations::kKeep, {}, &final);
  tape.Adjoint(model, 1, seed, &first);
  initial.twist[0] += 0.1;
  tape.Record(model, initial, Factorisations::kKeep, {}, &final);
  tape.Adjoint(model, 1, seed, &first);
  fresh.Record(model, initial, Factorisations::kKeep, {}, &final);
  fresh.Adjoint(model, 1, seed, &again);
  EXPECT_EQ((first - again).norm(), 0.0);
}

// Links of 0.3 m on hinges, laid out level, of 1e7 kg and 1 kg in turn. The first hangs on the
// world.
std::string LinksOfWideMasses(int count) {
  std::string bodies, joints, no_contact;
  for (int i = 0; i < count; ++i) {
    const std::string comma = i > 0 ? ", " : "";
    const std::string name = "l" + std::to_string(i);
    bodies += comma + R"({"name": ")" + name + R"(", "shape": {"box": {"size": [0.3, 0.05]}},)" +
              R"("mass": )" + (i % 2 == 0 ? "1e7" : "1") + R"(, "position": [)" +
              std::to_string(0.3 * i + 0.15) + ", 0]}";
    joints += comma + R"({"name": "p)" + std::to_string(i) +
              R"(", "type": "revolute", "bodies": [")" + name + R"(", ")" +
              (i > 0 ? "l" + std::to_string(i - 1) : "world") + R"("], "anchor": [)" +
              std::to_string(0.3 * i) + ", 0]}";
  }
  return R"({"bodies": [)" + bodies + R"(], "joints": [)" + joints +
         R"(], "no_contact": [["l*", "l*"]],
          "simulation": {"dt": 0.002, "duration": 0.3}})";
}

// What a factorisation needs goes with it onto the tape: here refinement, as masses differ by 1e7,
// though no contact closes.
TEST(RolloutAdjointTest, KeptFactorisationsOfWideMassesAreRefined) {
  const Scene scene = test_scenes::SceneOf(LinksOfWideMasses(12));
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  const ModelStructure& s = *model.structure;
  const int outputs = 6 * s.num_bodies();
  RowMatrixXd w_bar[2];
  for (int k = 0; k < 2; ++k) {
    RolloutTape tape;
    ASSERT_EQ(tape.Record(model, initial,
                          k == 0 ? Factorisations::kKeep : Factorisations::kRecompute, {}, &final)
                  .status,
              StepStatus::kDone);
    const long last = tape.steps();
    tape.Adjoint(
        model, outputs,
        [&](long step, RowMatrixXd* w) {
          if (step == last) w->topLeftCorner(outputs, outputs).diagonal().array() += 1.0;
        },
        &w_bar[k]);
  }
  EXPECT_EQ(w_bar[0], w_bar[1]);
  RowMatrixXd w_dot = RowMatrixXd::Zero(s.num_variables(), 1);
  const int mass = s.ParameterVariable(s.bodies[3].mass);
  w_dot(mass, 0) = 1.0;
  ASSERT_EQ(RolloutTangent(model, initial, {}, &w_dot, &final).status, StepStatus::kDone);
  const double size = w_dot.col(0).head(outputs).cwiseAbs().maxCoeff();
  EXPECT_GT(size, 1e-9);
  for (int i = 0; i < outputs; ++i) {
    EXPECT_NEAR(w_bar[0](mass, i), w_dot(i, 0), 1e-10 * std::abs(w_dot(i, 0)) + 1e-13 * size) << i;
  }
}

// Two bodies of wide masses on a hinge, above a floor: 0.3 m above it the run touches nothing, on
// it their corners and ends make several contacts.
std::string HingedAboveFloor() {
  return R"({"bodies": [
      {"name": "heavy", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1e6, "position": [0, 0.1]},
      {"name": "light", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0.5, 0.1]},
      )" +
         std::string(test_scenes::kFloor) +
         R"(], "joints": [{"name": "pin", "type": "revolute", "bodies": ["heavy", "light"],
                           "anchor": [0.25, 0.1]}],
      "no_contact": [["heavy", "light"]], "simulation": {"dt": 0.01, "duration": 0.1}})";
}

// A used tape holds problems of the run before, whose masses and contacts are not those of this
// one.
TEST(RolloutAdjointTest, AUsedTapeForgetsTheContactsOfItsLastRun) {
  const Scene scene = test_scenes::SceneOf(HingedAboveFloor());
  Model<double> wide, equal;
  State<double> on_floor, above, final;
  BuildModel(scene, &wide, &on_floor);
  const ModelStructure& s = *wide.structure;
  equal = wide;
  equal.parameters[s.bodies[0].mass] = 1.0;
  equal.parameters[s.bodies[0].inertia] = equal.parameters[s.bodies[1].inertia];
  above = on_floor;
  for (int body = 0; body < 2; ++body) {
    above.pose[3 * body + 1] += 0.3;
    above.twist[3 * body + 2] = 0.3 * (body + 1);
  }
  const auto sweep = [&](const Model<double>& model, const State<double>& from, RolloutTape* tape) {
    RowMatrixXd w_bar;
    EXPECT_EQ(tape->Record(model, from, Factorisations::kKeep, {}, &final).status,
              StepStatus::kDone);
    tape->Adjoint(
        model, 1,
        [](long k, RowMatrixXd* w) {
          if (k == 10) w->col(0).head(6).setOnes();
        },
        &w_bar);
    return w_bar;
  };
  const std::pair<const Model<double>*, const State<double>*> runs[] = {
      {&wide, &on_floor}, {&wide, &above},  {&equal, &above},    {&wide, &above}, {&equal, &above},
      {&wide, &on_floor}, {&equal, &above}, {&equal, &on_floor}, {&wide, &above}};
  RolloutTape used;
  for (const auto& [model, from] : runs) {
    RolloutTape fresh;
    const RowMatrixXd expected = sweep(*model, *from, &fresh);
    EXPECT_GT(expected.norm(), 1.0);
    EXPECT_EQ(sweep(*model, *from, &used), expected) << &from - &runs[0].second;
  }
}

// The structure of a scene that is gone may have had the address of another's.
TEST(RolloutAdjointTest, AUsedTapeIsTakenToAnotherScene) {
  RolloutTape used;
  for (int links = 2; links < 12; ++links) {
    Model<double> model;
    State<double> initial, final;
    BuildModel(test_scenes::SceneOf(LinksOfWideMasses(links)), &model, &initial);
    RolloutTape fresh;
    RowMatrixXd w_bar[2];
    RolloutTape* tapes[] = {&used, &fresh};
    for (int k = 0; k < 2; ++k) {
      ASSERT_EQ(tapes[k]->Record(model, initial, Factorisations::kKeep, {}, &final).status,
                StepStatus::kDone);
      const long last = tapes[k]->steps();
      tapes[k]->Adjoint(
          model, 1,
          [&](long step, RowMatrixXd* w) {
            if (step == last) (*w)(0, 0) += 1.0;
          },
          &w_bar[k]);
    }
    EXPECT_EQ(w_bar[0], w_bar[1]) << links;
  }
}

TEST(RolloutAdjointTest, NothingIsSeededNothingComes) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RolloutTape tape;
  tape.Record(model, initial, Factorisations::kKeep, {}, &final);
  RowMatrixXd w_bar;
  tape.Adjoint(
      model, 1, [](long, RowMatrixXd*) {}, &w_bar);
  EXPECT_EQ(w_bar.norm(), 0.0);
  EXPECT_EQ(w_bar.rows(), model.structure->num_variables());
}

}  // namespace
}  // namespace tangible
