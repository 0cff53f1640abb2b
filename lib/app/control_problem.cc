// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/control_problem.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "tangible/app/control_schema.h"
#include "tangible/app/program.h"
#include "tangible/app/tolerances.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

// Steps of a plan or a run: each has controls, and a plan has Jacobians of each.
constexpr double kMostSteps = 1e7;
// Each sample is its controls in memory.
constexpr int kMostSamples = 100000;
constexpr int kDefaultSamples = 64;

// The duration of a problem, which is rounded up to whole steps of dt, s.
double ReadHorizon(const JsonReader& json, double dt) {
  const double horizon = json.Number(NumberKind::kPositive);
  if (json.ok() && horizon > kMostSteps * dt) json.FailExpected("a time of at most 1e7 steps");
  return horizon;
}

// A duration that is rounded to the nearest number of steps, s.
double ReadSpan(const JsonReader& json, double dt) {
  const double span = json.Number(NumberKind::kPositive);
  if (json.ok() && !(span >= 0.5 * dt && span <= kMostSteps * dt)) {
    json.FailExpected("a time of at least half a step and at most 1e7 steps");
  }
  return span;
}

// The path of a file is relative to the folder of the problem's file, unless it is absolute.
std::string Beside(const std::string& file, const std::string& path) {
  return (std::filesystem::path(file).parent_path() / path).string();
}

// A plan's controls, a row a step, as --plan writes them.
class InitialTable {
 public:
  InitialTable(const std::string& file, ControlFile* problem) : file_(file), problem_(*problem) {}

  /// Empty, or what is wrong with the file, one line.
  std::string Read() {
    std::vector<std::string> columns = {"time"};
    columns.insert(columns.end(), problem_.paths.begin(), problem_.paths.end());
    std::string error;
    if (!ReadCsv(file_, columns, columns, &table_, &error)) return error;
    const long steps = NumSteps(problem_.scene.simulation);
    if (static_cast<long>(table_.rows.size()) != steps) {
      return file_ + ": expected a row for each of the horizon's " + std::to_string(steps) +
             " steps, got " + std::to_string(table_.rows.size());
    }
    problem_.initial_table.resize(steps, static_cast<Eigen::Index>(problem_.paths.size()));
    for (long k = 0; k < steps && error.empty(); ++k) error = ReadRow(static_cast<int>(k));
    return error;
  }

 private:
  std::string Expected(int row, const std::string& column, const std::string& what,
                       double got) const {
    return file_ + ": line " + std::to_string(table_.lines[row]) + ": " + column + ": expected " +
           what + ", got " + FormatNumber(got);
  }

  std::string ReadRow(int row) {
    std::string error;
    double value = 0.0;
    const double dt = problem_.scene.simulation.dt;
    if (!ReadCell(table_, row, table_.Column("time"), &value, &error)) return error;
    if (!(std::abs(value - row * dt) <= kSameStep * dt)) {
      return Expected(row, "time", "the start of the step, " + FormatNumber(row * dt), value);
    }
    for (size_t i = 0; i < problem_.paths.size(); ++i) {
      const std::string& path = problem_.paths[i];
      const auto control = static_cast<Eigen::Index>(i);
      if (!ReadCell(table_, row, table_.Column(path), &value, &error)) return error;
      if (!(value >= problem_.low[control] && value <= problem_.high[control])) {
        return Expected(row, path, "a number from low to high", value);
      }
      problem_.initial_table(row, control) = value;
    }
    return "";
  }

  const std::string file_;
  ControlFile& problem_;
  CsvTable table_;
};

// Reads the parts of a problem whose scene is known.
class Reader {
 public:
  Reader(const JsonReader& root, const std::string& file, ControlFile* problem)
      : root_(root), file_(file), problem_(*problem) {}

  /// What is wrong with a file that the problem names, one line; empty: nothing.
  const std::string& error() const { return error_; }

  void Read() {
    ReadControls();
    if (!root_.ok()) return;
    outputs_ = OutputNames(*BuildStructure(problem_.scene));
    ReadCost();
    if (root_.Has("max_iterations")) {
      problem_.options.max_iterations = root_.At("max_iterations").Integer(1, 1000000);
    }
    if (root_.Has("gradient_tolerance")) {
      problem_.options.gradient_tolerance =
          root_.At("gradient_tolerance").Number(NumberKind::kPositive);
    }
    if (root_.Has("second_order")) ReadSecondOrder(root_.At("second_order"));
    if (root_.Has("reference_extension")) {
      const JsonReader extension = root_.At("reference_extension");
      problem_.options.reference_extension = extension.Boolean();
      if (problem_.options.reference_extension &&
          problem_.scene.simulation.stepping != Stepping::kEvent) {
        extension.Fail("expected with event stepping only, got fixed stepping");
      }
    }
    if (root_.Has("surrogate")) ReadSurrogate(root_.At("surrogate"));
    if (root_.Has("starts")) ReadStarts(root_.At("starts"));
    if (root_.Has("sampling")) ReadSampling(root_.At("sampling"));
    if (root_.Has("initial")) ReadInitial(root_.At("initial"));
    if (root_.Has("mpc")) ReadPredictive(root_.At("mpc"));
  }

 private:
  void ReadControls() {
    const JsonReader list = root_.At("controls");
    const int count = list.ExpectArray("an array of controls");
    if (count == 0) list.Fail("expected at least one control, got none");
    problem_.low.setConstant(count, -std::numeric_limits<double>::infinity());
    problem_.high = -problem_.low;
    problem_.initial.setZero(count);
    for (int i = 0; i < count; ++i) {
      const JsonReader control = list.At(i);
      control.ExpectKeys({"path", "low", "high", "initial"}, " of a control");
      problem_.paths.push_back(control.At("path").String());
      if (control.Has("low")) problem_.low[i] = control.At("low").Number();
      if (control.Has("high")) problem_.high[i] = control.At("high").Number();
      if (problem_.low[i] > problem_.high[i]) {
        control.At("high").FailExpected("a number >= low");
        return;
      }
      problem_.initial[i] = std::clamp(0.0, problem_.low[i], problem_.high[i]);
      if (!control.Has("initial")) continue;
      problem_.initial[i] = control.At("initial").Number();
      if (!(problem_.initial[i] >= problem_.low[i] && problem_.initial[i] <= problem_.high[i])) {
        control.At("initial").FailExpected("a number from low to high");
      }
    }
    if (!root_.ok()) return;
    int which = -1;
    const std::string error = CheckControls(problem_.scene, problem_.paths, &which);
    if (!error.empty()) (which < 0 ? root_.At("scene") : list.At(which).At("path")).Fail(error);
  }

  void ReadCost() {
    const JsonReader list = root_.At("cost");
    const int count = list.ExpectArray("an array of terms");
    if (count == 0) list.Fail("expected at least one term, got none");
    for (int i = 0; i < count && root_.ok(); ++i) {
      ReadTerm(list.At(i));
      if (root_.ok()) NameTerms("/cost/" + std::to_string(i));
    }
  }

  // Names the terms that the place has added.
  void NameTerms(const std::string& place) {
    while (problem_.term_names.size() < problem_.terms.size()) {
      const CostTerm& term = problem_.terms[problem_.term_names.size()];
      const bool control = term.kind == CostTerm::Kind::kControl;
      std::string of = control ? problem_.paths[term.index] : outputs_[term.index];
      if (term.kind == CostTerm::Kind::kPoint) {
        of.resize(of.size() - 2);
        of.insert(0, term.axis == 0 ? "x of a point of " : "y of a point of ");
      }
      std::string& name = problem_.term_names.emplace_back(place);
      name.append(" (").append(of).append(")");
    }
  }

  // The index of a name, or 0 and a failure that lists some.
  int IndexOf(const JsonReader& json, const std::vector<std::string>& names,
              const std::string& what) const {
    const std::string name = json.String();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      json.FailExpected(what + (names.empty() ? "" : " such as " + names[0]));
    return found == names.end() ? 0 : static_cast<int>(found - names.begin());
  }

  void ReadTerm(const JsonReader& json) {
    json.ExpectKeys({"state", "point", "control", "target", "weight", "at", "wrap"}, " of a term");
    const int kinds =
        (json.Has("state") ? 1 : 0) + (json.Has("point") ? 1 : 0) + (json.Has("control") ? 1 : 0);
    if (kinds != 1) {
      json.Fail("expected one of state, point and control, got " + std::to_string(kinds));
      return;
    }
    CostTerm term;
    if (json.Has("weight")) term.weight = json.At("weight").Number(NumberKind::kNonNegative);
    if (json.Has("at")) term.at_end = json.At("at").Choice({"steps", "end"}) == 1;
    if (json.Has("wrap") && !json.Has("state")) {
      json.At("wrap").Fail("expected with an angle only");
    }
    if (json.Has("point")) {
      ReadPoint(json, term);
      return;
    }
    if (json.Has("target")) term.target = json.At("target").Number();
    if (json.Has("control")) {
      term.kind = CostTerm::Kind::kControl;
      term.index = IndexOf(json.At("control"), problem_.paths, "one of the controls");
      if (term.at_end) json.At("at").Fail("expected steps with a control, got end");
    } else {
      term.index = IndexOf(json.At("state"), outputs_, "a number of the state");
      if (json.Has("wrap") && json.At("wrap").Boolean()) {
        term.kind = CostTerm::Kind::kAngle;
        if (term.index % 6 != 2) json.At("wrap").Fail("expected with an angle only");
      }
    }
    problem_.terms.push_back(term);
  }

  // A point's two coordinates are two terms.
  void ReadPoint(const JsonReader& json, CostTerm term) {
    PlacePoint(json.At("point"), &term);
    const Vector2<double> target = json.At("target").Point();
    for (int axis = 0; axis < 2; ++axis) {
      term.axis = axis;
      term.target = target[axis];
      problem_.terms.push_back(term);
    }
  }

  void PlacePoint(const JsonReader& point, CostTerm* term) const {
    point.ExpectKeys({"body", "at"}, " of a point");
    std::vector<std::string> bodies;
    for (size_t i = 0; i < outputs_.size(); i += 6) {
      bodies.push_back(outputs_[i].substr(0, outputs_[i].size() - 2));
    }
    term->kind = CostTerm::Kind::kPoint;
    term->index = 6 * IndexOf(point.At("body"), bodies, "a moving body");
    if (point.Has("at")) term->at = point.At("at").Point();
  }

  // True, false or "secants".
  void ReadSecondOrder(const JsonReader& json) {
    if (json.IsString()) {
      if (json.String() != "secants") json.FailExpected("true, false or \"secants\"");
      problem_.options.secants = true;
    } else {
      problem_.options.second_order = json.Boolean();
    }
  }

  void ReadSurrogate(const JsonReader& json) {
    json.ExpectKeys({"samples", "deviation", "seed"}, " of surrogate");
    SampledSurrogate& surrogate = problem_.options.surrogate;
    surrogate.samples = json.At("samples").Integer(2, 1000000);
    if (surrogate.samples % 2 != 0) json.At("samples").FailExpected("an even number");
    if (json.Has("deviation")) {
      surrogate.deviation = json.At("deviation").Number(NumberKind::kPositive);
    }
    NeedBounds("a surrogate, whose deviation is a share of their range");
    ReadSeed(json, &surrogate.seed);
  }

  void NeedBounds(const std::string& with) const {
    for (int i = 0; i < static_cast<int>(problem_.paths.size()); ++i) {
      if (std::isfinite(problem_.low[i]) && std::isfinite(problem_.high[i])) continue;
      root_.At("controls")
          .At(i)
          .Fail("expected low and high with " + with + ", got a control without both");
    }
  }

  static void ReadSeed(const JsonReader& json, unsigned* seed) {
    if (json.Has("seed")) *seed = static_cast<unsigned>(json.At("seed").Integer(0, 1000000000));
  }

  // A number of starts, or an object.
  void ReadStarts(const JsonReader& json) {
    StartOptions& starts = problem_.starts;
    if (json.IsNumber()) {
      starts.count = json.Integer(1, kMostStarts);
    } else {
      json.ExpectKeys({"count", "pieces", "seed"}, " of starts");
      starts.count = json.At("count").Integer(1, kMostStarts);
      if (json.Has("pieces")) starts.pieces = json.At("pieces").Integer(1, 1000000);
      ReadSeed(json, &starts.seed);
    }
    if (starts.count > 1) NeedBounds("starts, which are drawn between them");
  }

  void ReadSampling(const JsonReader& json) {
    json.ExpectKeys({"method", "samples", "iterations", "seed"}, " of sampling");
    SamplingOptions& sampling = problem_.sampling;
    sampling.method = json.At("method").Choice({"cross_entropy", "mppi"}) == 0
                          ? SamplingMethod::kCrossEntropy
                          : SamplingMethod::kMppi;
    sampling.samples =
        json.Has("samples") ? json.At("samples").Integer(2, kMostSamples) : kDefaultSamples;
    if (json.Has("iterations")) sampling.iterations = json.At("iterations").Integer(1, 10000);
    ReadSeed(json, &sampling.seed);
    NeedBounds("sampling, which draws between them");
  }

  void ReadInitial(const JsonReader& json) {
    json.ExpectKeys({"file"}, " of initial");
    const std::string path = json.At("file").String();
    if (root_.ok()) error_ = InitialTable(Beside(file_, path), &problem_).Read();
  }

  void ReadPredictive(const JsonReader& json) {
    json.ExpectKeys({"duration", "horizon", "iterations", "observations"}, " of mpc");
    const double dt = problem_.scene.simulation.dt;
    problem_.run_duration = ReadSpan(json.At("duration"), dt);
    problem_.plan_horizon = ReadSpan(json.At("horizon"), dt);
    if (json.Has("iterations")) {
      problem_.plan_iterations = json.At("iterations").Integer(1, 1000000);
    }
    if (json.Has("observations")) ReadObservations(json.At("observations"));
  }

  void ReadObservations(const JsonReader& json) {
    json.ExpectKeys({"sensors", "every", "seed", "initial_sigma", "acceleration_sigma"},
                    " of observations");
    FilterOptions& filter = problem_.filter;
    const JsonReader sensors = json.At("sensors");
    const int count = sensors.ExpectArray("an array of sensors");
    if (count == 0) sensors.Fail("expected at least one sensor, got none");
    std::vector<double> sigma;
    for (int i = 0; i < count && root_.ok(); ++i) {
      const JsonReader sensor = sensors.At(i);
      sensor.ExpectKeys({"state", "point", "sigma"}, " of a sensor");
      if (sensor.Has("state") == sensor.Has("point")) {
        sensor.Fail(std::string("expected one of state and point, got ") +
                    (sensor.Has("state") ? "both" : "neither"));
        return;
      }
      CostTerm term;
      if (sensor.Has("state")) {
        term.index = IndexOf(sensor.At("state"), outputs_, "a number of the state");
      } else {
        PlacePoint(sensor.At("point"), &term);
      }
      const double noise = sensor.At("sigma").Number(NumberKind::kPositive);
      for (term.axis = 0; term.axis < (sensor.Has("point") ? 2 : 1); ++term.axis) {
        filter.sensors.push_back(term);
        sigma.push_back(noise);
      }
    }
    filter.sigma =
        Eigen::Map<const VectorX<double>>(sigma.data(), static_cast<Eigen::Index>(sigma.size()));
    if (json.Has("every")) problem_.observe_every = json.At("every").Integer(1, 1000000);
    ReadSeed(json, &problem_.noise_seed);
    for (const auto& [key, value] : {std::pair("initial_sigma", &filter.initial_sigma),
                                     {"acceleration_sigma", &filter.acceleration_sigma}}) {
      if (json.Has(key)) *value = json.At(key).Number(NumberKind::kNonNegative);
    }
  }

  const JsonReader& root_;
  const std::string& file_;
  ControlFile& problem_;
  std::vector<std::string> outputs_;
  std::string error_;
};

}  // namespace

std::string CheckControls(const Scene& scene, const std::vector<std::string>& paths, int* which) {
  RolloutFunction function;
  *which = -1;
  std::string error = function.Create(scene, {}, {}, {});
  for (size_t i = 0; i < paths.size() && error.empty(); ++i) {
    *which = static_cast<int>(i);
    error = function.Create(scene, {}, {paths.begin(), paths.begin() + *which + 1}, {});
  }
  return error;
}

RowMatrixXd ControlFile::InitialControls(long steps) const {
  if (initial_table.rows() == 0) return initial.transpose().replicate(steps, 1);
  RowMatrixXd controls(steps, initial_table.cols());
  for (long k = 0; k < steps; ++k) {
    controls.row(k) = initial_table.row(std::min<Eigen::Index>(k, initial_table.rows() - 1));
  }
  return controls;
}

bool LoadControlFile(const std::string& file, ControlFile* problem, std::string* error) {
  std::string text;
  return ReadTextFile(file, &text, error) && ParseControlFile(text, file, problem, error);
}

bool ParseControlFile(const std::string& text, const std::string& file, ControlFile* problem,
                      std::string* error) {
  Json json;
  if (!ParseJson(text, file, &json, error)) return false;
  JsonErrors errors(file);
  const JsonReader root(json, &errors);
  root.ExpectKeys({"name", "scene", "controls", "cost", "horizon", "max_iterations",
                   "gradient_tolerance", "second_order", "reference_extension", "surrogate",
                   "starts", "sampling", "initial", "mpc"});
  if (root.Has("name")) root.At("name").String();
  const std::string scene = root.At("scene").String();
  if (errors.ok()) {
    problem->scene_path = Beside(file, scene);
    if (!LoadScene(problem->scene_path, &problem->scene, error)) return false;
    if (root.Has("horizon")) {
      problem->scene.simulation.duration =
          ReadHorizon(root.At("horizon"), problem->scene.simulation.dt);
    } else if (!(problem->scene.simulation.duration > 0.0)) {
      root.At("horizon").Fail("missing, expected a number > 0, as the scene's duration is 0");
    }
    // Controls are held over whole steps.
    SimulationSettings& settings = problem->scene.simulation;
    settings.duration = static_cast<double>(NumSteps(settings)) * settings.dt;
    Reader reader(root, file, problem);
    reader.Read();
    if (errors.ok() && !reader.error().empty()) {
      *error = reader.error();
      return false;
    }
  }
  *error = errors.message();
  return errors.ok();
}

}  // namespace tangible
