// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/child.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <new>

namespace tangible::cost {
namespace {

// Exit statuses of the child.
constexpr int kChildDone = 0;
constexpr int kChildFailed = 3;
constexpr int kChildOutOfMemory = 4;

// The sanitizers map far more memory than they use; a limit on the address space would end them at
// once.
#if defined(__SANITIZE_ADDRESS__)
constexpr bool kLimitsAddressSpace = false;
#else
constexpr bool kLimitsAddressSpace = true;
#endif

void SetTimer(int which, double seconds) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - std::floor(seconds)));
  setitimer(which, &timer, nullptr);
}

// Address space of this process, bytes.
size_t AddressSpace() {
  size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

void SetLimits(const Budget& budget) {
  if (kLimitsAddressSpace) {
    const rlim_t bytes = AddressSpace() + budget.bytes;
    const rlimit limit{bytes, bytes};
    setrlimit(RLIMIT_AS, &limit);
  }
  const rlimit nothing{0, 0};
  setrlimit(RLIMIT_CORE, &nothing);
  // Data that do not fit into memory may not be written to files either: this ends the child,
  // however the program handles the signal.
  signal(SIGXFSZ, SIG_DFL);
  setrlimit(RLIMIT_FSIZE, &nothing);
  SetTimer(ITIMER_PROF, budget.seconds);
  SetTimer(ITIMER_REAL, 10.0 * budget.seconds);
}

void WriteAll(int file, const void* data, size_t size) {
  const char* from = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(file, from, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    from += written;
    size -= static_cast<size_t>(written);
  }
}

std::string ReadAll(int file) {
  std::string text;
  char buffer[65536];
  for (;;) {
    const ssize_t count = read(file, buffer, sizeof(buffer));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(buffer, static_cast<size_t>(count));
  }
}

using Work = std::function<std::vector<double>(const ChildLimits&, std::string*)>;
using TextWork = std::function<std::string(const ChildLimits&, std::string*)>;

int RunWork(const Budget& budget, const TextWork& work, int out) {
  SetLimits(budget);
  std::string error;
  std::string result;
  try {
    result = work(ChildLimits(), &error);
  } catch (const std::bad_alloc&) {
    return kChildOutOfMemory;
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  if (!error.empty()) {
    WriteAll(out, error.data(), error.size());
    return kChildFailed;
  }
  WriteAll(out, result.data(), result.size());
  return kChildDone;
}

// A temporary folder that is removed with its content; empty if it could not be made.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code error;
    std::string pattern =
        (std::filesystem::temp_directory_path(error) / "tangible-XXXXXX").string();
    if (!error && mkdtemp(pattern.data()) != nullptr) {
      path_ = pattern;
    }
  }
  ~TemporaryFolder() {
    std::error_code error;
    if (!path_.empty()) {
      std::filesystem::remove_all(path_, error);
    }
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

ChildOutcome Describe(int status, const rusage& usage, const std::string& text,
                      const Budget& budget) {
  ChildOutcome outcome;
  outcome.peak_bytes = static_cast<size_t>(usage.ru_maxrss) * 1024;
  for (const timeval& time : {usage.ru_utime, usage.ru_stime}) {
    outcome.cpu_seconds +=
        static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGPROF || signal == SIGALRM) {
      outcome.status = ChildStatus::kOverSeconds;
    } else if (signal == SIGKILL || signal == SIGXFSZ) {
      outcome.status = ChildStatus::kOverBytes;  // the system's own limit; a file instead of memory
    } else {
      outcome.message = "ended by signal " + std::to_string(signal);
    }
    return outcome;
  }
  const int code = WEXITSTATUS(status);
  if (code == kChildOutOfMemory || outcome.peak_bytes > budget.bytes) {
    outcome.status = ChildStatus::kOverBytes;
  } else if (code == kChildFailed) {
    outcome.message = text;
  } else if (code != kChildDone) {
    outcome.message = "ended with exit status " + std::to_string(code);
  } else {
    outcome.status = ChildStatus::kDone;
    outcome.text = text;
  }
  return outcome;
}

}  // namespace

void ChildLimits::LiftSeconds() const {
  SetTimer(ITIMER_PROF, 0.0);
  SetTimer(ITIMER_REAL, 0.0);
}

struct TextChild::State {
  Budget budget;
  TemporaryFolder folder;
  pid_t process = -1;
  int end = -1;         // of the pipe, for reading
  std::string message;  // why there is no process
};

TextChild::TextChild(const Budget& budget, const TextWork& work)
    : state_(std::make_unique<State>()) {
  state_->budget = budget;
  int ends[2];
  std::fflush(nullptr);
  if (pipe2(ends, O_CLOEXEC) != 0) {
    state_->message = std::string("no pipe: ") + std::strerror(errno);
    return;
  }
  state_->process = fork();
  if (state_->process == 0) {
    close(ends[0]);
    // A tape opens files in the current folder.
    if (chdir(state_->folder.path().c_str()) != 0) {
      _exit(kChildFailed);
    }
    _exit(RunWork(budget, work, ends[1]));
  }
  close(ends[1]);
  state_->end = ends[0];
  if (state_->process < 0) {
    state_->message = std::string("no process: ") + std::strerror(errno);
  }
}

TextChild::TextChild(TextChild&&) noexcept = default;

TextChild::~TextChild() {
  if (state_ != nullptr && state_->end >= 0) {
    Wait();
  }
}

ChildOutcome TextChild::Wait() {
  ChildOutcome outcome;
  std::string text;
  if (state_->end >= 0) {
    text = ReadAll(state_->end);
    close(state_->end);
    state_->end = -1;
  }
  if (!state_->message.empty()) {
    outcome.message = state_->message;
    return outcome;
  }
  int status = 0;
  rusage usage{};
  while (wait4(state_->process, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  return Describe(status, usage, text, state_->budget);
}

ChildOutcome RunInChild(const Budget& budget, const Work& work) {
  ChildOutcome outcome = TextChild(budget, [&work](const ChildLimits& limits, std::string* error) {
                           const std::vector<double> values = work(limits, error);
                           std::string bytes(values.size() * sizeof(double), '\0');
                           if (!values.empty())
                             std::memcpy(bytes.data(), values.data(), bytes.size());
                           return bytes;
                         }).Wait();
  outcome.values.resize(outcome.text.size() / sizeof(double));
  if (!outcome.values.empty()) {
    std::memcpy(outcome.values.data(), outcome.text.data(), outcome.values.size() * sizeof(double));
  }
  outcome.text.clear();
  return outcome;
}

}  // namespace tangible::cost
