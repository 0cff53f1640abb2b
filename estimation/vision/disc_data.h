// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Sequences of pictures of discs with their states, made from a seed, and as files.
//
// Billiards are defined here: the discs of BilliardWorld, all of which move, with states by event
// stepping. SimB follows the rules of RPIN's benchmark (HaozhiQi/RPIN, tools/gen_billiard.py, after
// Sutskever's bouncing balls). One disc moves at 2, 3, 4, 5 or 6 pixels a frame in one of 12
// directions, the others rest. Five substeps a frame move all discs, turn speeds inwards where a
// disc overlaps a wall, and exchange the normal speeds of two discs that overlap, at most once a
// frame and pair.
//
// A file is the line "tangible discs 1", a line of JSON (kind, seed, sizes, and the length and
// CRC-32 of what follows), and for each sequence its states as doubles and its pictures, each
// compressed (zlib) behind its length.

#include <cstdint>
#include <string>
#include <vector>

#include "tangible/estimation/vision/disc_world.h"

namespace tangible {

enum class DiscKind { kBilliards, kSimb };

/// "billiards", "simb".
const char* NameOf(DiscKind kind);
DiscWorld WorldOf(DiscKind kind);

struct DiscSequence {
  std::vector<double> states;         ///< (frames, n, 4)
  std::vector<std::string> pictures;  ///< compressed
};

struct DiscData {
  DiscKind kind = DiscKind::kBilliards;
  std::uint64_t seed = 0;
  int frames = 0;  ///< of each sequence
  DiscWorld world;
  std::vector<DiscSequence> sequences;

  int num_sequences() const { return static_cast<int>(sequences.size()); }
  /// The 4 n numbers of one frame.
  const double* State(int sequence, int frame) const {
    return sequences[sequence].states.data() + static_cast<size_t>(frame) * 4 * world.size();
  }
};

struct DiscDataOptions {
  DiscKind kind = DiscKind::kBilliards;
  int sequences = 100;
  int frames = 20;
  std::uint64_t seed = 0;
  int threads = 0;  ///< 0: one a core; the data have the same bits for any number
};

/// Each sequence has random numbers of its own, so that a shorter set is the beginning of a longer
/// one.
DiscData MakeDiscData(const DiscDataOptions& options);

/// Writes kPictureBytes at `pixels`; returns false if the compressed picture is damaged.
bool Decompress(const std::string& picture, unsigned char* pixels);

/// The file's bytes.
std::string SerializeDiscData(const DiscData& data);
/// Returns false, with one line, if `bytes` are not a complete file: damaged, cut off, or of
/// another kind.
bool ParseDiscData(const std::string& bytes, const std::string& name_for_messages, DiscData* data,
                   std::string* error);
bool LoadDiscData(const std::string& file, DiscData* data, std::string* error);

}  // namespace tangible
