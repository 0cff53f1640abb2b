// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_html.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "tangible/render/html.h"
#include "tangible/verification/gradients/verify_text.h"

namespace tangible {
namespace {

constexpr int kScenesInBlock = 100;
constexpr int kCellWidth = 8;    // px
constexpr int kCellHeight = 18;  // px
constexpr int kLabelWidth = 160;
constexpr size_t kMostExceptions = 200;

constexpr char kStyle[] = R"(<style>
.heat { display: block; margin: 4px 0 12px; }
.heat text { font-size: 11px; fill: var(--muted); }
.legend { display: flex; flex-wrap: wrap; gap: 14px; align-items: center; color: var(--muted); }
.legend span { display: inline-block; width: 14px; height: 14px; margin-right: 4px; vertical-align: -2px;
  border: 1px solid var(--line); }
.verdict { font-weight: 600; }
pre { overflow-x: auto; background: var(--panel); border: 1px solid var(--line); padding: 8px; }
</style>
)";

// Entries of exceptions of one scene and pair; `named` includes those of another solution.
struct Exceptions {
  long named = 0, unexplained = 0;
};
using ExceptionsByPair = std::map<int, Exceptions>;

ExceptionsByPair CountExceptions(const SceneCheck& scene) {
  ExceptionsByPair counts;
  for (const CheckedException& exception : scene.exceptions) {
    Exceptions& count = counts[exception.pair];
    (exception.unexplained() ? count.unexplained : count.named) += exception.entries;
  }
  return counts;
}

// From pale to dark; readable on a light page and on a dark one.
std::string Colour(double heat) {
  const double from[3] = {214, 232, 240};
  const double to[3] = {17, 62, 120};
  char text[8];
  int rgb[3];
  for (int i = 0; i < 3; ++i) {
    rgb[i] = static_cast<int>(std::lround(from[i] + heat * (to[i] - from[i])));
  }
  std::snprintf(text, sizeof(text), "#%02x%02x%02x", rgb[0] & 255, rgb[1] & 255, rgb[2] & 255);
  return text;
}

const char* const kNamedColour = "#e0a030";
const char* const kUnexplainedColour = "#d02020";

std::string Rect(int x, int y, int width, int height, const std::string& fill,
                 const std::string& title) {
  return "<rect x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\" width=\"" +
         std::to_string(width) + "\" height=\"" + std::to_string(height) + "\" fill=\"" + fill +
         "\"><title>" + HtmlEscape(title) + "</title></rect>\n";
}

std::string Cell(const SceneCheck& scene, int pair, const ExceptionsByPair& exceptions, int x,
                 int y) {
  const double error = scene.total.error[pair];
  const auto found = exceptions.find(pair);
  const Exceptions count = found == exceptions.end() ? Exceptions{} : found->second;
  if (std::isnan(error) && count.named + count.unexplained == 0) {
    return "";
  }
  std::string title = scene.name + ", " + kMethodPairs[pair].name + ": " + ErrorText(error);
  if (count.named > 0) {
    title += "; exceptions: " + std::to_string(count.named);
  }
  if (count.unexplained > 0) {
    title += "; unexplained: " + std::to_string(count.unexplained);
    return Rect(x, y, kCellWidth - 1, kCellHeight - 1, kUnexplainedColour, title);
  }
  std::string cell;
  if (!std::isnan(error)) {
    const double bound = kMethodPairs[pair].tolerance > 0.0 ? kMethodPairs[pair].tolerance : 1e-9;
    cell = Rect(x, y, kCellWidth - 1, kCellHeight - 1, Colour(HeatOf(error / bound)), title);
  }
  if (count.named > 0) {
    cell += Rect(x, y + kCellHeight - 6, kCellWidth - 1, 5, kNamedColour, title);
  }
  return cell;
}

std::string Label(int x, int y, const std::string& text) {
  return "<text x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\">" +
         HtmlEscape(text) + "</text>\n";
}

// A block of scenes: a column each.
std::string Block(const VerifyResult& result, const std::vector<int>& pairs, size_t first) {
  const size_t last = std::min(first + kScenesInBlock, result.scenes.size());
  const int width = kLabelWidth + kCellWidth * kScenesInBlock;
  const int height = 16 + kCellHeight * static_cast<int>(pairs.size());
  std::string svg = "<svg class=\"heat\" viewBox=\"0 0 " + std::to_string(width) + " " +
                    std::to_string(height) + "\" width=\"" + std::to_string(width) +
                    "\" style=\"max-width: 100%\" role=\"img\">\n" +
                    Label(kLabelWidth, 11,
                          result.scenes[first].name +
                              (last - first > 1 ? " to " + result.scenes[last - 1].name : ""));
  for (size_t row = 0; row < pairs.size(); ++row) {
    svg += Label(0, 16 + kCellHeight * static_cast<int>(row) + 12, kMethodPairs[pairs[row]].name);
  }
  for (size_t i = first; i < last; ++i) {
    const ExceptionsByPair exceptions = CountExceptions(result.scenes[i]);
    const int x = kLabelWidth + kCellWidth * static_cast<int>(i - first);
    for (size_t row = 0; row < pairs.size(); ++row) {
      svg += Cell(result.scenes[i], pairs[row], exceptions, x,
                  16 + kCellHeight * static_cast<int>(row));
    }
  }
  return svg + "</svg>\n";
}

std::string HeatMap(const VerifyResult& result) {
  const std::vector<int> pairs = PairsShown(result);
  std::string html =
      "<h2>Errors by scene</h2>\n<p>A column a scene, a row a pair of methods; the colour is the "
      "largest error over its bound. Differences of one step have no bound; their error, relative "
      "to the largest entry of its column, is shown as if it were 1e-5.</p>\n<p class=\"legend\">";
  for (const auto& [share, label] :
       {std::pair(1e-8, "1e-8 of the bound or less"), std::pair(1e-4, "1e-4"),
        std::pair(1.0, "at the bound or above (steps of one size)")}) {
    html += "<b><span style=\"background:" + Colour(HeatOf(share)) + "\"></span>" + label + "</b>";
  }
  html += std::string("<b><span style=\"background:") + kNamedColour +
          "\"></span>exceptions that the certificate had named, or of another solution</b><b><span "
          "style=\"background:" +
          kUnexplainedColour + "\"></span>unexplained</b></p>\n";
  for (size_t first = 0; first < result.scenes.size(); first += kScenesInBlock) {
    html += Block(result, pairs, first);
  }
  return html;
}

std::string Bounds(const VerifyResult& result) {
  std::map<int, Exceptions> sum;
  for (const SceneCheck& scene : result.scenes) {
    for (const auto& [pair, count] : CountExceptions(scene)) {
      sum[pair].named += count.named;
      sum[pair].unexplained += count.unexplained;
    }
  }
  std::vector<std::vector<std::string>> rows;
  for (const int pair : PairsShown(result)) {
    const MethodPair& methods = kMethodPairs[pair];
    rows.push_back({methods.name, NameOf(methods.b),
                    !methods.bounded             ? "none"
                    : methods.a == kByClosedForm ? "its own"
                                                 : CompactNumber(methods.tolerance),
                    ErrorText(result.total.error[pair]), std::to_string(sum[pair].named),
                    std::to_string(sum[pair].unexplained)});
  }
  return "<h2>Bounds</h2>\n" +
         HtmlTable({"method", "against", "bound", "largest error",
                    "exceptions: named or of another solution (entries)", "unexplained"},
                   rows);
}

std::string Kinds(const VerifyResult& result) {
  const std::vector<int> pairs = PairsShown(result);
  std::vector<std::string> head = {"kind", "entries"};
  for (const int pair : pairs) {
    head.emplace_back(kMethodPairs[pair].name);
  }
  head.insert(head.end(), {"coarse", "named", "unexplained"});
  std::vector<std::vector<std::string>> rows;
  for (const KindRow& kind : result.kinds) {
    std::vector<std::string> row = {kind.kind, std::to_string(kind.entries)};
    for (const int pair : pairs) {
      row.push_back(ErrorText(kind.error[pair]));
    }
    row.insert(row.end(), {std::to_string(kind.coarse), std::to_string(kind.named),
                           std::to_string(kind.unexplained)});
    rows.push_back(std::move(row));
  }
  return "<h2>By kind of parameter</h2>\n" + HtmlTable(head, rows);
}

std::string Worst(const VerifyResult& result) {
  std::vector<std::vector<std::string>> rows;
  std::string scenes;
  for (const auto& [scene, entry] : result.worst) {
    const MethodPair& pair = kMethodPairs[entry.pair];
    rows.push_back({result.scenes[scene].name, pair.name,
                    "d " + entry.output + " / d " + entry.parameter,
                    CompactNumber(entry.values[pair.a], 17),
                    CompactNumber(entry.values[pair.b], 17), CompactNumber(entry.ratio, 3)});
  }
  for (const auto& [scene, text] : result.worst_scenes) {
    scenes += "<details><summary>" + HtmlEscape(result.scenes[scene].name) +
              ", checked alone by <code>" + HtmlEscape(result.scenes[scene].replay) +
              "</code></summary><pre>" + HtmlEscape(text) + "</pre></details>\n";
  }
  return "<h2>The worst entries</h2>\n" +
         HtmlTable({"scene", "method", "entry", "it says", "the other says", "share of the bound"},
                   rows) +
         scenes;
}

std::string ExceptionTable(const VerifyResult& result) {
  std::vector<std::vector<std::string>> rows;
  size_t all = 0;
  for (const bool unexplained : {true, false}) {
    for (const SceneCheck& scene : result.scenes) {
      for (const CheckedException& e : scene.exceptions) {
        if (e.unexplained() != unexplained) {
          continue;
        }
        if (++all <= kMostExceptions) {
          rows.push_back({scene.name, e.parameter, kMethodPairs[e.pair].name,
                          std::to_string(e.entries), e.what,
                          unexplained        ? "unexplained"
                          : e.other_solution ? "another solution of the same problem"
                                             : e.named});
        }
      }
    }
  }
  if (all == 0) {
    return "<h2>Exceptions</h2>\n<p>None.</p>\n";
  }
  return "<h2>Exceptions</h2>\n" +
         (all > kMostExceptions ? "<p>The first " + std::to_string(kMostExceptions) + " of " +
                                      std::to_string(all) + ".</p>\n"
                                : std::string()) +
         HtmlTable({"scene", "parameter", "method", "entries", "what was seen",
                    "what the certificate had said before"},
                   rows);
}

std::string CoverageTable(const VerifyResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [what, count] : result.coverage) {
    rows.push_back({what, std::to_string(count)});
  }
  return "<h2>What the scenes had</h2>\n<details><summary>" + std::to_string(rows.size()) +
         " things, by the number of scenes</summary>\n" + HtmlTable({"", "scenes"}, rows) +
         "</details>\n";
}

}  // namespace

double HeatOf(double error_over_bound) {
  constexpr double kDecades = 8.0;
  if (!(error_over_bound > 0.0)) {
    return 0.0;
  }
  return std::clamp(1.0 + std::log10(error_over_bound) / kDecades, 0.0, 1.0);
}

std::string VerifyReport(const VerifyResult& result, const std::string& origin,
                         const std::string& verdict) {
  const std::string counts =
      std::to_string(result.scenes.size()) + " scenes, " + std::to_string(result.not_run) +
      " not run; " + std::to_string(result.total.entries) + " entries, " +
      std::to_string(result.total.coarse) + " whose differences are coarse, " +
      std::to_string(result.total.zero_columns.size()) + " parameters on which nothing depends";
  return HtmlPage("Derivatives by every method",
                  kStyle + std::string("<h1>Derivatives by every method</h1>\n<p>") +
                      HtmlEscape(counts) + "</p>\n<p class=\"verdict\">" +
                      HtmlEscape(verdict.empty() ? "Every bound holds." : verdict) + "</p>\n" +
                      Bounds(result) + HeatMap(result) + Kinds(result) + Worst(result) +
                      ExceptionTable(result) + CoverageTable(result) + "<p>" + HtmlEscape(origin) +
                      "</p>\n");
}

}  // namespace tangible
