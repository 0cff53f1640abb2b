// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Runs a program of the build as a user would, and keeps what it wrote.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace tangible {

struct ProgramRun {
  int exit_status = -1;
  std::string out;
  std::string error;
};

/// A folder of its own for each test, removed with it.
class ProgramTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    // With the process in it: another build's tests may run at the same time.
    std::string name = std::string(info->test_suite_name()) + "." + info->name() + "." +
                       std::to_string(::getpid());
    std::replace(name.begin(), name.end(), '/', '_');
    folder_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name)) << text;
    return Path(name);
  }

  static std::string Read(const std::string& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

  /// `arguments` as a shell reads them.
  ProgramRun Run(const std::string& program, const std::string& arguments) const {
    const std::string out = Path("stdout.txt");
    const std::string error = Path("stderr.txt");
    const std::string command = std::string(TANGIBLE_PROGRAM_DIR) + "/" + program + " " +
                                arguments + " > '" + out + "' 2> '" + error + "'";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, Read(out), Read(error)};
  }

  /// The run failed with `exit_status` and exactly one line on stderr that contains `what`.
  static void ExpectOneLine(const ProgramRun& run, int exit_status, const std::string& what) {
    EXPECT_EQ(run.exit_status, exit_status) << run.error;
    EXPECT_EQ(std::count(run.error.begin(), run.error.end(), '\n'), 1) << run.error;
    EXPECT_NE(run.error.find(what), std::string::npos) << run.error;
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace tangible
