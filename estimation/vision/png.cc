// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/png.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>

namespace tangible {
namespace {

void AppendNumber(std::uint32_t value, std::string* bytes) {
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes->push_back(static_cast<char>((value >> shift) & 0xFFU));
  }
}

void AppendChunk(const std::string& type, const std::string& data, std::string* bytes) {
  AppendNumber(static_cast<std::uint32_t>(data.size()), bytes);
  const std::string content = type + data;
  *bytes += content;
  const uLong sum = crc32(crc32(0L, Z_NULL, 0), reinterpret_cast<const Bytef*>(content.data()),
                          static_cast<uInt>(content.size()));
  AppendNumber(static_cast<std::uint32_t>(sum), bytes);
}

}  // namespace

std::string PngOf(const std::vector<unsigned char>& pixels, int width, int height) {
  const size_t row = 3 * static_cast<size_t>(width);
  std::string raw;
  for (int j = 0; j < height; ++j) {
    raw.push_back('\0');  // no filter
    raw.append(reinterpret_cast<const char*>(pixels.data()) + static_cast<size_t>(j) * row, row);
  }
  uLongf size = compressBound(raw.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
            reinterpret_cast<const Bytef*>(raw.data()), raw.size(), 9);
  packed.resize(size);
  std::string header;
  AppendNumber(static_cast<std::uint32_t>(width), &header);
  AppendNumber(static_cast<std::uint32_t>(height), &header);
  header += std::string("\x08\x02\x00\x00\x00", 5);  // 8 bits, red green blue, no interlace
  std::string bytes = "\x89PNG\r\n\x1a\n";
  AppendChunk("IHDR", header, &bytes);
  AppendChunk("IDAT", packed, &bytes);
  AppendChunk("IEND", "", &bytes);
  return bytes;
}

std::string PngStrip(const std::vector<std::vector<std::string>>& rows, int size, int scale) {
  constexpr int kGap = 4;
  size_t columns = 0;
  for (const auto& row : rows) columns = std::max(columns, row.size());
  const int pitch = size * scale + kGap;
  const int width = static_cast<int>(columns) * pitch + kGap;
  const int height = static_cast<int>(rows.size()) * pitch + kGap;
  std::vector<unsigned char> pixels(3 * static_cast<size_t>(width) * height, 255);
  for (size_t r = 0; r < rows.size(); ++r) {
    for (size_t k = 0; k < rows[r].size(); ++k) {
      for (int j = 0; j < size * scale; ++j) {
        for (int i = 0; i < size * scale; ++i) {
          const size_t y = kGap + r * pitch + j, x = kGap + k * pitch + i;
          for (int c = 0; c < 3; ++c) {
            pixels[3 * (y * width + x) + c] = static_cast<unsigned char>(
                rows[r][k][static_cast<size_t>(c) * size * size + j / scale * size + i / scale]);
          }
        }
      }
    }
  }
  return PngOf(pixels, width, height);
}

}  // namespace tangible
