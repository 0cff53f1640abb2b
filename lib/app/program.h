// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Functions that all programs share: the command line, one-line errors, atomic output. The scene
// module reads and writes JSON (json_reader.h, json_writer.h).
//
// Exit statuses: 0 done; 1 the job could not be done (bad input, an unsolved problem); 2 wrong
// usage of flags. gflags itself exits 1 on an unknown flag, a malformed value and --help, so
// arguments are checked here and handed to gflags one by one.
//
// A main reads
//
//   int Main(int argc, char** argv) {
//     const CommandLine line =
//         ParseCommandLine(argc, argv, {.name = ..., .source_file = __FILE__});
//     if (line.exit_status) return *line.exit_status;
//     ...
//   }
//   int main(int argc, char** argv) { return tangible::RunMain(&Main, argc, argv); }

#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tangible {

inline constexpr int kExitDone = 0;
inline constexpr int kExitFailed = 1;
inline constexpr int kExitUsage = 2;

struct ProgramInfo {
  std::string name;         ///< as typed: "tangible-lcp"
  std::string synopsis;     ///< the arguments: "PROBLEM.json [--out=S.json]"
  std::string description;  ///< what the program does, one paragraph
  std::string version;      ///< "0.1.0"
  std::string source_file;  ///< __FILE__ of the main: its flags are the ones that --help lists
  int num_positional = 1;   ///< number of arguments that are not flags
  int most_positional = 0;  ///< if more are allowed: at most this many
  /// Flags whose values are files that the program writes, and reads. No file is written twice, or
  /// over an input; a missing folder is reported before the work begins.
  std::vector<std::string> outputs = {"out"};
  std::vector<std::string> inputs{};
  /// Flags that change no bit of the results.
  std::vector<std::string> without_effect = {"threads"};
  /// Whether ranks of MPI that have no rows to divide run the program together, each with the same
  /// flags and files: it then divides its work by math/shared_work.h, and decides nothing by time.
  bool runs_in_step = false;
  /// Of such a program: whether there may be rows to divide, by a look at its arguments that costs
  /// little; none: there may.
  std::function<bool(const std::vector<std::string>& positional)> may_have_rows{};
  /// The JSON Schema of the program's input, which --schema prints; none if empty.
  std::function<std::string()> schema{};
};

struct CommandLine {
  std::vector<std::string> positional;
  /// Set when the program has nothing more to do (--help, --version, wrong usage); return it.
  std::optional<int> exit_status;
};

/// Checks the arguments and sets the gflags they name: those of the main's own file. The flags that
/// gflags and glog define (--flagfile, --fromenv, --v) are not accepted; glog takes its settings
/// from the environment (GLOG_v, GLOG_logtostderr). Prints help or the version on stdout, or one
/// line about what is wrong on stderr.
CommandLine ParseCommandLine(int argc, char** argv, const ProgramInfo& info);

/// What ParseCommandLine was called with.
const ProgramInfo& ParsedProgram();

/// Runs `body`. If memory runs out, an unexpected exception is thrown, or output does not reach
/// stdout (closed, a full disk, a pipe without a reader), it prints one line on stderr and returns
/// status 1.
int RunMain(int (*body)(int, char**), int argc, char** argv) noexcept;

/// Prints `message` as exactly one line on stderr and returns `exit_status`.
int ReportError(std::string_view message, int exit_status = kExitFailed);

/// The values of a flag that takes several: "a,b" is {"a", "b"}, "" one empty value.
std::vector<std::string> SplitAtCommas(const std::string& text);
/// The same for whole numbers from `least` to `most`; empty where a value is none.
std::vector<int> WholeNumbersAtCommas(const std::string& text, int least, int most);

/// A flag "--name" with its value and the range that it may have.
struct FlagRange {
  template <typename Number>
  FlagRange(const char* flag_, Number value_, double least_,
            double most_ = std::numeric_limits<double>::infinity())
      : flag(flag_), value(static_cast<double>(value_)), least(least_), most(most_) {}
  const char* flag;
  double value, least, most;
};
/// The first of several flags whose value is not finite or outside its range, as one line:
/// "--games: expected a number from 1 to 100, got 0", or "... a number >= 1, got 0"; empty if none
/// is.
std::string FirstOutside(std::initializer_list<FlagRange> flags);
/// The most threads that a program starts.
inline constexpr int kMostThreads = 256;

/// Prints "what: holds" or "what: DOES NOT HOLD" on stdout at once; returns `holds`.
bool PrintBound(bool holds, const std::string& what);

/// A number with 17 significant digits, so that reading it gives the same double.
std::string FormatNumber(double value);
/// Appends the same to a text.
void AppendNumber(double value, std::string* text);

/// Files that a write may replace: any file except one that was read as an input (json_reader.h),
/// or also an input that the program itself wrote in order to continue.
enum class Over { kNoInput, kOwnInput };

/// Writes a file so that it is either the old or the whole new one: a temporary in the same folder,
/// then a rename. Devices and pipes are written directly. A program that is killed meanwhile may
/// leave the temporary, PATH.tmp followed by its process number. Returns an error (one line) or
/// empty.
std::string WriteFileAtomically(const std::string& path, std::string_view text,
                                Over over = Over::kNoInput);

/// Whether two paths are of one file, there or not.
bool IsSameFile(const std::string& a, const std::string& b);

/// "tangible-fit: --report: expected a file of its own, got that of an input, PATH" where one of
/// the program's outputs names a file that was read, also one that another input names; empty where
/// none does. To be called before the work, after all inputs have been read; status kExitUsage.
std::string OutputOverInput();

/// Writes a result to `out_path`, or to stdout if that is empty. Returns an error or empty.
std::string WriteResult(const std::string& out_path, std::string_view text);

/// A file to write, or stdout where the path is empty.
struct OutputFile {
  std::string path;
  std::string text;
};

/// Writes all files or none: each is first written beside its place, and all are put there once
/// every one, and what goes to stdout, devices and pipes, has been written. Returns the first error
/// (one line) or empty.
std::string WriteAllOrNone(const std::vector<OutputFile>& files);

/// Writes several results one after the other; a failure does not prevent the others from being
/// written.
class ResultWriter {
 public:
  /// Writes nothing if the path is empty.
  void Write(const std::string& path, const std::function<std::string()>& text) {
    if (path.empty()) return;
    const std::string failed = WriteFileAtomically(path, text());
    if (error_.empty()) error_ = failed;
  }
  /// The first error, or empty.
  const std::string& error() const { return error_; }

 private:
  std::string error_;
};

}  // namespace tangible
