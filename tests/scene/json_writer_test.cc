// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/json_writer.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

namespace tangible {
namespace {

TEST(JsonTextTest, ShortValuesOnOneLineLongOnesOnSeveral) {
  OrderedJson json;
  json["b"] = {1.0, 2.5};
  json["a"] = std::string(100, 'x');
  EXPECT_EQ(JsonText(json),
            "{\n  \"b\": [1.0, 2.5],\n  \"a\": \"" + std::string(100, 'x') + "\"\n}\n");
  EXPECT_EQ(JsonText(OrderedJson::array()), "[]\n");
  EXPECT_EQ(JsonText(OrderedJson::object()), "{}\n");
}

TEST(JsonTextTest, NumbersReadBackBitForBit) {
  std::mt19937_64 random(11);
  OrderedJson json = OrderedJson::array({0.0, -0.0, 0.1, std::numeric_limits<double>::denorm_min(),
                                         std::numeric_limits<double>::max()});
  while (json.size() < 1000) {
    const std::uint64_t bits = random();
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    if (value - value == 0.0) json.push_back(value);
  }
  const OrderedJson back = OrderedJson::parse(JsonText(json));
  for (std::size_t i = 0; i < json.size(); ++i) {
    const double a = json[i].get<double>();
    const double b = back[i].get<double>();
    EXPECT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b)) << a;
  }
}

TEST(JsonTextTest, WhatIsNotFiniteIsNull) {
  const OrderedJson json = OrderedJson::array(
      {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()});
  EXPECT_EQ(JsonText(json), "[null, null]\n");
}

}  // namespace
}  // namespace tangible
