// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/missing_output.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tangible/render/html.h"

namespace tangible {
namespace {

// Of the terminal: more are in the result.
constexpr size_t kMostMissingLines = 8;

OrderedJson NumberOrNull(double x) {
  return std::isfinite(x) ? OrderedJson(x) : OrderedJson(nullptr);
}

std::string Percent(double part) {
  return std::isfinite(part) ? CompactNumber(100.0 * part, 3) + " %" : "";
}

/// "gravity/x 0.342 (0)": the values of the real fit, or to first order, and those that are held.
std::string ValuesText(const MissingRow& row) {
  const bool named = row.parameters.size() == 1 && row.parameters[0] == row.candidate;
  std::string text = named ? "" : row.candidate + ": ";
  for (size_t k = 0; k < row.parameters.size(); ++k) {
    const double value = row.refitted ? row.values[k] : row.first_order[k];
    text += (k == 0 ? "" : ", ") + row.parameters[k] + " = " + CompactNumber(value, 4);
    if (std::isfinite(row.held[k])) text += " in the place of " + CompactNumber(row.held[k], 4);
  }
  return text + (row.refitted ? "" : " to first order");
}

std::string EquivalentText(const MissingRow& row) {
  std::string text;
  for (const std::string& name : row.equivalent) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string CountText(const MissingResult& missing) {
  return std::to_string(missing.tested) + " candidates, " + std::to_string(missing.rollouts) +
         " rollouts, " + CompactNumber(missing.seconds, 2) + " s";
}

std::string RightAligned(std::string text, size_t width) {
  text.insert(0, width > text.size() ? width - text.size() : 0, ' ');
  return text;
}

}  // namespace

OrderedJson MissingToJson(const MissingResult& missing) {
  OrderedJson rows = OrderedJson::array();
  for (const MissingRow& row : missing.rows) {
    OrderedJson parameters = OrderedJson::array();
    for (size_t k = 0; k < row.parameters.size(); ++k) {
      parameters.push_back({{"name", row.parameters[k]},
                            {"held_at", NumberOrNull(row.held[k])},
                            {"first_order", NumberOrNull(row.first_order[k])},
                            {"estimate", row.refitted ? NumberOrNull(row.values[k]) : nullptr}});
    }
    rows.push_back({{"candidate", row.candidate},
                    {"kind", NameOf(row.kind)},
                    {"cost_share", NumberOrNull(row.cost_share)},
                    {"refitted", row.refitted},
                    {"refitted_cost_share", NumberOrNull(row.refitted_share)},
                    {"held_out_gain", NumberOrNull(row.held_out_gain)},
                    {"confirmed", row.confirmed},
                    {"equivalent", row.equivalent},
                    {"parameters", parameters}});
  }
  return rows;
}

OrderedJson MissingSummaryToJson(const MissingResult& missing) {
  return {{"candidates", missing.tested},
          {"chance", NumberOrNull(missing.chance)},
          {"conclusion", Conclusion(missing)},
          {"rollouts", missing.rollouts},
          {"seconds", missing.seconds}};
}

std::string MissingPart(const MissingResult& missing) {
  std::string html = "<h2>What would explain the residuals</h2>\n<p>" +
                     HtmlEscape(Conclusion(missing)) + " (" + CountText(missing) + ").</p>\n";
  if (missing.rows.empty()) return html;
  std::vector<std::vector<std::string>> rows;
  for (const MissingRow& row : missing.rows) {
    rows.push_back({row.candidate, Percent(row.cost_share), Percent(row.refitted_share),
                    Percent(row.held_out_gain), row.confirmed ? "confirmed" : "", ValuesText(row),
                    EquivalentText(row)});
  }
  return html +
         "<p>Each is one alone, without the others. The share of the cost is to first order, after "
         "all that the fitted parameters can do; the best were then fitted with them, to all "
         "observations, and to the first part of each recording, after which the rest was "
         "predicted.</p>\n" +
         HtmlTable({"candidate", "share of the cost", "in a real fit", "gain in what is held back",
                    "", "values", "cannot be told apart from it"},
                   rows);
}

std::string DescribeMissing(const MissingResult& missing) {
  if (missing.rows.empty()) return Conclusion(missing) + " (" + CountText(missing) + ")\n";
  std::string text = "what would explain the residuals (" + CountText(missing) +
                     "):\n    share  in a real fit   held out\n";
  const size_t shown = std::min(missing.rows.size(), kMostMissingLines);
  for (size_t i = 0; i < shown; ++i) {
    const MissingRow& row = missing.rows[i];
    text += RightAligned(Percent(row.cost_share), 9) +
            RightAligned(Percent(row.refitted_share), 15) +
            RightAligned(Percent(row.held_out_gain), 11) + "  " +
            (row.refitted && !row.confirmed ? "not confirmed: " : "") + ValuesText(row) + "\n";
    if (!row.equivalent.empty()) {
      text += RightAligned("", 37) + "cannot be told apart from " + EquivalentText(row) + "\n";
    }
  }
  if (shown < missing.rows.size()) {
    text += "    and " + std::to_string(missing.rows.size() - shown) + " more\n";
  }
  return text + Conclusion(missing) + "\n";
}

}  // namespace tangible
