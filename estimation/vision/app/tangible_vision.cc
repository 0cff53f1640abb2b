// SPDX-License-Identifier: Apache-2.0
//
// tangible-vision: pictures of discs, and models that predict them.
#include <ATen/Parallel.h>
#include <gflags/gflags.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "tangible/app/program.h"
#include "tangible/estimation/vision/png.h"
#include "tangible/estimation/vision/report.h"
#include "tangible/estimation/vision/study.h"
#include "tangible/estimation/vision/training_file.h"
#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/scene/json_writer.h"
#include "tangible/scene/text_file.h"

DEFINE_bool(quick, false,
            "a tiny training with its checks: the loss falls, gradients are right, a "
            "checkpoint resumes to the same bits");
DEFINE_bool(all, false, "train and measure every cell of the tables");
DEFINE_string(cells, "",
              "train and measure these cells: names or beginnings of names, with commas");
DEFINE_bool(list, false, "print the names of all cells");
DEFINE_string(folder, "out/vision",
              "of checkpoints and results of cells, which are not made again");
DEFINE_int32(jobs, 1, "cells that are trained at once, on one thread each");
DEFINE_int32(seed, 0, "of the data");
DEFINE_string(make, "", "make a data set: billiards or simb (with --out, --sequences, --frames)");
DEFINE_int32(sequences, 100, "of --make");
DEFINE_int32(frames, 100, "of --make: frames of a sequence");
DEFINE_string(check, "", "read a data set and say what it holds");
DEFINE_string(out, "", "JSON of all cells, or the data set of --make");
DEFINE_string(picture, "", "SVG: error against frames ahead");
DEFINE_string(labels_picture, "", "SVG: error against the share of labels");
DEFINE_string(strips, "", "PNG: rows of true and predicted pictures");
DEFINE_string(page, "", "HTML: true and predicted pictures, animated");

namespace tangible {
namespace {

namespace fs = std::filesystem;

// Shows the iterations done of all cells and the remaining time, in place on a terminal.
class Watch {
 public:
  explicit Watch(long total) : total_(total), terminal_(isatty(STDERR_FILENO) != 0) {}
  ~Watch() {
    if (terminal_) std::fputs("\r\033[K", stderr);
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  /// `resumed`: iterations that were not done now.
  void Skip(long resumed) { skipped_ += resumed; }
  void Add() {
    const long done = ++done_;
    if (!terminal_ || done % 10 != 0) return;
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    const double left =
        spent.count() / static_cast<double>(done) * static_cast<double>(total_ - skipped_ - done);
    std::fprintf(stderr, "\r%ld of %ld iterations, %.0f s left ", done + skipped_.load(), total_,
                 left);
  }

 private:
  long total_;
  bool terminal_;
  std::atomic<long> done_{0}, skipped_{0};
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Trains the cells that have no results yet, and reads the results of the others.
class Study {
 public:
  explicit Study(std::vector<StudyCell> cells) : cells_(std::move(cells)) {}

  std::string Run() {
    std::error_code failed;
    fs::create_directories(FLAGS_folder, failed);
    if (failed) return FLAGS_folder + ": expected a folder that can be made: " + failed.message();
    long total = 0;
    for (const StudyCell& cell : cells_) {
      if (!fs::exists(File(cell, ".json"))) total += cell.training.iterations;
    }
    Watch watch(total);
    WorkerPool pool(FLAGS_jobs);
    const std::function<void(size_t, int)> work = [&](size_t k, int /*thread*/) {
      at::set_num_threads(1);
      std::string error;
      try {
        error = Make(cells_[k], &watch);
      } catch (const c10::Error& exception) {
        error = cells_[k].name + ": " + OneLine(exception.what_without_backtrace());
      } catch (const std::exception& exception) {
        error = cells_[k].name + ": " + OneLine(exception.what());
      }
      if (!error.empty()) throw std::runtime_error(error);
    };
    // After an error no further cell is begun.
    try {
      pool.Run(cells_.size(), FLAGS_jobs, work);
    } catch (const std::exception& exception) {
      return exception.what();
    }
    return "";
  }

  /// Of all cells; false, with one line, where a file has none.
  bool ReadResults(std::vector<OrderedJson>* results, std::string* error) const {
    for (const StudyCell& cell : cells_) {
      const std::string file = File(cell, ".json");
      std::string text;
      if (!ReadTextFile(file, &text, error)) return false;
      OrderedJson& result = results->emplace_back(OrderedJson::parse(text, nullptr, false));
      if (result.is_object() && result.contains("cell")) continue;
      *error = file + ": expected a cell's result, got something else: remove it";
      return false;
    }
    return true;
  }
  std::string File(const StudyCell& cell, const char* ending) const {
    return FLAGS_folder + "/" + cell.name + ending;
  }
  const std::vector<StudyCell>& cells() const { return cells_; }

 private:
  const StudyData& Data(DiscKind kind) {
    const std::lock_guard<std::mutex> lock(data_mutex_);
    const auto found = data_.find(kind);
    if (found != data_.end()) return found->second;
    return data_[kind] = MakeStudyData(kind, static_cast<std::uint64_t>(FLAGS_seed));
  }

  std::string Make(const StudyCell& cell, Watch* watch) {
    const std::string done = File(cell, ".json"), checkpoint = File(cell, ".checkpoint");
    if (fs::exists(done)) return "";
    CellHooks hooks;
    std::string error, saving;
    if (fs::exists(fs::symlink_status(checkpoint))) {
      TrainingFile training;
      std::string bytes;
      // What is no checkpoint is refused before the data are made.
      if (!ReadTextFile(checkpoint, &bytes, &error) ||
          !ParseTraining(bytes, checkpoint, &training, &error)) {
        return error;
      }
      hooks.checkpoint = std::move(bytes);
    }
    hooks.progress = [&, first = true](long iteration) mutable {
      if (first) watch->Skip(iteration - 1);
      first = false;
      watch->Add();
    };
    hooks.save = [&](long, const std::string& bytes) {
      const std::string failed = WriteFileAtomically(checkpoint, bytes, Over::kOwnInput);
      if (saving.empty()) saving = failed;
    };
    const CellResult result = RunCell(cell, Data(cell.kind), hooks, &error);
    if (!error.empty()) return error;
    if (!saving.empty()) return saving;
    if (!result.truth.empty()) {
      // The pictures are kept beside the result: the planes of all pictures, true ones first.
      std::string pictures;
      for (const auto& picture : result.truth) pictures += picture;
      for (const auto& picture : result.predicted) pictures += picture;
      std::string failed = WriteFileAtomically(File(cell, ".pictures"), pictures);
      if (!failed.empty()) return failed;
    }
    return WriteFileAtomically(done, JsonText(result.json));
  }

  std::vector<StudyCell> cells_;
  std::map<DiscKind, StudyData> data_;
  std::mutex data_mutex_;
};

// Rows of pictures of the cells that have some: the true ones once, then those of each cell. False,
// with one line, where a file has none.
bool ReadPictureRows(const Study& study, std::vector<std::vector<std::string>>* rows,
                     std::string* error) {
  for (const StudyCell& cell : study.cells()) {
    const std::string file = study.File(cell, ".pictures");
    if (!fs::exists(fs::symlink_status(file))) continue;
    std::string bytes;
    if (!ReadTextFile(file, &bytes, error)) return false;
    const size_t count = bytes.size() / kPictureBytes / 2;
    if (count == 0 || bytes.size() != 2 * count * kPictureBytes) {
      *error = file + ": expected pairs of pictures of " + std::to_string(kPictureBytes) +
               " bytes each, got " + std::to_string(bytes.size()) +
               " bytes: remove it and the cell's result";
      return false;
    }
    for (const size_t first : {size_t{0}, count}) {
      if (first == 0 && !rows->empty()) continue;
      std::vector<std::string>& row = rows->emplace_back();
      for (size_t k = first; k < first + count; ++k) {
        row.push_back(bytes.substr(k * kPictureBytes, kPictureBytes));
      }
    }
  }
  return true;
}

int RunStudy() {
  std::vector<StudyCell> cells;
  const std::vector<std::string> wanted = SplitAtCommas(FLAGS_cells);
  for (const StudyCell& cell : StudyCells()) {
    const bool named = std::any_of(wanted.begin(), wanted.end(), [&](const std::string& start) {
      return !start.empty() && cell.name.rfind(start, 0) == 0;
    });
    if (FLAGS_all || named) cells.push_back(cell);
  }
  if (cells.empty()) {
    return ReportError("--cells: expected names of cells (--list), got " + FLAGS_cells, kExitUsage);
  }
  Study study(std::move(cells));
  std::string error = study.Run();
  if (!error.empty()) return ReportError(error);
  std::vector<OrderedJson> results;
  std::vector<std::vector<std::string>> rows;
  if (!study.ReadResults(&results, &error) || !ReadPictureRows(study, &rows, &error)) {
    return ReportError(error);
  }
  const OrderedJson timing = TimePhysics();
  std::cout << StudyTables(results) << TimingLine(timing);
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    return JsonText({{"cells", OrderedJson(results)}, {"timing", timing}});
  });
  writer.Write(FLAGS_picture, [&] { return ErrorByFrameSvg(results); });
  writer.Write(FLAGS_labels_picture, [&] { return ErrorByLabelsSvg(results); });
  if (rows.size() > 1) {
    writer.Write(FLAGS_strips, [&] { return PngStrip(rows, kPictureSize, 1); });
    writer.Write(FLAGS_page, [&] {
      return PredictionPage("Billiards, three frames seen and ten predicted", rows[0], rows[1],
                            ErrorByFrameSvg(results) + ErrorByLabelsSvg(results));
    });
  }
  return writer.error().empty() ? kExitDone : ReportError(writer.error());
}

int MakeData() {
  if (FLAGS_make != "billiards" && FLAGS_make != "simb") {
    return ReportError("--make: expected billiards or simb, got " + FLAGS_make, kExitUsage);
  }
  if (FLAGS_out.empty()) return ReportError("--make: expected --out=FILE too", kExitUsage);
  if (FLAGS_sequences < 1 || FLAGS_frames < 1) {
    return ReportError("--sequences and --frames: expected numbers >= 1", kExitUsage);
  }
  const DiscData data =
      MakeDiscData({.kind = FLAGS_make == "simb" ? DiscKind::kSimb : DiscKind::kBilliards,
                    .sequences = FLAGS_sequences,
                    .frames = FLAGS_frames,
                    .seed = static_cast<std::uint64_t>(FLAGS_seed)});
  const std::string bytes = SerializeDiscData(data);
  if (bytes.size() > kMaxFileSize) {
    return ReportError("--sequences and --frames: expected a file of at most " +
                       std::to_string(kMaxFileSize >> 20) + " MiB, got " +
                       std::to_string(bytes.size() >> 20));
  }
  const std::string error = WriteFileAtomically(FLAGS_out, bytes);
  return error.empty() ? kExitDone : ReportError(error);
}

int CheckData() {
  DiscData data;
  std::string error;
  if (!LoadDiscData(FLAGS_check, &data, &error)) return ReportError(error);
  std::printf("%s: %s, seed %llu, %d sequences of %d frames, %d discs\n", FLAGS_check.c_str(),
              NameOf(data.kind), static_cast<unsigned long long>(data.seed), data.num_sequences(),
              data.frames, data.world.size());
  return kExitDone;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-vision",
       .synopsis = "--quick | --all | --cells=NAMES | --list | --make=KIND --out=D | --check=D",
       .description =
           "Predicts pictures of moving discs: an encoder, the engine, a decoder, trained with few "
           "labels, and\nwhat stands in the engine's place for comparison. --cells and --all go on "
           "where they were interrupted.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0,
       .outputs = {"out", "picture", "labels_picture", "strips", "page"},
       .inputs = {"check"}});
  if (line.exit_status) return *line.exit_status;
  const int modes = (FLAGS_quick ? 1 : 0) + (FLAGS_all ? 1 : 0) + (FLAGS_list ? 1 : 0) +
                    (FLAGS_cells.empty() ? 0 : 1) + (FLAGS_make.empty() ? 0 : 1) +
                    (FLAGS_check.empty() ? 0 : 1);
  if (modes != 1) {
    return ReportError(
        "tangible-vision: expected one of --quick, --all, --cells, --list, --make and --check",
        kExitUsage);
  }
  if (FLAGS_jobs < 1 || FLAGS_seed < 0) {
    return ReportError("tangible-vision: expected --jobs >= 1 and --seed >= 0", kExitUsage);
  }
  // The threads of torch spin while other work runs.
  at::set_num_threads(1);
  if (FLAGS_list) {
    for (const StudyCell& cell : StudyCells()) std::puts(cell.name.c_str());
    return kExitDone;
  }
  if (!FLAGS_make.empty()) return MakeData();
  if (!FLAGS_check.empty()) return CheckData();
  if (!FLAGS_quick) return RunStudy();
  std::string lines;
  const bool good = QuickCheck(&lines);
  std::cout << lines;
  return good ? kExitDone : kExitFailed;
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
