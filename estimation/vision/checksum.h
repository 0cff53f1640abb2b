// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The checksum of the files of this module.

#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace tangible {

/// CRC-32 of the texts, one behind the other.
std::uint32_t Checksum(std::initializer_list<std::string_view> parts);

}  // namespace tangible
