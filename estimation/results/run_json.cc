// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/run_json.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tangible/dynamics/model/settings.h"
#include "tangible/estimation/problem/links.h"
#include "tangible/estimation/problem/tolerances.h"
#include "tangible/estimation/results/fit_names.h"
#include "tangible/estimation/results/instruments_json.h"
#include "tangible/render/html.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

ParameterSet ReadSet(const JsonReader& json) {
  json.ExpectKeys({"path", "scale", "offset", "add"}, " of a set");
  ParameterSet set;
  set.path = json.At("path").String();
  if (json.Has("scale")) {
    set.scale = json.At("scale").Number();
  }
  if (json.Has("offset")) {
    set.offset = json.At("offset").Number();
  }
  if (json.Has("add") && json.At("add").Boolean()) {
    set.mode = SetMode::kAdd;
  }
  return set;
}

// It is printed as it is, on a line with others.
std::string ReadName(const JsonReader& json) {
  std::string name = json.String();
  if (json.IsString() && (name.empty() || OneLine(name) != name)) {
    json.FailExpected(name.empty() ? "a name" : "a name without control characters");
  }
  return name;
}

/// {"gaussian": {"mean", "sigma"}} or {"log_normal": {"median", "sigma"}}.
std::optional<Prior> ReadPrior(const JsonReader& json) {
  Prior prior;
  if (!ReadDistribution(json, " of a prior", &prior.kind)) return std::nullopt;
  const bool gaussian = prior.kind == PriorKind::kGaussian;
  const JsonReader of = json.At(gaussian ? "gaussian" : "log_normal");
  if (gaussian) {
    of.ExpectKeys({"mean", "sigma"}, " of a Gaussian prior");
    prior.center = of.At("mean").Number();
  } else {
    of.ExpectKeys({"median", "sigma"}, " of a log-normal prior");
    prior.center = of.At("median").Number(NumberKind::kPositive);
  }
  prior.sigma = of.At("sigma").Number(NumberKind::kPositive);
  return prior;
}

FitParameter ReadParameter(const JsonReader& json) {
  FitParameter parameter;
  if (json.IsString()) {
    parameter.name = json.String();
    parameter.sets.push_back({parameter.name});
    return parameter;
  }
  json.ExpectKeys(
      {"name", "initial", "lower", "upper", "sets", "path", "scale", "prior", "per", "varies"},
      " of a parameter");
  const auto read = [&json](const char* key, std::optional<double>* value) {
    if (json.Has(key)) {
      *value = json.At(key).Number();
    }
  };
  read("initial", &parameter.initial);
  read("lower", &parameter.lower);
  read("upper", &parameter.upper);
  if (json.Has("scale")) {
    parameter.scale = json.At("scale").Choice(kScales);
  }
  if (json.Has("prior")) {
    parameter.prior = ReadPrior(json.At("prior"));
  }
  if (json.Has("path")) {
    if (json.Has("sets")) {
      json.At("sets").Fail("expected sets or path, got both");
    }
    parameter.sets.push_back({json.At("path").String()});
    parameter.name = json.Has("name") ? ReadName(json.At("name")) : parameter.sets[0].path;
    return parameter;
  }
  parameter.name = ReadName(json.At("name"));
  const JsonReader sets = json.At("sets");
  const int count = sets.ExpectArray("an array of {path, scale, offset}");
  for (int i = 0; i < count; ++i) {
    parameter.sets.push_back(ReadSet(sets.At(i)));
  }
  return parameter;
}

FitOptions ReadOptions(const JsonReader& root) {
  FitOptions options;
  if (root.Has("derivatives")) {
    options.derivatives = root.At("derivatives").Choice(kMethods);
    if (!IsAvailable(options.derivatives)) {
      root.At("derivatives")
          .Fail("this build has no Jets, expected tangent, adjoint or finite_difference");
    }
  }
  if (root.Has("loss")) {
    root.At("loss").ExpectKeys({"huber"}, " of loss");
    options.huber = root.At("loss").At("huber").Number(NumberKind::kPositive);
  }
  if (root.Has("segments")) {
    options.segments = root.At("segments").Integer(1, kMaxSegments);
  }
  if (root.Has("approach")) {
    options.approach = root.At("approach").Choice(kApproaches);
  }
  if (options.segments > 1) {
    if (options.approach != FitApproach::kAuto) {
      root.At("segments")
          .Fail("expected 1 with another approach, got " + std::to_string(options.segments));
    }
    options.approach = FitApproach::kSegments;
  }
  options.starts = root.Has("starts") ? root.At("starts").Integer(1, kMaxStarts) : 0;
  if (root.Has("seed")) {
    options.seed =
        static_cast<unsigned>(root.At("seed").Integer(0, std::numeric_limits<int>::max()));
  }
  if (root.Has("missing") && root.At("missing").Boolean()) options.missing = MissingPass::kRun;
  return options;
}

/// Where a parameter's fault stands.
std::string PointerOf(const ParameterError& error) {
  std::string pointer = "/parameters";
  if (error.parameter >= 0) {
    pointer += "/" + std::to_string(error.parameter);
  }
  if (error.set >= 0) {
    pointer += "/sets/" + std::to_string(error.set);
  }
  return error.key.empty() ? pointer : pointer + "/" + error.key;
}

/// Reads one part after another: the scene is needed to check the rest.
class RunReader {
 public:
  RunReader(const JsonReader& root, std::string folder, const RecordingPart& part,
            FitProblem* problem, std::string* error)
      : root_(root), folder_(std::move(folder)), part_(part), problem_(problem), error_(error) {}

  /// False with the error of the scene or an observation file; errors of the fit file itself are
  /// the reader's.
  bool Read() {
    root_.ExpectKeys({"scene", "observations", "recordings", "initial", "points", "sensors",
                      "cameras", "clocks", "events", "links", "parameters", "derivatives", "loss",
                      "approach", "segments", "starts", "seed", "process_noise", "missing"});
    const std::string scene_file = JoinPath(folder_, root_.At("scene").String());
    if (!root_.ok()) {
      return true;
    }
    if (!LoadScene(scene_file, &problem_->scene, error_)) {
      return false;
    }
    if (!CheckSettings(problem_->scene, error_)) {
      *error_ = scene_file + ": " + *error_;
      return false;
    }
    problem_->points = ReadPoints(root_.At("points"), problem_->scene);
    problem_->instruments = ReadInstruments(root_, problem_->scene, problem_->points);
    problem_->instruments.events = ReadEvents(root_.At("events"), problem_->scene);
    const JsonReader parameters = root_.At("parameters");
    const int count = parameters.ExpectArray("an array of parameters");
    for (int i = 0; i < count; ++i) {
      problem_->parameters.push_back(ReadParameter(parameters.At(i)));
    }
    ExpandLinks();
    problem_->options = ReadOptions(root_);
    CheckShooting();
    if (root_.Has("process_noise")) ReadNoise();
    return ReadObservationFiles();
  }

 private:
  void ReadNoise() {
    const JsonReader list = root_.At("process_noise");
    const int count = list.ExpectArray("an array of {body or joint, coordinate, intensity}");
    for (int i = 0; i < count; ++i) problem_->process_noise.push_back(ReadNoiseTerm(list.At(i)));
    if (!root_.ok()) return;
    if (const auto fault = CheckNoise(problem_->process_noise, problem_->scene)) {
      const JsonReader term = list.At(fault->term);
      (fault->key.empty() ? term : term.At(fault->key)).Fail(fault->what);
    }
    const auto refuse = [this](const char* key, const char* what) {
      if (root_.ok()) root_.At(key).Fail(std::string(what) + " beside process_noise");
    };
    const FitOptions& options = problem_->options;
    if (count == 0) return;
    if (options.derivatives != GradientMethod::kTangent) refuse("derivatives", "expected tangent");
    if (options.segments > 1) refuse("segments", "expected 1");
    if (options.approach == FitApproach::kWindows) refuse("approach", "expected auto or plain");
    if (options.missing == MissingPass::kRun) refuse("missing", "expected false");
    for (const Sensor& sensor : problem_->instruments.sensors) {
      if (sensor.estimate_sigma) refuse("sensors", "expected no estimate_sigma");
    }
  }

  static NoiseTerm ReadNoiseTerm(const JsonReader& json) {
    json.ExpectKeys({"body", "joint", "coordinate", "intensity", "correlation_time"},
                    " of process_noise");
    NoiseTerm term;
    if (json.Has("body")) term.body = json.At("body").String();
    if (json.Has("joint")) term.joint = json.At("joint").String();
    term.coordinate = json.At("coordinate").Choice(kNoiseCoordinates);
    const JsonReader intensity = json.At("intensity");
    if (intensity.IsNumber()) {
      term.intensity = intensity.Number(NumberKind::kPositive);
    } else if (!intensity.IsString() || intensity.String() != "estimate") {
      intensity.FailExpected("\"estimate\" or a number > 0");
    }
    if (json.Has("correlation_time")) {
      term.correlation_time = json.At("correlation_time").Number(NumberKind::kNonNegative);
    }
    return term;
  }

  /// As WhyNoNoise.
  void CheckNoiseRun() {
    if (problem_->process_noise.empty()) return;
    const JsonReader place = root_.At("process_noise");
    for (const FitParameter& parameter : problem_->parameters) {
      for (const ParameterSet& set : parameter.sets) {
        if (MovesTimes(set.path)) {
          place.Fail("expected none where a delay or clock is a parameter, got " + set.path);
        }
        if (set.path.rfind("forces/*", 0) == 0) {
          place.Fail("expected none where a parameter sets all forces, got " + set.path);
        }
      }
    }
    double last = 0.0;
    for (const Observation& one : problem_->observations) {
      if (one.event >= 0 || IsAcceleration(one.coordinate) || IsForce(one.coordinate)) {
        place.Fail("expected none where times of events, accelerations or forces are observed");
        return;
      }
      last = std::max(last, one.time);
    }
    if (!(last > 0.0)) place.Fail("expected none where nothing is observed after the start");
  }

  /// "links/NAME/length" becomes what it moves.
  void ExpandLinks() {
    if (!root_.ok()) return;
    std::vector<Link> links;
    for (const std::string& name : root_.At("links").Keys()) {
      links.push_back(ReadLink(name, root_.At("links").At(name)));
    }
    ParameterError error;
    if (root_.ok() &&
        !ExpandLengths(problem_->scene, problem_->points, links, &problem_->parameters, &error)) {
      const JsonReader parameter = root_.At("parameters").At(error.parameter);
      // A parameter may be its path alone.
      (parameter.Has("sets")   ? parameter.At("sets").At(error.set).At(error.key)
       : parameter.Has("path") ? parameter.At("path")
                               : parameter)
          .Fail(error.what);
    }
  }

  Link ReadLink(const std::string& name, const JsonReader& json) const {
    json.ExpectKeys({"from", "to"}, " of a link");
    Link link;
    link.name = name;
    const auto find = [](const auto& all, const std::string& wanted) {
      for (size_t i = 0; i < all.size(); ++i) {
        if (all[i].name == wanted) return static_cast<int>(i);
      }
      return -1;
    };
    if (name.empty() || name.find_first_of("/*") != std::string::npos || OneLine(name) != name) {
      json.Fail("expected a name without / and *");
      return link;
    }
    link.from = find(problem_->scene.joints, json.At("from").String());
    if (json.At("from").exists() && link.from < 0) {
      json.At("from").FailExpected("the name of a joint");
    }
    const std::string to = json.At("to").String();
    link.to_joint = find(problem_->scene.joints, to);
    link.to_point = link.to_joint < 0 ? find(problem_->points, to) : -1;
    if (json.At("to").exists() && link.to_joint < 0 && link.to_point < 0) {
      json.At("to").FailExpected("the name of a joint or point");
    }
    if (root_.ok()) {
      const std::string wrong = CheckLink(problem_->scene, problem_->points, link);
      if (!wrong.empty()) json.Fail(wrong);
    }
    return link;
  }

  static bool MovesTimes(const std::string& path) {
    return path.rfind("clocks/", 0) == 0 ||
           (path.rfind("sensors/", 0) == 0 && path.find("/delay") != std::string::npos);
  }

  /// The states at the ends of segments are at times that stand still.
  void CheckShooting() {
    for (const FitParameter& parameter : problem_->parameters) {
      for (const ParameterSet& set : parameter.sets) {
        if (MovesTimes(set.path) && problem_->options.segments > 1) {
          root_.At("segments")
              .Fail("expected 1 where a delay or clock is a parameter (" + set.path + "), got " +
                    std::to_string(problem_->options.segments));
          return;
        }
      }
    }
  }

  /// Forces have no derivative by their time.
  void CheckForceTimes() {
    const auto is_force = [](const Observation& one) { return IsForce(one.coordinate); };
    if (std::none_of(problem_->observations.begin(), problem_->observations.end(), is_force))
      return;
    for (size_t i = 0; i < problem_->parameters.size(); ++i) {
      for (const ParameterSet& set : problem_->parameters[i].sets) {
        if (!MovesTimes(set.path)) continue;
        root_.At("parameters")
            .At(static_cast<int>(i))
            .Fail("expected no delay or clock where forces are observed, got " + set.path);
        return;
      }
    }
  }

  /// As RolloutResiduals::NeedsWholeRun.
  void CheckWholeRun() {
    const auto needs_whole = [](const Observation& one) {
      return one.event >= 0 || IsAcceleration(one.coordinate) || IsForce(one.coordinate);
    };
    if (problem_->options.segments > 1 &&
        std::any_of(problem_->observations.begin(), problem_->observations.end(), needs_whole)) {
      root_.At("segments")
          .Fail("expected 1 where times of events, accelerations or forces are observed, got " +
                std::to_string(problem_->options.segments));
    }
  }

  bool ReadObservationFiles() {
    // Times of a part are checked when it has been cut out.
    Scene observed_scene = problem_->scene;
    const bool is_part = part_.start > 0.0 || std::isfinite(part_.end);
    if (is_part) observed_scene.simulation.duration = std::numeric_limits<double>::max();
    const ObservedScene scene{observed_scene, problem_->points, problem_->instruments};
    const JsonReader list = root_.At("observations");
    const int count = list.ExpectArray("an array of {file, sigma}");
    if (count == 0) {
      list.Fail("expected at least one {file, sigma}, got none");
    }
    for (int i = 0; i < count && root_.ok(); ++i) {
      const JsonReader entry = list.At(i);
      ObservationEntry observed = ReadObservationEntry(entry, scene);
      if (!root_.ok()) {
        return true;
      }
      observed.options.channel.file = i;
      problem_->files.push_back(observed.file);
      const size_t before = problem_->observations.size();
      if (!ReadObservations(JoinPath(folder_, observed.file), scene, observed.sigma,
                            observed.options, &problem_->channels, &problem_->observations,
                            error_)) {
        return false;
      }
      const bool any =
          std::any_of(problem_->observations.begin() + static_cast<std::ptrdiff_t>(before),
                      problem_->observations.end(),
                      [](const Observation& one) { return IsAcceleration(one.coordinate); });
      for (const char* key : {"frame", "gravity"}) {
        if (!entry.Has(key) || any) continue;
        entry.At(key).Fail("expected a file with ax, ay or alpha, got " + observed.file);
        return true;
      }
      for (size_t k = before; k < problem_->observations.size(); ++k) {
        const Observation& observation = problem_->observations[k];
        if (!(observation.sigma > 0.0)) {
          entry.At("sigma").Fail("expected a sigma of " + SigmaKey(observation) + ", which " +
                                 observed.file + " has");
          return true;
        }
      }
    }
    if (root_.ok()) CheckWholeRun();
    if (root_.ok()) CheckForceTimes();
    if (is_part && root_.ok()) Cut();
    if (root_.ok()) CheckNoiseRun();
    return true;
  }

  std::string SigmaKey(const Observation& observation) const {
    return observation.event < 0 ? NameOf(observation.coordinate)
                                 : problem_->instruments.events[observation.event].name;
  }

  /// Times and numbers of events count from the start of the part.
  void Cut() {
    std::vector<Observation> kept;
    std::vector<int> earlier(problem_->instruments.events.size(), 0);
    for (const Observation& observation : problem_->observations) {
      if (observation.event < 0 || observation.time >= part_.start) continue;
      earlier[observation.event] = std::max(earlier[observation.event], observation.number);
    }
    for (Observation observation : problem_->observations) {
      if (observation.time < part_.start || observation.time > part_.end) continue;
      observation.time -= part_.start;
      if (observation.event >= 0) {
        observation.value -= part_.start;
        observation.number -= earlier[observation.event];
      }
      const double end = problem_->scene.simulation.duration;
      const double slack = kTimeTolerance * problem_->scene.simulation.dt;
      if (observation.time > end && observation.time <= end + slack) observation.time = end;
      kept.push_back(observation);
      if (observation.time > end) {
        root_.At("observations")
            .Fail("expected times in the run, which ends " +
                  CompactNumber(problem_->scene.simulation.duration) + " s after start, got " +
                  CompactNumber(observation.time) + " s after it");
        return;
      }
    }
    if (kept.empty()) root_.At("observations").Fail("expected some from start to end, got none");
    problem_->observations = std::move(kept);
  }

  JsonReader root_;
  std::string folder_;
  RecordingPart part_;
  FitProblem* problem_;
  std::string* error_;
};

}  // namespace

bool ReadDistribution(const JsonReader& json, const std::string& of, PriorKind* kind) {
  json.ExpectKeys({"gaussian", "log_normal"}, of);
  if (json.Has("gaussian") == json.Has("log_normal")) {
    json.Fail("expected one of gaussian and log_normal, got " +
              std::string(json.Has("gaussian") ? "both" : "none"));
    return false;
  }
  *kind = json.Has("gaussian") ? PriorKind::kGaussian : PriorKind::kLogNormal;
  return true;
}

std::string DescribeFault(const std::string& name, const ParameterError& fault) {
  return OneLine(name + ": " + PointerOf(fault) + ": " + fault.what);
}

bool ReadRun(const Json& json, const std::string& name, const std::string& folder,
             const RecordingPart& part, FitProblem* problem, std::string* error) {
  *problem = FitProblem();
  JsonErrors errors(name);
  RunReader reader(JsonReader(json, &errors), folder, part, problem, error);
  const bool read = reader.Read();
  if (!errors.ok()) {
    *error = errors.message();
    return false;
  }
  problem->observations.shrink_to_fit();
  ParameterizedScene scene;
  ParameterError fault;
  if (read && !scene.Create(problem->scene, problem->points, problem->parameters, &fault,
                            problem->instruments)) {
    *error = DescribeFault(name, fault);
    return false;
  }
  return read;
}

}  // namespace tangible
