// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

constexpr char kCart[] = R"({"bodies": [
    {"name": "cart", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0]}],
  "joints": [{"name": "rail", "type": "prismatic", "bodies": ["cart", "world"], "anchor": [0, 0],
              "axis": [1, 0]}],
  "forces": [{"name": "push", "body": "cart", "force": [0, 0]}],
  "simulation": {"dt": 0.05, "duration": 1}})";

class TangibleControlTest : public ProgramTest {
 protected:
  ProgramRun Control(const std::string& problem, const std::string& flags = "") {
    Write("cart.json", kCart);
    return Run("tangible-control", "'" + Write("problem.json", problem) + "' " + flags);
  }
};

std::string Problem(const std::string& controls, const std::string& more = "") {
  return R"({"scene": "cart.json", "controls": [)" + controls + R"(], "cost": [
    {"state": "cart/x", "target": 1, "weight": 1e6, "at": "end"},
    {"state": "cart/vx", "weight": 1e6, "at": "end"},
    {"control": "joints/rail/effort", "weight": 1}])" +
         more + "}";
}
const std::string kEffort = R"({"path": "joints/rail/effort"})";
const std::string kBounded = R"({"path": "joints/rail/effort", "low": -1e3, "high": 1e3})";

// m x'' = u from rest to rest over 1 m in 1 s: u = 6 m (1 − 2 t) for the least ∫ u², so that
// ½ ∫ u² = 6 m². A step of 0.05 s changes that by h².
TEST_F(TangibleControlTest, MovesACartAsTheClosedFormSays) {
  const ProgramRun run =
      Control(Problem(kEffort), "--plan='" + Path("plan.csv") + "' --trajectory='" + Path("t.csv") +
                                    "' --view='" + Path("v.html") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "converged");
  EXPECT_EQ(result["iterations"].size(), 1u);
  EXPECT_NEAR(result["cost"].get<double>(), 24.0, 0.2);
  const json& values = result["controls"]["values"];
  ASSERT_EQ(values.size(), 20u);
  for (size_t k = 0; k < 20; ++k) {
    const double t = (static_cast<double>(k) + 0.5) * 0.05;
    EXPECT_NEAR(values[k][0].get<double>(), 12.0 * (1.0 - 2.0 * t), 0.7) << k;
  }
  EXPECT_NEAR(result["final_state"]["cart/x"].get<double>(), 1.0, 1e-3);
  EXPECT_EQ(result["certificate"]["verdict"], "trustworthy");
  EXPECT_EQ(Read(Path("plan.csv")).rfind("time,joints/rail/effort\n0,", 0), 0u);
  EXPECT_EQ(Read(Path("t.csv")).rfind("time,body,x", 0), 0u);
  EXPECT_NE(Read(Path("v.html")).find("Controls"), std::string::npos);
}

TEST_F(TangibleControlTest, KeepsBounds) {
  const ProgramRun run =
      Control(Problem(R"({"path": "joints/rail/effort", "low": -9, "high": 9, "initial": 3})"));
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "converged");
  double largest = 0.0;
  for (const json& u : result["controls"]["values"]) {
    largest = std::max(largest, std::abs(u[0].get<double>()));
  }
  EXPECT_EQ(largest, 9.0);
  EXPECT_NEAR(result["final_state"]["cart/x"].get<double>(), 1.0, 1e-2);
}

// A plant of twice the mass: the plan alone would come half as far.
TEST_F(TangibleControlTest, RecedingHorizonsBringAHeavierPlantToTheMark) {
  std::string heavy = kCart;
  heavy.replace(heavy.find("\"mass\": 2"), 9, "\"mass\": 4");
  Write("heavy.json", heavy);
  const std::string problem = R"({"scene": "cart.json", "controls": [)" + kEffort + R"(], "cost": [
      {"state": "cart/x", "target": 1, "weight": 100}, {"state": "cart/vx", "weight": 10},
      {"control": "joints/rail/effort", "weight": 0.01},
      {"state": "cart/x", "target": 1, "weight": 100, "at": "end"}],
    "mpc": {"duration": 3, "horizon": 1}})";
  const ProgramRun run = Control(problem, "--mpc --plant='" + Path("heavy.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(run.out);
  EXPECT_EQ(result["plans"], 60);
  EXPECT_EQ(result["plans_failed"], 0);
  EXPECT_NEAR(result["final_state"]["cart/x"].get<double>(), 1.0, 0.02);
  EXPECT_GT(result["cpu_seconds_max"].get<double>(), 0.0);
  // The best plan of a budget of time is played too.
  const ProgramRun timed =
      Control(problem, "--mpc --budget_ms=2 --plant='" + Path("heavy.json") + "'");
  ASSERT_EQ(timed.exit_status, 0) << timed.error;
  EXPECT_NEAR(json::parse(timed.out)["final_state"]["cart/x"].get<double>(), 1.0, 0.05);
}

// The plant's state is not known: what a noisy sensor reads is filtered by the model.
TEST_F(TangibleControlTest, RecedingHorizonsFromNoisyObservations) {
  const auto problem = [](const std::string& observations) {
    return R"({"scene": "cart.json", "controls": [)" + std::string(kEffort) + R"(], "cost": [
      {"state": "cart/x", "target": 1, "weight": 100}, {"state": "cart/vx", "weight": 10},
      {"control": "joints/rail/effort", "weight": 0.01}],
      "mpc": {"duration": 3, "horizon": 1, "observations": )" +
           observations + "}}";
  };
  const auto played = [&](const std::string& observations) {
    const ProgramRun run = Control(problem(observations), "--mpc");
    EXPECT_EQ(run.exit_status, 0) << run.error;
    json result = json::parse(run.out);
    for (const char* time : {"cpu_seconds_median", "cpu_seconds_max"}) result.erase(time);
    return result;
  };
  const std::string sensors = R"({"sensors": [{"state": "cart/x", "sigma": 0.01}])";
  const json result = played(sensors + "}");
  EXPECT_EQ(result["estimates"]["observations"], 60);
  EXPECT_NEAR(result["estimates"]["surprise_mean"].get<double>(), 1.0, 0.5);
  const double error = result["estimates"]["error_rms"]["cart/x"].get<double>();
  EXPECT_GT(error, 1e-4);
  EXPECT_LT(error, 0.01);
  EXPECT_NEAR(result["final_state"]["cart/x"].get<double>(), 1.0, 0.05);
  EXPECT_EQ(result, played(sensors + "}"));
  EXPECT_NE(result["cost"], played(sensors + R"(, "seed": 2})")["cost"]);
  const json rarely = played(sensors + R"(, "every": 7, "acceleration_sigma": 0.5})");
  EXPECT_EQ(rarely["estimates"]["observations"], 9);
  const json point =
      played(R"({"sensors": [{"point": {"body": "cart", "at": [0.1, 0]}, "sigma": 0.01}]})");
  EXPECT_LT(point["estimates"]["error_rms"]["cart/x"].get<double>(), 0.01);

  // A plant of other mass is not what the filter expects, and noise alone says nothing.
  std::string light = kCart;
  light.replace(light.find("\"mass\": 2"), 9, "\"mass\": 0.2");
  Write("light.json", light);
  const std::string exact = sensors + R"(, "acceleration_sigma": 0.01})";
  const ProgramRun other = Control(problem(exact), "--mpc --plant='" + Path("light.json") + "'");
  EXPECT_EQ(other.exit_status, 0) << other.error;
  EXPECT_NE(other.error.find("observations surprise the model's filter"), std::string::npos)
      << other.error << other.out.substr(0, 400);
  EXPECT_EQ(Control(problem(exact), "--mpc").error.find("surprise"), std::string::npos);

  for (const auto& [observations, message] :
       {std::pair(R"({})", "/mpc/observations/sensors: missing"),
        {R"({"sensors": []})", "/mpc/observations/sensors: expected at least one sensor, got none"},
        {R"({"sensors": [{"sigma": 1}]})",
         "/mpc/observations/sensors/0: expected one of state and point, got neither"},
        {R"({"sensors": [{"state": "cart/x", "point": {"body": "cart"}, "sigma": 1}]})",
         "got both"},
        {R"({"sensors": [{"state": "cart/z", "sigma": 1}]})",
         "/mpc/observations/sensors/0/state: expected a number of the state"},
        {R"({"sensors": [{"state": "cart/x", "sigma": 0}]})",
         "/mpc/observations/sensors/0/sigma: expected"},
        {R"({"sensors": [{"state": "cart/x"}]})", "/mpc/observations/sensors/0/sigma: missing"},
        {R"({"sensors": [{"state": "cart/x", "sigma": 1}], "every": 0})",
         "/mpc/observations/every: expected"},
        {R"({"sensors": [{"state": "cart/x", "sigma": 1}], "initial_sigma": -1})",
         "/mpc/observations/initial_sigma: expected"},
        {R"({"sensors": [{"state": "cart/x", "sigma": 1}], "noise": 1})", "/mpc/observations"}}) {
    ExpectOneLine(Control(problem(observations), "--mpc"), 1, message);
  }
}

// A pole that is 20 % longer in the plant: its states are not on the model's joints, and by events
// no step could be made from them. They are projected, which the result counts, and it stands.
TEST_F(TangibleControlTest, StatesOfALongerPoleAreProjectedOntoTheModelsJoints) {
  const auto scene = [this](const std::string& name, double length) {
    return Write(name, R"({"bodies": [
        {"name": "cart", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0]},
        {"name": "pole", "shape": {"box": {"size": [0.05, )" +
                           std::to_string(length) + R"(]}}, "mass": 0.2, "position": [0, )" +
                           std::to_string(length / 2) +
                           R"(]}],
      "joints": [{"name": "rail", "type": "prismatic", "bodies": ["cart", "world"], "anchor": [0, 0],
                  "axis": [1, 0]},
                 {"name": "pin", "type": "revolute", "bodies": ["pole", "cart"], "anchor": [0, 0],
                  "angle": 0.4}],
      "no_contact": [["cart", "pole"]],
      "simulation": {"dt": 0.02, "duration": 1, "stepping": "event"}})");
  };
  scene("model.json", 1.0);
  const std::string problem = R"({"scene": "model.json", "controls": [
      {"path": "joints/rail/effort", "low": -20, "high": 20}], "cost": [
      {"control": "joints/rail/effort", "weight": 0.01}, {"state": "pole/angle", "weight": 10},
      {"state": "pole/omega", "weight": 0.1}, {"state": "cart/x", "weight": 1},
      {"state": "pole/angle", "weight": 100, "at": "end"}, {"state": "pole/omega", "at": "end"},
      {"state": "cart/x", "weight": 10, "at": "end"}, {"state": "cart/vx", "weight": 10, "at": "end"}],
    "mpc": {"duration": 2, "horizon": 0.8}})";
  const ProgramRun longer = Control(problem, "--mpc --plant='" + scene("longer.json", 1.2) + "'");
  ASSERT_EQ(longer.exit_status, 0) << longer.error;
  json result = json::parse(longer.out);
  EXPECT_EQ(result["plans"], 100);
  EXPECT_EQ(result["plans_failed"], 0);
  EXPECT_EQ(result["states_projected"], 100);
  EXPECT_NEAR(result["joint_error_max"].get<double>(), 0.1, 1e-6);
  EXPECT_NEAR(result["final_state"]["pole/angle"].get<double>(), 0.0, 0.1);
  EXPECT_NEAR(result["final_state"]["pole/omega"].get<double>(), 0.0, 0.5);
  const ProgramRun same = Control(problem, "--mpc");
  ASSERT_EQ(same.exit_status, 0) << same.error;
  result = json::parse(same.out);
  EXPECT_EQ(result["states_projected"], 0);
  EXPECT_EQ(result["joint_error_max"], 0.0);
}

// A run without a plan, or without a cost, has no result: a speed at which the cost overflows, and
// one whose square is finite over a step and not over the run.
TEST_F(TangibleControlTest, ARunWithoutPlansOrCostIsAnError) {
  const auto at_speed = [this](const std::string& speed) {
    std::string fast = kCart;
    const std::string position = "\"position\": [0, 0]";
    fast.replace(fast.find(position), position.size(),
                 position + ", \"velocity\": [" + speed + ", 0]");
    Write("fast.json", fast);
    return Control(R"({"scene": "fast.json", "controls": [)" + kBounded + R"(], "cost": [
        {"state": "cart/x", "target": 1, "at": "end"}],
        "mpc": {"duration": 0.5, "horizon": 0.25}})",
                   "--mpc --out='" + Path("r.json") + "'");
  };
  for (const std::string speed : {"1e200", "-1e170"}) {
    ExpectOneLine(at_speed(speed), 1,
                  "problem.json: 10 of 10 plans failed, the first in step 0: the cost of the "
                  "initial controls is not finite");
    EXPECT_FALSE(std::filesystem::exists(Path("r.json")));
  }
  // x²/2 overflows above 1.896e154 m. A plan that begins at t ends 0.25 s later, the run at 0.5 s:
  // at 4e154 m/s the plans to 0.2 s can be made, and the run has no cost.
  ExpectOneLine(at_speed("4e154"), 1, "problem.json: the cost of the run is not finite");
  EXPECT_FALSE(std::filesystem::exists(Path("r.json")));
  // At 3e154 m/s it has one, and the plans from 0.4 s on, steps 8 and 9, cannot be made.
  ExpectOneLine(at_speed("3e154"), 0,
                "problem.json: warning: 2 of 10 plans failed, where the plans before them were "
                "continued; the first in step 8: ");
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["plans_failed"], 2);
  EXPECT_TRUE(result["cost"].is_number()) << result["cost"];
}

// A surrogate is named as such, and the plan ends with exact Jacobians: of a linear system in one
// iteration of each.
TEST_F(TangibleControlTest, LabelsASurrogate) {
  const ProgramRun run =
      Control(Problem(kBounded, R"(, "surrogate": {"samples": 4, "deviation": 0.2, "seed": 7})"));
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "converged");
  EXPECT_EQ(result["surrogate"]["samples"], 4);
  EXPECT_EQ(result["surrogate"]["seed"], 7);
  EXPECT_EQ(result["surrogate"]["iterations"], 1);
  EXPECT_EQ(result["iterations"][0]["jacobians"], "surrogate");
}

// The cart, and beside it a ball that falls from y onto a floor at -5 m and bounces.
std::string WithBouncingBall(const std::string& stepping, const std::string& y) {
  std::string text = kCart;
  text.replace(text.find("],"), 1, R"(,
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "restitution": 0.5,
     "position": [9, )" + y + R"(]},
    {"name": "floor", "static": true, "restitution": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": -5}}}])");
  text.insert(text.rfind("\"dt\""), "\"stepping\": \"" + stepping + "\", ");
  return text;
}

// A ball that bounces beside the cart: by fixed steps derivatives are those of the discrete map.
TEST_F(TangibleControlTest, WarnsOnceOfTheDiscreteMap) {
  const std::string problem = Problem(kEffort, R"(, "mpc": {"duration": 0.8, "horizon": 0.4})");
  const std::string file = "'" + Write("problem.json", problem) + "'";
  for (const char* flags : {"", " --mpc"}) {
    Write("cart.json", WithBouncingBall("fixed", "-4"));
    const ProgramRun fixed = Run("tangible-control", file + flags);
    ExpectOneLine(fixed, 0, "contact of ball and floor, an impact with restitution");
    EXPECT_NE(fixed.error.find(R"("stepping": "event")"), std::string::npos) << fixed.error;
    const json certificate = json::parse(fixed.out)["certificate"];
    EXPECT_EQ(certificate["verdict"], "of the discrete map: trustworthy") << flags;
    EXPECT_EQ(certificate["discrete_map"], true);
    for (const auto& [stepping, y] : {std::pair("event", "-4"), std::pair("fixed", "9")}) {
      Write("cart.json", WithBouncingBall(stepping, y));
      const ProgramRun none = Run("tangible-control", file + flags);
      EXPECT_EQ(none.exit_status, 0);
      EXPECT_EQ(none.error, "");
      EXPECT_EQ(json::parse(none.out)["certificate"]["discrete_map"], false);
      EXPECT_EQ(json::parse(none.out)["certificate"]["advice"], "");
    }
  }
}

// The ball lands at 0.43 s: within the horizon of the first plans, and after the run.
TEST_F(TangibleControlTest, WarnsOfAnImpactThatOnlyPlansHave) {
  for (const auto& [stepping, words] :
       {std::pair("fixed", "contact of ball and floor, an impact with restitution"),
        std::pair("event", "")}) {
    Write("cart.json", WithBouncingBall(stepping, "-4"));
    const std::string problem = Problem(kEffort, R"(, "mpc": {"duration": 0.2, "horizon": 0.4})");
    const ProgramRun run =
        Run("tangible-control", "'" + Write("problem.json", problem) + "' --mpc");
    ASSERT_EQ(run.exit_status, 0) << run.error;
    if (*words == '\0') {
      EXPECT_EQ(run.error, "");
    } else {
      ExpectOneLine(run, 0, words);
    }
    EXPECT_EQ(json::parse(run.out)["certificate"]["discrete_map"], false);
  }
}

// Of a linear motion secants have nothing to add; both are accepted.
TEST_F(TangibleControlTest, SecondOrderIsAFlagOrSecants) {
  const json plain = json::parse(Control(Problem(kBounded)).out);
  for (const char* value : {"true", "false", R"("secants")"}) {
    const ProgramRun run = Control(Problem(kBounded, std::string(R"(, "second_order": )") + value));
    ASSERT_EQ(run.exit_status, 0) << run.error;
    const json result = json::parse(run.out);
    EXPECT_EQ(result["status"], "converged") << value;
    EXPECT_NEAR(result["cost"].get<double>(), plain["cost"].get<double>(), 1e-6) << value;
  }
}

// Starts and samples are named in the result, which does not depend on the number of threads.
TEST_F(TangibleControlTest, StartsAndSamplingAreOfTheProblem) {
  const std::string problem = Problem(kBounded, R"(, "starts": {"count": 3, "pieces": 2, "seed": 5},
        "sampling": {"method": "mppi", "samples": 8, "iterations": 2, "seed": 4})");
  const ProgramRun run = Control(problem, "--threads=1");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "converged");
  EXPECT_NEAR(result["cost"].get<double>(), 24.0, 0.2);
  EXPECT_EQ(result["starts"]["count"], 3);
  EXPECT_EQ(result["starts"]["costs"].size(), 3u);
  EXPECT_EQ(result["starts"]["polished_costs"].size(), 3u);
  EXPECT_GT(result["starts"]["drawn"].get<int>(), 16);
  EXPECT_EQ(result["sampling"]["method"], "mppi");
  json other = json::parse(Control(problem, "--threads=4").out);
  result.erase("cpu_seconds");
  other.erase("cpu_seconds");
  EXPECT_EQ(result, other);
  const ProgramRun number = Control(Problem(kBounded, R"(, "starts": 2)"));
  ASSERT_EQ(number.exit_status, 0) << number.error;
  EXPECT_EQ(json::parse(number.out)["starts"]["count"], 2);
  ExpectOneLine(Control(Problem(kBounded), "--threads=-1"), 2, "--threads: expected a number");
  const ProgramRun horizons = Control(
      Problem(kBounded, R"(, "starts": 3, "mpc": {"duration": 0.2, "horizon": 0.5})"), "--mpc");
  EXPECT_EQ(horizons.exit_status, 0) << horizons.error;
}

// A plan is where another begins: it has converged there. In a receding horizon its first steps
// are, and its last one is held beyond its end.
TEST_F(TangibleControlTest, APlanFileContinues) {
  const std::string plan = Path("plan.csv");
  const ProgramRun first = Control(Problem(kBounded), "--plan='" + plan + "'");
  ASSERT_EQ(first.exit_status, 0) << first.error;
  const std::string table = R"(, "initial": {"file": "plan.csv"})";
  const ProgramRun second = Control(Problem(kBounded, table));
  ASSERT_EQ(second.exit_status, 0) << second.error;
  const json a = json::parse(first.out), b = json::parse(second.out);
  EXPECT_EQ(a["iterations"].size(), 1u);
  EXPECT_EQ(b["iterations"].size(), 0u);
  EXPECT_EQ(a["controls"], b["controls"]);
  EXPECT_EQ(a["cost"], b["cost"]);
  const std::string mpc = R"(, "mpc": {"duration": 0.2, "horizon": 1.5})";
  EXPECT_EQ(Control(Problem(kBounded, table + mpc), "--mpc").exit_status, 0);

  const std::string good = Read(plan);
  const auto with = [&](const std::string& text) {
    Write("plan.csv", text);
    return Control(Problem(kBounded, table));
  };
  ExpectOneLine(with(good.substr(0, good.rfind('\n', good.size() - 2) + 1)), 1,
                "plan.csv: expected a row for each of the horizon's 20 steps, got 19");
  std::string late = good;
  late.replace(late.find("\n0,"), 3, "\n0.01,");
  ExpectOneLine(with(late), 1,
                "plan.csv: line 2: time: expected the start of the step, 0, got 0.01");
  std::string large = good;
  const size_t at = large.find("\n0,") + 3;
  large.replace(at, large.find('\n', at) - at, "1001");
  ExpectOneLine(
      with(large), 1,
      "plan.csv: line 2: joints/rail/effort: expected a number from low to high, got 1001");
  ExpectOneLine(with("time,joints/rail/efort\n0,1\n"), 1, "plan.csv: ");
  std::filesystem::remove(plan);
  ExpectOneLine(Control(Problem(kBounded, table)), 1, "plan.csv: ");
}

TEST_F(TangibleControlTest, MistakesOfSearchesAreOneLine) {
  ExpectOneLine(Control(Problem(kEffort, R"(, "starts": 2)")), 1,
                "/controls/0: expected low and high with starts, which are drawn between them");
  ExpectOneLine(Control(Problem(kEffort, R"(, "sampling": {"method": "mppi"})")), 1,
                "/controls/0: expected low and high with sampling");
  ExpectOneLine(Control(Problem(kBounded, R"(, "starts": 0)")), 1, "/starts: expected");
  ExpectOneLine(Control(Problem(kBounded, R"(, "starts": {"pieces": 2})")), 1, "/starts/count");
  ExpectOneLine(Control(Problem(kBounded, R"(, "starts": {"count": 2, "pieces": 0})")), 1,
                "/starts/pieces: expected");
  ExpectOneLine(Control(Problem(kBounded, R"(, "starts": "many")")), 1, "/starts: expected");
  ExpectOneLine(Control(Problem(kBounded, R"(, "second_order": "newton")")), 1,
                "/second_order: expected");
  ExpectOneLine(Control(Problem(kBounded, R"(, "second_order": 1)")), 1, "/second_order: expected");
  ExpectOneLine(Control(Problem(kBounded, R"(, "sampling": {"method": "annealing"})")), 1,
                "/sampling/method: expected");
  ExpectOneLine(Control(Problem(kBounded, R"(, "sampling": {"method": "mppi", "samples": 1})")), 1,
                "/sampling/samples: expected");
  ExpectOneLine(Control(Problem(kBounded, R"(, "initial": {"fil": "x"})")), 1, "unknown key");
  ExpectOneLine(Control(Problem(kBounded, R"(, "initial": 3)")), 1, "/initial: expected");
}

TEST_F(TangibleControlTest, MistakesAreOneLine) {
  ExpectOneLine(Control(Problem(R"({"path": "joints/rail/effort", "low": 2, "high": 1})")), 1,
                "/controls/0/high: expected a number >= low, got 1");
  ExpectOneLine(Control(Problem(kEffort + R"(, {"path": "bodies/cart/mass"})")), 1,
                "problem.json: /controls/1/path: control bodies/cart/mass: expected");
  ExpectOneLine(Control(Problem(kEffort + R"(, {"path": "forces/pull/torque"})")), 1,
                "problem.json: /controls/1/path: parameter forces/pull/torque: matches no number");
  ExpectOneLine(Control(Problem(kEffort + ", " + kEffort)), 1, "problem.json: /controls/1/path: ");
  ExpectOneLine(Control(Problem(kEffort, R"(, "name": 3)")), 1, "/name: expected a string, got 3");
  ExpectOneLine(Control(Problem(kEffort, R"(, "surrogate": {"samples": 2})")), 1,
                "/controls/0: expected low and high with a surrogate");
  ExpectOneLine(Control(Problem(kEffort, R"(, "horizon": 0)")), 1,
                "/horizon: expected a number > 0, got 0");
  ExpectOneLine(Control(Problem(kEffort, R"(, "horizons": 1)")), 1, "unknown key");
  ExpectOneLine(Control(Problem(kEffort, R"(, "horizon": 1e300)")), 1, "/horizon: expected a time");
  for (const char* span : {"1e19", "1e-12"}) {
    const std::string of(span);
    ExpectOneLine(
        Control(Problem(kEffort, R"(, "mpc": {"horizon": 1, "duration": )" + of + "}"), "--mpc"), 1,
        "/mpc/duration: expected a time");
    ExpectOneLine(
        Control(Problem(kEffort, R"(, "mpc": {"duration": 1, "horizon": )" + of + "}"), "--mpc"), 1,
        "/mpc/horizon: expected a time");
  }
  ExpectOneLine(Control(Problem(R"({"path": "joints/rail/effort", "high": 1, "initial": 2})")), 1,
                "/controls/0/initial: expected a number from low to high");
  ExpectOneLine(Control(Problem(kEffort + R"(, {"path": "forces/push/force/y"})")), 1,
                "problem.json: /controls/1/path: expected a control that moves something, got "
                "forces/push/force/y, which moves nothing");
  std::string name = Problem(kEffort);
  name.replace(name.find("cart/vx"), 7, "card/vx");
  ExpectOneLine(Control(name), 1, "/cost/1/state: expected a number of the state");
  std::string large = Problem(kEffort);
  large.replace(large.find("1e6"), 3, "1e308");
  large.replace(large.find("\"target\": 1"), 11, "\"target\": 1e9");
  ExpectOneLine(Control(large), 1, "the cost of the initial controls is not finite");
  ExpectOneLine(Control(R"({"scene": "nowhere.json", "controls": [], "cost": []})"), 1,
                "nowhere.json");
  ExpectOneLine(Control(Problem(kEffort, R"(, "reference_extension": true)")), 1,
                "/reference_extension: expected with event stepping only");
  ExpectOneLine(Control(Problem(kBounded, R"(, "surrogate": {"samples": 3})")), 1,
                "/surrogate/samples: expected an even number, got 3");
  ExpectOneLine(Control(Problem(kBounded, R"(, "surrogate": {"samples": 2, "deviation": 0})")), 1,
                "/surrogate/deviation: expected a number > 0");
  ExpectOneLine(Control(Problem(kEffort), "--mpc"), 1, "/mpc: missing");
  ExpectOneLine(Control(Problem(kEffort + R"(, {"path": "forces/push/force/y"})",
                                R"(, "mpc": {"duration": 1, "horizon": 1})"),
                        "--mpc"),
                1, "/controls/1/path: expected a control that moves something");
  ExpectOneLine(Control(Problem(kEffort), "--plant=x.json"), 2, "--plant: needs --mpc");
  ExpectOneLine(Control(Problem(kEffort), "--budget_ms=-1 --mpc"), 2, "--budget_ms");
}

// Errors of the plant name its file, and the place in it.
TEST_F(TangibleControlTest, MistakesOfThePlantAreItsOwn) {
  const auto with = [this](const std::string& from, const std::string& to) {
    std::string plant = kCart;
    plant.replace(plant.find(from), from.size(), to);
    return Control(Problem(kEffort, R"(, "mpc": {"duration": 1, "horizon": 1})"),
                   "--mpc --plant='" + Write("plant.json", plant) + "'");
  };
  ExpectOneLine(with("\"dt\": 0.05", "\"dt\": 0.1"), 1, "plant.json: /simulation/dt: expected");
  ExpectOneLine(with("\"name\": \"rail\"", "\"name\": \"track\""), 1,
                "plant.json: parameter joints/rail/effort: matches no number");
  ExpectOneLine(with(R"("prismatic", "bodies": ["cart", "world"], "anchor": [0, 0],
              "axis": [1, 0])",
                     R"("revolute", "bodies": ["cart", "world"], "anchor": [0, 0])"),
                1,
                "plant.json: joints/rail/effort: expected a joint of the model's type, prismatic, "
                "got revolute");
  ExpectOneLine(
      with("{\"bodies\": [",
           R"({"bodies": [{"name": "dog", "mass": 1, "inertia": 1, "position": [9, 9]},)"),
      1, "plant.json: /bodies: expected the moving bodies of");
}

// By fixed steps nothing keeps the hinge of a rod that turns closed: the run that was played says
// so.
TEST_F(TangibleControlTest, AHingeThatComesApartUnderMpcIsNamed) {
  Write("rod.json", R"({"bodies": [
      {"name": "rod", "shape": {"box": {"size": [0.04, 1]}}, "mass": 1, "position": [0, -0.5],
       "velocity": [4, 0], "angular_velocity": 8}],
    "joints": [{"name": "hinge", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0]}],
    "simulation": {"dt": 0.02, "duration": 1}})");
  const ProgramRun run = Control(
      R"({"scene": "rod.json", "controls": [{"path": "joints/hinge/effort", "low": -1, "high": 1}],
          "cost": [{"state": "rod/omega", "target": 8}], "mpc": {"duration": 2, "horizon": 0.1}})",
      "--mpc");
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.error.find("warning: joint hinge is open by"), std::string::npos) << run.error;
}

// A force that ends before the horizon does, and costs nothing, is a convex problem as any other.
TEST_F(TangibleControlTest, AForceThatEndsBeforeTheHorizonIsPlanned) {
  std::string scene = kCart;
  const std::string force = "\"force\": [0, 0]";
  scene.replace(scene.find(force), force.size(), force + ", \"start\": 0, \"end\": 0.5");
  scene.insert(scene.find("\"dt\""), "\"stepping\": \"event\", ");
  const std::string early = Write("early.json", scene);
  const ProgramRun run = Control(R"({"scene": "early.json", "controls": [
      {"path": "forces/push/force/x", "initial": 0.5}], "cost": [
      {"state": "cart/x", "target": 1, "weight": 1e6, "at": "end"}]})");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "converged") << result["message"];
  EXPECT_EQ(result["gradient"], 0.0);
  EXPECT_NEAR(result["final_state"]["cart/x"].get<double>(), 1.0, 1e-9);
  EXPECT_EQ(result["controls"]["values"][19][0], 0.5);
}

// A pendulum that hangs and is to stand, with whole turns not counted, has no gradient.
TEST_F(TangibleControlTest, SaysThatItLeavesAMaximum) {
  Write("rod.json", R"({"bodies": [
      {"name": "rod", "shape": {"box": {"size": [0.05, 1]}}, "mass": 1, "position": [0, -0.5]}],
    "joints": [{"name": "motor", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0]}],
    "simulation": {"dt": 0.02, "duration": 1, "stepping": "event"}})");
  const ProgramRun run = Control(R"({"scene": "rod.json", "controls": [
      {"path": "joints/motor/effort", "low": -20, "high": 20}], "cost": [
      {"state": "rod/angle", "target": 3.141592653589793, "wrap": true, "weight": 100, "at": "end"},
      {"control": "joints/motor/effort", "weight": 0.01}]})");
  ExpectOneLine(run, 0, "warning: with the initial controls the cost has no gradient");
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "converged") << result["message"];
  EXPECT_NEAR(std::cos(result["final_state"]["rod/angle"].get<double>()), -1.0, 1e-2);
}

// A rod that is swung up by fixed steps does not end there in the motion: exit 1 with one line, the
// result, the terminal and the page name both costs, and the optimiser's status is kept. The same
// plan by events holds.
TEST_F(TangibleControlTest, AFixedStepPlanThatFailsInTheMotionSaysSo) {
  const auto rod = [this](const std::string& stepping) {
    Write("rod.json", R"({"bodies": [
        {"name": "rod", "shape": {"box": {"size": [0.05, 1]}}, "mass": 1, "position": [0, -0.5]}],
      "joints": [{"name": "motor", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0]}],
      "simulation": {"dt": 0.05, "duration": 1, )" +
                          stepping + "}}");
    return Control(R"({"scene": "rod.json", "controls": [
        {"path": "joints/motor/effort", "low": -20, "high": 20, "initial": 1}], "cost": [
        {"state": "rod/angle", "target": 3.141592653589793, "weight": 100, "at": "end"},
        {"state": "rod/omega", "weight": 10, "at": "end"},
        {"control": "joints/motor/effort", "weight": 0.01}]})",
                   "--out='" + Path("r.json") + "' --view='" + Path("v.html") + "'");
  };
  const ProgramRun fixed = rod(R"("joint_correction": "projection")");
  ExpectOneLine(fixed, 1, "problem.json: differs_from_motion: the plan's cost is ");
  json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["status"], "differs_from_motion");
  EXPECT_EQ(result["planned_status"], "converged");
  EXPECT_GT(result["motion"]["cost"].get<double>(), 1.05 * result["cost"].get<double>());
  EXPECT_GT(std::abs(result["motion"]["final_state"]["rod/angle"].get<double>() -
                     result["final_state"]["rod/angle"].get<double>()),
            0.01);
  EXPECT_NE(fixed.out.find("differs_from_motion"), std::string::npos) << fixed.out;
  EXPECT_NE(fixed.out.find("rod/angle"), std::string::npos) << fixed.out;
  EXPECT_NE(Read(Path("v.html")).find("differs_from_motion"), std::string::npos);
  EXPECT_NE(Read(Path("v.html")).find("replayed by events"), std::string::npos);

  const ProgramRun events = rod(R"("stepping": "event")");
  EXPECT_EQ(events.exit_status, 0) << events.error;
  result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["status"], "converged");
  EXPECT_EQ(result["planned_status"], "converged");
  EXPECT_NEAR(result["motion"]["cost"].get<double>(), result["cost"].get<double>(),
              0.01 * result["cost"].get<double>());
}

// A puck that the cart never touches: no effort changes where it ends, whatever the optimiser says
// of a gradient of zero. Beside a target of the cart it is a warning.
TEST_F(TangibleControlTest, ATargetThatNoControlChangesIsNamed) {
  std::string scene = kCart;
  scene.replace(scene.find("],"), 1, R"(,
    {"name": "puck", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [9, 5]}])");
  scene.insert(scene.find("\"dt\""), "\"stepping\": \"event\", ");
  Write("puck.json", scene);
  const auto problem = [](const std::string& more) {
    return R"({"scene": "puck.json", "controls": [{"path": "joints/rail/effort", "low": -9,
        "high": 9, "initial": 1}], "cost": [{"control": "joints/rail/effort"}, )" +
           more + R"({"point": {"body": "puck"}, "target": [8, 0.5], "at": "end"}]})";
  };
  const ProgramRun none = Control(problem(""));
  ExpectOneLine(none, 1,
                "problem.json: no_effect_on_target: the controls have no effect on /cost/1 (x of a "
                "point of puck), /cost/1 (y of a point of puck)");
  json result = json::parse(none.out);
  EXPECT_EQ(result["status"], "no_effect_on_target");
  EXPECT_EQ(result["planned_status"], "converged");
  const ProgramRun one =
      Control(problem(R"({"state": "cart/x", "target": 0.01, "weight": 100, "at": "end"}, )"));
  ExpectOneLine(one, 0, "warning: the controls have no effect on /cost/2 (x of a point of puck)");
  EXPECT_EQ(json::parse(one.out)["status"], "converged");
}

// A file that the problem names is an input as well, which is found before the work.
TEST_F(TangibleControlTest, OutputsOverTheProblemsSceneAreWrongUsage) {
  for (const char* flag : {"out", "plan", "trajectory", "view"}) {
    for (const char* file : {"cart.json", "problem.json"}) {
      const ProgramRun run =
          Control(Problem(kEffort), "--" + std::string(flag) + "='" + Path(file) + "'");
      ExpectOneLine(run, 2, "expected a file of its own");
    }
  }
  EXPECT_EQ(Read(Path("cart.json")), kCart);
}

// An output that cannot be written leaves the others as they were.
TEST_F(TangibleControlTest, WritesAllOutputsOrNone) {
  Write("plan.csv", "old");
  std::filesystem::create_symlink(Path("nowhere/r.json"), Path("r.json"));
  const ProgramRun run =
      Control(Problem(kEffort), "--out='" + Path("r.json") + "' --plan='" + Path("plan.csv") +
                                    "' --trajectory='" + Path("t.csv") + "'");
  ExpectOneLine(run, 1, "r.json: cannot be written");
  EXPECT_EQ(Read(Path("plan.csv")), "old");
  EXPECT_FALSE(std::filesystem::exists(Path("t.csv")));
  // Nor is anything left beside them.
  for (const auto& entry : std::filesystem::directory_iterator(Path(""))) {
    EXPECT_EQ(entry.path().string().find(".tmp"), std::string::npos) << entry.path();
  }
}

}  // namespace
}  // namespace tangible
