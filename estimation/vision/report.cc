// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "tangible/estimation/vision/disc_world.h"
#include "tangible/estimation/vision/png.h"
#include "tangible/render/html.h"
#include "tangible/render/plot.h"
#include "tangible/scene/json_writer.h"

namespace tangible {
namespace {

template <typename... Values>
std::string Line(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

// The root mean square error of estimated positions; a dash for predictors that estimate none.
std::string Seen(const std::optional<double>& error) {
  return error ? Line("%6.3f", *error) : "     -";
}

bool IsOf(const OrderedJson& cell, const char* kind) {
  return cell["cell"].get<std::string>().rfind(kind, 0) == 0;
}

std::string SimbTable(const std::vector<OrderedJson>& cells) {
  std::string text;
  const auto row = [&](const std::string& name, std::optional<double> seen,
                       const OrderedJson& score) {
    const OrderedJson& near = score["near"];
    const OrderedJson& far = score["far"];
    text +=
        Line("%-26s %s  %7.3f %7.3f %7.3f %7.3f  %7.2f %7.2f %7.2f %7.2f\n", name.c_str(),
             Seen(seen).c_str(), near["mean"].get<double>(), near["lower_quartile"].get<double>(),
             near["median"].get<double>(), near["upper_quartile"].get<double>(),
             far["mean"].get<double>(), far["lower_quartile"].get<double>(),
             far["median"].get<double>(), far["upper_quartile"].get<double>());
  };
  const OrderedJson* any = nullptr;
  for (const OrderedJson& cell : cells) {
    if (!cell.contains("simb")) continue;
    if (any == nullptr) {
      text +=
          "SimB: 1000 times the mean squared normalised position error, by sequence; published "
          "with "
          "all labels and true boxes: 2.55 and 25.77\n"
          "cell                        seen  [0, T] mean, quartile, median, quartile     [T, 2T]\n";
      any = &cell;
    }
    row(cell["cell"], cell["seen_error"].get<double>(), cell["simb"]["ours"]);
  }
  if (any == nullptr) return "";
  for (const char* other : {"true state", "constant velocity", "last frame"}) {
    row(other, {}, (*any)["simb"][other]);
  }
  return text + "\n";
}

std::string BilliardTable(const std::vector<OrderedJson>& cells) {
  std::string text;
  const std::vector<int> frames = {1, 2, 3, 5, 7, 10};
  const auto row = [&](const std::string& name, std::optional<double> seen,
                       const OrderedJson& errors) {
    text += Line("%-34s %s ", name.c_str(), Seen(seen).c_str());
    for (const int k : frames) text += Line(" %8.3f", errors["position"][k - 1].get<double>());
    text += " ";
    for (const int k : frames) text += Line(" %8.3f", 1e3 * errors["picture"][k - 1].get<double>());
    text += "\n";
  };
  const OrderedJson* any = nullptr;
  for (const OrderedJson& cell : cells) {
    if (!IsOf(cell, "billiards") || !cell.contains("ahead")) continue;
    if (any == nullptr) {
      text +=
          "Billiards: mean squared position error (pixels^2) and 1000 times the pictures', 1, 2, "
          "3, "
          "5, 7 and 10 frames ahead\n";
      any = &cell;
    }
    row(cell["cell"], cell["seen_error"].get<double>(), cell["ahead"]["model"]);
  }
  if (any == nullptr) return "";
  for (const char* other : {"constant velocity", "last frame", "true state"}) {
    row(other, {}, (*any)["ahead"][other]);
  }
  return text + "\n";
}

std::string ParameterTable(const std::vector<OrderedJson>& cells) {
  std::string text;
  for (const OrderedJson& cell : cells) {
    if (!cell.contains("parameters")) continue;
    if (text.empty()) text += "Physical parameters, estimate (truth)\n";
    text += Line("%-34s", cell["cell"].get<std::string>().c_str());
    for (const OrderedJson& parameter : cell["parameters"]) {
      text += Line("  %s %.4f (%g)", parameter["name"].get<std::string>().c_str(),
                   parameter["estimate"].get<double>(), parameter["truth"].get<double>());
    }
    text += "\n";
  }
  return text.empty() ? "" : text + "\n";
}

// The CPU time of the trainings that were not interrupted.
std::string TrainingLine(const std::vector<OrderedJson>& cells) {
  double least = HUGE_VAL, most = 0.0, sum = 0.0;
  int count = 0;
  for (const OrderedJson& cell : cells) {
    if (cell.value("iterations_now", 0L) < cell.value("iterations", 1L)) continue;
    const double seconds = cell["cpu_seconds"];
    least = std::min(least, seconds);
    most = std::max(most, seconds);
    sum += seconds;
    ++count;
  }
  if (count == 0) return "";
  return Line("%d trainings of one thread: %.0f to %.0f s of CPU time, together %.0f s\n", count,
              least, most, sum);
}

std::string Base64(const std::string& bytes) {
  static constexpr char kLetters[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t k = 0; k < bytes.size(); k += 3) {
    unsigned group = 0;
    for (size_t i = 0; i < 3; ++i) {
      group = group << 8 | (k + i < bytes.size() ? static_cast<unsigned char>(bytes[k + i]) : 0U);
    }
    for (size_t i = 0; i < 4; ++i) {
      text += k + i <= bytes.size() ? kLetters[group >> (18 - 6 * i) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace

std::string StudyTables(const std::vector<OrderedJson>& cells) {
  return SimbTable(cells) + BilliardTable(cells) + ParameterTable(cells) + TrainingLine(cells);
}

std::string TimingLine(const OrderedJson& timing) {
  return Line(
      "physics layer, forward and backward, batch %d x %d frames: %.1f ms; training iteration "
      "%.1f ms; share %.1f %%\n",
      timing["batch"].get<int>(), timing["frames"].get<int>(),
      1e3 * timing["physics_seconds"].get<double>(),
      1e3 * timing["iteration_seconds"].get<double>(), 1e2 * timing["share"].get<double>());
}

std::string ErrorByFrameSvg(const std::vector<OrderedJson>& cells) {
  std::vector<PlotSeries> series;
  for (const OrderedJson& cell : cells) {
    const std::string name = cell["cell"];
    // Other seeds than the first would lie upon it.
    if (!IsOf(cell, "billiards") || !cell.contains("ahead") || !name.ends_with("_0")) continue;
    PlotSeries& one = series.emplace_back();
    one.label = name;
    for (size_t k = 0; k < cell["ahead"]["model"]["position"].size(); ++k) {
      one.x.push_back(static_cast<double>(k + 1));
      one.y.push_back(cell["ahead"]["model"]["position"][k]);
    }
  }
  return PlotSvg({.title = "Billiards: error of predicted positions",
                  .x_label = "frames ahead",
                  .y_label = "mean squared error (pixels²)",
                  .y_scale = AxisScale::kLogarithmic,
                  .height = 480},
                 series);
}

std::string ErrorByLabelsSvg(const std::vector<OrderedJson>& cells) {
  std::map<std::string, std::map<double, std::pair<double, int>>> sums;
  for (const OrderedJson& cell : cells) {
    if (!IsOf(cell, "billiards") || !cell.contains("ahead")) continue;
    const std::string name = cell["cell"];
    const size_t labels_at = name.rfind('_', name.rfind('_') - 1);  // MODEL_LABELS_SEED
    const std::string model = name.substr(0, labels_at);
    auto& [sum, count] = sums[model][100.0 * cell["labels"].get<double>()];
    sum += cell["ahead"]["model"]["position"].back().get<double>();
    ++count;
  }
  std::vector<PlotSeries> series;
  for (const auto& [model, points] : sums) {
    PlotSeries& one = series.emplace_back();
    one.label = model;
    one.style = PlotStyle::kLineAndPoints;
    for (const auto& [labels, sum] : points) {
      one.x.push_back(labels);
      one.y.push_back(sum.first / sum.second);
    }
  }
  return PlotSvg({.title = "Billiards: error at the last frame by labels",
                  .x_label = "labels (%)",
                  .y_label = "mean squared error (pixels²)",
                  .x_scale = AxisScale::kLogarithmic,
                  .y_scale = AxisScale::kLogarithmic},
                 series);
}

std::string PredictionPage(const std::string& title, const std::vector<std::string>& truth,
                           const std::vector<std::string>& predicted, const std::string& below) {
  std::string frames = "[";
  for (size_t k = 0; k < truth.size() && k < predicted.size(); ++k) {
    const std::string png = PngStrip({{truth[k], predicted[k]}}, kPictureSize, 4);
    frames += (k == 0 ? "\"" : ",\"") + Base64(png) + "\"";
  }
  frames += "]";
  const std::string script =
      "<p>True (left) and predicted (right), frame <span id=\"frame\"></span></p>"
      "<img id=\"picture\" alt=\"true and predicted picture\">"
      "<script>\nconst frames = " +
      frames +
      ";\nlet k = 0;\nfunction show() {\n"
      "  document.getElementById('picture').src = 'data:image/png;base64,' + frames[k];\n"
      "  document.getElementById('frame').textContent = k + 1;\n  k = (k + 1) % frames.length;\n}\n"
      "show();\nsetInterval(show, 250);\n</script>";
  return HtmlPage(title, "<h1>" + HtmlEscape(title) + "</h1>" + script + below);
}

}  // namespace tangible
