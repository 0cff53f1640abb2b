// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/rollout_function.h"

#include <gtest/gtest.h>

#include <atomic>
#include <random>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/math/interrupt.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// A disc that is pushed along a floor and bounces on it, beside a driven pendulum.
Scene Driven(const std::string& stepping) {
  return SceneOf(R"({"bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1.3, "position": [0, 0.14],
       "velocity": [0.4, 0], "angular_velocity": 1, "friction": 0.3, "restitution": 0.4},
      {"name": "rod", "shape": {"box": {"size": [0.6, 0.05]}}, "mass": 0.7,
       "position": [2.3, 1.5]},
      {"name": "floor", "static": true, "friction": 0.3, "restitution": 0.4,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "joints": [{"name": "motor", "type": "revolute", "bodies": ["rod", "world"],
                "anchor": [2, 1.5], "damping": 0.1, "effort": 0.2}],
    "forces": [{"name": "push", "body": "disc", "force": [0.5, 0.1], "torque": 0.05}],
    "simulation": {"dt": 0.01, "duration": 0.2, "stepping": ")" +
                 stepping + R"("}})");
}

const std::vector<std::string> kParameters = {"bodies/disc/mass", "bodies/*/friction",
                                              "bodies/disc/position/y", "gravity/y"};
const std::vector<std::string> kControls = {"forces/push/force/x", "forces/push/torque",
                                            "joints/motor/effort"};

// Inputs that differ from the scene's in all that they have.
RolloutInput InputOf(const RolloutFunction& function, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  RolloutInput input = function.Defaults();
  for (int k = 0; k < function.num_parameters(); ++k) {
    // The scene's own are not numbers where those of a path differ.
    input.parameters[k] = function.parameters()[static_cast<size_t>(k)].value;
    input.parameters[k] *= 1.0 + 0.02 * unit(random);
  }
  for (double& x : input.state) x += 0.002 * unit(random);
  // The pendulum stays on its joint: of its state only the disc's is another one.
  input.state.tail(6) = function.Defaults().state.tail(6);
  for (Eigen::Index i = 0; i < input.controls.size(); ++i) {
    input.controls.data()[i] += 0.3 * unit(random);
  }
  return input;
}

RowMatrixXd Random(Eigen::Index rows, Eigen::Index columns, std::mt19937* random) {
  std::normal_distribution<double> normal;
  RowMatrixXd values(rows, columns);
  for (Eigen::Index i = 0; i < values.size(); ++i) values.data()[i] = normal(*random);
  return values;
}

class RolloutFunctionTest : public ::testing::TestWithParam<const char*> {
 protected:
  void Create(const std::vector<long>& records) {
    ASSERT_EQ(function_.Create(Driven(GetParam()), kParameters, kControls, records), "");
  }
  RolloutFunction function_;
};

TEST_P(RolloutFunctionTest, DefaultsAreTheScenesRun) {
  Create({});
  RolloutWorker worker(function_);
  RolloutInput input = function_.Defaults();
  const RolloutOutput with_state = worker.Run(input);
  input.state.resize(0);
  const RolloutOutput output = worker.Run(input);
  ASSERT_EQ(output.status, RolloutStatus::kDone) << output.message;
  Model<double> model;
  State<double> state;
  BuildModel(Driven(GetParam()), &model, &state);
  Rollout(model, state, {}, &state);
  EXPECT_EQ(output.final.pose, state.pose);
  EXPECT_EQ(output.final.twist, state.twist);
  EXPECT_EQ(output.states(0, 1), state.pose[1]);
  EXPECT_EQ(output.states(0, 9), state.twist[3]);
  EXPECT_EQ(with_state.states, output.states);
}

TEST_P(RolloutFunctionTest, TheFiveMethodsAgree) {
  if (!testing::HaveJets()) GTEST_SKIP() << "no width of Jets is built";
  Create({7, 20});
  RolloutWorker worker(function_);
  const RolloutInput input = InputOf(function_, 3);
  EXPECT_TRUE(IsTrustworthyMap(worker.Certify(input))) << worker.Certify(input).verdict;
  RowMatrixXd adjoint;
  GradientMethod used;
  const RolloutOutput output = worker.Jacobian(input, GradientMethod::kAdjoint,
                                               RolloutWorker::Inputs::kAll, &adjoint, &used);
  ASSERT_EQ(output.status, RolloutStatus::kDone) << output.message;
  ASSERT_EQ(adjoint.rows(), 2 * 12);
  ASSERT_EQ(adjoint.cols(), 4 + 12 + 20 * 3);
  const double size = adjoint.cwiseAbs().maxCoeff();
  // What acts after a recorded step has no effect on it; what acts before has one.
  EXPECT_EQ(adjoint.block(0, 16 + 7 * 3, 12, 13 * 3).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_GT(adjoint.block(0, 16, 12, 7 * 3).cwiseAbs().minCoeff(), -1.0);
  for (int control = 0; control < 3; ++control) {
    EXPECT_GT(adjoint.col(16 + 5 * 3 + control).cwiseAbs().maxCoeff(), 1e-4) << control;
  }
  const std::pair<GradientMethod, double> others[] = {{GradientMethod::kTangent, 1e-11},
                                                      {GradientMethod::kJetImplicit, 1e-9},
                                                      {GradientMethod::kJet, 1e-6},
                                                      {GradientMethod::kFiniteDifference, 1e-6}};
  for (const auto& [method, tolerance] : others) {
    RowMatrixXd other;
    const RolloutOutput again =
        worker.Jacobian(input, method, RolloutWorker::Inputs::kAll, &other, &used);
    ASSERT_EQ(again.status, RolloutStatus::kDone) << again.message;
    EXPECT_EQ(used, method);
    EXPECT_LE((again.states - output.states).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LE((other - adjoint).cwiseAbs().maxCoeff(), tolerance * size)
        << static_cast<int>(method);
  }
}

// The disc's mass is 1.3 kg and the rod's 0.7 kg: the scene's own values leave both as they are,
// whatever ran before, and differences move both by the same.
TEST_P(RolloutFunctionTest, APathThatMatchesDifferentNumbersKeepsTheirDifference) {
  ASSERT_EQ(function_.Create(Driven(GetParam()), {"bodies/*/mass"}, {}, {}), "");
  RolloutWorker worker(function_);
  const RolloutInput own{function_.Defaults().parameters, {}, {}};
  const RowMatrixXd states = worker.Run(own).states;
  EXPECT_NE(worker.Run({VectorX<double>::Constant(1, 0.9), {}, {}}).states, states);
  EXPECT_EQ(worker.Run(own).states, states);
  RowMatrixXd tangent, differences;
  GradientMethod used;
  for (int i = 0; i < 2; ++i) {
    const auto [method, jacobian] =
        i == 0 ? std::pair(GradientMethod::kTangent, &tangent)
               : std::pair(GradientMethod::kFiniteDifference, &differences);
    ASSERT_EQ(
        worker.Jacobian(own, method, RolloutWorker::Inputs::kParameters, jacobian, &used).status,
        RolloutStatus::kDone);
  }
  EXPECT_GT(tangent.cwiseAbs().maxCoeff(), 1e-2);
  EXPECT_NE(tangent, differences);
  EXPECT_LE((tangent - differences).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_EQ(worker.Run(own).states, states);
}

// ⟨f̄, J ẋ⟩ = ⟨Jᵀ f̄, ẋ⟩, with several directions and bars at once, and both agree with J.
TEST_P(RolloutFunctionTest, ProductsAreThoseOfTheJacobian) {
  Create({0, 5, 13});
  RolloutWorker worker(function_);
  const RolloutInput input = InputOf(function_, 5);
  std::mt19937 random(11);
  std::vector<InputDirection> directions(3);
  std::vector<RowMatrixXd> bars;
  for (InputDirection& d : directions) {
    d.parameters = Random(4, 1, &random);
    d.state = Random(12, 1, &random);
    d.controls = Random(20, 3, &random);
    bars.push_back(Random(3, 12, &random));
  }
  std::vector<RowMatrixXd> tangents;
  ASSERT_EQ(worker.Tangent(input, directions, &tangents).status, RolloutStatus::kDone);
  ASSERT_EQ(worker.Record(input).status, RolloutStatus::kDone);
  const std::vector<InputDirection> adjoints = worker.Adjoint(bars);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double forward = (bars[i].array() * tangents[j].array()).sum();
      const double backward = adjoints[i].parameters.dot(directions[j].parameters) +
                              adjoints[i].state.dot(directions[j].state) +
                              (adjoints[i].controls.array() * directions[j].controls.array()).sum();
      EXPECT_NEAR(forward, backward, 1e-10 * bars[i].norm() * tangents[j].norm());
      EXPECT_GT(std::abs(forward), 1e-3);
    }
  }
}

TEST_P(RolloutFunctionTest, BitsDependNeitherOnThreadsNorOnWhatRanBefore) {
  Create({});
  constexpr long kCount = 12;
  const auto run = [&](int threads) {
    std::vector<RowMatrixXd> finals(kCount);
    std::vector<InputDirection> adjoints(kCount);
    ForEachRollout(function_, kCount, threads, [&](RolloutWorker* worker, long i) {
      const RolloutOutput output = worker->Record(InputOf(function_, static_cast<unsigned>(i)));
      finals[i] = output.states;
      adjoints[i] = worker->Adjoint({RowMatrixXd::Ones(1, 12)})[0];
    });
    return std::make_pair(finals, adjoints);
  };
  const auto one = run(1);
  const auto three = run(3);
  for (long i = 0; i < kCount; ++i) {
    EXPECT_EQ(one.first[i], three.first[i]);
    EXPECT_EQ(one.second[i].parameters, three.second[i].parameters);
    EXPECT_EQ(one.second[i].controls, three.second[i].controls);
  }
  RolloutWorker fresh(function_);
  EXPECT_EQ(fresh.Run(InputOf(function_, 11)).states, one.first[11]);
}

// A row that is refused keeps none of the others from their derivatives.
TEST_P(RolloutFunctionTest, ABatchIsItsRows) {
  Create({});
  std::vector<RolloutInput> inputs;
  std::vector<InputDirection> directions;
  for (unsigned i = 0; i < 5; ++i) {
    inputs.push_back(InputOf(function_, i));
    directions.push_back(InputOf(function_, 100 + i));
  }
  inputs[2].parameters[0] = -1.0;
  RolloutBatch batch(function_, 2);
  const std::vector<RowMatrixXd> bars(5, RowMatrixXd::Ones(1, 12));
  const std::vector<RolloutOutput> runs = batch.Run(inputs);
  const std::vector<RolloutOutput> recorded = batch.Record(inputs);
  const std::vector<InputDirection> adjoints = batch.Adjoint(bars);
  std::vector<RowMatrixXd> tangents;
  batch.Tangent(inputs, directions, &tangents);
  RolloutWorker worker(function_);
  for (int i = 0; i < 5; ++i) {
    if (i == 2) {
      EXPECT_EQ(recorded[i].status, RolloutStatus::kRefused);
      EXPECT_TRUE(std::isnan(recorded[i].states(0, 0)));
      EXPECT_TRUE(std::isnan(adjoints[i].parameters[0]) && std::isnan(tangents[i](0, 0)));
      continue;
    }
    EXPECT_EQ(recorded[i].states, runs[i].states);
    worker.Record(inputs[i]);
    const InputDirection alone = worker.Adjoint({bars[i]})[0];
    EXPECT_EQ(adjoints[i].parameters, alone.parameters);
    EXPECT_EQ(adjoints[i].state, alone.state);
    EXPECT_EQ(adjoints[i].controls, alone.controls);
    std::vector<RowMatrixXd> one;
    worker.Tangent(inputs[i], {directions[i]}, &one);
    EXPECT_EQ(tangents[i], one[0]);
  }
}

// What a batch has recorded before leaves nothing in what it records then, with more rows or fewer.
TEST_P(RolloutFunctionTest, ABatchRecordsAgain) {
  Create({});
  RolloutBatch used(function_, 2);
  for (const unsigned rows : {3U, 5U, 2U}) {
    std::vector<RolloutInput> inputs;
    for (unsigned i = 0; i < rows; ++i) inputs.push_back(InputOf(function_, 10 * rows + i));
    const std::vector<RowMatrixXd> bars(rows, RowMatrixXd::Ones(1, 12));
    RolloutBatch fresh(function_, 1);
    const std::vector<RolloutOutput> expected = fresh.Record(inputs);
    const std::vector<RolloutOutput> found = used.Record(inputs);
    const std::vector<InputDirection> expected_adjoints = fresh.Adjoint(bars);
    const std::vector<InputDirection> adjoints = used.Adjoint(bars);
    for (unsigned i = 0; i < rows; ++i) {
      EXPECT_EQ(found[i].states, expected[i].states);
      EXPECT_EQ(adjoints[i].parameters, expected_adjoints[i].parameters);
      EXPECT_EQ(adjoints[i].state, expected_adjoints[i].state);
      EXPECT_EQ(adjoints[i].controls, expected_adjoints[i].controls);
    }
  }
}

// Runs, sweeps over their tapes, every method of a Jacobian, and certificates; what was interrupted
// gives the same bits afterwards.
TEST_P(RolloutFunctionTest, AnInterruptEndsEachComputation) {
  Create({});
  struct Interrupted {};
  const std::vector<RolloutInput> inputs(50, InputOf(function_, 1));
  const std::vector<RowMatrixXd> bars(
      50, RowMatrixXd::Ones(function_.num_records(), function_.num_states()));
  RolloutBatch batch(function_, 2);
  RolloutBatch recorded(function_, 2);
  recorded.Record(inputs);
  const std::vector<InputDirection> adjoints = recorded.Adjoint(bars);
  std::vector<RowMatrixXd> tangents;
  RowMatrixXd jacobian;
  GradientMethod used = GradientMethod::kAuto;
  RolloutWorker worker(function_);
  std::vector<std::function<void()>> computations{
      [&] { batch.Run(inputs); },
      [&] { batch.Tangent(inputs, inputs, &tangents); },
      [&] { RolloutBatch(function_, 2).Record(inputs); },
      [&] { recorded.Adjoint(bars); },
      [&] { batch.Certify(inputs); },
  };
  for (const auto& [name, method] : kGradientMethodNames) {
    computations.emplace_back([&, method = method] {
      worker.Jacobian(inputs[0], method, RolloutWorker::Inputs::kAll, &jacobian, &used);
    });
  }
  for (const std::function<void()>& compute : computations) {
    std::atomic<int> checks{0};
    const std::function<void()> check = [&] {
      if (++checks > 5) throw Interrupted();
    };
    const InterruptScope scope(&check);
    EXPECT_THROW(compute(), Interrupted);
    EXPECT_LT(checks, 12);  // at most a few of each thread
  }
  const std::vector<InputDirection> again = recorded.Adjoint(bars);
  for (size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(again[i].parameters, adjoints[i].parameters);
    EXPECT_EQ(again[i].state, adjoints[i].state);
    EXPECT_EQ(again[i].controls, adjoints[i].controls);
  }
}

INSTANTIATE_TEST_SUITE_P(Stepping, RolloutFunctionTest, ::testing::Values("fixed", "event"));

// A ball of 1 kg without gravity moves at 1 m/s towards a floor 0.1 m away, which it reaches as
// step 10 begins. It is pushed from then on: lands later, and has already been pushed before; lands
// sooner, and is pushed after the rebound alone. Away from the boundary there is no kink.
TEST(RolloutFunctionTest, AnEventAsControlsChangeIsAKink) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.2],
       "velocity": [0, -1], "restitution": 0.5},
      {"name": "floor", "static": true, "restitution": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "forces": [{"name": "push", "body": "ball", "force": [0, 0]}],
    "simulation": {"dt": 0.01, "duration": 0.2, "stepping": "event"}})");
  RolloutFunction function;
  ASSERT_EQ(function.Create(scene, {}, {"forces/push/force/y"}, {}), "");
  RolloutInput input = function.Defaults();
  input.controls.bottomRows(10).setConstant(2.0);
  RolloutWorker worker(function);
  const auto end = [&](double height) {
    RolloutInput moved = input;
    moved.state[1] += height;
    return worker.Run(moved).states(0, 4);
  };
  constexpr double kStep = 1e-6;
  const double later = (end(kStep) - end(0.0)) / kStep;
  const double sooner = (end(0.0) - end(-kStep)) / kStep;
  EXPECT_GT(std::abs(later - sooner), 1.0);
  const std::string verdict = worker.Certify(input).verdict;
  EXPECT_EQ(verdict.find("near a kink: margin"), 0u) << verdict;
  EXPECT_NE(verdict.find("contact of ball and floor, an event as controls change"),
            std::string::npos)
      << verdict;
  input.state[1] += 1e-3;
  EXPECT_EQ(worker.Certify(input).verdict, "trustworthy");
  input.state[1] -= 1e-3;
  input.controls.setConstant(2.0);
  input.state[4] = -1.0;
  EXPECT_EQ(worker.Certify(input).verdict, "trustworthy");
}

// No control acts, so that there are none, and nothing is read of a step before the first.
TEST_P(RolloutFunctionTest, ARunOfNoStepsEndsWhereItBegins) {
  Scene scene = Driven(GetParam());
  scene.simulation.duration = 0.0;
  ASSERT_EQ(function_.Create(scene, kParameters, kControls, {0}), "");
  RolloutWorker worker(function_);
  const RolloutInput input = function_.Defaults();
  ASSERT_EQ(input.controls.rows(), 0);
  EXPECT_EQ(worker.Run(input).states.row(0).transpose(), input.state);
  InputDirection direction{VectorX<double>::Unit(4, 2), VectorX<double>::Unit(12, 0),
                           RowMatrixXd(0, 3)};
  std::vector<RowMatrixXd> tangents;
  ASSERT_EQ(worker.Tangent(input, {direction}, &tangents).status, RolloutStatus::kDone);
  EXPECT_EQ(tangents[0](0, 0), 1.0);  // the state's own
  ASSERT_EQ(worker.Record(input).status, RolloutStatus::kDone);
  const InputDirection bar = worker.Adjoint({RowMatrixXd::Ones(1, 12)})[0];
  EXPECT_EQ(bar.state, VectorX<double>::Ones(12));
  EXPECT_EQ(bar.controls.size(), 0);
  for (const GradientMethod method :
       {GradientMethod::kTangent, GradientMethod::kAdjoint, GradientMethod::kJet,
        GradientMethod::kJetImplicit, GradientMethod::kFiniteDifference}) {
    RowMatrixXd jacobian;
    GradientMethod used;
    ASSERT_EQ(worker.Jacobian(input, method, RolloutWorker::Inputs::kAll, &jacobian, &used).status,
              RolloutStatus::kDone);
    ASSERT_EQ(jacobian.cols(), 16);
    // Differences of numbers near 1 with a step of about 1e-6 are right to 1e-9.
    EXPECT_LT((jacobian.rightCols(12) - RowMatrixXd::Identity(12, 12)).norm(), 1e-8);
  }
  EXPECT_FALSE(worker.Certify(input).verdict.empty());
}

TEST(RolloutFunctionControlsTest, TheTargetOfAServoIsOne) {
  const auto scene = [](const std::string& target) {
    return SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "m", "mass": 1, "inertia": 1, "position": [0, 0]}],
        "joints": [{"name": "r", "type": "prismatic", "bodies": ["m", "world"], "anchor": [0, 0],
        "axis": [1, 0], "effort": {"stiffness": 9, "damping": 2, "limit": 3, "target": )" +
                   target + R"(}}], "simulation": {"dt": 0.01, "duration": 0.3}})");
  };
  const std::string path = "joints/r/effort/target";
  RolloutFunction moved, held;
  ASSERT_EQ(moved.Create(scene("0"), {}, {path}, {}), "");
  ASSERT_EQ(held.Create(scene("0.7"), {}, {path}, {}), "");
  RolloutInput input = moved.Defaults();
  input.controls.setConstant(0.7);
  RolloutWorker to(moved), at(held);
  const RolloutOutput output = to.Run(input);
  EXPECT_EQ(output.states, at.Run(held.Defaults()).states);
  EXPECT_GT(output.states(0, 0), 0.05);
}

TEST(RolloutFunctionErrorsTest, OneLineEach) {
  RolloutFunction function;
  const Scene scene = Driven("fixed");
  const auto error = [&](const std::vector<std::string>& parameters,
                         const std::vector<std::string>& controls,
                         const std::vector<long>& records = {}) {
    return function.Create(scene, parameters, controls, records);
  };
  EXPECT_NE(error({"bodies/disk/mass"}, {}).find("matches no number"), std::string::npos);
  EXPECT_EQ(error({}, {"bodies/disc/mass"}),
            "control bodies/disc/mass: expected forces/NAME/force/x, forces/NAME/force/y, "
            "forces/NAME/torque or joints/NAME/effort (or its /target), got bodies/disc/mass");
  EXPECT_NE(error({"forces/push/force/x"}, {"forces/push/force/x"}), "");
  EXPECT_EQ(error({}, {}, {3, 3}), "records: expected ascending steps from 0 to 20, got 3");
  EXPECT_EQ(error({}, {}, {21}), "records: expected ascending steps from 0 to 20, got 21");
  ASSERT_EQ(error(kParameters, kControls), "");
  RolloutInput input = function.Defaults();
  EXPECT_EQ(function.CheckSizes(input), "");
  input.controls.resize(19, 3);
  EXPECT_EQ(function.CheckSizes(input), "controls: expected shape (20, 3), got (19, 3)");
  input = function.Defaults();
  input.parameters[0] = -1.0;
  RolloutWorker worker(function);
  const RolloutOutput refused = worker.Run(input);
  EXPECT_EQ(refused.status, RolloutStatus::kRefused);
  EXPECT_EQ(refused.message, "bodies/disc/mass: expected a number > 0, got -1.0");
  // The next call is not affected.
  input = function.Defaults();
  const RolloutOutput good = worker.Run(input);
  EXPECT_EQ(good.status, RolloutStatus::kDone);
  RolloutWorker fresh(function);
  EXPECT_EQ(fresh.Run(input).states, good.states);
  input.controls(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(worker.Run(input).message, "controls: expected finite numbers");
}

}  // namespace
}  // namespace tangible
