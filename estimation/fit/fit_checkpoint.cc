// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/fit_checkpoint.h"

#include <charconv>
#include <cstring>
#include <utility>

#include "tangible/math/bit_hash.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

constexpr char kFormat[] = "tangible-fit checkpoint 1";
constexpr int kDigits = 16;  // hexadecimal, of a number
constexpr char kZero = '.';  // Jacobians of multiple shooting are full of them
// A write waits until so many times the last one's time has gone by.
constexpr int kWait = 10;

// ---- numbers as their bits

template <typename Numbers>
std::string Bits(const Numbers& numbers) {
  static constexpr char kHexadecimal[] = "0123456789abcdef";
  std::string text;
  for (size_t i = 0; i < static_cast<size_t>(numbers.size()); ++i) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, numbers.data() + i, sizeof bits);
    if (bits == 0) {
      text += kZero;
      continue;
    }
    for (int digit = kDigits - 1; digit >= 0; --digit) {
      text += kHexadecimal[(bits >> (4 * digit)) & 15U];
    }
  }
  return text;
}

std::string Bits(double x) { return Bits(std::array<double, 1>{x}); }

std::vector<double> Numbers(const JsonReader& json) {
  const std::string text = json.String();
  const char* const end = text.data() + text.size();
  std::vector<double> numbers;
  for (const char* at = text.data(); at != end;) {
    std::uint64_t bits = 0;
    if (*at == kZero) {
      ++at;
    } else {
      const char* const next = end - at < kDigits ? end : at + kDigits;
      if (next - at < kDigits || std::from_chars(at, next, bits, 16).ptr != next) {
        json.Fail("expected numbers of 16 hexadecimal digits each");
        return {};
      }
      at = next;
    }
    double number = 0.0;
    std::memcpy(&number, &bits, sizeof number);
    numbers.push_back(number);
  }
  return numbers;
}

Eigen::VectorXd ReadVector(const JsonReader& json) {
  const std::vector<double> numbers = Numbers(json);
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(),
                                           static_cast<Eigen::Index>(numbers.size()));
}

double ReadNumber(const JsonReader& json) {
  const std::vector<double> numbers = Numbers(json);
  return numbers.size() == 1 ? numbers[0] : 0.0;
}

/// `rows` rows of any length.
RowMatrixXd ReadMatrix(const JsonReader& json, Eigen::Index rows) {
  const std::vector<double> numbers = Numbers(json);
  const auto size = static_cast<Eigen::Index>(numbers.size());
  if (rows == 0 ? size > 0 : size % rows != 0) {
    json.Fail("expected a multiple of " + std::to_string(rows) + " numbers, got " +
              std::to_string(size));
    return {};
  }
  return Eigen::Map<const RowMatrixXd>(numbers.data(), rows, rows == 0 ? 0 : size / rows);
}

// ---- what is kept

constexpr int kMostCount = 2'000'000'000;

Json ToJson(const EvaluationLog& log) {
  Json array = Json::array();
  for (const Evaluation& e : log.evaluations()) {
    array.push_back({{"at", Bits(e.at)},
                     {"with_jacobian", e.with_jacobian},
                     {"done", e.done},
                     {"message", e.message},
                     {"rollouts", e.rollouts},
                     {"residuals", Bits(e.residuals)},
                     {"jacobian", Bits(e.jacobian)}});
  }
  return array;
}

void Read(const JsonReader& json, EvaluationLog* log) {
  std::vector<Evaluation> evaluations(static_cast<size_t>(json.ExpectArray("evaluations")));
  for (size_t i = 0; i < evaluations.size(); ++i) {
    const JsonReader entry = json.At(static_cast<int>(i));
    Evaluation& e = evaluations[i];
    e.at = ReadVector(entry.At("at"));
    e.with_jacobian = entry.At("with_jacobian").Boolean();
    e.done = entry.At("done").Boolean();
    e.message = entry.At("message").String();
    e.rollouts = entry.At("rollouts").Integer(0, kMostCount);
    e.residuals = ReadVector(entry.At("residuals"));
    e.jacobian = ReadMatrix(entry.At("jacobian"), e.residuals.size());
  }
  log->Restore(std::move(evaluations));
}

Json ToJson(const FitStart& start) {
  return {{"initial", Bits(start.initial)},
          {"cost", Bits(start.cost)},
          {"iterations", start.iterations},
          {"shooting_iterations", start.shooting_iterations},
          {"status", start.status}};
}

FitStart ReadStart(const JsonReader& json) {
  FitStart start;
  start.initial = Numbers(json.At("initial"));
  start.cost = ReadNumber(json.At("cost"));
  start.iterations = json.At("iterations").Integer(0, kMostCount);
  start.shooting_iterations = json.At("shooting_iterations").Integer(0, kMostCount);
  start.status = json.At("status").String();
  return start;
}

Json ToJson(const Minimum& minimum) {
  Json iterations = Json::array();
  for (const FitIteration& i : minimum.iterations) {
    iterations.push_back({{"cost", Bits(i.cost)},
                          {"gradient_norm", Bits(i.gradient_norm)},
                          {"parameters", Bits(i.parameters)},
                          {"seconds", Bits(i.seconds)}});
  }
  return {{"status", static_cast<int>(minimum.status)},
          {"message", minimum.message},
          {"parameters", Bits(minimum.parameters)},
          {"cost", Bits(minimum.cost)},
          {"residuals", Bits(minimum.residuals)},
          {"jacobian", Bits(minimum.jacobian)},
          {"iterations", iterations}};
}

Minimum ReadMinimum(const JsonReader& json) {
  Minimum minimum;
  minimum.status =
      static_cast<FitStatus>(json.At("status").Integer(0, static_cast<int>(FitStatus::kNoEffect)));
  minimum.message = json.At("message").String();
  minimum.parameters = ReadVector(json.At("parameters"));
  minimum.cost = ReadNumber(json.At("cost"));
  minimum.residuals = ReadVector(json.At("residuals"));
  minimum.jacobian = ReadMatrix(json.At("jacobian"), minimum.residuals.size());
  const JsonReader iterations = json.At("iterations");
  for (int i = 0; i < iterations.ExpectArray("iterations"); ++i) {
    const JsonReader entry = iterations.At(i);
    minimum.iterations.push_back(
        {ReadNumber(entry.At("cost")), ReadNumber(entry.At("gradient_norm")),
         Numbers(entry.At("parameters")), ReadNumber(entry.At("seconds"))});
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
  if (log.shot) {
    json["shot"] = {{"parameters", Bits(log.shot->parameters)},
                    {"iterations", log.shot->iterations}};
  }
  return json;
}

void Read(const JsonReader& json, FitLog* log) {
  Read(json.At("search"), &log->search);
  Read(json.At("start"), &log->start);
  log->rollouts = json.At("rollouts").Integer(0, kMostCount);
  const JsonReader starts = json.At("starts");
  for (int i = 0; i < starts.ExpectArray("starts"); ++i) {
    log->starts.push_back(ReadStart(starts.At(i)));
  }
  if (!log->starts.empty()) {
    log->best = ReadMinimum(json.At("best"));
  }
  if (json.Has("shot")) {
    log->shot = {ReadVector(json.At("shot").At("parameters")),
                 json.At("shot").At("iterations").Integer(0, kMostCount)};
  }
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

}  // namespace

std::uint64_t Fingerprint(const FitProblem& problem) {
  BitHash hash;
  hash.Add(SceneToJson(problem.scene));
  for (const auto& joint : problem.scene.joints) {
    AddSignal(joint.effort_signal, &hash);
  }
  for (const auto& force : problem.scene.forces) {
    AddSignal(force.force_signal, &hash);
    AddSignal(force.torque_signal, &hash);
  }
  for (const BodyPoint& point : problem.points) {
    hash.Add(point.name);
    hash.Add(point.body);
    hash.AddAll(point.at);
  }
  for (const FitParameter& parameter : problem.parameters) {
    hash.Add(parameter.name);
    AddOptional(parameter.initial, &hash);
    AddOptional(parameter.lower, &hash);
    AddOptional(parameter.upper, &hash);
    for (const ParameterSet& set : parameter.sets) {
      hash.Add(set.path);
      hash.Add(set.scale);
      hash.Add(set.offset);
      hash.Add(static_cast<int>(set.mode));
    }
  }
  for (const Observation& o : problem.observations) {
    hash.AddAll(std::array<double, 2>{static_cast<double>(o.body), static_cast<double>(o.point)});
    hash.Add(static_cast<int>(o.coordinate));
    hash.AddAll(std::array<double, 3>{o.time, o.value, o.sigma});
  }
  const FitOptions& options = problem.options;
  hash.Add(NameOf(options.derivatives));
  hash.Add(options.huber);
  for (const int number :
       {options.segments, options.starts, static_cast<int>(options.seed), options.max_iterations}) {
    hash.Add(number);
  }
  return hash.value();
}

FitCheckpoint::FitCheckpoint(const FitProblem& problem, Writer writer)
    : problem_(Fingerprint(problem)), writer_(std::move(writer)) {
  for (FitLog& log : fits_) {
    log.on_end = [this] { WriteOnTheWay(); };
    log.search.OnIteration([this] { WriteNowAndThen(); });
    log.start.OnIteration([this] { WriteNowAndThen(); });
  }
}

std::string FitCheckpoint::Text() const {
  const Json fits = {ToJson(fits_[0]), ToJson(fits_[1])};
  BitHash problem;
  problem.Add(problem_);
  const Json json = {{"format", kFormat},
                     {"problem", problem.Text()},
                     {"content", HashOf(fits.dump())},
                     {"fits", fits}};
  return json.dump(0) + "\n";
}

std::string FitCheckpoint::Restore(const std::string& text, const std::string& file) {
  Json json;
  std::string error;
  if (!ParseJson(text, file, &json, &error)) {
    return error;
  }
  JsonErrors errors(file);
  const JsonReader root(json, &errors);
  root.ExpectKeys({"format", "problem", "content", "fits"});
  const std::string format = root.At("format").String();
  if (root.ok() && format != kFormat) {
    root.At("format").FailExpected(std::string("\"") + kFormat + "\"");
  }
  const std::string content = root.At("content").String();
  if (root.ok() && (!json.contains("fits") || content != HashOf(json["fits"].dump()))) {
    root.At("fits").Fail(
        "damaged: its content is not what was written; remove the file to begin anew");
  }
  BitHash problem;
  problem.Add(problem_);
  if (root.ok() && root.At("problem").String() != problem.Text()) {
    root.At("problem").Fail(
        "a checkpoint of another fit: scene, parameters, observations or options differ; name "
        "another file, or remove this one to begin anew");
  }
  const JsonReader fits = root.At("fits");
  if (fits.ExpectArray("two fits") == 2) {
    for (int i = 0; i < 2; ++i) {
      Read(fits.At(i), &fits_[static_cast<size_t>(i)]);
    }
  }
  return errors.message();
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
