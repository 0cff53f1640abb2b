// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/child.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <stdexcept>

#include "../../support/sanitizers.h"

namespace tangible::cost {
namespace {

constexpr size_t kMebibyte = 1u << 20;
// With sanitizers a byte of shadow to eight, and what is kept of freed memory.
constexpr double kOverhead = testing::kSanitized ? 0.2 : 0.02;

// Written and read again, so that it is there.
double Fill(size_t bytes) {
  std::vector<double> memory(bytes / sizeof(double));
  for (size_t i = 0; i < memory.size(); ++i) memory[i] = std::sin(static_cast<double>(i % 7));
  double sum = 0.0;
  for (const double x : memory) sum += x;
  return sum;
}

double Spin(double seconds) {
  double sum = 0.0;
  const std::clock_t end = std::clock() + static_cast<std::clock_t>(seconds * CLOCKS_PER_SEC);
  while (std::clock() < end) sum += std::sin(sum + 1.0);
  return sum;
}

TEST(RunInChildTest, HandsNumbersOver) {
  std::vector<double> many(100000);
  for (size_t i = 0; i < many.size(); ++i) many[i] = 1.0 / static_cast<double>(i + 1);
  const ChildOutcome outcome =
      RunInChild({}, [&](const ChildLimits&, std::string*) { return many; });
  EXPECT_EQ(outcome.status, ChildStatus::kDone) << outcome.message;
  EXPECT_EQ(outcome.values, many);
}

TEST(TextChildTest, HandsATextOver) {
  const std::string many(100000, 'x');
  const ChildOutcome outcome = TextChild({}, [&](const ChildLimits&, std::string*) {
                                 return many + std::string("\0y", 2);
                               }).Wait();
  EXPECT_EQ(outcome.status, ChildStatus::kDone) << outcome.message;
  EXPECT_EQ(outcome.text, many + std::string("\0y", 2));
  EXPECT_TRUE(outcome.values.empty());
  EXPECT_TRUE(TextChild({}, [](const ChildLimits&, std::string*) { return std::string(); })
                  .Wait()
                  .text.empty());
}

TEST(TextChildTest, SeveralRunAtTheSameTime) {
  std::vector<TextChild> children;
  for (int i = 0; i < 8; ++i) {
    children.emplace_back(Budget(), [i](const ChildLimits&, std::string*) {
      return std::string(100000, static_cast<char>('a' + i));
    });
  }
  // In any order; one is not waited for.
  for (const int i : {7, 0, 3, 1, 6, 2, 4}) {
    EXPECT_EQ(children[i].Wait().text, std::string(100000, static_cast<char>('a' + i)));
  }
}

TEST(RunInChildTest, MeasuresItsOwnPeakMemory) {
  const auto peak = [](size_t bytes) {
    return RunInChild({}, [&](const ChildLimits&,
                              std::string*) { return std::vector<double>{Fill(bytes)}; })
        .peak_bytes;
  };
  const size_t little = peak(1000);
  const size_t much = peak(40 * kMebibyte);
  const size_t again = peak(1000);
  EXPECT_NEAR(static_cast<double>(much - little), 40.0 * kMebibyte,
              (1.0 + 40.0 * kOverhead) * kMebibyte);
  EXPECT_LT(again, little + 2 * kMebibyte);
}

TEST(RunInChildTest, EndsBeyondTheTime) {
  const ChildOutcome outcome = RunInChild({.seconds = 0.05}, [](const ChildLimits&, std::string*) {
    return std::vector<double>{Spin(20.0)};
  });
  EXPECT_EQ(outcome.status, ChildStatus::kOverSeconds);
  EXPECT_TRUE(outcome.values.empty());
}

TEST(RunInChildTest, TheTimeMayBeLifted) {
  const ChildOutcome outcome =
      RunInChild({.seconds = 0.05}, [](const ChildLimits& limits, std::string*) {
        limits.LiftSeconds();
        return std::vector<double>{Spin(0.2)};
      });
  EXPECT_EQ(outcome.status, ChildStatus::kDone) << outcome.message;
}

TEST(RunInChildTest, EndsBeyondTheMemory) {
  Budget budget;
  budget.bytes = 64 * kMebibyte;
  const ChildOutcome outcome = RunInChild(budget, [](const ChildLimits&, std::string*) {
    return std::vector<double>{Fill(100 * kMebibyte)};
  });
  EXPECT_EQ(outcome.status, ChildStatus::kOverBytes);
}

TEST(RunInChildTest, FilesAreNoMemory) {
  const ChildOutcome outcome = RunInChild({}, [](const ChildLimits&, std::string*) {
    std::FILE* file = std::fopen("spill", "w");
    const std::vector<char> text(10000, 'x');
    const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
    return std::vector<double>{std::fclose(file) == 0 && written ? 1.0 : 0.0};
  });
  EXPECT_EQ(outcome.status, ChildStatus::kOverBytes);
}

TEST(RunInChildTest, NamesWhatFailed) {
  const ChildOutcome refused = RunInChild({}, [](const ChildLimits&, std::string* error) {
    *error = "no such scene";
    return std::vector<double>{1.0};
  });
  EXPECT_EQ(refused.status, ChildStatus::kFailed);
  EXPECT_EQ(refused.message, "no such scene");
  const ChildOutcome thrown =
      RunInChild({}, [](const ChildLimits&, std::string*) -> std::vector<double> {
        throw std::runtime_error("thrown");
      });
  EXPECT_EQ(thrown.status, ChildStatus::kFailed);
  EXPECT_EQ(thrown.message, "thrown");
  const ChildOutcome ended =
      RunInChild({}, [](const ChildLimits&, std::string*) -> std::vector<double> { _exit(7); });
  EXPECT_EQ(ended.status, ChildStatus::kFailed);
  EXPECT_EQ(ended.message, "ended with exit status 7");
}

}  // namespace
}  // namespace tangible::cost
