// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Rows of one run on many machines that exchange nothing but files: an array of jobs.
//
//   PROGRAM ARGUMENTS --shard=I/N --out=FILE_I   rows k with k mod N = I, I = 0, ..., N − 1
//   PROGRAM ARGUMENTS --merge=FILE_0,FILE_1   what PROGRAM ARGUMENTS alone writes
//
// A shard's file is the program's usual output of its rows. With them it keeps the rows as they are
// in memory, from which --merge computes everything that summarises rows: in the order of all rows
// and from the same bits, so that its output is that of one run, byte for byte. Measured times are
// those of the shard that ran the row.
//
//   JSON   a last key "shard": the header below with "rows": [...]
//   CSV    a last line "# shard {...}" with the same
//
// The header says which rows of which run these are:
//
//   {"program", "version", "index": I, "of": N, "rows_in_all": number of rows of the run,
//    "flags": {name: value of each flag that is not at its default and may change a result},
//    "inputs": {name: hash of its content},
//    "hash": of the rows (and of the lines before "# shard")}
//
// The names of files may differ from shard to shard, their content may not. Exit statuses: 2 where
// a flag is not as it must be (--shard=2/2, both flags); 1 where files are not: a shard that is
// missing, given twice, of other flags or inputs, damaged.

#include <gflags/gflags.h>

#include <string>
#include <string_view>
#include <vector>

#include "tangible/scene/json_reader.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

/// Defines --shard and --merge, in the file of a main.
#define TANGIBLE_DEFINE_SHARD_FLAGS()                                                              \
  DEFINE_string(shard, "",                                                                         \
                "I/N: only the rows k with k mod N = I, I from 0, for an array of jobs");          \
  DEFINE_string(merge, "",                                                                         \
                "files that --shard wrote, separated by commas: writes what a run in one writes, " \
                "and runs nothing")

/// The rows k of a run with k mod count = index; by default all of them.
struct Shard {
  long index = 0;
  long count = 1;

  bool Has(long row) const { return row % count == index; }
  /// How many there are of `rows`.
  long NumRows(long rows) const { return rows <= index ? 0 : (rows - index - 1) / count + 1; }
  /// The number in the run of the shard's row i.
  long RowOf(long i) const { return index + i * count; }
};

/// What --shard and --merge ask for.
struct ShardPlan {
  enum class Part { kAll, kShard, kMerge };
  Part part = Part::kAll;
  Shard shard;
  std::vector<std::string> files;  ///< to merge

  bool IsShard() const { return part == Part::kShard; }
  bool IsMerge() const { return part == Part::kMerge; }
};

/// Reads the values of both flags. Returns what is wrong with them, or empty.
std::string ReadShardFlags(const std::string& shard, const std::string& merge, ShardPlan* plan);

/// The same of a program whose --out holds the rows, so that --shard needs it.
std::string ReadShardFlags(const std::string& shard, const std::string& merge,
                           const std::string& out, ShardPlan* plan);

/// Hashes the files that have been read up to now: the inputs, by which shards are told apart. To
/// be called after the last input has been read and before the work. Returns an error or empty.
std::string HashInputs();

/// The value of the key "shard": the header, and the rows of this shard in their order.
/// `text` is what stands before it in a file that is not JSON.
OrderedJson ShardJson(const Shard& shard, long rows_in_all, const std::vector<Json>& rows,
                      std::string_view text = "");

/// A table with the line "# shard {...}" behind it.
std::string WithShard(std::string text, const Shard& shard, long rows_in_all,
                      const std::vector<Json>& rows);

/// What the files of all shards hold.
struct MergedShards {
  std::vector<Json> rows;          ///< all, in the order of the run
  std::vector<std::string> texts;  ///< of each shard, I = 0, 1, ...: the lines before "# shard"
};

/// Reads the shards of a run of `rows_in_all` rows with the flags and inputs of this program.
/// Returns one line about the first thing that is wrong, or empty.
std::string MergeShards(const ShardPlan& plan, long rows_in_all, MergedShards* merged);

}  // namespace tangible
