// SPDX-License-Identifier: Apache-2.0
//
// Programs with threads under limits of memory that are reached in any of them: a result, or one
// line and status 1, and never an abort.
#include <nlohmann/json.hpp>
#include <string>

#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

constexpr long kStep = 4096;  // KiB, half of a thread's stack

class MemoryTest : public ProgramTest {
 protected:
  /// Runs a program with `limit` KiB of addresses.
  ProgramRun RunWithin(long limit, const std::string& program, const std::string& arguments) const {
    const std::string command = "ulimit -v " + std::to_string(limit) + "; exec '" +
                                std::string(TANGIBLE_PROGRAM_DIR) + "/" + program + "' " +
                                arguments + " > '" + Path("o.txt") + "' 2> '" + Path("e.txt") + "'";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, Read(Path("o.txt")), Read(Path("e.txt"))};
  }

  /// From the second limit with which the program starts at all, to one with which it ends well.
  void ExpectResultOrOneLine(const std::string& program, const std::string& arguments) const {
    long limit = kStep;
    while (RunWithin(limit, program, "--version").exit_status != 0) limit += kStep;
    limit += kStep;  // with less the libraries that it links may end it while they start
    int failed = 0, done = 0;
    for (; done < 3; limit += kStep) {
      SCOPED_TRACE(program + " within " + std::to_string(limit) + " KiB");
      const ProgramRun run = RunWithin(limit, program, arguments);
      if (run.exit_status == 0) {
        ++done;
        continue;
      }
      ++failed;
      ExpectOneLine(run, 1, "");
      ASSERT_TRUE(run.error.find("not enough memory") != std::string::npos ||
                  run.error.find("cannot be started") != std::string::npos)
          << run.error;
    }
    EXPECT_GT(failed, 0);
  }
};

TEST_F(MemoryTest, AFitOfManyRecordings) {
  Write("ball.json", R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1],
       "velocity": [2, 3]}], "simulation": {"dt": 0.01, "duration": 0.5}})");
  std::string text = "time,body,x,y\n";
  for (int k = 0; k <= 50; k += 10) {
    text += json(0.01 * k).dump() + ",ball," + json(0.02 * k).dump() + "," +
            json(1.0 + 0.03 * k - 9.5e-4 * 0.5 * k * (k + 1)).dump() + "\n";
  }
  Write("o.csv", text);
  json fit = json::parse(R"({"scene": "ball.json", "recordings": [],
      "parameters": [{"name": "g", "initial": 8, "lower": 1, "upper": 20,
                      "sets": [{"path": "gravity/y", "scale": -1}]}]})");
  for (int i = 0; i < 8; ++i) {
    fit["recordings"].push_back({{"name", "r" + std::to_string(i)},
                                 {"observations", {{{"file", "o.csv"}, {"sigma", 0.01}}}}});
  }
  Write("fit.json", fit.dump());
  ExpectResultOrOneLine("tangible-fit", "'" + Path("fit.json") + "'");
}

TEST_F(MemoryTest, ABatch) {
  Write("ball.json", R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1]}],
      "simulation": {"dt": 0.01, "duration": 0.5}})");
  std::string rows = "bodies/ball/mass\n";
  for (int i = 1; i <= 16; ++i) rows += std::to_string(i) + "\n";
  Write("rows.csv", rows);
  ExpectResultOrOneLine("tangible-simulate", "'" + Path("ball.json") + "' --threads=8 --batch='" +
                                                 Path("rows.csv") + "'");
}

// With more memory than these limits a thread whose heap cannot grow asks the system for each
// allocation, which takes minutes and is no failure.
TEST_F(MemoryTest, AStudyOfPlans) {
  long limit = kStep;
  while (RunWithin(limit, "tangible-bounce", "--version").exit_status != 0) limit += kStep;
  for (int k = 0; k < 4; ++k, limit += kStep) {
    SCOPED_TRACE(std::to_string(limit) + " KiB");
    const ProgramRun run =
        RunWithin(limit, "tangible-bounce",
                  "'" TANGIBLE_SOURCE_DIR
                  "/data/control/struck_ball.json' --problems=4 --iterations=1 --threads=4");
    ExpectOneLine(run, 1, "");
    EXPECT_TRUE(run.error.find("not enough memory") != std::string::npos ||
                run.error.find("cannot be started") != std::string::npos)
        << run.error;
  }
}

}  // namespace
}  // namespace tangible
