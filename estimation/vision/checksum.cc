// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/checksum.h"

#include <zlib.h>

#include <algorithm>
#include <cstddef>

namespace tangible {

std::uint32_t Checksum(std::initializer_list<std::string_view> parts) {
  uLong sum = crc32(0L, Z_NULL, 0);
  // crc32 counts in 32 bits.
  constexpr size_t kMost = size_t{1} << 30;
  for (std::string_view part : parts) {
    while (!part.empty()) {
      const size_t size = std::min(kMost, part.size());
      sum = crc32(sum, reinterpret_cast<const Bytef*>(part.data()), static_cast<uInt>(size));
      part.remove_prefix(size);
    }
  }
  return static_cast<std::uint32_t>(sum);
}

}  // namespace tangible
