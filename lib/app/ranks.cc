// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/ranks.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gflags/gflags.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
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
#include "tangible/math/shared_work.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

// Shards for each rank: a rank that is slow, or has long rows, keeps the others waiting for less.
constexpr int kShardsOfRank = 4;
// How long a rank that waits sleeps before it looks for messages again. A question and its answer
// take two of these.
constexpr std::chrono::microseconds kNap(100);
// How the names of shards' files begin, which exist in memory only.
constexpr std::string_view kShardName = "rank-shard:";

enum Tag : int {
  kNextShard,
  kShardText,
  kReadFile,
  kReply,
  kRunTogether,  // rank 0 has found that there are no rows, but work to divide
  kExchange,     // what a rank has done of it, or of all ranks
  kFinished,     // another rank has run the program to its end
  kEnd
};

// What the program is run as at present.
struct RankPart {
  enum class Kind { kWhole, kShard, kMerge, kTogether } kind = Kind::kWhole;
  bool writes = true;  ///< rank 0 alone does, of a run together
  long shard = 0;
  long of = 1;
  std::optional<std::string> text;  ///< of the shard's file, once it is written
};

RankPart& Part() {
  static RankPart part;
  return part;
}

// Whether the program, as it was last called, can be run together.
bool& RunsInStep() {
  static bool runs = false;
  return runs;
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

// Rank 0 has ended the run while this rank waited for the others.
class EndOfRun : public std::exception {};

// Each text behind its length.
std::string Joined(const std::vector<std::string>& texts) {
  std::string joined;
  for (const std::string& text : texts) joined += std::to_string(text.size()) + ":" + text;
  return joined;
}
std::vector<std::string> Divided(const std::string& joined) {
  std::vector<std::string> texts;
  for (std::size_t at = 0; at < joined.size();) {
    const std::size_t colon = joined.find(':', at);
    const std::size_t size = std::stoul(joined.substr(at, colon - at));
    texts.push_back(joined.substr(colon + 1, size));
    at = colon + 1 + size;
  }
  return texts;
}

class Ranks : public SharedWork {
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
    if (failed_ && RunsInStep()) return LeadTogether();
    if (!failed_) {
      Part().kind = RankPart::Kind::kMerge;
      Part().of = shards_;
      SetFileReader([this](const std::string& file, std::string* content) {
        return ReadShard(file, content);
      });
    }
    const int exit_status = Body();
    SendToOthers(kEnd, "");
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
          const std::optional<std::string> shard = Await(kReply);
          return shard ? std::stol(*shard) : -1L;
        },
        [this](long shard, const std::optional<std::string>& text) {
          const std::string message = std::to_string(shard) + (text ? "+" + *text : "-");
          messages_.send(0, kShardText, message.data(), message.size());
        });
    if (!Await(kRunTogether)) return kExitDone;
    Part() = RankPart();
    Part().kind = RankPart::Kind::kTogether;
    Part().writes = false;
    try {
      RunTogether();
    } catch (const std::exception&) {
      // Rank 0 has ended the run, or meets the same, and says what it is.
    }
    if (!ended_) messages_.send(0, kFinished, nullptr, 0);
    Await(kEnd);
    return kExitDone;
  }

  int rank() const override { return messages_.rank; }
  int size() const override { return messages_.size; }

  std::vector<std::string> Exchange(const std::string& own) override {
    if (messages_.rank == 0) return ExchangeOfLeader(own);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!ended_) messages_.send(0, kExchange, own.data(), own.size());
    const std::optional<std::string> all = Await(kExchange);
    if (!all) throw EndOfRun();
    return Divided(*all);
  }

 private:
  int RunTogether() {
    const SharedWork::Scope scope(this);
    return Body();
  }

  void SendToOthers(int tag, const std::string& text) {
    for (int rank = 1; rank < messages_.size; ++rank) {
      messages_.send(rank, tag, text.data(), text.size());
    }
  }

  // Rank 0 runs the program in a thread of its own, while it answers the others.
  int LeadTogether() {
    Part().kind = RankPart::Kind::kTogether;
    SendToOthers(kRunTogether, "");
    sent_.assign(static_cast<std::size_t>(messages_.size), std::nullopt);
    int exit_status = kExitFailed;
    std::exception_ptr failure;
    std::atomic<bool> done{false};
    std::thread worker([&] {
      try {
        exit_status = RunTogether();
      } catch (...) {
        failure = std::current_exception();
      }
      done = true;
    });
    int unused = 0;
    while (!done) {
      const bool answered = Answer(&unused);
      if (!Distribute() && !answered) std::this_thread::sleep_for(kNap);
    }
    worker.join();
    SendToOthers(kEnd, "");
    if (failure) std::rethrow_exception(failure);
    return exit_status;
  }

  std::vector<std::string> ExchangeOfLeader(const std::string& own) {
    std::unique_lock<std::mutex> lock(mutex_);
    sent_[0] = own;
    distributed_.wait(lock, [this] { return !all_.empty(); });
    return std::exchange(all_, {});
  }

  // Sends all of them what each has sent, once the last one has.
  bool Distribute() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (finished_ && sent_[0]) SayThatARankDied(0);
    for (const std::optional<std::string>& one : sent_) {
      if (!one) return false;
    }
    for (std::optional<std::string>& one : sent_) {
      all_.push_back(std::move(*one));
      one.reset();
    }
    SendToOthers(kExchange, Joined(all_));
    distributed_.notify_one();
    return true;
  }

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
    } else if (tag == kExchange) {
      const std::lock_guard<std::mutex> lock(mutex_);
      sent_[static_cast<std::size_t>(from)] = std::move(text);
      return true;
    } else if (tag == kFinished) {
      const std::lock_guard<std::mutex> lock(mutex_);
      finished_ = true;
      return true;
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

  // The text of the next message; none where it has another tag, as rank 0 has ended the run, which
  // it says once.
  std::optional<std::string> Await(int expected) {
    if (ended_) return std::nullopt;
    int from = 0, tag = 0;
    std::size_t size = 0;
    while (!messages_.has_arrived(&from, &tag, &size)) std::this_thread::sleep_for(kNap);
    std::string text(size, '\0');
    messages_.receive(from, tag, text.data(), size);
    ended_ = tag == kEnd;
    if (tag != expected) return std::nullopt;
    return text;
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
    if (const auto known = asked_.find(file); known != asked_.end()) {
      *content = known->second;
      return "";
    }
    if (!ended_) messages_.send(0, kReadFile, file.data(), file.size());
    const std::string reply = Await(kReply).value_or("-the run has ended");
    *content = reply.substr(1);
    if (reply[0] != '+') return *content;
    asked_[file] = *content;
    return "";
  }

  const RankMessages& messages_;
  int (*const body_)(int, char**);
  const int argc_;
  char** const argv_;
  long shards_ = 0;
  std::mutex mutex_;
  long next_ = 0;
  bool failed_ = false;
  bool ended_ = false;  ///< rank 0 has said so
  /// Files that this rank has read: it reads them again for each shard, and the run together.
  std::map<std::string, std::string> asked_;
  std::map<std::string, std::string> texts_;  ///< of shards, by the names of their files
  // Of a run together, on rank 0.
  std::vector<std::optional<std::string>> sent_;  ///< by rank
  std::vector<std::string> all_;                  ///< not yet taken by this rank's program
  std::condition_variable distributed_;
  bool finished_ = false;  ///< some other rank has come to its end
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

bool SetRankPart(const ProgramInfo& info, const std::vector<std::string>& positional) {
  const RankPart& part = Part();
  if (part.kind == RankPart::Kind::kWhole) return true;
  gflags::CommandLineFlagInfo flag;
  const auto is_default = [&](const char* name) {
    return gflags::GetCommandLineFlagInfo(name, &flag) && flag.current_value == flag.default_value;
  };
  const bool divides_itself = !is_default("shard") || !is_default("merge");
  RunsInStep() = info.runs_in_step && !divides_itself;
  if (part.kind == RankPart::Kind::kTogether) {
    if (is_default("threads")) gflags::SetCommandLineOption("threads", "1");
    return true;
  }
  // The whole run is made by rank 0 where nothing can be divided, or the user divides it.
  if (divides_itself) return false;
  if (part.kind == RankPart::Kind::kShard && RunsInStep() && info.may_have_rows &&
      !info.may_have_rows(positional)) {
    return false;
  }
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
  if (!Part().writes) return true;
  if (path.rfind(kShardName, 0) != 0 || Part().kind != RankPart::Kind::kShard) return false;
  Part().text = text;
  return true;
}

}  // namespace tangible
