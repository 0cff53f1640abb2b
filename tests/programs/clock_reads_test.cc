// SPDX-License-Identifier: Apache-2.0
//
// How often tangible-simulate reads a clock: a step of a small scene takes a few microseconds, and
// two readings of the process's CPU time take another two or more.
#include <string>

#include "run_program.h"

namespace tangible {
namespace {

constexpr int kSteps = 1000;

class ClockReadsTest : public ProgramTest {
 protected:
  /// Readings of all clocks in a run of kSteps steps.
  long Reads(const std::string& flags) const {
    const std::string scene = Write("scene.json", R"({"bodies": [
        {"name": "a", "mass": 1, "inertia": 1, "position": [0, 1], "velocity": [1, 0]}],
      "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 2]}],
      "simulation": {"dt": 0.001, "duration": 1}})");
    const std::string count = Path("count.txt");
    std::filesystem::remove(count);
    // A sanitizer's library is to be the first one unless it hears otherwise.
    const std::string command = "ASAN_OPTIONS=verify_asan_link_order=0 TANGIBLE_CLOCK_READS='" +
                                count + "' LD_PRELOAD='" + std::string(TANGIBLE_COUNT_CLOCK_READS) +
                                "' '" + std::string(TANGIBLE_PROGRAM_DIR) +
                                "/tangible-simulate' '" + scene + "' --out=/dev/null " + flags;
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    const std::string text = Read(count);
    return text.empty() ? -1 : std::stol(text);
  }
};

// The start and the end of the run on two clocks, and the start of what shows progress.
constexpr long kOfTheRun = 8;

TEST_F(ClockReadsTest, NoStepReadsAClockWithoutASummary) {
  for (const char* every : {"--every=1", "--every=1000000"}) {
    const long reads = Reads(every);
    EXPECT_GT(reads, 0) << every;  // the count counts
    EXPECT_LE(reads, kOfTheRun) << every;
  }
  EXPECT_LE(Reads("--contacts=/dev/null --observe=/dev/null --view=/dev/null"), kOfTheRun);
}

TEST_F(ClockReadsTest, ASummaryReadsItAroundRowsAndNowAndThen) {
  const long alone = Reads("--every=1000000 --summary=/dev/null");
  EXPECT_LE(alone, kOfTheRun + kSteps / 50);
  EXPECT_LE(Reads("--every=10 --summary=/dev/null"), alone + 2 * kSteps / 10);
  EXPECT_LE(Reads("--every=1000000 --observe=/dev/null --rate=20 --summary=/dev/null"),
            alone + 2 * 21);
  // Rows in every step, which take longer than the clock.
  const long all = Reads("--summary=/dev/null");
  EXPECT_GE(all, 2 * kSteps);
  EXPECT_LE(all, kOfTheRun + 2 * (kSteps + 1));
}

}  // namespace
}  // namespace tangible
