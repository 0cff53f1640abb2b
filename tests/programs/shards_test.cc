// SPDX-License-Identifier: Apache-2.0
//
// Arrays of jobs: the files of all shards, merged, are the output of the run in one.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "run_program.h"

namespace tangible {
namespace {

/// A program whose work is divided.
struct Divided {
  std::string program;
  std::string arguments;  ///< of the run in one, without output
  std::string ending = ".json";
};

class ShardsTest : public ProgramTest {
 protected:
  std::string File(const std::string& name) const { return "'" + Path(name) + "'"; }

  ProgramRun RunTo(const Divided& work, const std::string& more, const std::string& out) const {
    return Run(work.program, work.arguments + " " + more + " --out=" + File(out));
  }

  /// Runs all shards and returns their files for --merge, the last shard first.
  std::string RunShards(const Divided& work, int count) const {
    std::string files;
    for (int i = 0; i < count; ++i) {
      const std::string name = "part" + std::to_string(i) + work.ending;
      const std::string of = std::to_string(i) + "/" + std::to_string(count);
      const ProgramRun run = RunTo(work, "--shard=" + of, name);
      EXPECT_EQ(run.exit_status, 0) << run.error;
      files = Path(name) + (files.empty() ? "" : ",") + files;
    }
    return files;
  }
};

// A ball that is thrown along the floor.
constexpr char kThrownScene[] = R"({"bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.5],
     "velocity": [1, 0], "friction": 0.3, "restitution": 0.6},
    {"name": "floor", "static": true, "friction": 0.3, "restitution": 0.6,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "simulation": {"dt": 0.005, "duration": 0.2}})";

class ShardsOfBatchesTest : public ShardsTest {
 protected:
  void SetUp() override {
    ShardsTest::SetUp();
    std::string table = "bodies/ball/velocity/x,bodies/ball/shape/radius\n";
    for (int i = 0; i < 11; ++i) {
      table += std::to_string(0.1 * i) + "," + std::to_string(0.1 + 0.002 * i) + "\n";
    }
    work_ = Batch(Write("scene.json", kThrownScene), Write("p.csv", table));
  }
  static Divided Batch(const std::string& scene, const std::string& table) {
    return {"tangible-simulate", "'" + scene + "' --batch='" + table + "'", ".csv"};
  }
  Divided work_;
};

TEST_F(ShardsOfBatchesTest, MergedAreTheRunInOneByteForByte) {
  ASSERT_EQ(RunTo(work_, "", "all.csv").exit_status, 0);
  const std::string all = Read(Path("all.csv"));
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 12);
  // More shards than rows too: some have none.
  for (const int count : {1, 2, 3, 13}) {
    const std::string files = RunShards(work_, count);
    const ProgramRun merged = RunTo(work_, "--merge='" + files + "'", "merged.csv");
    ASSERT_EQ(merged.exit_status, 0) << merged.error;
    EXPECT_EQ(merged.error, "");
    EXPECT_EQ(Read(Path("merged.csv")), all) << count;
    // On stdout as well, whatever the number of threads.
    const ProgramRun printed =
        Run(work_.program, work_.arguments + " --threads=1 --merge='" + files + "'");
    EXPECT_EQ(printed.out, all) << count;
  }
}

TEST_F(ShardsOfBatchesTest, AShardIsTheUsualTableOfItsRows) {
  ASSERT_EQ(RunTo(work_, "", "all.csv").exit_status, 0);
  RunShards(work_, 3);
  std::ifstream all(Path("all.csv"));
  std::ifstream part(Path("part1.csv"));
  std::string line;
  std::string got;
  for (int row = 0; std::getline(all, line); ++row) {
    if (row != 0 && (row - 1) % 3 != 1) continue;
    ASSERT_TRUE(std::getline(part, got));
    EXPECT_EQ(got, line);
  }
  ASSERT_TRUE(std::getline(part, got));
  EXPECT_EQ(got.rfind("# shard {\"program\":\"tangible-simulate\"", 0), 0U) << got;
  EXPECT_FALSE(std::getline(part, got));
}

// The numbers as schedulers hand them to the jobs of an array: Slurm counts from 0 on request, Grid
// Engine from 1.
TEST_F(ShardsOfBatchesTest, TakesItsNumbersFromTheEnvironmentOfASchedulersArray) {
  ASSERT_EQ(RunTo(work_, "", "all.csv").exit_status, 0);
  const std::string all = Read(Path("all.csv"));
  const std::string slurm = Write(
      "slurm.sh", "exec \"$1\" " + work_.arguments +
                      " --shard=$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT --out=" + Path("s") +
                      "_$SLURM_ARRAY_TASK_ID.csv\n");
  const std::string grid = Write("grid.sh", "exec \"$1\" " + work_.arguments +
                                                " --shard=$((SGE_TASK_ID - 1))/$SGE_TASK_LAST "
                                                "--out=" +
                                                Path("g") + "_$SGE_TASK_ID.csv\n");
  const std::string program = " '" TANGIBLE_PROGRAM_DIR "/tangible-simulate'";
  for (const char* task : {"0", "1", "2"}) {
    const std::string set = "SLURM_ARRAY_TASK_COUNT=3 SLURM_ARRAY_TASK_ID=";
    ASSERT_EQ(std::system((set + task + " sh '" + slurm + "'" + program).c_str()), 0);
  }
  for (const char* task : {"1", "2"}) {
    const std::string set = "SGE_TASK_LAST=2 SGE_TASK_ID=";
    ASSERT_EQ(std::system((set + task + " sh '" + grid + "'" + program).c_str()), 0);
  }
  for (const char* names : {"s", "g"}) {
    const ProgramRun merged = Run(
        work_.program, work_.arguments + " --merge=$(ls " + Path(names) + "_*.csv | paste -sd,)");
    EXPECT_EQ(merged.out, all) << merged.error;
  }
}

// Rows that fail, and warnings, are told of as in the run in one.
TEST_F(ShardsOfBatchesTest, WhatIsToldOfRowsIsThatOfTheRunInOne) {
  const Divided work = Batch(Path("scene.json"),
                             Write("p.csv", "bodies/ball/velocity/x\n1\n1e300\n\n2\n1e301\n3\n"));
  const ProgramRun one = RunTo(work, "", "all.csv");
  std::string files;
  for (const char* index : {"0", "1", "2"}) {
    const std::string name = std::string("part") + index + ".csv";
    const ProgramRun part = RunTo(work, std::string("--shard=") + index + "/3", name);
    EXPECT_LE(part.exit_status, 1);
    files += (files.empty() ? "" : ",") + Path(name);
  }
  const ProgramRun merged = RunTo(work, "--merge='" + files + "'", "merged.csv");
  EXPECT_NE(one.error, "");
  EXPECT_EQ(merged.error, one.error);
  EXPECT_EQ(merged.exit_status, one.exit_status);
  EXPECT_EQ(Read(Path("merged.csv")), Read(Path("all.csv")));
}

TEST_F(ShardsOfBatchesTest, FlagsThatAreNotAsTheyMustBeAreOneLine) {
  const auto run = [&](const std::string& flags) {
    return Run(work_.program, work_.arguments + " " + flags);
  };
  for (const char* shard : {"2/2", "x", "-1/2", "1", "0/0", "1/x"}) {
    ExpectOneLine(run(std::string("--shard=") + shard), 2,
                  std::string("--shard: expected I/N with I from 0 to N - 1, got '") + shard);
  }
  ExpectOneLine(run("--shard=0/2 --merge=a.csv"), 2, "--shard: not with --merge");
  ExpectOneLine(run("--merge=a.csv,"), 2, "--merge: expected files, separated by commas");
  const std::string scene = File("scene.json");
  ExpectOneLine(Run("tangible-simulate", scene + " --shard=0/2"), 2, "--shard: needs --batch");
  ExpectOneLine(Run("tangible-simulate", scene + " --merge=a.csv"), 2, "--merge: needs --batch");
}

TEST_F(ShardsOfBatchesTest, ShardsThatDoNotBelongTogetherAreNamed) {
  RunShards(work_, 3);
  const auto merge = [&](const std::vector<std::string>& names, const std::string& more = "") {
    std::string files;
    for (const std::string& name : names) files += (files.empty() ? "" : ",") + Path(name);
    return Run(work_.program, work_.arguments + " --merge='" + files + "' " + more);
  };
  const std::vector<std::string> all = {"part0.csv", "part1.csv", "part2.csv"};
  ASSERT_EQ(merge(all).exit_status, 0);
  ExpectOneLine(merge({"part0.csv", "part2.csv"}), 1, "--merge: shard 1 of 3 is missing");
  ExpectOneLine(merge({"part2.csv"}), 1, "--merge: shards 0 and 1 of 3 are missing");
  ExpectOneLine(merge({"part0.csv", "part1.csv", "part1.csv", "part2.csv"}), 1,
                "part1.csv: shard 1 of 3 is given twice, first by ");
  ExpectOneLine(merge({"part0.csv", "none.csv"}), 1, "none.csv: cannot be read");
  ExpectOneLine(merge({"part0.csv", "p.csv"}), 1, "p.csv: expected a file that --shard wrote");
  ExpectOneLine(merge({"part0.csv", "scene.json"}), 1,
                "scene.json: expected a file that --shard wrote");
  ExpectOneLine(merge(all, "--out=" + File("part1.csv")), 1, "it was read as an input");
  EXPECT_EQ(merge(all).exit_status, 0);

  // Of another division.
  RunTo(work_, "--shard=1/2", "other.csv");
  ExpectOneLine(merge({"part0.csv", "other.csv", "part2.csv"}), 1,
                "other.csv: /shard/of: expected 3 as in ");
  // Cut off, and changed.
  const std::string text = Read(Path("part1.csv"));
  Write("cut.csv", text.substr(0, text.size() / 2));
  ExpectOneLine(merge({"part0.csv", "cut.csv", "part2.csv"}), 1,
                "cut.csv: expected a file that --shard wrote");
  std::string changed = text;
  changed.replace(changed.find(",done,"), 8, ",done,9.");
  Write("changed.csv", changed);
  ExpectOneLine(merge({"part0.csv", "changed.csv", "part2.csv"}), 1,
                "changed.csv: /shard: damaged");
  // A header that is no header.
  Write("odd.csv", text.substr(0, text.find("# shard ")) + "# shard {\"program\": 3}\n");
  ExpectOneLine(merge({"part0.csv", "odd.csv", "part2.csv"}), 1, "odd.csv: /shard: damaged");
}

TEST_F(ShardsOfBatchesTest, ShardsOfOtherInputsAreNamed) {
  const std::string files = RunShards(work_, 2);
  // The same content under other names is the same input.
  const Divided moved =
      Batch(Write("moved.json", Read(Path("scene.json"))), Write("moved.csv", Read(Path("p.csv"))));
  EXPECT_EQ(Run(moved.program, moved.arguments + " --merge='" + files + "'").exit_status, 0);
  std::string scene = kThrownScene;
  scene.replace(scene.find("0.005"), 5, "0.004");
  const Divided other = Batch(Write("other.json", scene), Path("p.csv"));
  ExpectOneLine(Run(other.program, other.arguments + " --merge='" + files + "'"), 1,
                "/shard/inputs: expected " + Path("other.json") +
                    " as it is now, got another content: a shard of other inputs");
  RunTo(other, "--shard=0/2", "other.csv");
  ExpectOneLine(Run(work_.program, work_.arguments + " --merge='" + Path("part1.csv") + "," +
                                       Path("other.csv") + "'"),
                1, "other.csv: /shard/inputs: expected ");
}

/// Texts that programs print, without the line that says when and where they ran, and without
/// times.
std::string WithoutTimes(const std::string& printed, const std::string& time) {
  std::string text = std::regex_replace(printed, std::regex("; date [^;\n]*"), "");
  return std::regex_replace(text, std::regex(time), "TIME");
}

class ShardsOfStudiesTest : public ShardsTest {
 protected:
  /// --out of the run in one and merged, and what both print.
  struct Both {
    ProgramRun one, merged;
    nlohmann::ordered_json one_out, merged_out;
    std::string files;
  };
  /// `report` is a further output of both, if any: --report=one.html and --report=merged.html.
  Both Compare(const Divided& work, int count, const std::string& report = "") const {
    const auto with = [&](const char* name) {
      return report.empty() ? "" : report + "=" + File(std::string(name) + ".html");
    };
    Both both;
    both.one = RunTo(work, with("one"), "all.json");
    both.files = RunShards(work, count);
    both.merged = RunTo(work, with("merged") + " --merge='" + both.files + "'", "merged.json");
    EXPECT_EQ(both.merged.exit_status, both.one.exit_status) << both.merged.error;
    EXPECT_EQ(both.merged.error, both.one.error);
    both.one_out = nlohmann::ordered_json::parse(Read(Path("all.json")));
    both.merged_out = nlohmann::ordered_json::parse(Read(Path("merged.json")));
    return both;
  }

  /// Flags and files that are not as they must be, after two shards of the work were run.
  void ExpectMistakesAreNamed(const Divided& work, const Divided& other) const {
    const auto run = [&](const std::string& flags) {
      return Run(work.program, work.arguments + " " + flags);
    };
    ExpectOneLine(run("--shard=2/2 --out=" + File("x")), 2, "--shard: expected I/N");
    ExpectOneLine(run("--shard=x --out=" + File("x")), 2, "--shard: expected I/N");
    ExpectOneLine(run("--shard=0/2"), 2, "--shard: needs --out");
    ExpectOneLine(run("--shard=0/2 --merge=a --out=" + File("x")), 2, "--shard: not with --merge");
    ExpectOneLine(run("--merge=" + File("part0.json")), 1, "shard 1 of 2 is missing");
    ExpectOneLine(run("--merge='" + Path("part1.json") + "," + Path("part1.json") + "'"), 1,
                  "part1.json: shard 1 of 2 is given twice");
    ASSERT_EQ(RunTo(other, "--shard=1/2", "other.json").exit_status, 0);
    ExpectOneLine(run("--merge='" + Path("part0.json") + "," + Path("other.json") + "'"), 1,
                  "other.json: /shard/flags/seed: expected ");
    ExpectOneLine(run("--merge='" + Path("part0.json") + "," + Path("all.json") + "'"), 1,
                  "all.json: expected a file that --shard wrote");
  }
};

const std::string kStruckBall = "'" TANGIBLE_SOURCE_DIR "/data/control/struck_ball.json'";

TEST_F(ShardsOfStudiesTest, OfBounceAreTheStudyInOne) {
  const Divided work = {"tangible-bounce",
                        kStruckBall + " --problems=5 --iterations=3 --methods=exact,fixed"};
  const Both both = Compare(work, 2);
  EXPECT_EQ(Read(Path("merged.json")), Read(Path("all.json")));
  EXPECT_EQ(both.one_out["drawn"].size(), 5U);
  // The last column is CPU time: that of the shards.
  const std::string time = "[0-9.]+\n";
  EXPECT_EQ(WithoutTimes(both.merged.out, time), WithoutTimes(both.one.out, time));
  const auto part = nlohmann::json::parse(Read(Path("part1.json")));
  ASSERT_EQ(part["drawn"].size(), 2U);
  EXPECT_EQ(part["drawn"][1], nlohmann::json(both.one_out["drawn"][3])) << "its rows are 1 and 3";
  ExpectMistakesAreNamed(work, {work.program, work.arguments + " --seed=2"});
}

constexpr char kChain[] = R"({"bodies": [
    {"name": "link0", "mass": 1, "inertia": 0.1, "position": [0.5, 0], "velocity": [0, 0]},
    {"name": "link1", "mass": 1, "inertia": 0.1, "position": [1.5, 0]}],
  "joints": [{"name": "a", "type": "revolute", "bodies": ["link0", "world"], "anchor": [0, 0]},
             {"name": "b", "type": "revolute", "bodies": ["link1", "link0"], "anchor": [1, 0]}],
  "springs": [{"name": "s", "bodies": ["link1", "world"], "anchors": [[1.5, 0], [1, 2]],
               "stiffness": 10, "rest_length": 1}],
  "simulation": {"dt": 0.01, "duration": 0.5}})";

TEST_F(ShardsOfStudiesTest, OfChainsAreTheStudyInOne) {
  const Divided work = {"tangible-chain-study", "'" + Write("chain.json", kChain) +
                                                    "' --starts=4 --range=2 --replicas=7 "
                                                    "--rate=50"};
  for (const int count : {2, 3}) {
    Both both = Compare(work, count);
    const std::string time = " +[0-9]+\\.[0-9][0-9]\n";
    EXPECT_EQ(WithoutTimes(both.merged.out, time), WithoutTimes(both.one.out, time));
    EXPECT_NE(both.one.out.find("7 replicas"), std::string::npos) << both.one.out;
    ASSERT_EQ(both.one_out["starts"].size(), 4U);
    EXPECT_EQ(both.one_out["replicas"], 7);
    EXPECT_GT(both.one_out["covered"][0], 0);
    for (nlohmann::ordered_json* json : {&both.one_out, &both.merged_out}) {
      for (auto& start : (*json)["starts"]) start.erase("seconds");
    }
    EXPECT_EQ(both.merged_out.dump(), both.one_out.dump());
  }
  // A shard judges nothing: rows 0, 2, 4, ... are two of the starts and four replicas.
  RunShards(work, 2);
  const auto part = nlohmann::json::parse(Read(Path("part0.json")));
  EXPECT_EQ(part["starts"].size(), 2U);
  EXPECT_EQ(part["starts"][1]["start"], 2);
  EXPECT_EQ(part["replicas"], 4);
  EXPECT_FALSE(part.contains("holds"));
  ExpectMistakesAreNamed(work, {work.program, work.arguments + " --seed=2"});
}

class ShardsOfFitsTest : public ShardsOfStudiesTest {
 protected:
  /// A fit of the ball's speed and radius of bouncing to its own positions, moved by hand.
  Divided Fit(const std::string& keys, const std::string& flags = "") const {
    Write("scene.json", kThrownScene);
    EXPECT_EQ(
        Run("tangible-simulate", File("scene.json") + " --out=" + File("t.csv") +
                                     " --observe=" + File("o.csv") + " --noise=0.001 --seed=4")
            .exit_status,
        0);
    return {"tangible-fit", "'" +
                                Write("fit.json", R"({"scene": "scene.json",
              "observations": [{"file": "o.csv", "sigma": 0.001}],
              "parameters": [
                {"name": "speed", "initial": 0.7, "lower": 0.1, "upper": 3,
                 "sets": [{"path": "bodies/ball/velocity/x"}]},
                {"name": "fall", "initial": 9, "lower": 5, "upper": 15,
                 "sets": [{"path": "gravity/y", "scale": -1}]}])" +
                                                      keys + "}") +
                                "' " + flags};
  }

  /// Without measured times: the column of seconds, and those of the first estimate's line.
  static std::string Printed(const ProgramRun& run) {
    const std::string text = std::regex_replace(run.out, std::regex(" +[0-9.]+\n"), "\n");
    return std::regex_replace(text, std::regex(", [0-9.e-]+ s\n"), "\n");
  }
  static nlohmann::ordered_json WithoutSeconds(nlohmann::ordered_json json) {
    json.erase("seconds");
    for (auto& iteration : json["iterations"]) iteration.erase("seconds");
    return json;
  }
};

TEST_F(ShardsOfFitsTest, AreTheFitInOne) {
  const std::pair<std::string, std::string> fits[] = {
      {R"(, "starts": 5, "seed": 2)", ""},
      {R"(, "starts": 3, "loss": {"huber": 2})", "--profile=fall"},
      {"", "--profile=speed,fall"},
      {"", "--profile=fall --predict_from=0.15"}};
  for (const auto& [keys, flags] : fits) {
    const Divided work = Fit(keys, flags);
    const Both both = Compare(work, 2, "--predictions");
    EXPECT_EQ(both.one.exit_status, 0) << both.one.error;
    EXPECT_EQ(Printed(both.merged), Printed(both.one)) << keys << flags;
    EXPECT_EQ(WithoutSeconds(both.merged_out).dump(), WithoutSeconds(both.one_out).dump());
    EXPECT_EQ(Read(Path("merged.html")), Read(Path("one.html"))) << "the predictions";
  }
}

// With several starts and profiles too each shard finds the estimate for itself.
TEST_F(ShardsOfFitsTest, OfChainsAreTheDrawsInOne) {
  for (const char* keys : {R"(, "starts": 1)", R"(, "starts": 3, "seed": 2)"}) {
    const Divided work =
        Fit(keys, "--posterior=60 --posterior_chains=3 --posterior_warm_up=50 --posterior_seed=7");
    Both both = Compare(work, 2, "--posterior_samples");
    EXPECT_EQ(both.one.exit_status, 0) << both.one.error;
    for (nlohmann::ordered_json* json : {&both.one_out, &both.merged_out}) {
      ASSERT_EQ((*json)["posterior"]["draws"], 60);
      (*json)["posterior"].erase("seconds");
    }
    EXPECT_EQ(WithoutSeconds(both.merged_out).dump(), WithoutSeconds(both.one_out).dump());
    EXPECT_EQ(Read(Path("merged.html")), Read(Path("one.html"))) << "the draws";
    EXPECT_NE(Read(Path("one.html")).find("\n59,2,"), std::string::npos);
  }
  RunShards(Fit("", "--posterior=60 --posterior_chains=3 --posterior_warm_up=50"), 2);
  const auto part = nlohmann::json::parse(Read(Path("part0.json")));
  ASSERT_EQ(part["chains"].size(), 2U);
  EXPECT_EQ(part["chains"][1]["chain"], 2);
}

TEST_F(ShardsOfFitsTest, MistakesAreOneLine) {
  const Divided plain = Fit("");
  ExpectOneLine(RunTo(plain, "--shard=0/2", "x.json"), 1,
                "--shard: expected a fit with \"starts\" above 1, --profile or --posterior");
  const Divided work = Fit(R"(, "starts": 3)");
  RunShards(work, 2);
  EXPECT_EQ(nlohmann::json::parse(Read(Path("part0.json")))["starts"].size(), 2U);
  const auto run = [&](const std::string& flags) {
    return Run(work.program, work.arguments + " " + flags);
  };
  ExpectOneLine(run("--shard=2/2 --out=" + File("x")), 2, "--shard: expected I/N");
  ExpectOneLine(run("--shard=0/2"), 2, "--shard: needs --out");
  ExpectOneLine(run("--shard=0/2 --merge=a --out=" + File("x")), 2, "--shard: not with --merge");
  ExpectOneLine(run("--shard=0/2 --report=r.html --out=" + File("x")), 2,
                "--report: not with --shard");
  ExpectOneLine(run("--merge=a --checkpoint=" + File("c")), 2, "--checkpoint: not with --shard");
  ExpectOneLine(run("--merge=" + File("part0.json")), 1, "shard 1 of 2 is missing");
  ExpectOneLine(run("--max_iterations=9 --merge=" + File("part0.json")), 1,
                "part0.json: /shard/flags/max_iterations: expected 9, got the default");
  const Divided other = Fit(R"(, "starts": 3, "seed": 9)");
  ExpectOneLine(Run(other.program, other.arguments + " --merge='" + Path("part0.json") + "," +
                                       Path("part1.json") + "'"),
                1, "part0.json: /shard/inputs: expected ");
}

TEST_F(ShardsOfStudiesTest, OfVerificationAreTheCheckInOne) {
  const Divided work = {"tangible-verify",
                        "--random=2 --starts=1 --coincidences=1 --seed=3 --jacobians"};
  Both both = Compare(work, 2, "--report");
  ExpectMistakesAreNamed(work, {work.program,
                                "--random=2 --starts=1 --coincidences=1 --seed=4 "
                                "--jacobians --stepping=fixed"});
  EXPECT_EQ(WithoutTimes(both.merged.out, "x^"), WithoutTimes(both.one.out, "x^"));
  EXPECT_EQ(WithoutTimes(Read(Path("merged.html")), "x^"),
            WithoutTimes(Read(Path("one.html")), "x^"));
  EXPECT_EQ(both.one_out["scenes"].size(), 8U);
  both.one_out.erase("provenance");
  both.merged_out.erase("provenance");
  EXPECT_EQ(both.merged_out.dump(), both.one_out.dump());
}

}  // namespace
}  // namespace tangible
