// SPDX-License-Identifier: Apache-2.0
// Any bytes as a fit file, up to a line "%", and as the observations seen.csv that it may name,
// beside the scene ball.json, a ball that falls and bounces: refused with one line, or fitted in a
// few iterations, with what follows a fit of several recordings. A fit that is said to have
// converged has finite estimates.
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "expect.h"
#include "tangible/estimation/results/fit_json.h"

namespace {

using tangible::testing::Expect;

constexpr char kBall[] = R"({
  "gravity": [0, -10],
  "bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.12],
     "velocity": [0.5, -1], "restitution": 0.5, "friction": 0.2},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "simulation": {"dt": 0.02, "duration": 0.1, "stepping": "event"}})";

// A folder with the scene, which is removed at exit.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / Name()) {
    std::filesystem::create_directories(path_);
    std::ofstream(path_ / "ball.json") << kBall;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string File(const char* name) const { return (path_ / name).string(); }

 private:
  static std::string Name() { return "fuzz_recordings." + std::to_string(::getpid()); }
  std::filesystem::path path_;
};

void Fit(tangible::FitFile* fit, tangible::RecordingsProblem* problem) {
  for (tangible::RecordingInput& recording : fit->input.recordings) {
    tangible::FitOptions& options = recording.problem.options;
    options.max_iterations = 3;
    options.starts = 1;
    options.threads = 1;
  }
  const tangible::FitResult result =
      tangible::Fit(fit->input.options(), problem, tangible::FitProgress());
  Expect(result.message.find('\n') == std::string::npos, "one line", result.message);
  if (result.status == tangible::FitStatus::kConverged) {
    Expect(result.estimate.allFinite(), "finite estimates", result.message);
  } else {
    Expect(!result.message.empty(), "a message", "none");
  }
  if (result.estimate.size() > 0) (void)tangible::ResultToJson(*problem, result);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const std::size_t end = bytes.find("\n%\n");
  const std::string seen = end == std::string::npos ? "" : bytes.substr(end + 3);
  std::ofstream(folder.File("seen.csv"), std::ios::binary) << seen;
  tangible::FitFile fit;
  std::string error;
  if (!tangible::ParseFit(bytes.substr(0, end), folder.File("fit.json"), &fit, &error)) {
    Expect(!error.empty() && error.find('\n') == std::string::npos, "one line", error);
    return 0;
  }
  const auto problem = tangible::MakeProblem(fit, &error);
  Expect((problem != nullptr) == error.empty() && error.find('\n') == std::string::npos, "one line",
         error);
  constexpr int kMostRecordings = 4;
  constexpr int kMostParameters = 12;
  if (problem == nullptr || problem->num_blocks() > kMostRecordings ||
      static_cast<int>(problem->entries().size()) > kMostParameters) {
    return 0;
  }
  Fit(&fit, problem.get());
  return 0;
}
