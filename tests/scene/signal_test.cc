// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/signal.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

namespace tangible {
namespace {

class SignalTest : public ::testing::Test {
 protected:
  bool Read(const std::string& text, SignalColumns columns) {
    file_ = ::testing::TempDir() + "tangible_signal_test.csv";
    std::ofstream(file_) << text;
    signal_ = Signal();
    error_.clear();
    return ReadSignal(file_, columns, &signal_, &error_);
  }

  std::string file_;
  std::string error_;
  Signal signal_;
};

TEST_F(SignalTest, ForceAndValue) {
  ASSERT_TRUE(Read("time,y,x\n0,1,2\n0.5,3,4\n", SignalColumns::kForce)) << error_;
  EXPECT_EQ(signal_.time, (std::vector<double>{0.0, 0.5}));
  EXPECT_EQ(signal_.x, (std::vector<double>{2.0, 4.0}));
  EXPECT_EQ(signal_.y, (std::vector<double>{1.0, 3.0}));
  EXPECT_TRUE(signal_.value.empty());
  ASSERT_TRUE(Read("time,x,value\n-1,7,2\n", SignalColumns::kValue)) << error_;
  EXPECT_EQ(signal_.value, (std::vector<double>{2.0}));
  EXPECT_TRUE(signal_.x.empty());
}

TEST_F(SignalTest, AMissingDirectionIsZero) {
  ASSERT_TRUE(Read("time,y\n0,1\n1,2\n", SignalColumns::kForce)) << error_;
  EXPECT_EQ(signal_.x, (std::vector<double>{0.0, 0.0}));
}

TEST_F(SignalTest, MessagesNameTheLine) {
  EXPECT_FALSE(Read("time,x\n0,1\n1,2\n1,3\n", SignalColumns::kForce));
  EXPECT_EQ(error_, file_ + ": line 4: time: expected a number > 1.0 (the time before), got 1.0");
  EXPECT_FALSE(Read("time,value\n0,\n", SignalColumns::kValue));
  EXPECT_EQ(error_, file_ + ": line 2: value: expected a number, got \"\"");
  EXPECT_FALSE(Read("time,x\n", SignalColumns::kValue));
  EXPECT_EQ(error_, file_ + ": line 1: missing column value, expected time, value, got time, x");
  EXPECT_FALSE(Read("time,value\n0,1\n", SignalColumns::kForce));
  EXPECT_EQ(error_, file_ + ": line 1: missing columns, expected x or y beside time");
  EXPECT_FALSE(Read("time,value\n", SignalColumns::kValue));
  EXPECT_EQ(error_, file_ + ": line 2: expected at least one row, got none");
}

}  // namespace
}  // namespace tangible
