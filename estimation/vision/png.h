// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Pictures as PNG files.

#include <string>
#include <vector>

namespace tangible {

/// A picture of 8-bit red, green and blue, rows from the top: `pixels` has 3 width height bytes.
/// Returns the file's bytes (PNG specification, W3C 2003: IHDR, one IDAT, IEND).
std::string PngOf(const std::vector<unsigned char>& pixels, int width, int height);

/// Rows of pictures of one size with a gap between them, as one PNG. Each picture is three planes
/// (red, green, blue) of size x size bytes, drawn `scale` times as large.
std::string PngStrip(const std::vector<std::vector<std::string>>& rows, int size, int scale);

}  // namespace tangible
