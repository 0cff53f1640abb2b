// SPDX-License-Identifier: Apache-2.0
#include <mpi.h>

#include <algorithm>
#include <cstdint>

#include "tangible/app/ranks_messages.h"

namespace tangible {
namespace {

// MPI counts bytes with an int.
constexpr std::size_t kMostBytes = std::size_t{1} << 30;
// Tags of the lengths that announce messages, and of their bytes.
constexpr int kLengths = 1000;
constexpr int kBytes = 2000;

void Send(int to, int tag, const char* bytes, std::size_t size) {
  const std::uint64_t length = size;
  MPI_Send(&length, 1, MPI_UINT64_T, to, kLengths + tag, MPI_COMM_WORLD);
  for (std::size_t at = 0; at < size; at += kMostBytes) {
    MPI_Send(bytes + at, static_cast<int>(std::min(kMostBytes, size - at)), MPI_BYTE, to,
             kBytes + tag, MPI_COMM_WORLD);
  }
}

bool HasArrived(int* from, int* tag, std::size_t* size) {
  // Bytes follow the length that announces them, and are received with it.
  int flag = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &flag, &status);
  if (flag == 0 || status.MPI_TAG >= kBytes) return false;
  std::uint64_t length = 0;
  MPI_Recv(&length, 1, MPI_UINT64_T, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD,
           MPI_STATUS_IGNORE);
  *from = status.MPI_SOURCE;
  *tag = status.MPI_TAG - kLengths;
  *size = static_cast<std::size_t>(length);
  return true;
}

void Receive(int from, int tag, char* bytes, std::size_t size) {
  for (std::size_t at = 0; at < size; at += kMostBytes) {
    MPI_Recv(bytes + at, static_cast<int>(std::min(kMostBytes, size - at)), MPI_BYTE, from,
             kBytes + tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  }
}

void Finish() { MPI_Finalize(); }

}  // namespace
}  // namespace tangible

extern "C" const tangible::RankMessages* TangibleOpenRanks() {
  int provided = 0;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided) != MPI_SUCCESS ||
      provided < MPI_THREAD_SERIALIZED) {
    return nullptr;
  }
  static tangible::RankMessages messages;
  MPI_Comm_rank(MPI_COMM_WORLD, &messages.rank);
  MPI_Comm_size(MPI_COMM_WORLD, &messages.size);
  messages.send = tangible::Send;
  messages.has_arrived = tangible::HasArrived;
  messages.receive = tangible::Receive;
  messages.finish = tangible::Finish;
  return &messages;
}
