// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/fit_checkpoint.h"

#include <utility>

#include "tangible/math/bit_hash.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

constexpr char kFormat[] = "tangible-fit checkpoint 7";
// A write waits for this multiple of the duration of the last write.
constexpr int kWait = 10;

// CBOR stores doubles exactly, including infinite ones.
template <typename Values>
Json Array(const Values& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

Eigen::VectorXd ReadVector(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// `rows` rows of any length.
RowMatrixXd ReadMatrix(const Json& json, Eigen::Index rows) {
  const auto values = json.get<std::vector<double>>();
  const auto size = static_cast<Eigen::Index>(values.size());
  return Eigen::Map<const RowMatrixXd>(values.data(), rows, rows == 0 ? 0 : size / rows);
}

Json ToJson(const EvaluationLog& log) {
  Json array = Json::array();
  for (const Evaluation& e : log.evaluations()) {
    array.push_back({{"at", Array(e.at)},
                     {"with_jacobian", e.with_jacobian},
                     {"done", e.done},
                     {"message", e.message},
                     {"rollouts", e.rollouts},
                     {"residuals", Array(e.residuals)},
                     {"jacobian", Array(e.jacobian)}});
  }
  return array;
}

void Read(const Json& json, EvaluationLog* log) {
  std::vector<Evaluation> evaluations;
  for (const Json& entry : json) {
    Evaluation& e = evaluations.emplace_back();
    e.at = ReadVector(entry.at("at"));
    e.with_jacobian = entry.at("with_jacobian");
    e.done = entry.at("done");
    e.message = entry.at("message");
    e.rollouts = entry.at("rollouts");
    e.residuals = ReadVector(entry.at("residuals"));
    e.jacobian = ReadMatrix(entry.at("jacobian"), e.residuals.size());
  }
  log->Restore(std::move(evaluations));
}

Json ToJson(const FitStart& start) {
  return {{"initial", start.initial},       {"cost", start.cost},
          {"iterations", start.iterations}, {"approach_iterations", start.approach_iterations},
          {"status", start.status},         {"approach", start.approach},
          {"plain_cost", start.plain_cost}, {"tried", start.tried},
          {"tried_cost", start.tried_cost}, {"message", start.message},
          {"estimate", start.estimate}};
}

FitStart ReadStart(const Json& json) {
  return {json.at("initial"),    json.at("cost"),
          json.at("iterations"), json.at("approach_iterations"),
          json.at("status"),     json.at("approach"),
          json.at("plain_cost"), json.at("tried"),
          json.at("tried_cost"), json.at("message"),
          json.at("estimate")};
}

Json ToJson(const Minimum& minimum) {
  Json iterations = Json::array();
  for (const FitIteration& i : minimum.iterations) {
    iterations.push_back({i.cost, i.gradient_norm, i.parameters, i.seconds});
  }
  return {{"status", static_cast<int>(minimum.status)},
          {"message", minimum.message},
          {"parameters", Array(minimum.parameters)},
          {"cost", minimum.cost},
          {"iterations", iterations},
          {"rollouts", minimum.rollouts},
          {"approach",
           {static_cast<int>(minimum.approach), minimum.approach_iterations,
            minimum.approach_message}}};
}

Minimum ReadMinimum(const Json& json) {
  Minimum minimum;
  minimum.status = static_cast<FitStatus>(json.at("status").get<int>());
  minimum.message = json.at("message");
  minimum.parameters = ReadVector(json.at("parameters"));
  minimum.cost = json.at("cost");
  minimum.rollouts = json.at("rollouts");
  minimum.approach = static_cast<FitApproach>(json.at("approach").at(0).get<int>());
  minimum.approach_iterations = json.at("approach").at(1);
  minimum.approach_message = json.at("approach").at(2);
  for (const Json& i : json.at("iterations")) {
    minimum.iterations.push_back({i.at(0), i.at(1), i.at(2), i.at(3)});
  }
  return minimum;
}

Json ToJson(const FitLog& log) {
  Json starts = Json::array();
  for (const FitStart& start : log.starts) {
    starts.push_back(ToJson(start));
  }
  Json json = {{"search", ToJson(log.search)},
               {"starts", starts},
               {"start", ToJson(log.start)},
               {"rollouts", log.rollouts}};
  if (!log.starts.empty()) {
    json["best"] = ToJson(log.best);
  }
  for (const Minimum& minimum : log.reached) {
    json["reached"].push_back(ToJson(minimum));
  }
  if (log.shot) {
    json["shot"] = {Array(log.shot->parameters), log.shot->iterations, log.shot->rollouts,
                    log.shot->message};
  }
  return json;
}

void Read(const Json& json, FitLog* log) {
  Read(json.at("search"), &log->search);
  Read(json.at("start"), &log->start);
  log->rollouts = json.at("rollouts");
  for (const Json& start : json.at("starts")) {
    log->starts.push_back(ReadStart(start));
  }
  if (!log->starts.empty()) {
    log->best = ReadMinimum(json.at("best"));
  }
  for (const Json& minimum : json.value("reached", Json::array())) {
    log->reached.push_back(ReadMinimum(minimum));
  }
  if (json.contains("shot")) {
    const Json& shot = json.at("shot");
    log->shot = {ReadVector(shot.at(0)), shot.at(1), shot.at(2), shot.at(3)};
  }
}

std::string Encode(const Json& json) {
  std::string text;
  Json::to_cbor(json, text);
  return text;
}

std::string HashOf(const std::string& text) {
  BitHash hash;
  hash.Add(text);
  return hash.Text();
}

void AddSignal(const std::optional<Signal>& signal, BitHash* hash) {
  if (signal) {
    for (const std::vector<double>* series :
         {&signal->time, &signal->x, &signal->y, &signal->value}) {
      hash->AddAll(*series);
    }
  }
}

void AddOptional(const std::optional<double>& x, BitHash* hash) {
  hash->Add(static_cast<int>(x.has_value()));
  hash->Add(x.value_or(0.0));
}

void AddScene(const FitProblem& problem, BitHash* to) {
  BitHash& hash = *to;
  hash.Add(SceneToJson(problem.scene));
  for (const auto& joint : problem.scene.joints) {
    AddSignal(joint.effort_signal, to);
  }
  for (const auto& force : problem.scene.forces) {
    AddSignal(force.force_signal, to);
    AddSignal(force.torque_signal, to);
  }
  for (const BodyPoint& point : problem.points) {
    hash.Add(point.name);
    hash.Add(point.body);
    hash.AddAll(point.at);
  }
}

void AddParameters(const FitProblem& problem, BitHash* to) {
  BitHash& hash = *to;
  for (const FitParameter& parameter : problem.parameters) {
    hash.Add(parameter.name);
    AddOptional(parameter.initial, to);
    AddOptional(parameter.lower, to);
    hash.Add(static_cast<int>(parameter.scale));
    hash.Add(parameter.prior ? static_cast<int>(parameter.prior->kind) : -1);
    if (parameter.prior) {
      hash.Add(parameter.prior->center);
      hash.Add(parameter.prior->sigma);
    }
    AddOptional(parameter.upper, to);
    for (const ParameterSet& set : parameter.sets) {
      hash.Add(set.path);
      hash.Add(set.scale);
      hash.Add(set.offset);
      hash.Add(static_cast<int>(set.mode));
    }
  }
}

void AddObservations(const FitProblem& problem, BitHash* to) {
  BitHash& hash = *to;
  Instruments instruments = problem.instruments;
  for (const InstrumentNumber& number : EnumerateNumbers(&instruments)) {
    hash.Add(number.path);
    hash.Add(*number.value);
  }
  for (const Sensor& sensor : problem.instruments.sensors) {
    hash.Add(static_cast<int>(sensor.estimate_sigma));
  }
  for (const Camera& camera : problem.instruments.cameras) {
    hash.Add(camera.marker_body);
    hash.Add(camera.marker_point);
    hash.Add(camera.radial_length);
  }
  for (const Channel& channel : problem.channels) {
    for (const int number :
         {channel.sensor, channel.camera, channel.clock, channel.to_body, channel.to_point}) {
      hash.Add(number);
    }
    if (channel.body_frame || channel.gravity) {
      hash.Add((channel.body_frame ? 1 : 0) + (channel.gravity ? 2 : 0));
    }
  }
  for (const Observation& o : problem.observations) {
    hash.Add(o.channel);
    hash.AddAll(std::array<double, 2>{static_cast<double>(o.body), static_cast<double>(o.point)});
    hash.Add(static_cast<int>(o.coordinate));
    hash.AddAll(std::array<double, 3>{o.time, o.value, o.sigma});
    if (IsForce(o.coordinate)) {
      for (const int number : {o.joint, o.pair[0], o.pair[1]}) hash.Add(number);
    }
    if (o.event < 0) continue;
    const ObservedEvent& event = problem.instruments.events[o.event];
    for (const int number :
         {o.number, static_cast<int>(event.kind), event.bodies[0], event.bodies[1]}) {
      hash.Add(number);
    }
  }
}

}  // namespace

std::uint64_t Fingerprint(const FitInput& input) {
  BitHash hash;
  for (const ParameterScope& scope : input.scopes) {
    hash.Add(static_cast<int>(scope.kind));
    hash.Add(static_cast<int>(scope.distribution));
    AddOptional(scope.spread, &hash);
  }
  for (const RecordingInput& recording : input.recordings) {
    hash.Add(recording.name);
    hash.Add(recording.weight);
    AddScene(recording.problem, &hash);
    AddParameters(recording.problem, &hash);
    AddObservations(recording.problem, &hash);
  }
  const FitOptions& options = input.options();
  hash.Add(NameOf(options.derivatives));
  hash.Add(options.huber);
  hash.Add(NameOf(options.approach));
  for (const int number :
       {options.segments, options.starts, static_cast<int>(options.seed), options.max_iterations}) {
    hash.Add(number);
  }
  return hash.value();
}

FitCheckpoint::FitCheckpoint(const FitInput& input, Writer writer)
    : problem_(Fingerprint(input)), writer_(std::move(writer)) {}

FitLog* FitCheckpoint::Add() {
  FitLog& log = fits_.emplace_back();
  log.on_end = [this] { WriteOnTheWay(); };
  log.search.OnIteration([this] { WriteNowAndThen(); });
  log.start.OnIteration([this] { WriteNowAndThen(); });
  return &log;
}

FitLog* FitCheckpoint::Next() { return next_++ < fits_.size() ? &fits_[next_ - 1] : Add(); }

long FitCheckpoint::mismatch() const {
  for (const FitLog& log : fits_) {
    if (log.mismatch() != 0) {
      return log.mismatch();
    }
  }
  return 0;
}

std::string FitCheckpoint::Text() const {
  Json fits = Json::array();
  for (const FitLog& log : fits_) {
    fits.push_back(ToJson(log));
  }
  const Json json = {{"problem", problem_}, {"fits", fits}};
  const std::string content = Encode(json);
  return std::string(kFormat) + " " + HashOf(content) + "\n" + content;
}

// The hash stands before the content and is checked first, so that only content written by this
// program is decoded.
std::string FitCheckpoint::Restore(const std::string& text, const std::string& file) {
  const size_t end = text.find('\n');
  if (end == std::string::npos || text.rfind(kFormat, 0) != 0) {
    return file + ": expected a \"" + kFormat +
           "\", got another or a damaged file; remove it to begin anew";
  }
  std::string damaged =
      file + ": damaged: its content is not what was written; remove the file to begin anew";
  const std::string content = text.substr(end + 1);
  if (text.substr(0, end) != std::string(kFormat) + " " + HashOf(content)) {
    return damaged;
  }
  try {
    const Json json = Json::from_cbor(content);
    if (json.at("problem") != problem_) {
      return file +
             ": /problem: a checkpoint of another fit: scene, parameters, observations or options "
             "differ; name another file, or remove this one to begin anew";
    }
    for (const Json& fit : json.at("fits")) {
      Read(fit, Add());
    }
  } catch (const Json::exception&) {
    return damaged;
  }
  return "";
}

std::string FitCheckpoint::Write() {
  const auto began = std::chrono::steady_clock::now();
  std::string error = writer_(Text());
  written_ = std::chrono::steady_clock::now();
  write_time_ = written_ - began;
  return error;
}

void FitCheckpoint::WriteOnTheWay() {
  if (error_.empty()) {
    error_ = Write();
  }
}

void FitCheckpoint::WriteNowAndThen() {
  if (std::chrono::steady_clock::now() - written_ >= kWait * write_time_) {
    WriteOnTheWay();
  }
}

}  // namespace tangible
