// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Scratch memory that is sized and then written in full before it is read. With the CMake option
// TANGIBLE_POISON it is filled with signalling NaN when it is sized, and Eigen's matrices with NaN
// (EIGEN_INITIALIZE_MATRICES_BY_NAN): a number that is read before it was written, or left over
// from the step before, then shows in every result that it touches.

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace tangible {

#ifdef TANGIBLE_POISON
inline constexpr bool kPoison = true;
#else
inline constexpr bool kPoison = false;
#endif

/// `numbers` with this size; what they hold is not to be read.
template <typename T>
void SizeScratch(std::size_t size, std::vector<T>* numbers) {
  numbers->resize(size);
  if constexpr (kPoison) {
    std::fill(numbers->begin(), numbers->end(), T(std::numeric_limits<double>::signaling_NaN()));
  }
}

}  // namespace tangible
