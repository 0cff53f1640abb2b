// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A hash of the bits of numbers and texts (FNV-1a, 64 bits): two results with the same hash are the
// same bit for bit, two zeros of different sign are not. It tells results apart; it protects
// nothing from a forger.

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

namespace tangible {

class BitHash {
 public:
  void Add(std::string_view text) {
    for (const char c : text) {
      Byte(static_cast<unsigned char>(c));
    }
    Byte(0xff);  // "ab", "c" is not "a", "bc"
  }
  void Add(double x) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    Add(bits);
  }
  void Add(std::uint64_t bits) {
    for (int i = 0; i < 8; ++i) {
      Byte(static_cast<unsigned char>(bits >> (8 * i)));
    }
  }
  void Add(int x) { Add(static_cast<std::uint64_t>(static_cast<std::int64_t>(x))); }
  /// The numbers of a vector or matrix and how many there are.
  template <typename Numbers>
  void AddAll(const Numbers& numbers) {
    Add(static_cast<std::uint64_t>(numbers.size()));
    for (decltype(numbers.size()) i = 0; i < numbers.size(); ++i) {
      Add(static_cast<double>(numbers.data()[i]));
    }
  }

  std::uint64_t value() const { return value_; }
  /// 16 hexadecimal digits.
  std::string Text() const {
    std::array<char, 17> text{};
    std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value_));
    return text.data();
  }

 private:
  void Byte(unsigned char byte) {
    value_ ^= byte;
    value_ *= 0x100000001b3ULL;
  }
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace tangible
