// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>

#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

constexpr size_t kKindWidth = 26;
constexpr size_t kErrorWidth = 9;
// Headers of kMethodPairs' columns.
const char* const kHeads[] = {"adjoint",  "recomp.",  "implicit", "impl-adj", "unrolled", "Ridders",
                              "diff1e-4", "diff6e-6", "closed",   "plus",     "minus"};
static_assert(std::size(kHeads) == kNumPairs);

std::string Left(std::string text, size_t width) {
  text.resize(std::max(width, text.size()), ' ');
  return text;
}

std::string Right(const std::string& text, size_t width) {
  return std::string(width > text.size() ? width - text.size() : 0, ' ') + text;
}

std::string Head(const std::vector<int>& pairs, const std::string& first, size_t first_width) {
  std::string line = first.empty() ? "" : Left(first, first_width);
  line += Left("kind", kKindWidth) + Right("entries", 8);
  for (const int pair : pairs) {
    line += Right(kHeads[pair], kErrorWidth);
  }
  return line + Right("coarse", 7) + Right("named", 7) + Right("other", 6) + Right("unexpl.", 8) +
         Right("zero", 5) + "\n";
}

std::string RowText(const KindRow& row, const std::vector<int>& pairs) {
  std::string line = Left(row.kind, kKindWidth) + Right(std::to_string(row.entries), 8);
  for (const int pair : pairs) {
    line += Right(ErrorText(row.error[pair]), kErrorWidth);
  }
  return line + Right(std::to_string(row.coarse), 7) + Right(std::to_string(row.named), 7) +
         Right(std::to_string(row.other_solution), 6) + Right(std::to_string(row.unexplained), 8) +
         Right(std::to_string(row.zero_columns.size()), 5) + "\n";
}

std::string Exceptions(const VerifyResult& result) {
  std::ostringstream out;
  for (const SceneCheck& scene : result.scenes) {
    for (const CheckedException& e : scene.exceptions) {
      out << (e.unexplained()    ? "UNEXPLAINED "
              : e.other_solution ? "other solution "
                                 : "named ")
          << scene.name << ", " << e.parameter << ", " << kMethodPairs[e.pair].name << ", "
          << e.entries << " entries: " << e.what;
      if (!e.named.empty()) {
        out << "; the certificate: " << e.named;
      }
      out << "\n";
    }
  }
  return out.str().empty() ? "" : "exceptions\n" + out.str() + "\n";
}

std::string WrongValues(const VerifyResult& result) {
  std::string text;
  for (const SceneCheck& scene : result.scenes) {
    if (scene.wrong_value.empty()) continue;
    text += "UNEXPLAINED " + scene.name + ", " + scene.wrong_value + " (" + scene.replay + ")\n";
  }
  return text.empty() ? "" : "motions that differ from the known ones\n" + text + "\n";
}

std::string FalseAlarms(const VerifyResult& result) {
  std::ostringstream out;
  for (const SceneCheck& scene : result.scenes) {
    for (const std::string& alarm : scene.false_alarms) {
      out << scene.name << " (" << scene.replay << "), " << alarm << "\n";
    }
  }
  return out.str().empty() ? "" : "kinks that are named and are none\n" + out.str() + "\n";
}

std::string ZeroColumns(const VerifyResult& result) {
  std::ostringstream out;
  for (const SceneCheck& scene : result.scenes) {
    if (scene.total.zero_columns.empty()) {
      continue;
    }
    out << scene.name << ":";
    for (const std::string& path : scene.total.zero_columns) {
      out << " " << path;
    }
    out << "\n";
  }
  return out.str().empty() ? "" : "parameters on which nothing depends\n" + out.str() + "\n";
}

std::string WorstEntries(const VerifyResult& result) {
  std::ostringstream out;
  out << "worst entries, by error over bound\n";
  for (const auto& [scene, entry] : result.worst) {
    const MethodPair& pair = kMethodPairs[entry.pair];
    char numbers[160];
    std::snprintf(numbers, sizeof(numbers), "%.3g of the bound, %.17g against %.17g", entry.ratio,
                  entry.values[pair.a], entry.values[pair.b]);
    out << "  " << pair.name << ", " << result.scenes[scene].name << ", d " << entry.output
        << " / d " << entry.parameter << ": " << numbers << "\n    " << result.scenes[scene].replay
        << "\n";
  }
  return out.str();
}

// Of random scenes, and of coincidences, whose features have names of their own.
std::string CoverageText(const Coverage& coverage, bool random) {
  std::string text = "scenes that had\n";
  std::string line = " ";
  for (const auto& [what, count] : coverage) {
    if (!random && what.rfind(kCoincidencePrefix, 0) != 0) continue;
    const std::string item = " " + what + ": " + std::to_string(count) + ";";
    if (line.size() + item.size() > 110) {
      text += line + "\n";
      line = " ";
    }
    line += item;
  }
  text += line + "\n";
  const std::vector<std::string> missing = MissingCoverage(coverage);
  for (const std::string& what : missing) {
    if (!random && what.rfind(kCoincidencePrefix, 0) != 0) continue;
    text += "  not covered: " + what + "\n";
  }
  return text;
}

}  // namespace

std::string ErrorText(double error) {
  if (std::isnan(error)) {
    return "-";
  }
  if (std::isinf(error)) {
    return "none";
  }
  char text[32];
  std::snprintf(text, sizeof(text), "%.1e", error);
  return error == 0.0 ? "0" : text;
}

std::vector<int> PairsShown(const VerifyResult& result) {
  std::vector<int> pairs;
  for (int pair = 0; pair < kNumPairs; ++pair) {
    if (!std::isnan(result.total.error[pair])) {
      pairs.push_back(pair);
    }
  }
  return pairs;
}

std::string TableText(const VerifyResult& result) {
  const std::vector<int> pairs = PairsShown(result);
  size_t width = 6;
  for (const SceneCheck& scene : result.scenes) {
    width = std::max(width, scene.name.size() + 2);
  }
  std::string text = Head(pairs, "scene", width);
  for (const SceneCheck& scene : result.scenes) {
    const std::string name = Left(scene.name, width);
    if (!scene.done) {
      text += name + "not run: " + scene.message + "\n";
    }
    for (const KindRow& row : scene.rows) {
      text += name + RowText(row, pairs);
    }
  }
  return text;
}

std::string SummaryText(const VerifyResult& result, bool random) {
  const std::vector<int> pairs = PairsShown(result);
  std::ostringstream out;
  out << WrongValues(result) << Exceptions(result) << FalseAlarms(result) << ZeroColumns(result)
      << Head(pairs, "", 0);
  for (const KindRow& row : result.kinds) {
    out << RowText(row, pairs);
  }
  out << RowText(result.total, pairs) << "\n";
  long closed = 0, sliding = 0, sticking = 0, limits = 0, impacts = 0, recoveries = 0;
  for (const SceneCheck& scene : result.scenes) {
    closed += scene.closed;
    sliding += scene.sliding;
    sticking += scene.sticking;
    limits += scene.limits;
    impacts += scene.impacts;
    recoveries += scene.recoveries;
  }
  out << "closed contacts " << closed << ": sliding " << sliding << ", sticking " << sticking
      << ", limits " << limits << ", impacts " << impacts << ", recovering " << recoveries << "\n";
  if (random || HasCoincidences(result.coverage)) {
    out << CoverageText(result.coverage, random);
  }
  out << WorstEntries(result) << result.scenes.size() << " scenes, " << result.not_run
      << " not run; " << result.total.entries << " entries, " << result.exceptions_named
      << " named exceptions, " << result.exceptions_unexplained << " unexplained\n";
  return out.str();
}

}  // namespace tangible
