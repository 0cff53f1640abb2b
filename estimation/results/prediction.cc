// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/prediction.h"

#include <algorithm>
#include <charconv>
#include <numeric>
#include <utility>

#include "tangible/estimation/results/held_out.h"
#include "tangible/estimation/results/residual_summary.h"
#include "tangible/estimation/results/tolerances.h"
#include "tangible/scene/csv.h"

namespace tangible {
namespace {

constexpr int kHorizons = 20;

/// Accumulates root mean squares and largest errors, one observation after the other.
class ErrorSum {
 public:
  void Add(const Observation& observation, const std::vector<Channel>& channels, double residual) {
    const double error = std::abs(residual * observation.sigma);
    sum_ += residual * residual;
    ++count_;
    PerUnit* const unit = UnitFor(observation, channels);
    if (unit != nullptr) {
      unit->sum += error * error;
      unit->max = std::max(unit->max, error);
      ++unit->count;
    }
  }

  HorizonError Result(double from, double to) const {
    const auto rms = [](double sum, long count) {
      return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : NAN;
    };
    return {from,
            to,
            count_,
            rms(sum_, count_),
            rms(length_.sum, length_.count),
            length_.count > 0 ? length_.max : NAN,
            rms(angle_.sum, angle_.count),
            angle_.count > 0 ? angle_.max : NAN};
  }

 private:
  struct PerUnit {
    double sum = 0.0;
    double max = 0.0;
    long count = 0;
  };
  /// Null for observations that are neither lengths in m nor angles.
  PerUnit* UnitFor(const Observation& observation, const std::vector<Channel>& channels) {
    const bool direct = channels.empty() || channels[observation.channel].camera < 0;
    switch (observation.coordinate) {
      case Coordinate::kX:
      case Coordinate::kY:
      case Coordinate::kDistance:
        return direct ? &length_ : nullptr;
      case Coordinate::kAngle:
        return &angle_;
      default:
        return nullptr;
    }
  }

  double sum_ = 0.0;
  long count_ = 0;
  PerUnit length_, angle_;
};

void AppendCell(double x, std::string* row) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, x);
  row->push_back(',');
  row->append(text, end.ptr);
}

}  // namespace

std::vector<Observation> TakeLater(double from, std::vector<Observation>* observations) {
  const auto later = std::stable_partition(observations->begin(), observations->end(),
                                           [from](const Observation& o) { return o.time <= from; });
  std::vector<Observation> taken(later, observations->end());
  observations->erase(later, observations->end());
  return taken;
}

PredictionScore ScorePrediction(const std::vector<PredictedRun>& runs) {
  PredictionScore score;
  score.from = runs.empty() ? 0.0 : runs.front().from;
  double reach = 0.0;
  for (const PredictedRun& run : runs) {
    if (run.from != score.from) score.from = NAN;
    for (const Observation& observation : run.observations) {
      reach = std::max(reach, observation.time - run.from);
    }
  }
  const double width = reach / kHorizons;
  ErrorSum all;
  std::vector<ErrorSum> bins(kHorizons);
  for (const PredictedRun& run : runs) {
    for (size_t i = 0; i < run.observations.size(); ++i) {
      const Observation& observation = run.observations[i];
      const double residual = run.residuals[static_cast<Eigen::Index>(i)];
      const double part = (observation.time - run.from) / reach;
      const int bin = std::clamp(static_cast<int>(std::ceil(part * kHorizons - kEdgeRounding)) - 1,
                                 0, kHorizons - 1);
      all.Add(observation, run.channels, residual);
      bins[bin].Add(observation, run.channels, residual);
    }
  }
  score.all = all.Result(0.0, reach);
  for (int bin = 0; bin < kHorizons; ++bin) {
    const HorizonError error =
        bins[bin].Result(bin * width, bin + 1 == kHorizons ? reach : (bin + 1) * width);
    if (error.count > 0) {
      score.horizons.push_back(error);
    }
  }
  return score;
}

LaterObservations PredictLater(const FitProblem& problem, const Eigen::VectorXd& estimate,
                               double from, std::vector<Observation> later,
                               const RolloutResiduals* before) {
  LaterObservations result;
  result.observations = std::move(later);
  result.score.from = from;
  ParameterizedScene scene;
  ParameterError fault;
  const bool driven = before != nullptr && before->noise() != nullptr;
  if (!scene.Create(driven ? WithNoiseForces(problem.process_noise, problem.scene) : problem.scene,
                    problem.points, problem.parameters, &fault, problem.instruments)) {
    result.score.message = fault.what;
    return result;
  }
  RolloutResiduals run(std::move(scene), result.observations, problem.channels);
  if (driven) run.Follow(*before);
  if (!run.Evaluate(estimate, problem.options.derivatives, &result.residuals, nullptr)) {
    result.score.message = run.message();
    result.residuals.resize(0);
    return result;
  }
  result.score = ScorePrediction({{from, result.observations, problem.channels, result.residuals}});
  return result;
}

namespace {

constexpr const char* kColumns =
    "time,target,relative_to,coordinate,file,sensor,used,sigma,observed,predicted,residual,"
    "residual_in_sigma\n";

/// The rows of a run, each after `prefix`; `used` says what for those that are `fitted` are. Cells
/// stay empty where there are no values.
void AppendRows(const std::string& prefix, const char* used, const RolloutResiduals& residuals,
                const std::vector<Observation>& fitted,
                const Eigen::Ref<const Eigen::VectorXd>& values, const LaterObservations* later,
                std::string* csv) {
  const size_t num_later = later == nullptr ? 0 : later->observations.size();
  const auto observation = [&](size_t i) -> const Observation& {
    return i < fitted.size() ? fitted[i] : later->observations[i - fitted.size()];
  };
  std::vector<size_t> order(fitted.size() + num_later);
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return observation(a).time < observation(b).time; });
  const Scene& scene = residuals.scene().scene();
  const std::vector<BodyPoint>& points = residuals.scene().points();
  for (const size_t i : order) {
    const Observation& o = observation(i);
    const bool is_later = i >= fitted.size();
    char time[32];
    csv->append(prefix);
    csv->append(time, std::to_chars(time, time + sizeof time, o.time).ptr);
    *csv += "," + TargetName({scene, points, residuals.scene().instruments()}, o) + "," +
            ReferenceName(scene, points, residuals.ChannelOf(o)) + "," + NameOf(o.coordinate) +
            "," + CsvCell(FileOf(residuals, o)) + "," + SensorOf(residuals, o) + "," +
            (is_later ? "prediction" : used);
    AppendCell(o.sigma, csv);
    AppendCell(o.value, csv);
    if ((is_later ? later->residuals.size() : values.size()) == 0) {
      *csv += ",,,\n";
      continue;
    }
    const double r = is_later ? later->residuals[static_cast<Eigen::Index>(i - fitted.size())]
                              : values[static_cast<Eigen::Index>(i)];
    AppendCell(o.value + r * o.sigma, csv);
    AppendCell(r * o.sigma, csv);
    AppendCell(r, csv);
    csv->push_back('\n');
  }
}

}  // namespace

PredictedRecordings PredictLater(const FitInput& input, const RecordingsProblem& problem,
                                 const Eigen::VectorXd& estimate, double from,
                                 std::vector<std::vector<Observation>> later) {
  PredictedRecordings result;
  std::vector<PredictedRun> runs;
  result.runs.reserve(later.size());
  for (size_t b = 0; b < later.size(); ++b) {
    const RecordingInput& recording = input.recordings[b];
    const int block = static_cast<int>(b);
    LaterObservations& run = result.runs.emplace_back();
    if (later[b].empty()) continue;
    run = PredictLater(recording.problem, problem.ParametersOf(block, estimate), from,
                       std::move(later[b]), &problem.recordings()[b].residuals);
    if (!run.score.message.empty() && result.score.message.empty()) {
      result.score.message = problem.BlockName(block) + run.score.message;
    }
    runs.push_back({from, run.observations, recording.problem.channels, run.residuals});
  }
  if (result.score.message.empty()) {
    result.score = ScorePrediction(runs);
  }
  result.score.from = from;
  return result;
}

std::string PredictionCsv(const RecordingsProblem& problem, const Eigen::VectorXd& values,
                          const PredictedRecordings* later, const HeldOutRuns* held_out) {
  std::string csv = std::string(problem.IsNamed() ? "recording," : "") + kColumns;
  Eigen::Index first = 0;
  for (int b = 0; b < problem.num_blocks(); ++b) {
    const RecordedRun& recording = problem.recordings()[b];
    const Eigen::Index rows = recording.residuals.num_residuals();
    AppendRows(problem.IsNamed() ? CsvCell(recording.name) + "," : "", "fit", recording.residuals,
               recording.residuals.observations(), values.segment(first, rows),
               later == nullptr ? nullptr : &later->runs[b], &csv);
    first += rows;
  }
  if (held_out == nullptr) return csv;
  for (const HeldOutRun& run : held_out->runs) {
    if (!run.first_part) continue;
    const std::string prefix = CsvCell(run.name) + ",";
    AppendRows(prefix, "unused", *run.first_part, run.unused, Eigen::VectorXd(), nullptr, &csv);
    AppendRows(prefix, "state", *run.first_part, run.used, run.residuals, &run.later, &csv);
  }
  return csv;
}

}  // namespace tangible
