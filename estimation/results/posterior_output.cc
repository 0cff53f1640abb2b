// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/posterior_output.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/results/fitted_scene.h"
#include "tangible/estimation/results/residual_summary.h"
#include "tangible/render/html.h"
#include "tangible/render/plot.h"
#include "tangible/scene/csv.h"

namespace tangible {
namespace {

// More parameters are listed but not drawn.
constexpr size_t kMostTraces = 12;
// More parameters are in the result as JSON.
constexpr size_t kMostLines = 30;
constexpr int kTraceBuckets = 300;
constexpr int kHistogramBins = 30;

OrderedJson Finite(double x) { return std::isfinite(x) ? OrderedJson(x) : OrderedJson(nullptr); }

std::string Padded(int number, int most) {
  const std::string text = std::to_string(number);
  const size_t width = std::max<size_t>(3, std::to_string(most).size());
  return std::string(width - std::min(width, text.size()), '0') + text;
}

std::string Histogram(const std::string& name, const Eigen::VectorXd& draws) {
  const double low = draws.minCoeff();
  const double width = (draws.maxCoeff() - low) / kHistogramBins;
  if (!(width > 0.0)) return "";
  std::vector<double> middle, count(kHistogramBins, 0.0);
  for (int i = 0; i < kHistogramBins; ++i) middle.push_back(low + (i + 0.5) * width);
  for (const double x : draws) {
    count[std::min(static_cast<size_t>((x - low) / width), count.size() - 1)] += 1.0;
  }
  return PlotSvg({.title = name + ": draws", .x_label = name, .y_label = "draws", .height = 220},
                 {{"", middle, count, PlotStyle::kLineAndPoints, {}}});
}

/// The draws of each chain in their order.
std::string Trace(const std::string& name, const Posterior& posterior, Eigen::Index k) {
  std::vector<PlotSeries> chains(static_cast<size_t>(posterior.options.chains));
  for (size_t j = 0; j < chains.size(); ++j) chains[j].label = "chain " + std::to_string(j);
  for (Eigen::Index i = 0; i < posterior.draws.rows(); ++i) {
    PlotSeries& chain = chains[static_cast<size_t>(posterior.chain_of[static_cast<size_t>(i)])];
    chain.x.push_back(static_cast<double>(chain.x.size()));
    chain.y.push_back(posterior.draws(i, k));
  }
  for (PlotSeries& chain : chains) chain = Thinned(chain, kTraceBuckets);
  return PlotSvg(
      {.title = name + ": chains", .x_label = "draw of its chain", .y_label = name, .height = 220},
      chains);
}

/// What is predicted for each row by each draw: residuals in multiples of sigma.
class Bands {
 public:
  explicit Bands(Eigen::Index rows) : residuals_(rows, 0) {}
  void Add(const Eigen::VectorXd& residuals) {
    residuals_.conservativeResize(Eigen::NoChange, residuals_.cols() + 1);
    residuals_.rightCols(1) = residuals;
  }
  /// ",low,median,high" of a row.
  std::string Cells(Eigen::Index row, const Observation& observation) const {
    std::string text;
    const Eigen::VectorXd of = residuals_.row(row);
    for (const double share : {0.025, 0.5, 0.975}) {
      const double quantile = observation.value + observation.sigma * QuantileOf(of, share);
      text += std::isfinite(quantile) ? "," + CsvNumber(quantile) : ",";
    }
    return text;
  }

 private:
  Eigen::MatrixXd residuals_;
};

void AppendBands(const std::string& start, const RolloutResiduals& run,
                 const std::vector<Observation>& observations, const char* used, const Bands& bands,
                 Eigen::Index first, std::string* csv) {
  for (size_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    csv->append(start + CsvNumber(observation.time) + "," + CsvCell(SeriesLabel(run, observation)) +
                "," + used + "," + CsvNumber(observation.sigma) + "," +
                CsvNumber(observation.value) +
                bands.Cells(first + static_cast<Eigen::Index>(i), observation) + "\n");
  }
}

/// At most kMostBands draws at equal distances.
std::vector<Eigen::VectorXd> SomeDraws(const Posterior& posterior) {
  std::vector<Eigen::VectorXd> some;
  const auto count = std::min<Eigen::Index>(kMostBands, posterior.draws.rows());
  for (Eigen::Index i = 0; i < count; ++i) {
    some.emplace_back(posterior.draws.row(i * posterior.draws.rows() / count));
  }
  return some;
}

}  // namespace

OrderedJson PosteriorToJson(const std::vector<ParameterEntry>& entries,
                            const Posterior& posterior) {
  OrderedJson parameters = OrderedJson::array();
  for (size_t k = 0; k < entries.size(); ++k) {
    const ChainStatistics& of = posterior.parameters[k];
    parameters.push_back({{"name", entries[k].name},
                          {"mean", Finite(of.mean)},
                          {"standard_deviation", Finite(of.deviation)},
                          {"median", Finite(of.median)},
                          {"interval_95", {Finite(of.low), Finite(of.high)}},
                          {"r_hat", Finite(of.r_hat)},
                          {"ess_bulk", Finite(of.ess_bulk)},
                          {"ess_tail", Finite(of.ess_tail)}});
  }
  return {{"draws", posterior.draws.rows()},
          {"transitions", posterior.transitions},
          {"chains", posterior.options.chains},
          {"warm_up", posterior.options.warm_up},
          {"seed", posterior.options.seed},
          {"target", posterior.options.target},
          {"parameters", parameters},
          {"divergences", posterior.divergences},
          {"saturated", posterior.saturated},
          {"acceptance", Finite(posterior.acceptance)},
          {"temperatures", posterior.options.temperatures},
          {"exchanged", Finite(posterior.exchanged)},
          {"steps", posterior.steps},
          {"evaluations", posterior.evaluations},
          {"seconds", posterior.seconds},
          {"warnings", posterior.warnings}};
}

std::string PosteriorCsv(const std::vector<ParameterEntry>& entries, const Posterior& posterior) {
  std::string csv = "draw,chain,cost";
  for (const ParameterEntry& entry : entries) csv += "," + CsvCell(entry.name);
  csv += "\n";
  for (Eigen::Index i = 0; i < posterior.draws.rows(); ++i) {
    csv += std::to_string(i) + "," + std::to_string(posterior.chain_of[static_cast<size_t>(i)]) +
           "," + CsvNumber(posterior.costs[i]);
    for (const double value : Eigen::VectorXd(posterior.draws.row(i))) {
      csv += "," + CsvNumber(value);
    }
    csv += "\n";
  }
  return csv;
}

std::string PosteriorPart(const std::vector<ParameterEntry>& entries, const Posterior& posterior) {
  const auto number = [](double x, int digits) {
    return std::isfinite(x) ? CompactNumber(x, digits) : std::string();
  };
  std::vector<std::vector<std::string>> rows;
  for (size_t k = 0; k < entries.size(); ++k) {
    const ChainStatistics& of = posterior.parameters[k];
    rows.push_back({entries[k].name, number(of.mean, 8), number(of.deviation, 3),
                    number(of.median, 8), number(of.low, 8) + " to " + number(of.high, 8),
                    number(of.r_hat, 4), number(of.ess_bulk, 4), number(of.ess_tail, 4)});
  }
  std::string html =
      "<h2>Posterior</h2>\n<p>" + std::to_string(posterior.transitions) + " draws by " +
      std::to_string(posterior.options.chains) + " chains after a warm-up of " +
      std::to_string(posterior.options.warm_up) + " each; " +
      std::to_string(posterior.divergences) + " of them diverged. R-hat is 1 where chains agree; " +
      "the draws are worth as many independent ones as the last columns say, in the middle and in "
      "the tails of the distribution.</p>\n" +
      HtmlTable({"parameter", "mean", "standard deviation", "median", "95 % interval", "R-hat",
                 "effective draws", "in the tails"},
                rows);
  for (size_t k = 0; k < std::min(entries.size(), kMostTraces); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    html += Histogram(entries[k].name, posterior.draws.col(column)) +
            Trace(entries[k].name, posterior, column);
  }
  return html;
}

std::string DescribePosterior(const std::vector<ParameterEntry>& entries,
                              const Posterior& posterior) {
  std::string text = "posterior: " + std::to_string(posterior.transitions) + " draws of " +
                     std::to_string(posterior.options.chains) + " chains, " +
                     std::to_string(posterior.divergences) + " divergences, " +
                     std::to_string(posterior.evaluations) + " evaluations, " +
                     CompactNumber(posterior.seconds, 3) + " s\n";
  for (size_t k = 0; k < std::min(entries.size(), kMostLines); ++k) {
    const ChainStatistics& of = posterior.parameters[k];
    text += "posterior of " + entries[k].name + ": mean " + CompactNumber(of.mean, 8) + " ± " +
            CompactNumber(of.deviation, 3) + ", median " + CompactNumber(of.median, 8) +
            ", R-hat " + CompactNumber(of.r_hat, 4) + ", effective draws " +
            CompactNumber(of.ess_bulk, 4) + " (tails " + CompactNumber(of.ess_tail, 4) + ")\n";
  }
  return text;
}

std::string CheckSceneFolder(const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code none;
  const fs::path path(folder);
  if (fs::exists(path, none)) {
    return fs::is_directory(path, none) ? "" : "expected a folder, got " + folder + ", a file";
  }
  const fs::path absolute = fs::absolute(path, none);
  const fs::path parent =
      (absolute.has_filename() ? absolute : absolute.parent_path()).parent_path();
  return fs::is_directory(parent, none) ? ""
                                        : "expected a folder in one that exists, got " + folder;
}

std::string WritePosteriorScenes(const std::string& folder, const FitInput& input,
                                 const RecordingsProblem& problem, const Posterior& posterior,
                                 const FileWriter& write) {
  namespace fs = std::filesystem;
  std::error_code failed;
  fs::create_directory(folder, failed);
  if (failed) return folder + ": cannot be made: " + failed.message();
  const auto count = static_cast<int>(posterior.draws.rows());
  for (int i = 0; i < count; ++i) {
    for (int b = 0; b < problem.num_blocks(); ++b) {
      std::string text;
      std::string error;
      if (!FittedScene(input.recordings[static_cast<size_t>(b)].problem,
                       problem.ParametersOf(b, posterior.draws.row(i)), folder, &text, &error)) {
        return error.insert(0, folder + ": draw " + std::to_string(i) + ": ");
      }
      const std::string name = "scene_" + Padded(i, count - 1) +
                               (problem.IsNamed() ? "_" + std::to_string(b) : "") + ".json";
      error = write((fs::path(folder) / name).string(), text);
      if (!error.empty()) return error;
    }
  }
  return "";
}

std::string PosteriorBandsCsv(const FitInput& input, const Posterior& posterior,
                              const PredictedRecordings* later, RecordingsProblem* problem) {
  Eigen::Index rows = 0, later_rows = 0;
  std::vector<std::vector<Observation>> beyond;
  for (int b = 0; b < problem->num_blocks(); ++b) {
    rows += problem->num_observation_rows(b);
    if (later != nullptr) {
      beyond.push_back(later->runs[static_cast<size_t>(b)].observations);
      later_rows += static_cast<Eigen::Index>(beyond.back().size());
    }
  }
  Bands fitted(rows), predicted(later_rows);
  Linearizer linearizer(problem, GradientMethod::kTangent, posterior.options.threads, nullptr);
  for (const Eigen::VectorXd& draw : SomeDraws(posterior)) {
    std::vector<BlockEvaluation> blocks;
    if (linearizer.Rows(draw, BlockDerivatives::kSkip, &blocks)) {
      Eigen::VectorXd all(rows);
      Eigen::Index at = 0;
      for (const BlockEvaluation& block : blocks) {
        all.segment(at, block.residuals.size()) = block.residuals;
        at += block.residuals.size();
      }
      fitted.Add(all);
    }
    if (later == nullptr) continue;
    const PredictedRecordings runs = PredictLater(input, *problem, draw, later->score.from, beyond);
    Eigen::VectorXd all(later_rows);
    Eigen::Index at = 0;
    for (const LaterObservations& run : runs.runs) {
      if (run.residuals.size() != static_cast<Eigen::Index>(run.observations.size())) break;
      all.segment(at, run.residuals.size()) = run.residuals;
      at += run.residuals.size();
    }
    if (at == later_rows) predicted.Add(all);
  }
  std::string csv = std::string(problem->IsNamed() ? "recording," : "") +
                    "time,series,used,sigma,observed,low,median,high\n";
  Eigen::Index first = 0, first_later = 0;
  for (int b = 0; b < problem->num_blocks(); ++b) {
    const RecordedRun& recording = problem->recordings()[static_cast<size_t>(b)];
    const std::string start = problem->IsNamed() ? CsvCell(recording.name) + "," : "";
    AppendBands(start, recording.residuals, recording.residuals.observations(), "fit", fitted,
                first, &csv);
    first += recording.residuals.num_residuals();
    if (later == nullptr) continue;
    const std::vector<Observation>& of = beyond[static_cast<size_t>(b)];
    AppendBands(start, recording.residuals, of, "prediction", predicted, first_later, &csv);
    first_later += static_cast<Eigen::Index>(of.size());
  }
  return csv;
}

}  // namespace tangible
