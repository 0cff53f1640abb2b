// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <vector>

#include "run_program.h"
#include "tangible/scene/csv.h"

namespace tangible {
namespace {

// A ball thrown along the floor, and a belt that moves beside it.
constexpr char kThrow[] = R"({"bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.5],
     "velocity": [1, 0], "friction": 0.3, "restitution": 0.6},
    {"name": "belt", "kinematic": true, "position": [0, 0], "velocity": [2, 0]},
    {"name": "floor", "static": true, "friction": 0.3, "restitution": 0.6,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "simulation": {"dt": 0.005, "duration": 0.5}})";

class TangibleSimulateBatchTest : public ProgramTest {
 protected:
  ProgramRun Batch(const std::string& table, const std::string& flags = "",
                   const std::string& scene = kThrow) const {
    return Run("tangible-simulate", "'" + Write("scene.json", scene) + "' --batch='" +
                                        Write("p.csv", table) + "' " + flags);
  }
  static CsvTable Table(const std::string& text) {
    CsvTable table;
    std::string error;
    EXPECT_TRUE(ParseCsv(text, "table", {}, {}, &table, &error)) << error;
    return table;
  }
};

TEST_F(TangibleSimulateBatchTest, RowsAreThoseOfSingleRuns) {
  const ProgramRun run = Batch("bodies/ball/velocity/x, bodies/*/friction\n1,0.3\n\n2.5,+0.1\n");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.error, "");
  const CsvTable table = Table(run.out);
  EXPECT_EQ(table.columns,
            (std::vector<std::string>{"row", "status", "ball/x", "ball/y", "ball/angle", "ball/vx",
                                      "ball/vy", "ball/omega", "belt/x", "belt/y", "belt/angle",
                                      "belt/vx", "belt/vy", "belt/omega"}));
  ASSERT_EQ(table.rows.size(), 2u);
  const std::pair<std::string, std::string> values[] = {{"1", "0.3"}, {"2.5", "0.1"}};
  for (size_t r = 0; r < 2; ++r) {
    std::string scene = kThrow;
    scene.replace(scene.find("[1, 0]"), 2, "[" + values[r].first);
    for (size_t at = 0; (at = scene.find("\"friction\": 0.3", at)) != std::string::npos; ++at) {
      scene.replace(at + 12, 3, values[r].second);
    }
    const ProgramRun single =
        Run("tangible-simulate", "'" + Write("one.json", scene) + "' --every=1000");
    const CsvTable trajectory = Table(single.out);
    ASSERT_EQ(trajectory.rows.size(), 4u) << single.error;
    EXPECT_EQ(table.rows[r][0], std::to_string(r + 1));
    EXPECT_EQ(table.rows[r][1], "done");
    for (size_t body = 0; body < 2; ++body) {
      for (size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(table.rows[r][2 + 6 * body + i], trajectory.rows[2 + body][2 + i]);
      }
    }
  }
}

TEST_F(TangibleSimulateBatchTest, ThreadsDoNotChangeABit) {
  std::string table = "bodies/ball/velocity/x,bodies/ball/shape/radius\n";
  for (int i = 0; i < 50; ++i) {
    table += std::to_string(0.1 * i) + "," + std::to_string(0.1 + 0.002 * i) + "\n";
  }
  const std::string one = Batch(table, "--threads=1").out;
  EXPECT_EQ(Table(one).rows.size(), 50u);
  for (const char* threads : {"0", "2", "3", "256"}) {
    EXPECT_EQ(Batch(table, std::string("--threads=") + threads).out, one) << threads;
  }
  const ProgramRun to_file = Batch(table, "--out='" + Path("f.csv") + "'");
  EXPECT_EQ(to_file.out, "");
  EXPECT_EQ(Read(Path("f.csv")), one);
}

// A plate pressed onto a ball on the floor has no solution.
// Piles that stand apart are islands, solved by as many threads as there are.
TEST_F(TangibleSimulateBatchTest, ThreadsOfIslandsDoNotChangeABit) {
  std::string bodies;
  for (int pile = 0; pile < 24; ++pile) {
    for (int level = 0; level < 4; ++level) {
      bodies += R"({"name": "d)" + std::to_string(pile) + "_" + std::to_string(level) +
                R"(", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "friction": 0.4,
                "position": [)" +
                std::to_string(0.5 * pile + 0.01 * level) + ", " +
                std::to_string(0.06 + 0.11 * level) + "]},";
    }
  }
  const std::string scene = Write("piles.json", R"({"bodies": [)" + bodies +
                                                    R"({"name": "floor", "static": true,
      "friction": 0.4, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.005, "duration": 0.2}})");
  const std::string one = Run("tangible-simulate", "'" + scene + "' --threads=1").out;
  EXPECT_GT(one.size(), 10000u);
  for (const char* threads : {"2", "5", "0"}) {
    EXPECT_EQ(one, Run("tangible-simulate", "'" + scene + "' --threads=" + threads).out);
  }
}

TEST_F(TangibleSimulateBatchTest, RowsThatFailAreReportedAndTheOthersWritten) {
  const std::string press = R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5]},
      {"name": "plate", "kinematic": true, "shape": {"box": {"size": [1, 0.2]}},
       "position": [0, 1.2]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 0.5}})";
  const ProgramRun run =
      Batch("bodies/plate/velocity/y\n1\n-1\n0\n-2\n", "--out='" + Path("f.csv") + "'", press);
  EXPECT_EQ(run.exit_status, 1);
  EXPECT_EQ(std::count(run.error.begin(), run.error.end(), '\n'), 2) << run.error;
  EXPECT_NE(run.error.find("p.csv: line 3: step "), std::string::npos) << run.error;
  EXPECT_NE(run.error.find("p.csv: line 5: step "), std::string::npos) << run.error;
  const CsvTable table = Table(Read(Path("f.csv")));
  ASSERT_EQ(table.rows.size(), 4u);
  const char* const status[] = {"done", "unsolved", "done", "unsolved"};
  for (size_t r = 0; r < 4; ++r) EXPECT_EQ(table.rows[r][1], status[r]);
}

TEST_F(TangibleSimulateBatchTest, MistakesInTheTableAreOneLine) {
  const std::string mass = "bodies/ball/mass\n";
  for (const auto& [table, what] : std::vector<std::pair<std::string, std::string>>{
           {"", "p.csv: line 1: missing header"},
           {mass, "p.csv: expected at least one row, got none"},
           {"\nbodies/bal/mass\n1\n",
            "p.csv: line 2: parameter bodies/bal/mass: matches no number of the scene; bodies are"},
           {"bodies/ball/mass,\n1,2\n", "p.csv: line 1: parameter : "},
           {"bodies/ball/mass,bodies/ball/mass\n1,2\n", "column bodies/ball/mass given twice"},
           {"bodies/*/friction,bodies/ball/friction\n1,2\n",
            "p.csv: line 1: bodies/ball/friction: expected numbers that no other parameter sets"},
           {mass + "1\n\n2,3\n", "p.csv: line 4: expected 1 cells, got 2"},
           {mass + "1\nheavy\n",
            "p.csv: line 3: bodies/ball/mass: expected a number, got \"heavy\""},
           {mass + "nan\n", "p.csv: line 2: bodies/ball/mass: expected a number, got \"nan\""},
           {mass + "1e999\n", "p.csv: line 2: bodies/ball/mass: expected a number, got"},
           {mass + "1\n-1\n", "p.csv: line 3: bodies/ball/mass: expected a number > 0, got -1"},
           {"bodies/ball/restitution\n1.1\n", "expected a number in [0, 1], got 1.1"},
           {"bodies/floor/shape/normal/x,bodies/floor/shape/normal/y\n0,0\n",
            "p.csv: line 2: the scene with these values: /bodies/2/shape"}}) {
    const ProgramRun run = Batch(table, "--out='" + Path("f.csv") + "'");
    ExpectOneLine(run, 1, what);
    EXPECT_FALSE(std::filesystem::exists(Path("f.csv")));
  }
  ExpectOneLine(Run("tangible-simulate",
                    "'" + Write("scene.json", kThrow) + "' --batch='" + Path("no.csv") + "'"),
                1, "no.csv: cannot be read");
}

TEST_F(TangibleSimulateBatchTest, WrongFlagsAreUsage) {
  const std::string table = "bodies/ball/mass\n1\n";
  ExpectOneLine(Batch(table, "--threads=-1"), 2, "--threads: expected a number from 0 to 256");
  ExpectOneLine(Batch(table, "--threads=257"), 2, "--threads");
  for (const char* flag :
       {"--every=2", "--contacts=x", "--initial=x", "--view=x", "--summary=x", "--observe=x"}) {
    ExpectOneLine(Batch(table, flag), 2, ": not with --batch");
  }
  ExpectOneLine(Batch(table, "--out='" + Path("p.csv") + "'"), 2, "--out: expected a file of its");
}

}  // namespace
}  // namespace tangible
