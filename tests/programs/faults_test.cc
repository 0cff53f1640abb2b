// SPDX-License-Identifier: Apache-2.0
//
// What the world does to programs: a disk that is full, files that are folders, a stdout that is
// closed, a kill in the middle of a write. Each is exit status 1 and one line, and a file is the
// old or the whole new one.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "run_program.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

using nlohmann::json;

constexpr char kBall[] = R"({"bodies": [
  {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1],
   "velocity": [2, 3]}], "simulation": {"dt": 0.01, "duration": 0.5}})";

/// A program, its files in the test's folder, and what it writes.
struct Job {
  std::string program;
  std::string arguments;             ///< without outputs
  std::vector<std::string> outputs;  ///< flags
  bool prints = true;                ///< to stdout, without outputs
  bool quick = true;                 ///< else only what is found before the work
};

const std::vector<Job>& Jobs() {
  static const std::vector<Job> jobs = {
      {"tangible-simulate", "ball.json", {"out", "contacts", "view", "summary"}},
      {"tangible-simulate", "ball.json --rate=20 --noise=0.1", {"observe"}, false},
      {"tangible-simulate", "ball.json --batch=batch.csv", {"out"}},
      {"tangible-gradient", "ball.json --parameters=bodies/ball/mass", {"out"}},
      {"tangible-control", "control.json", {"out", "plan", "trajectory", "view"}},
      {"tangible-lcp", "lcp.json", {"out"}},
      {"tangible-fit", "fit.json", {"out", "report", "scene_out", "predictions", "checkpoint"}},
      {"tangible-import-recording", "markers.csv --length=0.1 --to=0.01", {"out"}, false},
      {"tangible-pendulums", "recordings", {"out"}, false, false},
      {"tangible-closed-forms", "", {"out", "picture"}, true, false},
      {"tangible-cost",
       "--parameters=1 --steps=5 --long_run=20 --repeat_seconds=0.001 --nobounds",
       {"out", "picture"},
       true,
       false},
      {"tangible-extremes", "--list", {}},
      {"tangible-extremes", "", {"out", "report"}, true, false},
      {"tangible-tradeoff", "ball.json", {"out", "report", "picture"}, true, false},
      {"tangible-verify", "ball.json", {"out", "report"}}};
  return jobs;
}

class FaultsTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    Write("ball.json", kBall);
    Write("lcp.json", R"({"F": [[2]], "c": [-1]})");
    Write(
        "pushed.json",
        R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0]}],
        "forces": [{"name": "push", "body": "ball", "force": [0, 0]}],
        "simulation": {"duration": 0.1}})");
    Write("control.json", R"({"scene": "pushed.json", "controls": [{"path": "forces/push/force/x"}],
        "cost": [{"control": "forces/push/force/x"}, {"state": "ball/x", "target": 1, "at": "end"}]})");
    Write("batch.csv", "bodies/ball/mass\n1\n2\n");
    std::string text = "time,body,y\n";
    for (int k = 0; k <= 50; k += 10) {
      text += std::to_string(0.01 * k) + ",ball," +
              json(1.0 + 0.03 * k - 9.5e-4 * 0.5 * k * (k + 1)).dump() + "\n";
    }
    Write("o.csv", text);
    Write("fit.json", R"({"scene": "ball.json", "observations": [{"file": "o.csv", "sigma": 0.01}],
        "parameters": [{"name": "g", "initial": 8, "lower": 1, "upper": 20,
                        "sets": [{"path": "gravity/y", "scale": -1}]}]})");
    std::string markers;
    for (int k = 0; k < 10; ++k) {
      markers += "1000,2000,1500,2000,1500,2300\n";
    }
    Write("markers.csv", markers);
    std::filesystem::create_directory(Path("folder"));
  }

  /// In the test's folder, after `before`, with stdout as given: the program's status and stderr.
  ProgramRun RunIn(const std::string& before, const Job& job, const std::string& arguments,
                   const std::string& redirection) const {
    const std::string command = "cd '" + Path("") + "' && ( ( " + before + " '" +
                                std::string(TANGIBLE_PROGRAM_DIR) + "/" + job.program + "' " +
                                job.arguments + " " + arguments + " 2>&3 " + redirection +
                                " ); echo $? > status.txt ) 3>&1 | cat > stderr.txt";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    const std::string status = Read(Path("status.txt"));
    return {status.empty() ? -1 : std::stoi(status), "", Read(Path("stderr.txt"))};
  }

  void WriteFilesThatName(const std::string& input) const;

  /// Files in the folder that a program left behind under a name of its own.
  std::vector<std::string> Temporaries() const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(Path(""))) {
      const std::string name = entry.path().filename().string();
      if (name.find(".tmp") != std::string::npos) {
        found.push_back(name);
      }
    }
    return found;
  }
};

TEST_F(FaultsTest, OutputsThatCannotBeWritten) {
  for (const Job& job : Jobs()) {
    for (size_t i = 1; i < job.outputs.size(); ++i) {
      const std::string twice = "--" + job.outputs[i - 1] + "=x --" + job.outputs[i] + "=x";
      ExpectOneLine(RunIn("", job, twice, "> /dev/null"), 2, "expected a file of its own");
    }
    for (const std::string& flag : job.outputs) {
      SCOPED_TRACE(job.program + " " + job.arguments + " --" + flag);
      const auto with = [&](const std::string& path) { return "--" + flag + "=" + path; };
      ExpectOneLine(RunIn("", job, with("folder"), "> /dev/null"), 1, "folder: ");
      ExpectOneLine(RunIn("", job, with("none/file"), "> /dev/null"), 1,
                    "none/file: cannot be written: No such file or directory");
      ExpectOneLine(RunIn("", job, with("ball.json/file"), "> /dev/null"), 1,
                    "ball.json/file: cannot be written: Not a directory");
      if (!job.quick) {
        continue;
      }
      // A device that is always full, and a limit on the size of files.
      const bool read_first = flag == "checkpoint";
      ExpectOneLine(RunIn("", job, with("/dev/full"), "> /dev/null"), 1,
                    read_first ? "/dev/full: cannot be written: expected a file"
                               : "/dev/full: cannot be written: No space left");
      // A checkpoint that is there is read, and this is none.
      const std::string old = read_first ? "new" : "old";
      Write("old", "old");
      ExpectOneLine(RunIn("ulimit -f 0; exec", job, with(old), "> /dev/null"), 1,
                    old + ": cannot be written: File too large");
      EXPECT_EQ(Read(Path("old")), "old");
      EXPECT_FALSE(std::filesystem::exists(Path("new")));
      EXPECT_EQ(Temporaries(), std::vector<std::string>());
    }
  }
}

// Files that the fit names, and a scene: not on the command line, and inputs all the same.
TEST_F(FaultsTest, OutputsOverInputsThatAFileNames) {
  for (const std::string flag : {"out", "report", "checkpoint"}) {
    for (const std::string file : {"ball.json", "o.csv", "./folder/../o.csv"}) {
      const std::string before = Read(Path(file));
      ExpectOneLine(
          RunIn("", {"tangible-fit", "fit.json", {}}, "--" + flag + "=" + file, "> /dev/null"), 2,
          "expected a file of its own, got that of an input");
      EXPECT_EQ(Read(Path(file)), before);
    }
  }
}

// A signal's file that the scene names, in every program that reads a scene.
TEST_F(FaultsTest, OutputsOverAFileThatTheSceneNames) {
  Write("push.csv", "time,x,y\n0,0,0\n1,0.1,0\n");
  json struck =
      json::parse(Read(std::string(TANGIBLE_SOURCE_DIR) + "/data/control/struck_ball.json"));
  struck["forces"] = {{{"name", "wind"}, {"body", "ball"}, {"force", {{"file", "push.csv"}}}}};
  Write("struck.json", struck.dump());
  json ball = json::parse(kBall);
  ball["forces"] = {{{"name", "wind"}, {"body", "ball"}, {"force", {{"file", "push.csv"}}}}};
  Write("blown.json", ball.dump());
  for (const auto& [program, arguments, flags] :
       {std::tuple("tangible-verify", "blown.json", std::vector<std::string>{"out", "report"}),
        std::tuple("tangible-tradeoff", "blown.json",
                   std::vector<std::string>{"out", "report", "picture"}),
        std::tuple("tangible-bounce", "struck.json", std::vector<std::string>{"out"}),
        std::tuple("tangible-gradient", "blown.json --parameters=gravity/y",
                   std::vector<std::string>{"out"}),
        std::tuple("tangible-simulate", "blown.json", std::vector<std::string>{"out", "view"})}) {
    for (const std::string& flag : flags) {
      SCOPED_TRACE(std::string(program) + " --" + flag);
      ExpectOneLine(RunIn("", {program, arguments, {}}, "--" + flag + "=push.csv", "> /dev/null"),
                    2,
                    std::string(program) + ": --" + flag +
                        ": expected a file of its own, got that of an input, push.csv");
      EXPECT_EQ(Read(Path("push.csv")).rfind("time,x,y", 0), 0u);
    }
  }
}

TEST_F(FaultsTest, FlagsOfTheChainStudyOutsideTheirRange) {
  const std::string chain = "'" + std::string(TANGIBLE_SOURCE_DIR) + "/data/scenes/chain.json'";
  for (const char* flag : {"--seed=-1", "--rate=1e300", "--rate=0", "--rate=nan", "--sigma=0",
                           "--sigma=-1", "--range=0.5", "--starts=-1", "--replicas=-1"}) {
    SCOPED_TRACE(flag);
    const std::string name = std::string(flag).substr(0, std::string(flag).find('='));
    ExpectOneLine(RunIn("", {"tangible-chain-study", chain, {}}, flag, "> /dev/null"), 2,
                  "tangible-chain-study: " + name + ": expected a number");
  }
}

TEST_F(FaultsTest, OneOutputThatFailsDoesNotKeepTheOthers) {
  ExpectOneLine(
      RunIn("", {"tangible-fit", "fit.json", {}}, "--out=/dev/full --report=r.html", "> /dev/null"),
      1, "/dev/full: cannot be written: No space left");
  EXPECT_NE(Read(Path("r.html")).find("</html>"), std::string::npos);
}

TEST_F(FaultsTest, ACostThatIsNotFiniteHasNotConverged) {
  for (const std::string value : {"1e300", "1e200"}) {
    Write("o.csv", "time,body,y\n0.1,ball," + value + "\n0.2,ball,1\n");
    ExpectOneLine(RunIn("", {"tangible-fit", "fit.json", {}}, "--out=r.json", "> /dev/null"), 1,
                  "the cost is not finite");
    EXPECT_EQ(json::parse(Read(Path("r.json")))["status"], "failed");
  }
  // Huber's loss is finite where the plain squares that lead to its optimum are not.
  json fit = json::parse(Read(Path("fit.json")));
  fit["loss"] = {{"huber", 2}};
  Write("fit.json", fit.dump());
  const ProgramRun run = RunIn("", {"tangible-fit", "fit.json", {}}, "", "> /dev/null");
  EXPECT_LE(std::count(run.error.begin(), run.error.end(), '\n'), 1) << run.error;
}

TEST_F(FaultsTest, AStdoutThatTakesNothing) {
  // A pipe whose reader is gone.
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  constexpr int kPipe = 9;
  ASSERT_EQ(::dup2(ends[1], kPipe), kPipe);
  ::close(ends[0]);
  ::close(ends[1]);
  for (const Job& job : Jobs()) {
    if (!job.prints || !job.quick) {
      continue;
    }
    SCOPED_TRACE(job.program + " " + job.arguments);
    const std::string lost = "stdout: cannot be written: ";
    ExpectOneLine(RunIn("", job, "", "> /dev/full"), 1, lost);
    ExpectOneLine(RunIn("", job, "", ">&-"), 1, lost);
    ExpectOneLine(RunIn("", job, "", ">&9"), 1, lost);
    ExpectOneLine(RunIn("", job, "--help", "> /dev/full"), 1, lost);
    ExpectOneLine(RunIn("", job, "--version", ">&-"), 1, lost);
  }
  ::close(kPipe);
}

// The file that is opened next must not get the number of the stdout that is closed.
TEST_F(FaultsTest, WithStdoutClosedFilesAreWhole) {
  const Job fit{"tangible-fit", "fit.json", {}};
  ExpectOneLine(RunIn("", fit, "--out=r.json", ">&-"), 1, "stdout: cannot be written");
  EXPECT_EQ(json::parse(Read(Path("r.json")))["status"], "converged");
  const Job simulate{"tangible-simulate", "ball.json", {}};
  const ProgramRun quiet = RunIn("", simulate, "--out=t.csv", ">&- <&-");
  EXPECT_EQ(quiet.exit_status, 0) << quiet.error;
  EXPECT_EQ(Read(Path("t.csv")).rfind("time,body,x", 0), 0u);
}

/// Each program with each of its inputs, of which the test decides what it is.
std::vector<Job> JobsThatRead(const std::string& input) {
  return {
      {"tangible-simulate", input, {}},
      {"tangible-simulate", "ball.json --initial=" + input, {}},
      {"tangible-simulate", "ball.json --batch=" + input, {}},
      {"tangible-simulate", "ball.json --observe=x.csv --rate=20 --points=" + input, {}},
      {"tangible-gradient", input + " --parameters=bodies/ball/mass", {}},
      {"tangible-gradient", "ball.json --parameters=bodies/ball/mass --loss=" + input, {}},
      {"tangible-control", input, {}},
      {"tangible-lcp", input, {}},
      {"tangible-fit", input, {}},
      {"tangible-fit", "fit.json --checkpoint=" + input, {}},
      {"tangible-import-recording", input + " --out=x.csv", {}},
      {"tangible-import-recording", input + " --kind=multiarm_single --out=x.csv", {}},
      {"tangible-import-recording",
       input + " --kind=table --mapping=" + input + " --out=x.csv",
       {}},
      {"tangible-import-recording", input + " --kind=deeplabcut --frame_rate=9 --out=x.csv", {}},
      {"tangible-import-recording", input + " --kind=tracker --out=x.csv", {}},
      {"tangible-pendulums", input, {}},
      {"tangible-tradeoff", input, {}},
      {"tangible-verify", input, {}},
      // Files that a file names.
      {"tangible-fit", "names_scene.json", {}},
      {"tangible-fit", "names_observations.json", {}},
      {"tangible-simulate", "names_signal.json", {}},
      {"tangible-gradient", "names_signal.json --parameters=bodies/ball/mass", {}}};
}

/// The same files, which name `input` in the place of another.
void FaultsTest::WriteFilesThatName(const std::string& input) const {
  for (const auto& [name, file] : {std::pair<std::string, std::string>("scene", "ball.json"),
                                   std::pair<std::string, std::string>("observations", "o.csv")}) {
    std::string fit = Read(Path("fit.json"));
    fit.replace(fit.find(file), file.size(), input);
    Write("names_" + name + ".json", fit);
  }
  json scene = json::parse(kBall);
  scene["forces"] = {{{"name", "push"}, {"body", "ball"}, {"force", {{"file", input}}}}};
  Write("names_signal.json", scene.dump());
}

// None is waited for, and none read without end.
TEST_F(FaultsTest, InputsThatAreNotRegularFiles) {
  ASSERT_EQ(::mkfifo(Path("pipe").c_str(), 0600), 0);
  for (const std::string input : {"folder", "pipe", "/dev/zero", "/dev/null"}) {
    WriteFilesThatName(input);
    for (const Job& job : JobsThatRead(input)) {
      SCOPED_TRACE(job.program + " " + job.arguments);
      const ProgramRun run = RunIn("timeout 20", job, "", "> /dev/null");
      ExpectOneLine(run, 1, input);
      const bool reads = job.program != "tangible-pendulums" && input != "folder" &&
                         job.arguments.find("--checkpoint") == std::string::npos;
      EXPECT_EQ(
          run.error.find("cannot be read: expected a regular file, got a ") != std::string::npos,
          reads)
          << run.error;
    }
  }
  std::filesystem::create_directory(Path("problems"));
  ASSERT_EQ(::mkfifo(Path("problems/p.json").c_str(), 0600), 0);
  ExpectOneLine(RunIn("timeout 20", {"tangible-corpus", "--problems=problems", {}}, "", ""), 1,
                "problems/p.json: cannot be read: expected a regular file, got a pipe");
  // What a shell opens: a pipe is refused, a file taken.
  const Job standard{"tangible-simulate", "/dev/stdin", {}};
  ExpectOneLine(RunIn("cat ball.json | timeout 20", standard, "", "> /dev/null"), 1,
                "/dev/stdin: cannot be read: expected a regular file, got a pipe");
  EXPECT_EQ(RunIn("timeout 20", standard, "", "> /dev/null < ball.json").exit_status, 0);
}

// Bytes that a terminal would obey, and more than anyone would read.
TEST_F(FaultsTest, WhatFilesHoldDoesNotReachTheTerminalRaw) {
  std::mt19937 random(11);
  std::vector<std::string> garbage;
  for (const std::string& start :
       {std::string(), std::string("{\"a\": "), std::string("{\""), std::string("time,body,"),
        std::string("1,2,3,4,5,"), std::string("{\"format\": \"")}) {
    for (const size_t size : {40u, 100000u}) {
      std::string& bytes = garbage.emplace_back(start);
      for (size_t i = 0; i < size; ++i) bytes += static_cast<char>(random() % 256);
    }
  }
  garbage.emplace_back("{\"\x1b]0;owned\x07\": 1}");
  garbage.emplace_back("{\"\\u001b[31m\": 1, \"\\u009b2J\": 2}");
  garbage.emplace_back("time,body,x\x1b[31m\n0,ball,1\n");
  garbage.emplace_back(
      "time,body,x\n0,\xc2\x9b"
      "31m,\x1b[2J\n");
  garbage.emplace_back("time,body,x,y,angle,vx,vy,omega\n0,\x1b[31mball,0,0,0,0,0,0\n");
  garbage.emplace_back("bodies/\x1b[31mball/mass\n1\n");
  WriteFilesThatName("garbage");
  for (const std::string& bytes : garbage) {
    Write("garbage", bytes);
    for (const Job& job : JobsThatRead("garbage")) {
      if (job.program == "tangible-pendulums") continue;
      SCOPED_TRACE(job.program + " " + job.arguments + ": " + OneLine(bytes.substr(0, 60)));
      const ProgramRun run = RunIn("timeout 20", job, "", "> out.txt");
      ExpectOneLine(run, 1, "garbage");
      const std::string line = run.error.substr(0, run.error.find('\n'));
      EXPECT_EQ(line, OneLine(line));
      EXPECT_LT(line.size(), 2000u);
      EXPECT_EQ(Read(Path("out.txt")), "");
    }
  }
}

// Names on the command line are another's text too, where a script has them from elsewhere.
TEST_F(FaultsTest, NorDoesTheCommandLine) {
  const std::string name = "\x1b[31m\xff.json";
  for (const std::string& arguments :
       {std::string("'" + name + "'"), "ball.json --out='" + name + "/x'",
        "ball.json '--" + name + "'", "ball.json --every='" + name + "'"}) {
    const ProgramRun run = RunIn("", {"tangible-simulate", arguments, {}}, "", "> /dev/null");
    EXPECT_NE(run.exit_status, 0);
    const std::string line = run.error.substr(0, run.error.find('\n'));
    EXPECT_EQ(line.size() + 1, run.error.size());
    EXPECT_EQ(line, OneLine(line));
    EXPECT_NE(line.find("\\x1b[31m\\xff"), std::string::npos) << line;
  }
}

// Without memory every program ends with a line; what a gradient can do about it is in the line.
TEST_F(FaultsTest, NoMemoryIsOneLine) {
  std::string zeros = "[0";
  for (int i = 0; i < 15'000'000; ++i) zeros += ",0";
  Write("large.json", zeros + "]");
  for (const Job& job : std::vector<Job>{{"tangible-simulate", "large.json", {}},
                                         {"tangible-lcp", "large.json", {}},
                                         {"tangible-fit", "large.json", {}},
                                         {"tangible-tradeoff", "large.json", {}},
                                         {"tangible-verify", "large.json", {}}}) {
    SCOPED_TRACE(job.program);
    ExpectOneLine(RunIn("ulimit -v 200000; exec", job, "", "> /dev/null"), 1,
                  job.program + ": not enough memory");
  }
  json scene = json::parse(kBall);
  scene["simulation"]["dt"] = 1e-6;
  Write("long.json", scene.dump());
  const Job gradient{
      "tangible-gradient", "long.json --parameters=bodies/ball/mass --method=adjoint", {}};
  ExpectOneLine(RunIn("ulimit -v 200000; exec", gradient, "", "> /dev/null"), 1,
                "long.json: not enough memory");
  ExpectOneLine(RunIn("ulimit -v 200000; exec", gradient, "", "> /dev/null"), 1,
                "--checkpoint=budget:MIB");
  // And it helps.
  EXPECT_EQ(RunIn("ulimit -v 200000; exec", gradient, "--checkpoint=budget:50", "> /dev/null")
                .exit_status,
            0);
}

TEST_F(FaultsTest, AKillLeavesTheOldOrTheWholeNewFile) {
  json scene = json::parse(kBall);
  scene["simulation"]["dt"] = 1e-5;
  Write("long.json", scene.dump());
  const Job job{"tangible-simulate", "long.json --summary=s.json", {}};
  ASSERT_EQ(RunIn("", job, "--out=new.csv", "").exit_status, 0);
  const std::string whole = Read(Path("new.csv"));
  const double seconds = json::parse(Read(Path("s.json")))["seconds"];
  int killed = 0;
  constexpr int kKills = 8;
  for (int i = 1; i <= kKills; ++i) {
    Write("t.csv", "old");
    const std::string after = std::to_string(1.2 * seconds * i / kKills + 0.005);
    const Job kill{"tangible-simulate", "long.json", {}};
    killed += RunIn("timeout -s KILL " + after, kill, "--out=t.csv", "").exit_status == 137 ? 1 : 0;
    const std::string left = Read(Path("t.csv"));
    EXPECT_TRUE(left == "old" || left == whole) << left.size() << " of " << whole.size();
  }
  EXPECT_GT(killed, 0);
  for (const std::string& name : Temporaries()) {
    EXPECT_EQ(name.rfind("t.csv.tmp", 0), 0u) << name;
  }
}

/// All but the times.
json WithoutSeconds(json value) {
  if (value.is_object()) {
    value.erase("seconds");
  }
  if (value.is_structured()) {
    for (json& item : value) {
      item = WithoutSeconds(item);
    }
  }
  return value;
}

// The first checkpoint holds little; what follows it is above the limit of one block of 512 bytes.
TEST_F(FaultsTest, ACheckpointThatCannotBeWrittenOnTheWayIsAFailure) {
  const std::string file = std::string(TANGIBLE_SOURCE_DIR) + "/data/fits/chain.json";
  const Job fit{"tangible-fit", "'" + file + "' --checkpoint=c.json", {}};
  const ProgramRun run = RunIn("ulimit -f 1; exec", fit, "", "> /dev/null");
  EXPECT_EQ(run.exit_status, 1) << run.error;
  // The ball's bounce by fixed steps has a warning of its own.
  EXPECT_EQ(std::count(run.error.begin(), run.error.end(), '\n'), 2) << run.error;
  EXPECT_NE(run.error.find("c.json: cannot be written: File too large: the fit went on without its "
                           "checkpoint"),
            std::string::npos)
      << run.error;
  EXPECT_TRUE(std::filesystem::exists(Path("c.json")));
  EXPECT_EQ(Temporaries(), std::vector<std::string>());
}

TEST_F(FaultsTest, AFitThatIsDoneLeavesItsCheckpointAsItIs) {
  const Job fit{"tangible-fit", "fit.json --checkpoint=c.json", {}};
  ASSERT_EQ(RunIn("", fit, "", "> first.json").exit_status, 0);
  struct stat written;
  ASSERT_EQ(::stat(Path("c.json").c_str(), &written), 0);
  ASSERT_EQ(RunIn("", fit, "", "> second.json").exit_status, 0);
  struct stat left;
  ASSERT_EQ(::stat(Path("c.json").c_str(), &left), 0);
  EXPECT_EQ(left.st_ino, written.st_ino);  // a file written anew is another one
  EXPECT_EQ(left.st_size, written.st_size);
}

TEST_F(FaultsTest, LinksAreFollowedToFilesThatAreNotThereYet) {
  namespace fs = std::filesystem;
  fs::create_symlink("../new.csv", Path("folder/second"));
  fs::create_symlink("folder/second", Path("first"));
  const Job simulate{"tangible-simulate", "ball.json", {}};
  EXPECT_EQ(RunIn("", simulate, "--out=first", "").exit_status, 0);
  EXPECT_TRUE(fs::is_symlink(Path("first")));
  EXPECT_TRUE(fs::is_symlink(Path("folder/second")));
  EXPECT_EQ(Read(Path("new.csv")).rfind("time,body,x", 0), 0u);
  fs::create_symlink("unborn", Path("alias"));
  ExpectOneLine(RunIn("", simulate, "--out=unborn --summary=alias", ""), 2,
                "expected a file of its own");
  Write("private", "old");
  const fs::perms owner = fs::perms::owner_read | fs::perms::owner_write;
  fs::permissions(Path("private"), owner);
  EXPECT_EQ(RunIn("", simulate, "--out=private", "").exit_status, 0);
  EXPECT_EQ(fs::status(Path("private")).permissions(), owner);
  fs::create_symlink("round", Path("round"));
  ExpectOneLine(RunIn("", simulate, "--out=round", ""), 1, "round: cannot be written: ");
}

TEST_F(FaultsTest, AKilledFitGoesOnFromItsCheckpointToTheSameBits) {
  const std::string file = std::string(TANGIBLE_SOURCE_DIR) + "/data/fits/chain.json";
  const Job fit{"tangible-fit", "'" + file + "' --discretisation_check", {}};
  ASSERT_EQ(RunIn("", fit, "--out=whole.json", "> /dev/null").exit_status, 0);
  int kills = 0;
  ProgramRun run;
  do {
    // Long enough to come further than the time before, as long as it takes.
    const std::string after = std::to_string(0.05 * std::pow(1.3, kills));
    run = RunIn("timeout -s KILL " + after, fit, "--checkpoint=c.json --out=resumed.json",
                "> /dev/null");
  } while (run.exit_status == 137 && ++kills < 30);
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_GT(kills, 0);
  EXPECT_EQ(WithoutSeconds(json::parse(Read(Path("resumed.json")))).dump(),
            WithoutSeconds(json::parse(Read(Path("whole.json")))).dump());
  // Damaged, cut, another fit's.
  const std::string text = Read(Path("c.json"));
  const auto expect_refused = [&](const std::string& damaged, const std::string& what) {
    Write("damaged.json", damaged);
    ExpectOneLine(RunIn("", fit, "--checkpoint=damaged.json --out=none.json", "> /dev/null"), 1,
                  "damaged.json: " + what);
    EXPECT_EQ(Read(Path("damaged.json")), damaged);
    EXPECT_FALSE(std::filesystem::exists(Path("none.json")));
  };
  expect_refused("", "");
  expect_refused(text.substr(0, text.size() / 2), "damaged: ");
  expect_refused(std::string(1'000'000, '\x81') + "\n", "expected a \"tangible-fit checkpoint 7\"");
  std::string flipped = text;
  flipped[text.find("cost") + 6] ^= 1;  // within the number
  expect_refused(flipped, "damaged: ");
  ExpectOneLine(RunIn("", {"tangible-fit", "fit.json", {}}, "--checkpoint=c.json", "> /dev/null"),
                1, "c.json: /problem: a checkpoint of another fit");
}

}  // namespace
}  // namespace tangible
