// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/problem_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "../../support/cases.h"
#include "tangible/verification/corpus/corpus_run.h"

namespace tangible::corpus {
namespace {

class ProblemFolderTest : public ::testing::Test {
 protected:
  ProblemFolderTest() { std::filesystem::create_directories(folder_); }
  ~ProblemFolderTest() override { std::filesystem::remove_all(folder_); }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  std::string Read() {
    cases_.clear();
    return ReadProblemFolder(folder_.string(), &cases_);
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() /
      (std::string("tangible_") + ::testing::UnitTest::GetInstance()->current_test_info()->name() +
       "." + std::to_string(::getpid()));
  std::vector<FileCase> cases_;
};

TEST_F(ProblemFolderTest, ReadsBothFormatsByName) {
  Write("b.json", R"({"F": [[1]], "c": [-1]})");
  Write("a.json", R"({"M": [[2]], "q": [-1], "status": "solvable", "props": {"psd": true}})");
  Write("c.json", R"({"M": [[-1]], "q": [-1], "status": "infeasible"})");
  Write("d.json", R"({"M": [[2]], "q": [1], "status": "solvable", "contact": {"mu": [0.5, 2]}})");
  Write("e.json", R"({"M": [[2]], "q": [1], "status": "solvable", "contact": {"mu": [0.5, 3]}})");
  Write("f.json", R"({"M": [[2]], "q": [1], "status": "feasible_unsolvable"})");
  Write("other.txt", "no problem");
  ASSERT_EQ(Read(), "");
  ASSERT_EQ(cases_.size(), 6U);
  EXPECT_EQ(cases_[0].name, "a.json");
  EXPECT_EQ(cases_[0].problem.F(0, 0), 2.0);
  EXPECT_EQ(cases_[0].problem.c[0], -1.0);
  const Known known[] = {Known::kSolvable, Known::kUnknown,        Known::kInfeasible,
                         Known::kSolvable, Known::kHardlySolvable, Known::kUnsolvable};
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(cases_[i].known, known[i]) << cases_[i].name;
}

TEST_F(ProblemFolderTest, WhatIsWrongIsOneLine) {
  EXPECT_NE(Read().find("expected problem files"), std::string::npos);
  EXPECT_NE(ReadProblemFolder("/nonexistent", &cases_).find("/nonexistent: cannot be read"),
            std::string::npos);
  Write("a.json", R"({"M": [[1, 2]], "q": [1]})");
  EXPECT_NE(Read().find("a.json: /M: expected 1 x 1, got 1 x 2"), std::string::npos);
  Write("a.json", R"({"F": [[1]]})");
  EXPECT_NE(Read().find("a.json: /c: missing"), std::string::npos);
  Write("a.json", "{");
  EXPECT_NE(Read().find("a.json: line 1"), std::string::npos);
}

TEST_F(ProblemFolderTest, EveryPublishedProblemIsAnswered) {
  for (const nlohmann::json& data : PlainCases()) {
    const nlohmann::json problem = {{"M", data["M"]}, {"q", data["q"]}, {"status", data["status"]}};
    Write(data["name"].get<std::string>() + ".json", problem.dump());
  }
  ASSERT_EQ(Read(), "");
  EXPECT_GT(cases_.size(), 90U);
  EXPECT_EQ(FirstFailure(RunCorpus(cases_, {})), "");
}

}  // namespace
}  // namespace tangible::corpus
