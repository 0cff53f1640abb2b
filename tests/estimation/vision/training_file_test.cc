// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/training_file.h"

#include <gtest/gtest.h>

#include <string>

namespace tangible {
namespace {

const TrainingFile kTraining = {"billiards 7 0.001", 200, std::string("weights\n\0\xff", 10)};

std::string Refusal(const std::string& bytes) {
  TrainingFile training;
  std::string error;
  EXPECT_FALSE(ParseTraining(bytes, "c", &training, &error));
  EXPECT_EQ(error.rfind("c: ", 0), 0U) << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  return error;
}

TEST(TrainingFileTest, ReadsBack) {
  TrainingFile training;
  std::string error;
  ASSERT_TRUE(ParseTraining(SerializeTraining(kTraining), "c", &training, &error)) << error;
  EXPECT_EQ(training.fingerprint, kTraining.fingerprint);
  EXPECT_EQ(training.iteration, 200);
  EXPECT_EQ(training.weights, kTraining.weights);
}

TEST(TrainingFileTest, AnEmptyFileIsNoCheckpoint) {
  EXPECT_NE(Refusal("").find("empty file"), std::string::npos);
  EXPECT_NE(Refusal("what else").find("another file"), std::string::npos);
  EXPECT_NE(Refusal("tangible training 1\nx\n1 2\n").find("version 1"), std::string::npos);
}

// The checksum is that of all bytes: no change of one is taken.
TEST(TrainingFileTest, EveryChangedBitIsFound) {
  const std::string bytes = SerializeTraining(kTraining);
  for (size_t i = 0; i < bytes.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
      EXPECT_NE(Refusal(damaged), "") << i;
    }
    EXPECT_NE(Refusal(bytes.substr(0, i)), "") << i;
  }
  std::string later = bytes;
  later.replace(later.find("200 "), 4, "201 ");
  EXPECT_NE(Refusal(later).find("damaged"), std::string::npos);
  for (const char* iteration : {"0 ", "-5 ", "1e3 ", " ", "99999999999999999999 ", "200"}) {
    std::string other = bytes;
    other.replace(other.find("200 "), 4, iteration);
    EXPECT_NE(Refusal(other).find("iteration"), std::string::npos) << iteration;
  }
}

}  // namespace
}  // namespace tangible
