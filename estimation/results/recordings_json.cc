// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/recordings_json.h"

#include <cmath>
#include <set>
#include <utility>

#include "tangible/estimation/results/initial_state.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/set_parameters.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

// Keys that a recording may have instead of the file.
constexpr const char* kOfFile[] = {"scene",   "observations", "points",
                                   "sensors", "cameras",      "clocks"};

class Reader {
 public:
  Reader(const Json& json, std::string file, JsonErrors* errors, RecordingsFile* out)
      : json_(json), file_(std::move(file)), root_(json, errors), out_(*out), common_(json) {}

  // False with an error of a single recording; errors of the file itself go to the reader.
  bool Read(std::string* error) {
    ReadOwn();
    const JsonReader list = root_.At("recordings");
    const int count = list.ExpectArray("an array of recordings");
    if (count == 0) list.Fail("expected at least one recording, got none");
    common_.erase("recordings");
    common_.erase("initial");
    if (root_.Has("initial") && !root_.At("initial").IsString()) {
      root_.At("initial").FailExpected("from_observations");
    }
    FromObservations(root_);
    std::set<std::string> names;
    for (int i = 0; i < count && root_.ok(); ++i) {
      if (!ReadRecording(list.At(i), json_["recordings"][i], &names, error)) return false;
    }
    return true;
  }

 private:
  // Reads which parameters are per recording; the key is not allowed in the fit of a single
  // recording.
  void ReadOwn() {
    const JsonReader parameters = root_.At("parameters");
    for (int i = 0; i < parameters.Size(); ++i) {
      const JsonReader parameter = parameters.At(i);
      const bool own = parameter.Has("per");
      if (own) {
        parameter.At("per").Choice({"recording"});
        common_["parameters"][i].erase("per");
      }
      out_.own.push_back(own);
    }
    if (root_.Has("segments") && root_.At("segments").Integer(1, 1000000) > 1) {
      root_.At("segments").Fail("expected 1 with recordings");
    }
    if (root_.Has("observations")) {
      root_.At("observations").Fail("expected in each recording, where recordings are given");
    }
  }

  bool ReadRecording(const JsonReader& reader, const Json& json, std::set<std::string>* names,
                     std::string* error) {
    reader.ExpectKeys({"name", "scene", "observations", "points", "sensors", "cameras", "clocks",
                       "start", "end", "weight", "values", "initial"},
                      " of a recording");
    RecordingEntry entry;
    entry.name = reader.At("name").String();
    if (!reader.ok()) return true;
    if (entry.name.empty() || OneLine(entry.name) != entry.name) {
      reader.At("name").FailExpected("a name without control characters");
    } else if (!names->insert(entry.name).second) {
      reader.At("name").FailExpected("a name that no other recording has");
    }
    if (reader.Has("weight")) entry.weight = reader.At("weight").Number(NumberKind::kPositive);
    Json own = common_;
    for (const char* key : kOfFile) {
      if (reader.Has(key)) own[key] = json[key];
    }
    if (!reader.At("observations").exists()) reader.At("observations").FailExpected("an array");
    SetInitial(reader, &own);
    const RecordingPart part = ReadPart(reader);
    if (!reader.ok()) return true;
    const std::string label = file_ + ": recording '" + entry.name + "'";
    if (!FitFromJson(own, label, FolderOf(file_), part, &entry.fit, error)) return false;
    if (!SetValues(reader, label, &entry.fit.problem.scene, error)) return false;
    if (FromObservations(reader.Has("initial") ? reader : root_)) {
      StartFromObservations(&entry.fit.problem);
    }
    out_.recordings.push_back(std::move(entry));
    return true;
  }

  // Sets the initial values of the recording's parameters: {name: value}.
  static void SetInitial(const JsonReader& reader, Json* own) {
    if (!reader.Has("initial") || FromObservations(reader)) return;
    const JsonReader initial = reader.At("initial");
    if (!initial.IsObject()) initial.FailExpected("from_observations or {parameter: value}");
    for (const std::string& name : initial.Keys()) {
      const double value = initial.At(name).Number();
      bool known = false;
      for (Json& parameter : (*own)["parameters"]) {
        if (parameter.is_string() && parameter == name) {
          parameter = {{"path", name}, {"initial", value}};
          known = true;
        } else if (parameter.is_object() &&
                   parameter[parameter.contains("name") ? "name" : "path"] == name) {
          parameter["initial"] = value;
          known = true;
        }
      }
      if (!known) initial.At(name).Fail("expected the name of a parameter");
    }
  }

  // Whether `initial` of a recording, or of the file for all of them, is "from_observations".
  static bool FromObservations(const JsonReader& reader) {
    return reader.Has("initial") && reader.At("initial").IsString() &&
           reader.At("initial").Choice({"from_observations"}) == 0;
  }

  // Sets numbers of the scene that differ in this recording: {path: value}.
  static bool SetValues(const JsonReader& reader, const std::string& label, Scene* scene,
                        std::string* error) {
    if (!reader.Has("values")) return true;
    const JsonReader values = reader.At("values");
    for (const std::string& path : values.Keys()) {
      ParameterPath parameter;
      const double value = values.At(path).Number();
      std::string wrong;
      if (ResolveParameter(*scene, path, &parameter, &wrong)) {
        wrong = SetParameters({parameter}, &value, scene);
      }
      if (!wrong.empty()) {
        *error = OneLine(wrong.insert(0, ": /values: ").insert(0, label));
        return false;
      }
    }
    return true;
  }

  // Reads the part of the recording from `start`, which is the run's time 0, to `end`.
  static RecordingPart ReadPart(const JsonReader& reader) {
    RecordingPart part;
    if (reader.Has("start")) part.start = reader.At("start").Number(NumberKind::kNonNegative);
    if (reader.Has("end")) part.end = reader.At("end").Number();
    if (!(part.start < part.end)) reader.At("end").FailExpected("a time after start");
    return part;
  }

  // Sets the initial values of those own parameters of the recording that are an initial coordinate
  // or speed of a body, from the first observations of that body.
  void StartFromObservations(FitProblem* problem) const {
    for (size_t i = 0; i < problem->parameters.size(); ++i) {
      if (!out_.own[i]) continue;
      if (const auto start = InitialFromObservations(*problem, problem->parameters[i])) {
        problem->parameters[i].initial = *start;
      }
    }
  }

  const Json& json_;
  std::string file_;
  JsonReader root_;
  RecordingsFile& out_;
  Json common_;  // the file without its recordings
};

}  // namespace

bool HasRecordings(const std::string& text) {
  Json json;
  std::string error;
  return ParseJson(text, "", &json, &error) && json.is_object() && json.contains("recordings");
}

bool ParseRecordings(const std::string& text, const std::string& file, RecordingsFile* recordings,
                     std::string* error) {
  Json json;
  if (!ParseJson(text, file, &json, error)) return false;
  *recordings = RecordingsFile();
  recordings->path = file;
  JsonErrors errors(file);
  const bool read = Reader(json, file, &errors, recordings).Read(error);
  if (!errors.ok()) *error = errors.message();
  return read && errors.ok();
}

bool MakeRecordingsProblem(const RecordingsFile& file, std::vector<RecordedRun>* recordings,
                           std::string* error) {
  for (const RecordingEntry& entry : file.recordings) {
    std::vector<RolloutResiduals> residuals;
    if (!MakeResiduals(entry.fit.problem, file.path + ": recording '" + entry.name + "'",
                       &residuals, error)) {
      return false;
    }
    recordings->push_back({entry.name, entry.weight, std::move(residuals.front())});
  }
  return true;
}

LaterOfRecordings PredictLater(const RecordingsFile& file, const RecordingsProblem& problem,
                               const Eigen::VectorXd& estimate, double from,
                               std::vector<std::vector<Observation>> later) {
  LaterOfRecordings result;
  std::vector<PredictedRun> runs;
  result.runs.reserve(later.size());
  for (size_t b = 0; b < later.size(); ++b) {
    const RecordingEntry& entry = file.recordings[b];
    LaterObservations& run = result.runs.emplace_back();
    if (later[b].empty()) continue;
    run = PredictLater(entry.fit.problem, problem.ParametersOf(static_cast<int>(b), estimate), from,
                       std::move(later[b]));
    if (!run.score.message.empty() && result.score.message.empty()) {
      result.score.message = "recording '" + entry.name + "': " + run.score.message;
    }
    runs.push_back({run.observations, entry.fit.problem.channels, run.residuals});
  }
  if (result.score.message.empty()) {
    result.score = ScorePrediction(from, runs);
  }
  result.score.from = from;
  return result;
}

double RmsOfRecording(const RecordingsProblem& problem, const FitResult& result, int recording) {
  Eigen::Index first = 0;
  for (int block = 0; block < recording; ++block) first += problem.num_rows(block);
  const Eigen::Index rows = problem.num_rows(recording);
  if (result.residuals.size() < first + rows) return std::nan("");
  return std::sqrt(result.residuals.segment(first, rows).squaredNorm() / static_cast<double>(rows));
}

}  // namespace tangible
