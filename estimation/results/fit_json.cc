// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/fit_json.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tangible/estimation/fit/observed_state.h"
#include "tangible/estimation/fit/sensor_noise.h"
#include "tangible/estimation/results/run_json.h"
#include "tangible/scene/set_parameters.h"

namespace tangible {
namespace {

// Keys that a recording has in the place of the file's.
constexpr const char* kOfFile[] = {"scene",   "observations", "points", "sensors",
                                   "cameras", "clocks",       "events"};

class Reader {
 public:
  Reader(const Json& json, std::string file, JsonErrors* errors, FitFile* out)
      : json_(json),
        file_(std::move(file)),
        root_(json, errors),
        out_(out->input),
        held_out_(out->held_out),
        common_(json) {}

  // False with an error of a recording's own; errors of the file itself are the reader's.
  bool Read(std::string* error) {
    if (!root_.IsObject()) {
      root_.FailExpected("an object");
      return true;
    }
    has_recordings_ = root_.Has("recordings");
    ReadScopes();
    if (root_.Has("initial") && !root_.At("initial").IsString()) {
      root_.At("initial").FailExpected("from_observations");
    }
    FromObservations(root_);
    common_.erase("recordings");
    common_.erase("initial");
    if (!root_.ok()) return true;
    return has_recordings_ ? ReadRecordings(error) : ReadSingle(error);
  }

 private:
  bool ReadSingle(std::string* error) {
    RecordingInput& only = out_.recordings.emplace_back();
    if (!ReadRun(common_, file_, FolderOf(file_), {}, &only.problem, error)) return false;
    out_.scopes.resize(only.problem.parameters.size());
    CheckSensors();
    if (FromObservations(root_)) StartFromObservations(root_.At("initial"), &only.problem);
    return true;
  }

  bool ReadRecordings(std::string* error) {
    if (root_.Has("observations")) {
      root_.At("observations").Fail("expected in each recording, where recordings are given");
    }
    const JsonReader list = root_.At("recordings");
    const int count = list.ExpectArray("an array of recordings");
    if (count == 0) list.Fail("expected at least one recording, got none");
    std::set<std::string> names;
    for (int i = 0; i < count && root_.ok(); ++i) {
      if (!ReadRecording(list.At(i), json_["recordings"][i], &names, error)) return false;
    }
    if (root_.ok() && out_.recordings.empty()) {
      list.Fail("expected at least one recording of the role identify, got none");
    }
    if (root_.ok()) CheckSpreads(static_cast<int>(out_.recordings.size()));
    if (root_.ok()) CheckSensors();
    return true;
  }

  // A sigma is estimated from residuals: the sensor needs observations in some recording.
  void CheckSensors() {
    const std::string sensor = SensorWithoutObservations(out_);
    if (sensor.empty()) return;
    JsonReader place = root_;
    for (int i = 0; i < root_.At("recordings").Size(); ++i) {
      const JsonReader recording = root_.At("recordings").At(i);
      if (recording.At("sensors").Has(sensor)) place = recording;
    }
    place.At("sensors")
        .At(sensor)
        .At("estimate_sigma")
        .Fail("expected a sensor that observations name, got one without observations");
  }

  // Whose each parameter is; these keys are none of a run's.
  void ReadScopes() {
    const JsonReader parameters = root_.At("parameters");
    for (int i = 0; i < parameters.Size(); ++i) {
      const JsonReader parameter = parameters.At(i);
      ParameterScope& scope = out_.scopes.emplace_back();
      if (parameter.Has("per")) {
        parameter.At("per").Choice({"recording"});
        scope.kind = ParameterScope::Kind::kOwn;
        if (!has_recordings_) parameter.At("per").Fail("expected recordings in the file, got none");
        common_["parameters"][i].erase("per");
      }
      if (parameter.Has("varies")) {
        ReadSpread(parameter.At("varies"), &scope);
        if (scope.kind != ParameterScope::Kind::kOwn) {
          parameter.At("varies").Fail("expected \"per\": \"recording\" beside it, got none");
        }
        scope.kind = ParameterScope::Kind::kVaries;
        common_["parameters"][i].erase("varies");
      }
    }
  }

  // {"gaussian": {"spread": "estimate" or a number}} or {"log_normal": ...}.
  static void ReadSpread(const JsonReader& json, ParameterScope* scope) {
    if (!ReadDistribution(json, " of varies", &scope->distribution)) return;
    const bool gaussian = scope->distribution == PriorKind::kGaussian;
    const JsonReader of = json.At(gaussian ? "gaussian" : "log_normal");
    of.ExpectKeys({"spread"}, " of what varies");
    const JsonReader spread = of.At("spread");
    if (spread.IsNumber() && spread.Number() > 0.0) {
      scope->spread = spread.Number();
    } else if (!spread.IsString() || spread.String() != "estimate") {
      spread.FailExpected("\"estimate\" or a number > 0");
    }
  }

  void CheckSpreads(int num_recordings) {
    for (size_t i = 0; i < out_.scopes.size(); ++i) {
      const ParameterScope& scope = out_.scopes[i];
      if (scope.kind != ParameterScope::Kind::kVaries) continue;
      const JsonReader varies = root_.At("parameters").At(static_cast<int>(i)).At("varies");
      if (!scope.spread && num_recordings < 2) {
        varies.Fail("expected at least two recordings, of which a spread is estimated, got one");
      }
      for (const RecordingInput& recording : out_.recordings) {
        const FitProblem& problem = recording.problem;
        ParameterizedScene scene;
        ParameterError fault;  // none: it was made before
        scene.Create(problem.scene, problem.points, problem.parameters, &fault,
                     problem.instruments);
        const ParameterEntry& entry = scene.entries()[i];
        if (scope.distribution == PriorKind::kLogNormal &&
            !(entry.lower >= 0.0 && entry.initial > 0.0)) {
          varies.Fail(
              "expected gaussian for a parameter that may be negative or starts at 0, got "
              "log_normal");
          return;
        }
      }
    }
  }

  bool ReadRecording(const JsonReader& reader, const Json& json, std::set<std::string>* names,
                     std::string* error) {
    reader.ExpectKeys(
        {"name", "scene", "observations", "points", "sensors", "cameras", "clocks", "events",
         "start", "end", "weight", "values", "initial", "role", "state_from"},
        " of a recording");
    RecordingInput entry;
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
    if (!ReadRun(own, label, FolderOf(file_), part, &entry.problem, error)) {
      if (!ConcernsRecording(reader, label, *error)) error->replace(0, label.size(), file_);
      return false;
    }
    SetValues(reader, &entry.problem);
    if (!reader.ok()) return true;
    const JsonReader& starts = reader.Has("initial") ? reader : root_;
    const bool from_observations = FromObservations(starts);
    HeldOutRecording held_out;
    const bool predicts = Predicts(reader);
    if (predicts) HoldOut(reader, &entry.problem.observations, &held_out);
    if (predicts) CheckFirstPart(reader, entry.problem);
    if (!reader.ok()) return true;
    if (from_observations) StartFromObservations(starts.At("initial"), &entry.problem);
    if (!predicts) {
      out_.recordings.push_back(std::move(entry));
      return true;
    }
    held_out.recording = std::move(entry);
    held_out.from_observations = from_observations;
    held_out.place = static_cast<int>(names->size()) - 1;
    held_out_.push_back(std::move(held_out));
    return true;
  }

  static bool Predicts(const JsonReader& recording) {
    const bool predicts =
        recording.Has("role") && recording.At("role").Choice({"identify", "predict"}) == 1;
    if (!predicts && recording.Has("state_from")) {
      recording.At("state_from").Fail("expected beside the role predict alone");
    }
    return predicts;
  }

  // Moves what comes after state_from out of the observations.
  static void HoldOut(const JsonReader& recording, std::vector<Observation>* observations,
                      HeldOutRecording* held_out) {
    if (recording.Has("state_from")) {
      held_out->state_from = recording.At("state_from").Number(NumberKind::kNonNegative);
    }
    held_out->later = TakeLater(held_out->state_from, observations);
    if (held_out->later.empty()) {
      recording.At("state_from").FailExpected("a time with observations after it");
    }
  }

  void CheckFirstPart(const JsonReader& recording, const FitProblem& problem) const {
    const std::vector<bool> own = OwnStates(problem, out_.scopes);
    if (problem.observations.empty() && std::find(own.begin(), own.end(), true) != own.end()) {
      recording.At("state_from")
          .FailExpected(
              "a time with observations up to it, to which the recording's start is fitted");
    }
  }

  // Whether a message of ReadRun is of the recording, not of a key that the file has for all: the
  // recording has that key, or one without which the key could be right.
  bool ConcernsRecording(const JsonReader& recording, const std::string& label,
                         const std::string& message) const {
    const std::string start = label + ": /";
    if (message.rfind(start, 0) != 0) return true;  // of another file, or of several keys
    const size_t end = message.find_first_of("/:", start.size());
    const std::string key = message.substr(start.size(), end - start.size());
    if (key == "observations") return true;
    if (key == "scene") return recording.Has(key) || !root_.Has(key);
    if (key == "parameters" && recording.Has("initial")) return true;
    // What is observed and estimated depends on the scene and what belongs to it.
    const auto is = [&key](const std::string& one) { return one == key; };
    const auto differs = [&recording](const std::string& one) {
      return one != "observations" && recording.Has(one);
    };
    return (key == "parameters" || std::any_of(std::begin(kOfFile), std::end(kOfFile), is)) &&
           std::any_of(std::begin(kOfFile), std::end(kOfFile), differs);
  }

  // Where the recording's own parameters start: {name: value}. Those that are shared start where
  // the file says.
  void SetInitial(const JsonReader& reader, Json* own) const {
    if (!reader.Has("initial") || FromObservations(reader)) return;
    const JsonReader initial = reader.At("initial");
    if (!initial.IsObject()) initial.FailExpected("from_observations or {parameter: value}");
    for (const std::string& name : initial.Keys()) {
      const double value = initial.At(name).Number();
      bool known = false;
      size_t index = 0;
      for (Json& parameter : (*own)["parameters"]) {
        const bool is_shared = out_.scopes[index++].kind == ParameterScope::Kind::kShared;
        if (parameter.is_string() && parameter == name) {
          parameter = {{"path", name}, {"initial", value}};
          known = !is_shared;
        } else if (parameter.is_object() &&
                   parameter[parameter.contains("name") ? "name" : "path"] == name) {
          parameter["initial"] = value;
          known = !is_shared;
        }
      }
      if (!known) initial.At(name).Fail("expected the name of a parameter per recording");
    }
  }

  // Whether `initial` of a recording, or of the file for all of them, is "from_observations".
  static bool FromObservations(const JsonReader& reader) {
    return reader.Has("initial") && reader.At("initial").IsString() &&
           reader.At("initial").Choice({"from_observations"}) == 0;
  }

  // Numbers of the scene that are others in this recording, and that no parameter sets: {path:
  // value}. They are set together, because some are allowed only beside others.
  static void SetValues(const JsonReader& reader, FitProblem* problem) {
    if (!reader.Has("values")) return;
    const JsonReader values = reader.At("values");
    if (!values.IsObject()) values.FailExpected("an object of numbers by path");
    std::vector<ParameterPath> paths;
    std::vector<double> numbers;
    for (const std::string& path : values.Keys()) {
      std::string wrong;
      numbers.push_back(values.At(path).Number());
      if (!ResolveParameter(problem->scene, path, &paths.emplace_back(), &wrong)) {
        values.At(path).Fail(wrong);
      }
      const std::string owner = ParameterThatSets(paths.back(), *problem);
      if (!owner.empty()) values.At(path).Fail(ExpectedUnset(owner));
    }
    std::string wrong;
    if (!reader.ok()) return;
    if (CheckApart(problem->scene, paths, &wrong)) {
      wrong = SetParameters(paths, numbers.data(), &problem->scene);
    }
    if (!wrong.empty()) FailAtPath(values, wrong);
  }

  // Records "path: what" at the value of that path, and what concerns several at all of them.
  static void FailAtPath(const JsonReader& values, const std::string& wrong) {
    for (const std::string& path : values.Keys()) {
      const std::string start = path + ": ";
      if (wrong.rfind(start, 0) == 0) values.At(path).Fail(wrong.substr(start.size()));
    }
    values.Fail(wrong);
  }

  static std::string ExpectedUnset(const std::string& owner) {
    return "expected a number that no parameter sets, got one that \"" + owner +
           "\" sets (initial says where its value in a recording begins)";
  }

  // The name of the parameter that sets a number of the path; empty if none does. What is added
  // to a number leaves its own value in force.
  static std::string ParameterThatSets(const ParameterPath& path, const FitProblem& problem) {
    for (const FitParameter& parameter : problem.parameters) {
      for (const ParameterSet& set : parameter.sets) {
        ParameterPath other;
        std::string none;  // points and instruments are no numbers of the scene
        if (set.mode == SetMode::kAssign &&
            ResolveParameter(problem.scene, set.path, &other, &none) &&
            std::find_first_of(path.numbers.begin(), path.numbers.end(), other.numbers.begin(),
                               other.numbers.end()) != path.numbers.end()) {
          return parameter.name;
        }
      }
    }
    return "";
  }

  // From `start`, which is the run's time 0, to `end`.
  static RecordingPart ReadPart(const JsonReader& reader) {
    RecordingPart part;
    if (reader.Has("start")) part.start = reader.At("start").Number(NumberKind::kNonNegative);
    if (reader.Has("end")) part.end = reader.At("end").Number();
    if (!(part.start < part.end)) reader.At("end").FailExpected("a time after start");
    return part;
  }

  // The initial values of what is a pose or twist at the start, of several recordings those that
  // each has for itself. `reader` is of the key that asks for it.
  void StartFromObservations(const JsonReader& reader, FitProblem* problem) const {
    ParameterizedScene scene;
    ParameterError fault;
    if (!scene.Create(problem->scene, problem->points, problem->parameters, &fault,
                      problem->instruments)) {
      return;  // said when the residuals are made
    }
    std::vector<bool> free;
    for (size_t i = 0; i < problem->parameters.size(); ++i) {
      const bool own = out_.scopes[i].kind != ParameterScope::Kind::kShared;
      free.push_back((own || !has_recordings_) &&
                     IsOfInitialState(problem->scene, problem->parameters[i]));
    }
    if (std::find(free.begin(), free.end(), true) == free.end()) {
      reader.Fail(
          "expected parameters that set nothing but initial poses, twists, joint angles, "
          "displacements or rates" +
          std::string(has_recordings_ ? ", each per recording" : "") + ", got none");
      return;
    }
    const Eigen::VectorXd found = ParametersFromObservations(
        RolloutResiduals(std::move(scene), problem->observations, problem->channels), free);
    for (size_t i = 0; i < free.size(); ++i) {
      if (free[i]) problem->parameters[i].initial = found[static_cast<Eigen::Index>(i)];
    }
  }

  const Json& json_;
  std::string file_;
  JsonReader root_;
  FitInput& out_;
  std::vector<HeldOutRecording>& held_out_;
  Json common_;  // the file without its recordings
  bool has_recordings_ = false;
};

bool FitFromJson(const Json& json, const std::string& file, FitFile* fit, std::string* error) {
  *fit = FitFile();
  fit->path = file;
  JsonErrors errors(file);
  const bool read = Reader(json, file, &errors, fit).Read(error);
  if (!errors.ok()) *error = errors.message();
  return read && errors.ok();
}

}  // namespace

bool LoadFit(const std::string& file, FitFile* fit, std::string* error) {
  Json json;
  return ParseJsonFile(file, &json, error) && FitFromJson(json, file, fit, error);
}

bool ParseFit(const std::string& text, const std::string& file, FitFile* fit, std::string* error) {
  Json json;
  return ParseJson(text, file, &json, error) && FitFromJson(json, file, fit, error);
}

std::unique_ptr<RecordingsProblem> MakeProblem(const FitFile& fit, std::string* error) {
  ParameterError fault;
  int at = 0;
  std::unique_ptr<RecordingsProblem> problem = MakeProblem(fit.input, &fault, &at);
  if (problem == nullptr) {
    const std::string& name = fit.input.recordings[at].name;
    *error =
        DescribeFault(name.empty() ? fit.path : fit.path + ": recording '" + name + "'", fault);
    return nullptr;
  }
  for (const HeldOutRecording& held_out : fit.held_out) {
    const FitProblem& run = held_out.recording.problem;
    ParameterizedScene scene;
    if (scene.Create(run.scene, run.points, run.parameters, &fault, run.instruments)) continue;
    *error = DescribeFault(fit.path + ": recording '" + held_out.recording.name + "'", fault);
    return nullptr;
  }
  return problem;
}

}  // namespace tangible
