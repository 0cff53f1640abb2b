// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/ranks.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gflags/gflags.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/ranks_messages.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

// Shards for each rank: a rank that is slow, or has long rows, keeps the others waiting for less.
constexpr int kShardsOfRank = 4;
// How long a rank that waits sleeps before it looks for messages again.
constexpr std::chrono::microseconds kNap(200);
// How the names of shards' files begin, which exist in memory only.
constexpr std::string_view kShardName = "rank-shard:";

enum Tag : int { kNextShard, kShardText, kReadFile, kReply, kEnd };

// What the program is run as at present.
struct RankPart {
  enum class Kind { kWhole, kShard, kMerge } kind = Kind::kWhole;
  long shard = 0;
  long of = 1;
  std::optional<std::string> text;  ///< of the shard's file, once it is written
};

RankPart& Part() {
  static RankPart part;
  return part;
}

std::string NameOfShard(long shard) { return std::string(kShardName) + std::to_string(shard); }

// Number of ranks that the launcher has started, as it says in the environment.
int RanksStarted() {
  const char* size = std::getenv("OMPI_COMM_WORLD_SIZE");  // Open MPI
  if (size == nullptr) size = std::getenv("PMI_SIZE");     // MPICH, Intel MPI
  // Within an allocation of Slurm a program is a rank only where srun has started it with PMI.
  if (size == nullptr && std::getenv("PMIX_RANK") != nullptr) size = std::getenv("SLURM_NTASKS");
  return size != nullptr ? std::atoi(size) : 1;
}

// The library that has MPI: beside the program, where it is built, or in the folder of libraries.
void* OpenLibrary(std::string* error) {
  std::error_code failed;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failed);
  const std::filesystem::path bin = program.parent_path();
  for (const std::filesystem::path& folder :
       {bin, bin.parent_path() / "lib" / "tangible", bin.parent_path() / "lib"}) {
    const std::filesystem::path file = folder / "libtangible_ranks.so";
    if (!std::filesystem::exists(file, failed)) continue;
    void* const library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL);
    if (library == nullptr) *error = ::dlerror();
    return library;
  }
  *error = "libtangible_ranks.so is not beside the program (cmake -DTANGIBLE_MPI=ON builds it)";
  return nullptr;
}

// Where errors are shown while shards are run.
volatile std::sig_atomic_t shown_errors = STDERR_FILENO;

// What is printed while shards are run would be printed again as they are put together.
class Silence {
 public:
  Silence() {
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    for (int i = 0; i < 2; ++i) {
      kept_[i] = ::dup(STDOUT_FILENO + i);
      if (nowhere >= 0) ::dup2(nowhere, STDOUT_FILENO + i);
    }
    if (nowhere >= 0) ::close(nowhere);
    shown_errors = kept_[1];
  }
  ~Silence() {
    shown_errors = STDERR_FILENO;
    std::fflush(nullptr);
    for (int i = 0; i < 2; ++i) {
      ::dup2(kept_[i], STDOUT_FILENO + i);
      ::close(kept_[i]);
    }
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  int kept_[2];
};

void SayThatARankDied(int) {
  constexpr char kText[] = "a rank of the run has ended before its work was done\n";
  static_cast<void>(!::write(shown_errors, kText, sizeof kText - 1));
  std::_Exit(kExitFailed);
}

class Ranks {
 public:
  Ranks(const RankMessages& messages, int (*body)(int, char**), int argc, char** argv)
      : messages_(messages), body_(body), argc_(argc), argv_(argv) {
    shards_ = static_cast<long>(kShardsOfRank) * messages.size;
  }

  // Rank 0: runs shards too, while it answers the others; then puts all together.
  int Lead() {
    std::signal(SIGTERM, SayThatARankDied);
    {
      const Silence silence;
      std::atomic<bool> done{false};
      std::thread worker([&] {
        RunShards(
            [this] { return NextShard(); },
            [this](long shard, std::optional<std::string> text) { Keep(shard, std::move(text)); });
        done = true;
      });
      int busy = messages_.size - 1;
      while (!done || busy > 0) {
        if (!Answer(&busy)) std::this_thread::sleep_for(kNap);
      }
      worker.join();
    }
    Part() = RankPart();
    if (!failed_) {
      Part().kind = RankPart::Kind::kMerge;
      Part().of = shards_;
      SetFileReader([this](const std::string& file, std::string* content) {
        return ReadShard(file, content);
      });
    }
    const int exit_status = Body();
    for (int rank = 1; rank < messages_.size; ++rank) messages_.send(rank, kEnd, nullptr, 0);
    return exit_status;
  }

  // The others: run shards until there are none, and wait for the end.
  int Follow() {
    SetFileReader([this](const std::string& file, std::string* content) {
      return AskForFile(file, content);
    });
    const Silence silence;
    RunShards(
        [this] {
          messages_.send(0, kNextShard, nullptr, 0);
          return std::stol(Await(kReply));
        },
        [this](long shard, const std::optional<std::string>& text) {
          const std::string message = std::to_string(shard) + (text ? "+" + *text : "-");
          messages_.send(0, kShardText, message.data(), message.size());
        });
    Await(kEnd);
    return kExitDone;
  }

 private:
  // Flags begin at their defaults each time.
  int Body() {
    const gflags::FlagSaver saver;
    return body_(argc_, argv_);
  }

  template <typename Next, typename Finished>
  void RunShards(const Next& next, const Finished& finished) {
    for (long shard = next(); shard >= 0; shard = next()) {
      Part() = RankPart();
      Part().kind = RankPart::Kind::kShard;
      Part().shard = shard;
      Part().of = shards_;
      try {
        Body();
      } catch (const std::exception&) {
        Part().text.reset();  // rank 0 meets it again, and says what it is
      }
      finished(shard, std::move(Part().text));
    }
  }

  // The next shard that nobody has taken; −1: none is left, or some shard cannot be run.
  long NextShard() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return failed_ || next_ == shards_ ? -1 : next_++;
  }

  void Keep(long shard, std::optional<std::string> text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failed_ = failed_ || !text;
    if (text) texts_[NameOfShard(shard)] = std::move(*text);
  }

  // Answers a message, if one has arrived.
  bool Answer(int* busy) {
    int from = 0, tag = 0;
    std::size_t size = 0;
    if (!messages_.has_arrived(&from, &tag, &size)) return false;
    std::string text(size, '\0');
    messages_.receive(from, tag, text.data(), size);
    std::string reply;
    if (tag == kNextShard) {
      const long shard = NextShard();
      *busy -= shard < 0 ? 1 : 0;
      reply = std::to_string(shard);
    } else if (tag == kReadFile) {
      std::string error, content;
      reply = ReadTextFile(text, &content, &error) ? "+" + content : "-" + error;
    } else {
      const std::size_t mark = text.find_first_of("+-");
      std::optional<std::string> file;
      if (text[mark] == '+') file = text.substr(mark + 1);
      Keep(std::stol(text.substr(0, mark)), std::move(file));
      return true;
    }
    messages_.send(from, kReply, reply.data(), reply.size());
    return true;
  }

  std::string Await(int expected) {
    int from = 0, tag = 0;
    std::size_t size = 0;
    while (!messages_.has_arrived(&from, &tag, &size)) std::this_thread::sleep_for(kNap);
    std::string text(size, '\0');
    messages_.receive(from, tag, text.data(), size);
    return tag == expected ? text : "-1";
  }

  // The files of shards are in memory; others are on the disk.
  std::optional<std::string> ReadShard(const std::string& file, std::string* content) {
    const auto found = texts_.find(file);
    if (found == texts_.end()) return std::nullopt;
    *content = std::move(found->second);
    return "";
  }

  std::optional<std::string> AskForFile(const std::string& file, std::string* content) {
    const std::lock_guard<std::mutex> lock(mutex_);
    messages_.send(0, kReadFile, file.data(), file.size());
    const std::string reply = Await(kReply);
    *content = reply.substr(1);
    return reply[0] == '+' ? "" : *content;
  }

  const RankMessages& messages_;
  int (*const body_)(int, char**);
  const int argc_;
  char** const argv_;
  long shards_ = 0;
  std::mutex mutex_;
  long next_ = 0;
  bool failed_ = false;
  std::map<std::string, std::string> texts_;  ///< of shards, by the names of their files
};

}  // namespace

bool IsOneOfRanks() { return RanksStarted() > 1; }

int RunOnRanks(int (*body)(int, char**), int argc, char** argv) {
  std::string error;
  void* const library = OpenLibrary(&error);
  if (library == nullptr) return ReportError("mpirun has started several ranks, but " + error);
  const auto open = reinterpret_cast<OpenRanks>(::dlsym(library, kOpenRanks));
  const RankMessages* const messages = open != nullptr ? open() : nullptr;
  if (messages == nullptr) return ReportError("MPI could not be started");
  if (messages->size == 1) {
    const int exit_status = body(argc, argv);
    messages->finish();
    return exit_status;
  }
  Ranks ranks(*messages, body, argc, argv);
  const int exit_status = messages->rank == 0 ? ranks.Lead() : ranks.Follow();
  SetFileReader(nullptr);
  std::signal(SIGTERM, SIG_DFL);
  messages->finish();
  return exit_status;
}

bool SetRankPart(const ProgramInfo& info) {
  const RankPart& part = Part();
  if (part.kind == RankPart::Kind::kWhole) return true;
  gflags::CommandLineFlagInfo flag;
  const auto is_default = [&](const char* name) {
    return gflags::GetCommandLineFlagInfo(name, &flag) && flag.current_value == flag.default_value;
  };
  // The whole run is made by rank 0 where nothing can be divided, or the user divides it.
  if (!is_default("shard") || !is_default("merge")) return false;
  if (is_default("threads")) gflags::SetCommandLineOption("threads", "1");
  if (part.kind == RankPart::Kind::kMerge) {
    std::string files;
    for (long k = 0; k < part.of; ++k) files += (k > 0 ? "," : "") + NameOfShard(k);
    gflags::SetCommandLineOption("merge", files.c_str());
    return true;
  }
  for (const std::string& name : info.outputs) {
    if (!is_default(name.c_str())) gflags::SetCommandLineOption(name.c_str(), "");
  }
  gflags::SetCommandLineOption("out", NameOfShard(part.shard).c_str());
  const std::string shard = std::to_string(part.shard) + "/" + std::to_string(part.of);
  gflags::SetCommandLineOption("shard", shard.c_str());
  return true;
}

bool TakeRankOutput(const std::string& path, std::string_view text) {
  if (path.rfind(kShardName, 0) != 0 || Part().kind != RankPart::Kind::kShard) return false;
  Part().text = text;
  return true;
}

}  // namespace tangible
