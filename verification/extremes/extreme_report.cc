// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/extreme_report.h"

#include <cmath>
#include <cstdio>

#include "tangible/render/html.h"

namespace tangible::extremes {
namespace {

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

// A figure as a fraction of its bound; one that is not a number exceeds any bound.
double Share(const Figure& figure) {
  const double size = std::abs(figure.value);
  if (!std::isfinite(size)) return std::numeric_limits<double>::infinity();
  if (size == 0.0 || figure.bound == kReported) return 0.0;
  return size / figure.bound;  // infinite where the bound is 0
}

// The figure nearest its bound; among equals the first other than whether the run ended.
const Figure* Nearest(const std::vector<Figure>& figures) {
  const Figure* nearest = nullptr;
  for (const Figure& figure : figures) {
    if (nearest == nullptr || Share(figure) > Share(*nearest) ||
        (nearest == &figures[0] && Share(figure) == Share(*nearest))) {
      nearest = &figure;
    }
  }
  return nearest;
}

std::string Error(double error) {
  if (std::isnan(error)) return "-";
  return error == 0.0 ? "0" : Format("%.0e", error);
}

std::string Bound(const Figure& figure) {
  return figure.bound == kReported ? "none" : Format("%.3g", figure.bound);
}

// The kind of the verdict, without its reasons.
std::string ShortVerdict(const std::string& verdict) {
  const std::string own = WithoutDiscreteMap(verdict);
  return verdict.substr(0, verdict.size() - own.size()) + own.substr(0, own.find(':'));
}

std::string GradientColumns(const GradientFinding& gradient) {
  if (!gradient.taken) return Format("%6s %6s %6s  %s", "-", "-", "-", "not taken");
  if (!gradient.message.empty()) return Format("%6s %6s %6s  %s", "no", "-", "-", "none");
  return Format("%6s %6s %6s  %s", gradient.finite ? "yes" : "no", Error(gradient.adjoint).c_str(),
                Error(gradient.differences).c_str(), ShortVerdict(gradient.verdict).c_str());
}

// The bounds that do not hold, a line each.
std::vector<std::string> Broken(const CaseResult& result) {
  std::vector<std::string> lines;
  if (!result.message.empty()) lines.push_back(result.message);
  for (const Figure& figure : result.finding.figures) {
    if (!figure.holds()) {
      lines.push_back(figure.what + Format(" %.3g ", figure.value) + figure.unit +
                      ", expected at most " + Bound(figure) + " (" + figure.reason + ")");
    }
  }
  const GradientFinding& gradient = result.finding.gradient;
  if (!gradient.holds()) {
    lines.push_back("gradient: " +
                    (!gradient.message.empty() ? gradient.message
                     : !gradient.finite
                         ? std::string("not finite")
                         : Format("adjoint %.1e, differences %.1e off the tangent, said to be "
                                  "trustworthy",
                                  gradient.adjoint, gradient.differences)));
  }
  return lines;
}

std::string Row(const CaseResult& result) {
  const Figure* figure = Nearest(result.finding.figures);
  std::string row = Format("  %-37s %-6s", result.name.c_str(), result.stepping.c_str());
  if (figure != nullptr) {
    row += Format(" %9.2g %9s %-6s", figure->value, Bound(*figure).c_str(), figure->unit.c_str());
  } else {
    row += Format(" %9s %9s %-6s", "-", "-", "");
  }
  row += Format(" %-6s %5.1f ", NameOf(result.verdict()), result.seconds) +
         GradientColumns(result.finding.gradient) + "\n";
  for (const std::string& line : Broken(result)) row += "      " + line + "\n";
  if (!result.finding.note.empty()) row += "      " + result.finding.note + "\n";
  if (result.verdict() == Verdict::kKnown) row += "      known: " + result.known_reason + "\n";
  return row;
}

OrderedJson OrNull(double value) {
  return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr);
}

}  // namespace

Counts Count(const std::vector<CaseResult>& results) {
  Counts counts;
  for (const CaseResult& result : results) {
    const Verdict verdict = result.verdict();
    counts.holds += verdict == Verdict::kHolds ? 1 : 0;
    counts.known += verdict == Verdict::kKnown ? 1 : 0;
    counts.failed += verdict == Verdict::kFailed ? 1 : 0;
    counts.gradients += result.finding.gradient.taken ? 1 : 0;
    counts.trustworthy += result.finding.gradient.trustworthy() ? 1 : 0;
  }
  return counts;
}

std::string SummaryText(const Counts& counts) {
  return Format("%ld cases: %ld hold, %ld known not to, %ld fail; %ld gradients, %ld trustworthy",
                counts.holds + counts.known + counts.failed, counts.holds, counts.known,
                counts.failed, counts.gradients, counts.trustworthy);
}

std::string TableText(const std::vector<CaseResult>& results) {
  std::string text = Format("%-46s %9s %9s %-6s %-6s %5s %6s %6s %6s  %s\n", "case", "figure",
                            "bound", "unit", "", "s", "finite", "adj.", "diff.", "certificate");
  std::string group;
  for (const CaseResult& result : results) {
    if (result.group != group) {
      group = result.group;
      text += group + "\n";
    }
    text += Row(result);
  }
  return text + "\n" + SummaryText(Count(results)) + "\n";
}

OrderedJson ToJson(const std::vector<CaseResult>& results) {
  OrderedJson cases = OrderedJson::array(), known = OrderedJson::array();
  for (const CaseResult& result : results) {
    OrderedJson figures = OrderedJson::array();
    for (const Figure& figure : result.finding.figures) {
      figures.push_back({{"what", figure.what},
                         {"value", OrNull(figure.value)},
                         {"bound", OrNull(figure.bound)},
                         {"unit", figure.unit},
                         {"reason", figure.reason},
                         {"holds", figure.holds()}});
    }
    OrderedJson row = {{"group", result.group},       {"name", result.name},
                       {"stepping", result.stepping}, {"verdict", NameOf(result.verdict())},
                       {"message", result.message},   {"note", result.finding.note},
                       {"seconds", result.seconds},   {"figures", figures}};
    const GradientFinding& gradient = result.finding.gradient;
    if (gradient.taken) {
      row["gradient"] = {{"finite", gradient.finite},
                         {"adjoint", OrNull(gradient.adjoint)},
                         {"differences", OrNull(gradient.differences)},
                         {"certificate", gradient.verdict},
                         {"condition", OrNull(gradient.condition)},
                         {"message", gradient.message},
                         {"holds", gradient.holds()}};
    } else {
      row["gradient"] = nullptr;
    }
    cases.push_back(row);
    if (result.verdict() == Verdict::kKnown) {
      known.push_back(
          {{"name", result.name}, {"stepping", result.stepping}, {"reason", result.known_reason}});
    }
  }
  const Counts counts = Count(results);
  return {{"summary",
           {{"cases", counts.holds + counts.known + counts.failed},
            {"hold", counts.holds},
            {"known", counts.known},
            {"fail", counts.failed},
            {"gradients", counts.gradients},
            {"trustworthy", counts.trustworthy}}},
          {"known", known},
          {"cases", cases}};
}

std::string Page(const std::vector<CaseResult>& results, const std::string& origin) {
  std::string body =
      "<h1>At the extremes</h1>\n<p>" + HtmlEscape(SummaryText(Count(results))) + "</p>\n";
  std::vector<std::vector<std::string>> rows, gradients, not_holding;
  const auto flush = [&](const std::string& group) {
    if (rows.empty()) return;
    body += "<h2>" + HtmlEscape(group) + "</h2>\n" +
            HtmlTable({"case", "stepping", "figure", "measured", "bound", "unit", "why this bound",
                       "verdict", "s"},
                      rows) +
            "<h3>" + HtmlEscape(group) + ": gradients, and what was chosen</h3>\n" +
            HtmlTable({"case", "stepping", "finite", "adjoint off", "differences off",
                       "certificate", "note"},
                      gradients);
    rows.clear();
    gradients.clear();
  };
  std::string group;
  for (const CaseResult& result : results) {
    for (const std::string& line : Broken(result)) {
      not_holding.push_back({result.group, result.name, result.stepping, NameOf(result.verdict()),
                             line, result.known_reason});
    }
    if (result.group != group) {
      flush(group);
      group = result.group;
    }
    if (result.finding.figures.empty()) {
      rows.push_back({result.name, result.stepping, result.message, "", "", "", "",
                      NameOf(result.verdict()), Format("%.2f", result.seconds)});
    }
    for (const Figure& figure : result.finding.figures) {
      const bool first = &figure == &result.finding.figures[0];
      rows.push_back({first ? result.name : "", first ? result.stepping : "", figure.what,
                      Format("%.3g", figure.value), Bound(figure), figure.unit, figure.reason,
                      figure.holds() ? "holds" : "does not hold",
                      first ? Format("%.2f", result.seconds) : ""});
    }
    const GradientFinding& gradient = result.finding.gradient;
    if (gradient.taken) {
      gradients.push_back({result.name, result.stepping, gradient.finite ? "yes" : "no",
                           Error(gradient.adjoint), Error(gradient.differences),
                           gradient.message.empty() ? gradient.verdict : gradient.message,
                           result.finding.note});
    } else {
      gradients.push_back(
          {result.name, result.stepping, "", "", "", "not taken", result.finding.note});
    }
  }
  flush(group);
  if (!not_holding.empty()) {
    body +=
        "<h2>What does not hold</h2>\n" +
        HtmlTable({"group", "case", "stepping", "verdict", "what", "known reason"}, not_holding);
  }
  return HtmlPage("At the extremes", body + "<p>" + HtmlEscape(origin) + "</p>\n");
}

std::string FirstFailure(const std::vector<CaseResult>& results) {
  for (const CaseResult& result : results) {
    if (result.verdict() == Verdict::kFailed) {
      const std::vector<std::string> broken = Broken(result);
      return result.group + ", " + result.name + ", " + result.stepping + ": " + broken[0];
    }
  }
  return "";
}

}  // namespace tangible::extremes
