// SPDX-License-Identifier: Apache-2.0
//
// Programs that mpirun starts on several ranks: what one process writes, to the bit.
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "run_program.h"

namespace tangible {
namespace {

class RanksTest : public ProgramTest {
 protected:
  /// Runs a program on ranks of this machine.
  ProgramRun RunOn(int ranks, const std::string& program, const std::string& arguments) const {
    return RunBy(Mpirun(ranks), program, arguments);
  }

  /// The same with one rank on each of two nodes, which are this machine: what would be told to
  /// another machine through ssh is run here.
  ProgramRun RunOnTwoNodes(const std::string& program, const std::string& arguments) const {
    Write("hosts", "node-a slots=1\nnode-b slots=1\n");
    Write("agent",
          "#!/bin/sh\n"
          "while [ \"${1#-}\" != \"$1\" ]; do shift; done\n"
          "shift\n"
          "exec sh -c \"$*\"\n");
    return RunBy("chmod +x '" + Path("agent") + "'; " + Mpirun(2) + " --hostfile '" +
                     Path("hosts") + "' --mca plm_rsh_agent '" + Path("agent") + "'",
                 program, arguments);
  }

  ProgramRun RunBy(const std::string& mpirun, const std::string& program,
                   const std::string& arguments) const {
    const std::string command = mpirun + " '" + std::string(TANGIBLE_PROGRAM_DIR) + "/" + program +
                                "' " + arguments + " > '" + Path("o.txt") + "' 2> '" +
                                Path("e.txt") + "'";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, Read(Path("o.txt")), Read(Path("e.txt"))};
  }

  /// As root, and with more ranks than cores, Open MPI runs only where it is told to.
  static std::string Mpirun(int ranks) {
    return "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
           "OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_btl_vader_single_copy_mechanism=none '" +
           std::string(TANGIBLE_MPIRUN) + "' -n " + std::to_string(ranks);
  }

  /// A result without what is measured anew in each run.
  nlohmann::json WithoutTimes(const std::string& file) const {
    return nlohmann::json::parse(
        Read(Path(file)), [](int, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
          return event != nlohmann::json::parse_event_t::key ||
                 (parsed != "seconds" && parsed != "rollout_seconds" && parsed != "provenance");
        });
  }

  void WriteBall() const {
    Write("ball.json", R"({"bodies": [
        {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1],
         "restitution": 0.5, "velocity": [1, 0]},
        {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "simulation": {"dt": 0.01, "duration": 0.8}})");
  }
};

TEST_F(RanksTest, RowsOfABatch) {
  WriteBall();
  std::string rows = "bodies/ball/mass,bodies/ball/restitution\n";
  for (int i = 1; i <= 37; ++i) rows += std::to_string(i) + "," + std::to_string(0.02 * i) + "\n";
  Write("rows.csv", rows);
  const std::string batch = "'" + Path("ball.json") + "' --batch='" + Path("rows.csv") + "'";
  const ProgramRun alone = Run("tangible-simulate", batch);
  ASSERT_EQ(alone.exit_status, 0) << alone.error;
  for (const int ranks : {2, 3}) {
    const ProgramRun run = RunOn(ranks, "tangible-simulate", batch);
    EXPECT_EQ(run.exit_status, 0) << run.error;
    EXPECT_EQ(run.out, alone.out);
    EXPECT_EQ(run.error, alone.error);
    const ProgramRun to_file =
        RunOn(ranks, "tangible-simulate", batch + " --out='" + Path("r.csv") + "'");
    EXPECT_EQ(to_file.exit_status, 0) << to_file.error;
    EXPECT_EQ(Read(Path("r.csv")), alone.out);
  }
}

TEST_F(RanksTest, ARowThatFailsIsSaidOnce) {
  WriteBall();
  Write("rows.csv", "bodies/ball/mass\n1\n-1\n2\n");
  const std::string batch = "'" + Path("ball.json") + "' --batch='" + Path("rows.csv") + "'";
  const ProgramRun alone = Run("tangible-simulate", batch);
  const ProgramRun run = RunOn(2, "tangible-simulate", batch);
  EXPECT_EQ(run.exit_status, alone.exit_status);
  EXPECT_EQ(run.out, alone.out);
  EXPECT_EQ(run.error.substr(0, alone.error.size()), alone.error);
}

// Of a run that nothing divides rank 0 alone makes the files.
TEST_F(RanksTest, WhatCannotBeDividedIsMadeOnce) {
  WriteBall();
  const std::string scene = "'" + Path("ball.json") + "'";
  const ProgramRun alone = Run("tangible-simulate", scene);
  const ProgramRun run = RunOn(2, "tangible-simulate", scene);
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.out, alone.out);
  const std::string gradient = scene + " --parameters=bodies/ball/mass --out='";
  ASSERT_EQ(Run("tangible-gradient", gradient + Path("alone.json") + "'").exit_status, 0);
  EXPECT_EQ(RunOn(2, "tangible-gradient", gradient + Path("ranks.json") + "'").exit_status, 0);
  EXPECT_EQ(WithoutTimes("ranks.json"), WithoutTimes("alone.json"));
  const ProgramRun help = RunOn(2, "tangible-fit", "--version");
  EXPECT_EQ(help.out, Run("tangible-fit", "--version").out);
}

TEST_F(RanksTest, BadInputGivesOneLine) {
  WriteBall();
  const ProgramRun run = RunOn(2, "tangible-simulate",
                               "'" + Path("ball.json") + "' --batch='" + Path("none.csv") + "'");
  EXPECT_EQ(run.exit_status, 1);
  const std::string alone =
      Run("tangible-simulate", "'" + Path("ball.json") + "' --batch='" + Path("none.csv") + "'")
          .error;
  EXPECT_EQ(run.error.substr(0, alone.size()), alone);
}

TEST_F(RanksTest, StartsOfAFit) {
  WriteBall();
  const ProgramRun truth =
      Run("tangible-simulate", "'" + Path("ball.json") + "' --observe='" + Path("o.csv") + "'");
  ASSERT_EQ(truth.exit_status, 0) << truth.error;
  Write("fit.json", nlohmann::json::parse(R"({"scene": "ball.json", "starts": 5,
      "observations": [{"file": "o.csv", "sigma": 0.01}],
      "parameters": [{"name": "e", "path": "bodies/ball/restitution", "initial": 0.3, "lower": 0.1,
                      "upper": 0.9}]})")
                        .dump());
  const std::string fit = "'" + Path("fit.json") + "' --out='";
  ASSERT_EQ(Run("tangible-fit", fit + Path("alone.json") + "'").exit_status, 0);
  const ProgramRun run = RunOn(2, "tangible-fit", fit + Path("ranks.json") + "'");
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(WithoutTimes("ranks.json"), WithoutTimes("alone.json"));
}

TEST_F(RanksTest, ChainsOfAPosterior) {
  WriteBall();
  ASSERT_EQ(Run("tangible-simulate",
                "'" + Path("ball.json") + "' --noise=0.01 --observe='" + Path("o.csv") + "'")
                .exit_status,
            0);
  Write("fit.json", R"({"scene": "ball.json", "observations": [{"file": "o.csv", "sigma": 0.01}],
      "parameters": [{"name": "v", "path": "bodies/ball/velocity/x", "initial": 0.7, "lower": 0.1,
                      "upper": 3}]})");
  const std::string fit = "'" + Path("fit.json") +
                          "' --posterior=40 --posterior_warm_up=20 --posterior_samples='" +
                          Path("draws.csv") + "' --out='";
  const ProgramRun alone = Run("tangible-fit", fit + Path("alone.json") + "'");
  ASSERT_EQ(alone.exit_status, 0) << alone.error;
  const std::string draws = Read(Path("draws.csv"));
  const ProgramRun run = RunOn(2, "tangible-fit", fit + Path("ranks.json") + "'");
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(WithoutTimes("ranks.json"), WithoutTimes("alone.json"));
  EXPECT_EQ(Read(Path("draws.csv")), draws);
}

/// A ball that is thrown several times, each with a speed of its own: gravity is that of all.
class RanksOfRecordingsTest : public RanksTest {
 protected:
  std::string WriteThrows(int count, double duration) const {
    const auto ball = [&](double speed) {
      nlohmann::json scene = nlohmann::json::parse(R"({"bodies": [
          {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1],
           "velocity": [1, 3], "restitution": 0.6},
          {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}}],
          "simulation": {"dt": 0.01, "stepping": "event"}})");
      scene["bodies"][0]["velocity"][0] = speed;
      scene["simulation"]["duration"] = duration;
      return scene.dump();
    };
    nlohmann::json recordings = nlohmann::json::array();
    for (int i = 0; i < count; ++i) {
      const std::string name = std::to_string(i);
      Write("s" + name + ".json", ball(0.5 + 0.25 * i));
      EXPECT_EQ(Run("tangible-simulate", "'" + Path("s" + name + ".json") + "' --observe='" +
                                             Path("o" + name + ".csv") +
                                             "' --noise=0.01 --seed=" + name + " --rate=50")
                    .exit_status,
                0);
      recordings.push_back({{"name", "throw " + name},
                            {"observations", {{{"file", "o" + name + ".csv"}, {"sigma", 0.01}}}}});
    }
    Write("scene.json", ball(1.0));
    const nlohmann::json fit = {
        {"scene", "scene.json"},
        {"starts", 1},
        {"recordings", recordings},
        {"parameters",
         {{{"name", "g"}, {"path", "gravity/y"}, {"initial", -9}},
          {{"name", "v"}, {"path", "bodies/ball/velocity/x"}, {"per", "recording"}}}}};
    return "'" + Write("fit.json", fit.dump()) + "'";
  }
};

TEST_F(RanksOfRecordingsTest, AreTheFitOfOneProcess) {
  const std::string fit = WriteThrows(5, 1.0);
  const auto flags = [&](const std::string& name) {
    return fit + " --out='" + Path(name + ".json") + "' --predictions='" + Path(name + ".csv") +
           "' --report='" + Path(name + ".html") + "'";
  };
  ASSERT_EQ(Run("tangible-fit", flags("alone")).exit_status, 0);
  for (const int ranks : {2, 3}) {
    const ProgramRun run = RunOn(ranks, "tangible-fit", flags("ranks"));
    EXPECT_EQ(run.exit_status, 0) << run.error;
    EXPECT_NE(run.out.find("g = -9.8"), std::string::npos) << run.out;
    EXPECT_EQ(run.out.find("g = ", run.out.find("g = ") + 1), std::string::npos) << "said once";
    EXPECT_EQ(WithoutTimes("ranks.json"), WithoutTimes("alone.json"));
    EXPECT_EQ(Read(Path("ranks.csv")), Read(Path("alone.csv")));
  }
  const ProgramRun nodes = RunOnTwoNodes("tangible-fit", flags("nodes"));
  EXPECT_EQ(nodes.exit_status, 0) << nodes.error;
  EXPECT_EQ(WithoutTimes("nodes.json"), WithoutTimes("alone.json"));
}

// A recording that cannot be fitted is one line, of rank 0, whichever rank has met it.
TEST_F(RanksOfRecordingsTest, WhatFailsIsSaidOnce) {
  const std::string fit = WriteThrows(4, 0.3);
  Write("o2.csv", "time,body,x\n0.1,ball,1\n9,ball,2\n");
  const ProgramRun alone = Run("tangible-fit", fit);
  EXPECT_EQ(alone.exit_status, 1);
  const ProgramRun run = RunOn(2, "tangible-fit", fit);
  EXPECT_EQ(run.exit_status, 1);
  EXPECT_EQ(run.error.substr(0, alone.error.size()), alone.error);
}

// A fit that has lost a rank goes on from its checkpoint, on ranks or alone, to the same bits.
TEST_F(RanksOfRecordingsTest, ALostRankAndTheCheckpoint) {
  const std::string fit = WriteThrows(6, 1.5);
  ASSERT_EQ(Run("tangible-fit", fit + " --out='" + Path("alone.json") + "'").exit_status, 0);
  const std::string kept = fit + " --checkpoint='" + Path("c.json") + "' --out='";
  // The second rank ends as it begins the fit; the line says so, and there is no result.
  const std::string dies =
      Mpirun(2) +
      " sh -c 'if [ \"$OMPI_COMM_WORLD_RANK\" = 1 ]; then (sleep 0.5; kill -9 $$) "
      "& fi; exec \"$0\" \"$@\"'";
  static_cast<void>(RunBy(dies, "tangible-fit", kept + Path("lost.json") + "'"));
  for (const int ranks : {2, 3}) {
    const std::string name = "ranks" + std::to_string(ranks) + ".json";
    const ProgramRun run = RunOn(ranks, "tangible-fit", kept + Path(name) + "'");
    EXPECT_EQ(run.exit_status, 0) << run.error;
    EXPECT_EQ(WithoutTimes(name), WithoutTimes("alone.json"));
  }
  ASSERT_EQ(Run("tangible-fit", kept + Path("after.json") + "'").exit_status, 0);
  EXPECT_EQ(WithoutTimes("after.json"), WithoutTimes("alone.json"));
}

TEST_F(RanksTest, TwoNodesOfAHostfile) {
  WriteBall();
  std::string rows = "bodies/ball/mass\n";
  for (int i = 1; i <= 20; ++i) rows += std::to_string(i) + "\n";
  Write("rows.csv", rows);
  const std::string batch = "'" + Path("ball.json") + "' --batch='" + Path("rows.csv") + "'";
  const ProgramRun run = RunOnTwoNodes("tangible-simulate", batch);
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.out, Run("tangible-simulate", batch).out);
}

TEST_F(RanksTest, RandomScenes) {
  const std::string verify = "--random=6 --starts=0 --coincidences=0 --out='";
  ASSERT_EQ(Run("tangible-verify", verify + Path("alone.json") + "'").exit_status, 0);
  EXPECT_EQ(RunOn(2, "tangible-verify", verify + Path("ranks.json") + "'").exit_status, 0);
  EXPECT_EQ(WithoutTimes("ranks.json"), WithoutTimes("alone.json"));
}

// The others do not wait for a rank that is gone.
TEST_F(RanksTest, ARankThatDiesEndsTheRun) {
  WriteBall();
  std::string rows = "bodies/ball/mass\n";
  for (int i = 1; i <= 400000; ++i) rows += std::to_string(i) + "\n";
  Write("rows.csv", rows);
  const std::string command =
      Mpirun(2) +
      " sh -c 'if [ \"$OMPI_COMM_WORLD_RANK\" = 1 ]; then (sleep 1; kill -9 $$) & fi; exec \"" +
      std::string(TANGIBLE_PROGRAM_DIR) + "/tangible-simulate\" \"" + Path("ball.json") +
      "\" --batch=\"" + Path("rows.csv") + "\" --out=\"" + Path("r.csv") + "\"' 2> '" +
      Path("e.txt") + "'";
  const auto start = std::chrono::steady_clock::now();
  const int status = std::system(command.c_str());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  EXPECT_NE(status, 0);
  EXPECT_LT(took.count(), 11.0);
  EXPECT_NE(Read(Path("e.txt")).find("a rank of the run has ended before its work was done"),
            std::string::npos)
      << Read(Path("e.txt"));
  EXPECT_FALSE(std::filesystem::exists(Path("r.csv")));
}

}  // namespace
}  // namespace tangible
