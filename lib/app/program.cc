// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/program.h"

#include <fcntl.h>
#include <gflags/gflags.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <new>
#include <sstream>
#include <system_error>
#include <utility>

#include "tangible/app/ranks.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

using gflags::CommandLineFlagInfo;

std::string Help(const ProgramInfo& info) {
  std::ostringstream out;
  out << "usage: " << info.name << " " << info.synopsis << "\n\n"
      << info.description << "\n\nflags:\n";
  std::vector<CommandLineFlagInfo> flags;
  gflags::GetAllFlags(&flags);
  for (const CommandLineFlagInfo& flag : flags) {
    if (flag.filename != info.source_file) continue;
    const char* quote = flag.type == "string" ? "\"" : "";
    out << "  --" << flag.name << " (" << flag.type << ", default " << quote << flag.default_value
        << quote << "): " << flag.description << "\n";
  }
  out << (info.schema ? "  --schema prints the JSON Schema of the input\n" : "")
      << "  --help, --version\n\n"
      << "Exit status: 0 done, 1 the job could not be done, 2 wrong usage of flags.\n";
  return out.str();
}

CommandLine UsageError(const ProgramInfo& info, const std::string& what) {
  CommandLine line;
  line.exit_status =
      ReportError(info.name + ": " + what + " (see " + info.name + " --help)", kExitUsage);
  return line;
}

// A flag as typed, split at its "=".
struct FlagText {
  std::string name;
  std::optional<std::string> value;
};

FlagText SplitFlag(std::string_view argument) {
  argument.remove_prefix(argument.substr(0, 2) == "--" ? 2 : 1);
  const std::size_t equal = argument.find('=');
  if (equal == std::string_view::npos) return {std::string(argument), std::nullopt};
  return {std::string(argument.substr(0, equal)), std::string(argument.substr(equal + 1))};
}

// Finds a flag that the program itself defines; flags of libraries could read files and change exit
// statuses.
bool FindFlag(const ProgramInfo& info, const std::string& name, CommandLineFlagInfo* flag) {
  return gflags::GetCommandLineFlagInfo(name.c_str(), flag) && flag->filename == info.source_file;
}

// Completes a flag without "=": a switch (--x, --nox), or a value in the next argument. Returns an
// error or empty; `index` advances over a consumed value.
std::string CompleteFlag(int argc, char** argv, const ProgramInfo& info, FlagText& flag,
                         int& index) {
  CommandLineFlagInfo known;
  if (!FindFlag(info, flag.name, &known)) {
    const bool negated = flag.name.rfind("no", 0) == 0 && !flag.value &&
                         FindFlag(info, flag.name.substr(2), &known) && known.type == "bool";
    if (!negated) return "unknown flag --" + flag.name;
    flag = {flag.name.substr(2), "false"};
  }
  if (flag.value) return "";
  if (known.type == "bool") {
    flag.value = "true";
  } else if (index + 1 < argc) {
    flag.value = argv[++index];
  } else {
    return "flag --" + flag.name + " needs a value";
  }
  return "";
}

// What ParseCommandLine was called with.
ProgramInfo& Parsed() {
  static ProgramInfo info;
  return info;
}

// A file that the command line names, and the argument that names it.
struct NamedFile {
  std::string word;
  std::string path;
};

// The file to which links lead, which may not exist yet: it has to be replaced, not the link.
std::filesystem::path FollowLinks(std::filesystem::path path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  for (int k = 0; k < kMostLinks && std::filesystem::is_symlink(path, error); ++k) {
    const std::filesystem::path next = std::filesystem::read_symlink(path, error);
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path;
}

// An error, or empty where no output is another output or an input.
std::string SharedFile(const ProgramInfo& info, const std::vector<std::string>& positional) {
  std::vector<NamedFile> files;
  files.reserve(positional.size());
  for (const std::string& path : positional) {
    files.push_back({"the input", path});
  }
  const auto add = [&](const std::string& name) {
    std::string value;
    if (gflags::GetCommandLineOption(name.c_str(), &value) && !value.empty()) {
      files.push_back({"--" + name, value});
    }
  };
  for (const std::string& name : info.inputs) {
    add(name);
  }
  const std::size_t num_inputs = files.size();
  for (const std::string& name : info.outputs) {
    add(name);
  }
  for (std::size_t i = num_inputs; i < files.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (IsSameFile(files[i].path, files[k].path)) {
        return files[i].word + ": expected a file of its own, got that of " + files[k].word + ", " +
               files[i].path;
      }
    }
  }
  return "";
}

bool IsFlag(const char* argument) { return argument[0] == '-' && argument[1] != '\0'; }

std::string Unwritable(const std::string& path, const std::string& reason) {
  return OneLine(path + ": cannot be written: " + reason);
}

std::string WriteDirectly(const std::string& path, std::string_view text) {
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (file) return "";
  return errno != 0 ? std::strerror(errno) : "write failed";
}

// A pipe without a reader and a file above the allowed size would end the program between two
// outputs; as errors of the write they are reported, and the other outputs are written.
void TakeFaultsAsErrors() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  // Where stdin, stdout or stderr is closed, the next opened file would take its number, and output
  // for the one would end in the other. The number is therefore taken by a descriptor that can only
  // fail.
  for (int number = STDIN_FILENO; number <= STDERR_FILENO; ++number) {
    if (::fcntl(number, F_GETFD) == -1 && errno == EBADF) {
      static_cast<void>(::open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY));
    }
  }
}

// The program's name without its folder, whose name may be anything.
const char* ProgramName(char** argv) {
  if (argv == nullptr || argv[0] == nullptr) return "tangible";
  const char* const slash = std::strrchr(argv[0], '/');
  return slash == nullptr ? argv[0] : slash + 1;
}

// An error where output to stdout was lost, or empty.
std::string LostOutput() {
  errno = 0;
  const bool flushed = std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  return flushed ? "" : Unwritable("stdout", errno != 0 ? std::strerror(errno) : "write failed");
}

// The reason why a file cannot be written, which is checked before the work whose result it will
// hold; or empty.
std::string WhyUnwritable(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::is_directory(path, error)) return Unwritable(path, "it is a directory");
  if (fs::exists(path, error)) return "";
  const fs::path folder = fs::absolute(path, error).parent_path();
  if (fs::is_directory(folder, error)) return "";
  return Unwritable(path, std::strerror(fs::exists(folder, error) && !error ? ENOTDIR : ENOENT));
}

// A file's new content, written beside its place until it is put there; the content for a device or
// a pipe is kept until then.
class PendingFile {
 public:
  explicit PendingFile(std::string path) : path_(std::move(path)) {}
  PendingFile(PendingFile&& other) noexcept
      : path_(std::move(other.path_)),
        target_(std::move(other.target_)),
        temporary_(std::exchange(other.temporary_, {})),
        direct_text_(other.direct_text_),
        is_taken_(other.is_taken_) {}
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;
  ~PendingFile() {
    std::error_code error;
    if (!temporary_.empty()) std::filesystem::remove(temporary_, error);
  }

  // `text` has to live until Commit. Both return an error (one line) or empty.
  std::string Prepare(std::string_view text, Over over);
  std::string Commit();
  bool is_direct() const { return direct_text_.has_value(); }

 private:
  std::string path_;
  std::filesystem::path target_;
  std::string temporary_;
  std::optional<std::string_view> direct_text_;
  bool is_taken_ = false;  ///< it is kept in memory
};

std::string PendingFile::Prepare(std::string_view text, Over over) {
  namespace fs = std::filesystem;
  is_taken_ = TakeRankOutput(path_, text);
  if (is_taken_) return "";
  if (over == Over::kNoInput) {
    for (const std::string& input : FilesRead()) {
      if (IsSameFile(path_, input)) return Unwritable(path_, "it was read as an input");
    }
  }
  std::error_code error;
  const fs::file_status status = fs::status(path_, error);
  if (fs::is_directory(status)) return Unwritable(path_, "it is a directory");
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    direct_text_ = text;
    return "";
  }
  target_ = FollowLinks(path_);
  if (fs::is_symlink(target_, error)) return Unwritable(path_, "its links lead round");
  temporary_ = target_.string() + ".tmp" + std::to_string(::getpid());
  const std::string reason = WriteDirectly(temporary_, text);
  if (!reason.empty()) return Unwritable(path_, reason);
  // A file that is replaced keeps its permissions.
  if (fs::exists(status)) fs::permissions(temporary_, status.permissions(), error);
  return "";
}

std::string PendingFile::Commit() {
  if (is_taken_) return "";
  if (direct_text_) {
    const std::string reason = WriteDirectly(path_, *direct_text_);
    return reason.empty() ? "" : Unwritable(path_, reason);
  }
  std::error_code error;
  std::filesystem::rename(temporary_, target_, error);
  if (error) return Unwritable(path_, error.message());
  temporary_.clear();
  return "";
}

}  // namespace

const ProgramInfo& ParsedProgram() { return Parsed(); }

CommandLine ParseCommandLine(int argc, char** argv, const ProgramInfo& info) {
  Parsed() = info;
  CommandLine line;
  bool only_positional = false;
  for (int i = 1; i < argc; ++i) {
    if (only_positional || !IsFlag(argv[i])) {
      line.positional.emplace_back(argv[i]);
      continue;
    }
    FlagText flag = SplitFlag(argv[i]);
    if (std::strcmp(argv[i], "--") == 0) {
      only_positional = true;
    } else if (flag.name == "help" || flag.name == "h") {
      std::cout << Help(info);
      line.exit_status = kExitDone;
      return line;
    } else if (flag.name == "version") {
      std::cout << info.name << " " << info.version << "\n";
      line.exit_status = kExitDone;
      return line;
    } else if (flag.name == "schema" && info.schema) {
      std::cout << info.schema();
      line.exit_status = kExitDone;
      return line;
    } else {
      const std::string error = CompleteFlag(argc, argv, info, flag, i);
      if (!error.empty()) return UsageError(info, error);
      if (gflags::SetCommandLineOption(flag.name.c_str(), flag.value->c_str()).empty()) {
        CommandLineFlagInfo known;
        gflags::GetCommandLineFlagInfo(flag.name.c_str(), &known);
        return UsageError(
            info, "--" + flag.name + ": expected " + known.type + ", got '" + *flag.value + "'");
      }
    }
  }
  const int given = static_cast<int>(line.positional.size());
  const int most = std::max(info.num_positional, info.most_positional);
  if (given < info.num_positional || given > most) {
    return UsageError(info, "expected " + std::to_string(info.num_positional) +
                                (most > info.num_positional ? " to " + std::to_string(most) : "") +
                                " argument(s), got " + std::to_string(line.positional.size()));
  }
  const std::string shared = SharedFile(info, line.positional);
  if (!shared.empty()) return UsageError(info, shared);
  for (const std::string& name : info.outputs) {
    std::string path;
    if (!gflags::GetCommandLineOption(name.c_str(), &path) || path.empty()) continue;
    const std::string unwritable = WhyUnwritable(path);
    if (!unwritable.empty()) {
      line.exit_status = ReportError(unwritable);
      return line;
    }
  }
  if (!SetRankPart(info, line.positional)) line.exit_status = kExitFailed;
  return line;
}

int RunMain(int (*body)(int, char**), int argc, char** argv) noexcept {
  try {
    TakeFaultsAsErrors();
    const int exit_status = IsOneOfRanks() ? RunOnRanks(body, argc, argv) : body(argc, argv);
    const std::string lost = LostOutput();
    return exit_status == kExitDone && !lost.empty() ? ReportError(lost) : exit_status;
  } catch (const std::bad_alloc&) {
    // The memory of the work has been released, so that there is room for a message again; but
    // nothing here relies on it.
    std::fprintf(stderr, "%s: not enough memory for this job\n", ProgramName(argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: unexpected error: %s\n", ProgramName(argv), error.what());
  } catch (...) {
    std::fprintf(stderr, "%s: unexpected error\n", ProgramName(argv));
  }
  return kExitFailed;
}

int ReportError(std::string_view message, int exit_status) {
  std::cerr << OneLine(message) << "\n";
  return exit_status;
}

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::vector<int> WholeNumbersAtCommas(const std::string& text, int least, int most) {
  std::vector<int> numbers;
  for (const std::string& part : SplitAtCommas(text)) {
    const char* const end = part.data() + part.size();
    int number = 0;
    const std::from_chars_result read = std::from_chars(part.data(), end, number);
    if (read.ec != std::errc() || read.ptr != end || number < least || number > most) {
      return {};
    }
    numbers.push_back(number);
  }
  return numbers;
}

std::string FirstOutside(std::initializer_list<FlagRange> flags) {
  for (const FlagRange& flag : flags) {
    if (std::isfinite(flag.value) && flag.value >= flag.least && flag.value <= flag.most) continue;
    std::array<char, 80> expected{};
    std::snprintf(expected.data(), expected.size(),
                  std::isfinite(flag.most) ? "from %.15g to %.15g" : ">= %.15g", flag.least,
                  flag.most);
    return std::string(flag.flag) + ": expected a number " + expected.data() + ", got " +
           FormatNumber(flag.value);
  }
  return "";
}

bool PrintBound(bool holds, const std::string& what) {
  std::printf("%s: %s\n", what.c_str(), holds ? "holds" : "DOES NOT HOLD");
  std::fflush(stdout);
  return holds;
}

void AppendNumber(double value, std::string* text) {
  // The digits of "%.17g", in a third of printf's time.
  std::array<char, 32> digits{};
  const std::to_chars_result end = std::to_chars(digits.data(), digits.data() + digits.size(),
                                                 value, std::chars_format::general, 17);
  text->append(digits.data(), end.ptr);
}

std::string FormatNumber(double value) {
  std::string text;
  AppendNumber(value, &text);
  return text;
}

bool IsSameFile(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(a, error);
  if (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status)) {
    return false;  // a device or a pipe may be written to twice
  }
  if (fs::equivalent(a, b, error) && !error) return true;
  std::error_code error_a;
  std::error_code error_b;
  const fs::path canonical_a = fs::weakly_canonical(FollowLinks(fs::absolute(a, error)), error_a);
  const fs::path canonical_b = fs::weakly_canonical(FollowLinks(fs::absolute(b, error)), error_b);
  return !error_a && !error_b && canonical_a == canonical_b;
}

std::string OutputOverInput() {
  const std::vector<std::string> inputs = FilesRead();
  for (const std::string& flag : Parsed().outputs) {
    std::string path;
    if (!gflags::GetCommandLineOption(flag.c_str(), &path) || path.empty()) continue;
    for (const std::string& input : inputs) {
      if (IsSameFile(path, input)) {
        std::string message = Parsed().name;
        message += ": --";
        message += flag;
        message += ": expected a file of its own, got that of an input, ";
        message += path;
        return message;
      }
    }
  }
  return "";
}

std::string WriteFileAtomically(const std::string& path, std::string_view text, Over over) {
  PendingFile file(path);
  const std::string error = file.Prepare(text, over);
  return error.empty() ? file.Commit() : error;
}

std::string WriteResult(const std::string& out_path, std::string_view text) {
  if (!out_path.empty()) return WriteFileAtomically(out_path, text);
  std::cout << text;
  return LostOutput();
}

std::string WriteAllOrNone(const std::vector<OutputFile>& files) {
  std::vector<PendingFile> pending;
  pending.reserve(files.size());
  for (const OutputFile& file : files) {
    if (file.path.empty()) continue;
    std::string error = pending.emplace_back(file.path).Prepare(file.text, Over::kNoInput);
    if (!error.empty()) return error;
  }
  for (const OutputFile& file : files) {
    std::string error = file.path.empty() ? WriteResult("", file.text) : "";
    if (!error.empty()) return error;
  }
  // What cannot be taken back comes first.
  for (const bool direct : {true, false}) {
    for (PendingFile& file : pending) {
      std::string error = file.is_direct() == direct ? file.Commit() : "";
      if (!error.empty()) return error;
    }
  }
  return "";
}

}  // namespace tangible
