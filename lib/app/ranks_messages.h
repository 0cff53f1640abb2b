// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a program that mpirun has started needs of MPI: bytes from one rank to another. It is a
// shared library of its own (ranks_mpi.cc), which is opened by ranks.cc only in such a program, so
// that the others neither link MPI nor start it.

#include <cstddef>

namespace tangible {

/// One thread at a time calls these functions.
struct RankMessages {
  int rank = 0;
  int size = 1;
  /// Returns when the bytes may be changed.
  void (*send)(int to, int tag, const char* bytes, std::size_t size) = nullptr;
  /// Whether a message has arrived; from whom, and how long it is.
  bool (*has_arrived)(int* from, int* tag, std::size_t* size) = nullptr;
  void (*receive)(int from, int tag, char* bytes, std::size_t size) = nullptr;
  /// Waits for all ranks.
  void (*finish)() = nullptr;
};

/// The name of the function that starts MPI, of type OpenRanks; null where that fails.
inline constexpr char kOpenRanks[] = "TangibleOpenRanks";
using OpenRanks = const RankMessages* (*)();

}  // namespace tangible
