// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A program on the ranks of MPI, as mpirun starts them:
//
//   mpirun -n N PROGRAM ARGUMENTS     what PROGRAM ARGUMENTS alone writes, to the bit
//
// The rows of the run are divided into shards (shards.h), more than there are ranks; each rank asks
// rank 0 for the next one, runs it as PROGRAM --shard=I/M would and sends its file, and rank 0 puts
// all of them together as --merge does. Rank 0 alone reads and writes files: the others ask it for
// what they read. Each rank has one thread where --threads is not given. Of a run without rows some
// programs divide the work (ProgramInfo::runs_in_step): all ranks run it, and rank 0 alone writes.
// Another one is made by rank 0 alone. Ranks that wait sleep. Where a rank dies mpirun ends the
// others, and rank 0 says so in one line.

#include <string>
#include <string_view>
#include <vector>

namespace tangible {

struct ProgramInfo;

/// Whether mpirun has started the program beside others.
bool IsOneOfRanks();

/// Runs `body` over all ranks; returns the exit status of this one.
int RunOnRanks(int (*body)(int, char**), int argc, char** argv);

// What ParseCommandLine and files ask, while a shard is run or the shards are put together.

/// Sets the flags that make it run a shard, or put the shards together. False where it cannot run a
/// shard, which it then must not begin.
bool SetRankPart(const ProgramInfo& info, const std::vector<std::string>& positional);
/// Takes the text of a shard's file, or of any that another rank than 0 would write, which is
/// written nowhere; false where it is to be written.
bool TakeRankOutput(const std::string& path, std::string_view text);

}  // namespace tangible
