// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "../support/scenes.h"
#include "run_program.h"
#include "tangible/scene/csv.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleSimulateTest : public ProgramTest {
 protected:
  ProgramRun Simulate(const std::string& scene, const std::string& flags = "") const {
    return Run("tangible-simulate", "'" + Write("scene.json", scene) + "' " + flags);
  }
  // `--name='path in the test's folder'`.
  std::string Flag(const std::string& name, const std::string& file) const {
    return "--" + name + "='" + Path(file) + "' ";
  }
  CsvTable Table(const std::string& text, const std::vector<std::string>& columns) const {
    CsvTable table;
    std::string error;
    EXPECT_TRUE(ParseCsv(text, "table", columns, columns, &table, &error)) << error;
    return table;
  }
};

const std::vector<std::string> kTrajectory = {"time",  "body", "x",  "y",
                                              "angle", "vx",   "vy", "omega"};

// Numbers of a cell by column's name.
double Cell(const CsvTable& table, size_t row, const std::string& column) {
  double value = NAN;
  EXPECT_TRUE(ParseNumber(table.rows[row][table.Column(column)], &value));
  return value;
}

constexpr char kFall[] = R"({"bodies": [
    {"name": "a", "mass": 1, "inertia": 1, "position": [0, 5], "velocity": [1, 0]},
    {"name": "belt", "kinematic": true, "position": [0, 0], "velocity": [2, 0]},
    {"name": "wall", "static": true}],
  "simulation": {"dt": 0.125, "duration": 0.9}})";

TEST_F(TangibleSimulateTest, WritesTheTrajectoryToStdout) {
  const ProgramRun run = Simulate(kFall, "--every=3");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(run.out.substr(0, run.out.find('\n')), "time,body,x,y,angle,vx,vy,omega");
  const CsvTable table = Table(run.out, kTrajectory);
  // Eight steps, the last one shorter: times 0, 3, 6 steps and the end; what moves, in scene order.
  ASSERT_EQ(table.rows.size(), 8u);
  const double times[] = {0.0, 0.375, 0.75, 0.9};
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(Cell(table, i, "time"), times[i / 2]);
    EXPECT_EQ(table.rows[i][1], i % 2 == 0 ? "a" : "belt");
  }
  EXPECT_DOUBLE_EQ(Cell(table, 6, "vy"), -9.81 * 0.9);
  EXPECT_DOUBLE_EQ(Cell(table, 7, "x"), 1.8);
  // 17 digits: read back, the sum of the map's steps to the bit.
  double y = 5.0;
  double vy = 0.0;
  for (int k = 0; k < 3; ++k) {
    vy = (vy + 0.125 * -9.81) / 1.0;
    y += 0.125 * vy;
  }
  EXPECT_EQ(Cell(table, 2, "y"), y);
}

TEST_F(TangibleSimulateTest, OtherResultsDoNotFloodStdout) {
  for (const char* flag : {"view", "summary", "observe"}) {
    const ProgramRun run = Simulate(kFall, Flag(flag, "result"));
    EXPECT_EQ(run.exit_status, 0) << run.error;
    EXPECT_EQ(run.out, "");
    EXPECT_NE(Read(Path("result")), "");
  }
}

TEST_F(TangibleSimulateTest, SummaryHasItsKeysAndItsNumbersAreRight) {
  const ProgramRun run = Simulate(test_scenes::Mixture(), Flag("summary", "s.json"));
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json s = json::parse(Read(Path("s.json")));
  for (const char* key : {"status",
                          "message",
                          "steps",
                          "seconds",
                          "cpu_seconds",
                          "bodies",
                          "contacts_max",
                          "lcp_rows_max",
                          "islands_max",
                          "events",
                          "fallbacks",
                          "solver",
                          "residual_max",
                          "penetration_max",
                          "joint_drift_max",
                          "impact_energy_gain_max",
                          "energy_start",
                          "energy_end",
                          "momentum_start",
                          "momentum_end",
                          "reductions",
                          "fallback_kinds",
                          "undetermined_end",
                          "bounces_ended",
                          "ellipse_motions",
                          "rounding_of_coordinates"}) {
    EXPECT_TRUE(s.contains(key)) << key;
  }
  EXPECT_EQ(s["status"], "done");
  EXPECT_EQ(s["steps"], 63);
  EXPECT_EQ(s["bodies"], 4);
  EXPECT_EQ(s["islands_max"], 3);
  EXPECT_GE(s["contacts_max"], 1);
  EXPECT_LE(s["joint_drift_max"], 1e-10);
  EXPECT_LE(s["residual_max"], 1e-10);
  EXPECT_LE(s["penetration_max"], 1e-4);
  EXPECT_LT(s["energy_end"], s["energy_start"]);
  EXPECT_GT(s["cpu_seconds"], 0.0);
  const json& reductions = s["reductions"];
  EXPECT_EQ(s["solver"]["guess"].get<int>() + reductions["steps_without_lcp"].get<int>(), 63);
  EXPECT_EQ(reductions["lcp_rows"],
            3 * reductions["contacts"].get<int>() - 2 * reductions["single_rows"].get<int>());
  EXPECT_LE(reductions["pairs_near"], reductions["pairs_compared"]);
  for (const char* kind :
       {"pivoting", "interior_point", "lemke", "dense", "restarts", "extrapolation", "regularised",
        "whole_system", "islands_together", "newton_stages", "halved_motions", "damped_projections",
        "short_steps", "rebounds_given_up", "held_contacts"}) {
    EXPECT_EQ(s["fallback_kinds"].count(kind), 1u) << kind;
  }
  EXPECT_EQ(s["fallback_kinds"]["interior_point"], 0);
  // The ball's 1 · 1 and the crate's 2 · 1.2 m/s, and the rod's 0.5 · 0.25 m · 0.2 rad/s sin(0.1).
  const double rod = 0.5 * 0.25 * 0.2 * std::sin(0.1);
  EXPECT_NEAR(s["momentum_start"][0], 3.4 + rod, 1e-12);
}

// Which of many solutions a run ends with is told: a disc's impulses are unique; a box's two
// corners may share its friction as they like; four corners its weight, and as they slide with
// different friction the motion itself.
// Discs that begin 0.05 m into each other and part: no pair of them ever acts.
TEST_F(TangibleSimulateTest, SummaryHasTheOverlapOfBodiesThatSeparate) {
  for (const char* stepping : {"fixed", "event"}) {
    const std::string scene = Write("s.json", R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
       "velocity": [-1, 0]},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.15, 0],
       "velocity": [1, 0]}],
      "simulation": {"dt": 0.01, "duration": 0.1, "stepping": ")" +
                                                  std::string(stepping) + "\"}}");
    ASSERT_EQ(
        Run("tangible-simulate", "'" + scene + "' --summary='" + Path("s.out") + "'").exit_status,
        0);
    const json summary = json::parse(Read(Path("s.out")));
    EXPECT_NEAR(summary["penetration_max"].get<double>(), 0.05, 1e-12) << stepping;
  }
}

TEST_F(TangibleSimulateTest, SummarySaysWhereImpulsesAreNotUnique) {
  const std::string floor = R"({"name": "floor", "static": true,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}, "friction": 0.3})";
  const auto box = [](const std::string& name, double x, double speed, double friction) {
    return json{{"name", name},
                {"shape", {{"box", {{"size", {1, 1}}}}}},
                {"mass", 1},
                {"position", {x, 0.5}},
                {"velocity", {speed, 0}},
                {"friction", friction}};
  };
  const json disc = {{"name", "a"},
                     {"shape", {{"circle", {{"radius", 0.5}}}}},
                     {"mass", 1},
                     {"position", {0, 0.5}},
                     {"friction", 0.3}};
  const json weld = {
      {"name", "w"}, {"type", "weld"}, {"bodies", {"a", "b"}}, {"anchor", {0.5, 0.5}}};
  struct {
    std::vector<json> bodies;
    bool welded;
    int impulses, motions;
  } const cases[] = {{{disc}, false, 0, 0},
                     {{box("a", 0, 0, 0.3)}, false, 1, 0},
                     {{box("a", 0, 2, 0.3)}, false, 0, 0},
                     {{box("a", 0, 2, 0.3), box("b", 1, 2, 0.3)}, true, 2, 0},
                     {{box("a", 0, 2, 0.1), box("b", 1, 2, 0.6)}, true, 2, 1}};
  for (const char* stepping : {"fixed", "event"}) {
    for (const auto& c : cases) {
      json scene = {{"bodies", c.bodies},
                    {"simulation", {{"dt", 0.01}, {"duration", 0.05}, {"stepping", stepping}}}};
      scene["bodies"].push_back(json::parse(floor));
      if (c.welded) scene["joints"] = {weld};
      const ProgramRun run = Simulate(scene.dump(), Flag("summary", "s.json"));
      ASSERT_EQ(run.exit_status, 0) << run.error;
      const json end = json::parse(Read(Path("s.json")))["undetermined_end"];
      EXPECT_EQ(end["impulses"], c.impulses) << scene;
      EXPECT_EQ(end["motions"], c.motions) << scene;
      EXPECT_EQ(end["chosen"].get<std::string>().empty(), c.impulses == 0) << scene;
    }
  }
}

// Whatever is counted as a fallback has its kind: a box that rocks is held, a ball whose bounces do
// not end gives them up, and a rod that catches needs pivots (Painlevé).
TEST_F(TangibleSimulateTest, FallbacksAreTheSumOfTheirKinds) {
  const auto run = [&](const std::string& bodies, const std::string& floor,
                       const std::string& settings) {
    const ProgramRun done = Simulate(R"({"bodies": [)" + bodies +
                                         R"({"name": "floor", "static": true, "shape":
            {"half_plane": {"normal": [0, 1], "offset": 0}}, )" +
                                         floor + R"(}], "simulation": {)" + settings + "}}",
                                     Flag("summary", "s.json"));
    EXPECT_EQ(done.exit_status, 0) << done.error;
    const json summary = json::parse(Read(Path("s.json")));
    long sum = 0;
    for (const json& count : summary["fallback_kinds"]) sum += count.get<long>();
    EXPECT_EQ(summary["fallbacks"], sum) << summary;
    return summary["fallback_kinds"];
  };
  const std::string box = R"({"name": "box", "shape": {"box": {"size": [0.15, 0.3]}}, "mass": 1,
      "position": [3, 0.152], "angle": 0.01, "friction": 0.6},)";
  const std::string ball = R"({"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
      "position": [0, 0.1001], "restitution": 0.9},)";
  const std::string rod = R"({"name": "rod", "shape": {"capsule": {"length": 1, "radius": 0.001}},
      "mass": 1, "inertia": 0.08333333333333333, "position": [0.3213938048432697,
      0.384022221559489], "angle": 0.8726646259971648, "velocity": [-2, 0], "friction": 3},)";
  const std::string event = R"("stepping": "event", )";
  EXPECT_GT(run(box, R"("friction": 0.6)", event + R"("dt": 0.01, "duration": 1)")["held_contacts"],
            0);
  EXPECT_EQ(run(ball, R"("restitution": 0.9)", event + R"("dt": 0.1, "duration": 0.1,
                                       "restitution_threshold": 0, "max_events_per_step": 5)")
                ["rebounds_given_up"],
            1);
  EXPECT_GT(run(rod, R"("friction": 3)", event + R"("dt": 0.001, "duration": 0.05)")["pivoting"],
            0);
  const std::string mixed = R"("friction": 0.5, "restitution": 0.9)";
  run(box + ball + rod, mixed, R"("dt": 0.01, "duration": 0.5)");
}

// A rank of more operations than a stated bound is not taken, and the summary says so: a ring of
// 900 hinged links.
TEST_F(TangibleSimulateTest, SummarySaysWhereARankWouldTakeTooLong) {
  constexpr int kLinks = 900;
  json bodies = json::array(), joints = json::array();
  for (int i = 0; i < kLinks; ++i) {
    const std::string name = "l" + std::to_string(i);
    const double angle = 2.0 * M_PI * i / kLinks;
    const double between = angle - M_PI / kLinks;
    bodies.push_back({{"name", name},
                      {"mass", 1},
                      {"inertia", 1},
                      {"position", {100 * std::cos(angle), 100 * std::sin(angle)}}});
    joints.push_back({{"name", "j" + std::to_string(i)},
                      {"type", "revolute"},
                      {"bodies", {name, "l" + std::to_string((i + kLinks - 1) % kLinks)}},
                      {"anchor", {100 * std::cos(between), 100 * std::sin(between)}}});
  }
  const json scene = {
      {"bodies", bodies}, {"joints", joints}, {"simulation", {{"dt", 0.01}, {"duration", 0.01}}}};
  ASSERT_EQ(Simulate(scene.dump(), Flag("summary", "s.json")).exit_status, 0);
  const json end = json::parse(Read(Path("s.json")))["undetermined_end"];
  EXPECT_TRUE(end["impulses"].is_null());
  EXPECT_TRUE(end["motions"].is_null());
  EXPECT_EQ(end["reason"].get<std::string>().find("not counted: "), 0u) << end;
}

TEST_F(TangibleSimulateTest, AChainThatTurnsTooFarInAStepShowsInItsSummary) {
  json scene = json::parse(test_scenes::WhippingChain(2.0));
  scene["simulation"]["dt"] = 0.05;
  ASSERT_EQ(Simulate(scene.dump(), Flag("summary", "s.json")).exit_status, 0);
  EXPECT_GT(json::parse(Read(Path("s.json")))["fallback_kinds"]["damped_projections"], 0);
}

// The certificate needs solves of its own with the steps' factorisations: the motion stays the same
// to the last bit.
TEST_F(TangibleSimulateTest, CertifiesOnRequest) {
  const auto run = [&](const std::string& scene, const std::string& flags) {
    const ProgramRun done =
        Simulate(scene, Flag("summary", "s.json") + Flag("out", "t.csv") + flags);
    EXPECT_EQ(done.exit_status, 0) << done.error;
    return json::parse(Read(Path("s.json")));
  };
  EXPECT_FALSE(run(test_scenes::Mixture(), "").contains("certificate"));
  const std::string motion = Read(Path("t.csv"));
  const json certificate = run(test_scenes::Mixture(), "--certify").at("certificate");
  EXPECT_EQ(Read(Path("t.csv")), motion);
  EXPECT_EQ(certificate.at("verdict"), "of the discrete map: trustworthy");
  EXPECT_GT(certificate.at("mode_switches"), 0);
  const json landing =
      run(test_scenes::FallingBall(0.05, R"({"dt": 0.01, "duration": 0.1})"), "--certify");
  EXPECT_EQ(landing.at("certificate")
                .at("verdict")
                .get<std::string>()
                .find("of the discrete map: discontinuous: landing in the last step"),
            0u);
  ExpectOneLine(Simulate(test_scenes::Mixture(), "--certify"), 2, "--certify");
}

TEST_F(TangibleSimulateTest, ContactsCarryTheWeight) {
  const ProgramRun run = Simulate(R"({"gravity": [0, -10], "bodies": [
      {"name": "box", "shape": {"box": {"size": [1, 1]}}, "mass": 2, "position": [0, 0.5],
       "friction": 0.5},
      {"name": "bob", "mass": 3, "inertia": 1, "position": [4, 2]}, )" +
                                      std::string(test_scenes::kFloor) + R"(],
    "joints": [{"name": "nail", "type": "weld", "bodies": ["bob", "world"], "anchor": [4, 2]}],
    "simulation": {"dt": 0.01, "duration": 0.02}})",
                                  Flag("contacts", "c.csv") + Flag("out", "t.csv"));
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.out, "");
  const CsvTable table = Table(
      Read(Path("c.csv")), {"time", "kind", "first", "second", "gap", "normal_impulse",
                            "tangential_impulse", "mode", "impulse_1", "impulse_2", "impulse_3"});
  ASSERT_EQ(table.rows.size(), 6u);
  for (const size_t step : {0u, 1u}) {
    // Two corners carry 2 kg · 10 m/s² · 0.01 s, the nail 3 kg · 10 m/s² · 0.01 s.
    for (const size_t corner : {0u, 1u}) {
      const size_t row = 3 * step + corner;
      EXPECT_EQ(table.rows[row][1], "contact");
      EXPECT_EQ(table.rows[row][2], "box");
      EXPECT_EQ(table.rows[row][3], "floor");
      EXPECT_EQ(table.rows[row][7], "sticking");
      EXPECT_NEAR(Cell(table, row, "normal_impulse"), 0.1, 1e-12);
      EXPECT_NEAR(Cell(table, row, "gap"), 0.0, 1e-12);
    }
    EXPECT_EQ(table.rows[3 * step + 2][1], "joint");
    EXPECT_EQ(table.rows[3 * step + 2][2], "nail");
    EXPECT_NEAR(Cell(table, 3 * step + 2, "impulse_2"), 0.3, 1e-12);
    EXPECT_NEAR(Cell(table, 3 * step + 2, "impulse_3"), 0.0, 1e-12);
  }
}

TEST_F(TangibleSimulateTest, GoesOnFromTheLastRowsOfATrajectory) {
  // Half of the fall twice is the whole: the map does not depend on time.
  const std::string half = R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1,
      "position": [0, 5], "velocity": [1, 0], "angular_velocity": 2}],
    "simulation": {"dt": 0.125, "duration": )";
  const ProgramRun whole = Simulate(half + "2}}");
  ASSERT_EQ(Simulate(half + "1}}", Flag("out", "first.csv")).exit_status, 0);
  const ProgramRun second = Simulate(half + "1}}", Flag("initial", "first.csv"));
  ASSERT_EQ(second.exit_status, 0) << second.error;
  const CsvTable a = Table(whole.out, kTrajectory);
  const CsvTable b = Table(second.out, kTrajectory);
  for (const char* column : {"x", "y", "angle", "vx", "vy", "omega"}) {
    EXPECT_EQ(Cell(a, a.rows.size() - 1, column), Cell(b, b.rows.size() - 1, column)) << column;
  }
}

TEST_F(TangibleSimulateTest, ViewIsOnePageWithItsContacts) {
  const ProgramRun run = Simulate(test_scenes::Mixture(), Flag("view", "v.html"));
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const std::string page = Read(Path("v.html"));
  EXPECT_EQ(page.find("<!DOCTYPE html>"), 0u);
  for (const char* text : {"mixture", "ball", "pin", "sticking"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  EXPECT_EQ(page.find("http://"), std::string::npos);
  EXPECT_EQ(page.find("https://"), std::string::npos);
}

TEST_F(TangibleSimulateTest, ObservesPointsBetweenSteps) {
  const std::string scene = R"({"gravity": [0, 0], "bodies": [{"name": "a", "mass": 1,
      "inertia": 1, "position": [1, 2], "velocity": [3, 0], "angular_velocity": 1}],
    "simulation": {"dt": 0.1, "duration": 1}})";
  Write("p.json", R"({"tip": {"body": "a", "at": [0, -0.5]}})");
  const ProgramRun run =
      Simulate(scene, Flag("observe", "o.csv") + Flag("points", "p.json") + "--rate=16");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const CsvTable table = Table(Read(Path("o.csv")), {"time", "point", "x", "y"});
  ASSERT_EQ(table.rows.size(), 17u);
  for (size_t i = 0; i < table.rows.size(); ++i) {
    const double t = static_cast<double>(i) / 16.0;
    EXPECT_EQ(table.rows[i][1], "tip");
    EXPECT_NEAR(Cell(table, i, "time"), t, 1e-15);
    EXPECT_NEAR(Cell(table, i, "x"), 1.0 + 3.0 * t + 0.5 * std::sin(t), 1e-13);
    EXPECT_NEAR(Cell(table, i, "y"), 2.0 - 0.5 * std::cos(t), 1e-13);
  }
}

TEST_F(TangibleSimulateTest, NoiseHasItsDeviationAndItsSeed) {
  const std::string scene = R"({"gravity": [0, 0], "bodies": [{"name": "a", "mass": 1,
      "inertia": 1, "position": [1, 2]}], "simulation": {"dt": 0.001, "duration": 5}})";
  const auto observe = [&](const std::string& flags) {
    EXPECT_EQ(Simulate(scene, Flag("observe", "o.csv") + flags).exit_status, 0);
    return Read(Path("o.csv"));
  };
  const std::string first = observe("--noise=0.01 --seed=7");
  EXPECT_EQ(first, observe("--noise=0.01 --seed=7"));
  EXPECT_NE(first, observe("--noise=0.01 --seed=8"));
  const CsvTable table = Table(first, {"time", "body", "x", "y"});
  double mean = 0.0, square = 0.0, cross = 0.0;
  const double n = static_cast<double>(table.rows.size());
  ASSERT_EQ(table.rows.size(), 5001u);
  for (size_t i = 0; i < table.rows.size(); ++i) {
    const double x = (Cell(table, i, "x") - 1.0) / 0.01;
    const double y = (Cell(table, i, "y") - 2.0) / 0.01;
    mean += (x + y) / (2.0 * n);
    square += (x * x + y * y) / (2.0 * n);
    cross += x * y / n;
  }
  // Four standard deviations of each estimate.
  EXPECT_LT(std::abs(mean), 4.0 / std::sqrt(2.0 * n));
  EXPECT_LT(std::abs(square - 1.0), 4.0 * std::sqrt(2.0 / (2.0 * n)));
  EXPECT_LT(std::abs(cross), 4.0 / std::sqrt(n));
}

TEST_F(TangibleSimulateTest, ADivergingRunKeepsWhatItHas) {
  // 1e308 m/s for two seconds is more than a double holds.
  const ProgramRun run = Simulate(R"({"gravity": [0, 0], "bodies": [{"name": "a", "mass": 1,
      "inertia": 1, "position": [0, 0], "velocity": [1e308, 0]}],
    "simulation": {"dt": 1, "duration": 1000}})",
                                  Flag("out", "t.csv") + "--every=7 " + Flag("summary", "s.json"));
  ExpectOneLine(run, 1, "scene.json: step ");
  EXPECT_NE(run.error.find("diverged"), std::string::npos) << run.error;
  const json s = json::parse(Read(Path("s.json")));
  EXPECT_EQ(s["status"], "diverged");
  const CsvTable table = Table(Read(Path("t.csv")), kTrajectory);
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(Cell(table, 1, "time"), 1.0);
  EXPECT_EQ(Cell(table, 1, "x"), 1e308);
}

TEST_F(TangibleSimulateTest, AFirstStateThatIsNotFiniteIsRefused) {
  // A rate of 10 / s on an arm of 1e308 m.
  const ProgramRun run = Simulate(R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1,
      "position": [0, 0]}], "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"],
      "anchor": [1e308, 0], "angle": 1, "rate": 10}]})",
                                  Flag("out", "far.csv"));
  ExpectOneLine(run, 1, "scene.json: body a: expected a finite pose and twist at time 0");
  EXPECT_FALSE(std::filesystem::exists(Path("far.csv")));
}

TEST_F(TangibleSimulateTest, BadInputIsOneLine) {
  ExpectOneLine(Run("tangible-simulate", "/nonexistent.json"), 1, "/nonexistent.json");
  ExpectOneLine(Simulate(R"({"bodies": [)"), 1, "scene.json: ");
  ExpectOneLine(Simulate(R"({"bodies": [], "colour": 1})"), 1, "/colour");
  ExpectOneLine(Simulate(R"({"bodies": [{"name": "a", "mass": -1, "position": [0, 0]}]})"), 1,
                "/bodies/0/mass");
  ExpectOneLine(Simulate(R"({"bodies": [], "simulation": {"integrator": "runge_kutta_4"}})"), 1,
                "scene.json: /simulation/integrator: ");
  ExpectOneLine(Simulate(R"({"bodies": [], "simulation": {"impact_law": "poisson"}})"), 1,
                "scene.json: /simulation/impact_law: expected \"newton\" with fixed stepping");
  EXPECT_EQ(Simulate(R"({"bodies": [], "simulation": {"impact_law": "poisson",
                         "stepping": "event", "duration": 0.02}})")
                .exit_status,
            0);
  ExpectOneLine(Simulate(kFall, "--out=/nonexistent/t.csv"), 1, "/nonexistent/t.csv");
  ExpectOneLine(Simulate(kFall, "--view=/nonexistent/v.html"), 1, "/nonexistent/v.html");
  Write("i.csv", "time,body,x,y,angle,vx,vy,omega\n0,wall,0,0,0,0,0,0\n");
  ExpectOneLine(Simulate(kFall, Flag("initial", "i.csv")), 1, "i.csv: line 2: body");
  Write("i.csv", "time,body,x,y,angle,vx,vy,omega\n0,a,0,nan,0,0,0,0\n");
  ExpectOneLine(Simulate(kFall, Flag("initial", "i.csv")), 1, "i.csv: line 2: y");
  for (const auto& [points, what] : std::map<std::string, std::string>{
           {R"({"tip": {"body": "b"}})", "p.json: /tip/body"},
           {R"({"tip": {"body": "a", "at": [1]}})", "p.json: /tip/at"},
           {R"({"tip": {"body": "a", "on": 1}})", "p.json: /tip/on"},
           {R"({"tip": 3})", "p.json: /tip"},
           {"[]", "p.json: expected an object of points"},
           {"{}", "p.json: expected at least one point"},
           {R"({"tip": )", "p.json: "}}) {
    Write("p.json", points);
    ExpectOneLine(Simulate(kFall, Flag("observe", "o.csv") + Flag("points", "p.json")), 1, what);
  }
}

TEST_F(TangibleSimulateTest, NoFileIsWrittenTwice) {
  const std::string own = "expected a file of its own, got that of ";
  ExpectOneLine(Simulate(kFall, Flag("out", "x") + Flag("summary", "x")), 2,
                "--summary: " + own + "--out");
  ExpectOneLine(Simulate(kFall, Flag("view", "./x") + Flag("contacts", "x")), 2,
                "--view: " + own + "--contacts");
  EXPECT_FALSE(std::filesystem::exists(Path("x")));
  ExpectOneLine(Simulate(kFall, Flag("observe", "scene.json")), 2,
                "--observe: " + own + "the input");
  Write("i.csv", "time,body,x,y,angle,vx,vy,omega\n0,a,0,1,0,0,0,0\n");
  std::filesystem::create_symlink("i.csv", Path("link.csv"));
  ExpectOneLine(Simulate(kFall, Flag("initial", "i.csv") + Flag("out", "link.csv")), 2,
                "--out: " + own + "--initial");
  EXPECT_EQ(Simulate(kFall, "--out=/dev/null --summary=/dev/null").exit_status, 0);
  ExpectOneLine(Simulate(kFall, "--flagfile=x"), 2, "unknown flag --flagfile");
}

TEST_F(TangibleSimulateTest, WrongFlagsAreUsage) {
  ExpectOneLine(Simulate(kFall, "--every=0"), 2, "--every");
  ExpectOneLine(Simulate(kFall, "--noise=1"), 2, "--observe");
  ExpectOneLine(Simulate(kFall, "--observe=o.csv --noise=-1"), 2, "--noise");
  ExpectOneLine(Simulate(kFall, "--observe=o.csv --noise=nan"), 2, "--noise");
  ExpectOneLine(Simulate(kFall, "--observe=o.csv --noise=1e308"), 2, "--noise: expected a number");
  ExpectOneLine(Simulate(kFall, "--observe=o.csv --rate=-1"), 2, "--rate");
  ExpectOneLine(Simulate(kFall, "--observe=o.csv --rate=1e9"), 1, "--rate: expected at most");
  ExpectOneLine(Simulate(kFall, "--speed=3"), 2, "speed");
  ExpectOneLine(Run("tangible-simulate", ""), 2, "tangible-simulate");
  EXPECT_EQ(Run("tangible-simulate", "--help").exit_status, 0);
  EXPECT_EQ(Run("tangible-simulate", "--version").exit_status, 0);
}

}  // namespace
}  // namespace tangible
