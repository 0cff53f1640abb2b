// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/design_output.h"

#include <algorithm>
#include <cmath>

#include "tangible/render/html.h"
#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

OrderedJson FiniteOrNull(double x) {
  return std::isfinite(x) ? OrderedJson(x) : OrderedJson(nullptr);
}

DesignCandidate ReadCandidate(const JsonReader& json, const FitInput& input) {
  DesignCandidate candidate;
  json.ExpectKeys({"values", "duration", "camera"}, " of a candidate");
  if (json.Has("values")) {
    const JsonReader values = json.At("values");
    if (!values.IsObject()) values.FailExpected("an object of paths and numbers");
    for (const std::string& path : values.Keys()) {
      candidate.values.emplace_back(path, values.At(path).Number());
    }
  }
  if (json.Has("duration")) candidate.duration = json.At("duration").Number(NumberKind::kPositive);
  if (json.Has("camera")) {
    const std::vector<Camera>& cameras = input.recordings.front().problem.instruments.cameras;
    const std::string name = json.At("camera").String();
    const auto found = std::find_if(cameras.begin(), cameras.end(),
                                    [&name](const Camera& one) { return one.name == name; });
    if (found == cameras.end()) {
      json.At("camera").FailExpected(cameras.empty()
                                         ? "a camera of the fit, which has none"
                                         : "a camera of the fit such as " + cameras.front().name);
    } else {
      candidate.camera = static_cast<int>(found - cameras.begin());
    }
  }
  if (json.ok()) {
    const std::string wrong = CheckCandidate(input, candidate);
    if (!wrong.empty()) json.Fail(wrong);
  }
  return candidate;
}

void ReadWanted(const JsonReader& json, const FitInput& input, const RecordingsProblem& problem,
                DesignRequest* request) {
  if (!json.IsObject()) json.FailExpected("an object of parameters and widths");
  const std::vector<ParameterEntry>& entries = problem.entries();
  for (const std::string& name : json.Keys()) {
    const JsonReader width = json.At(name);
    const auto found =
        std::find_if(entries.begin(), entries.end(),
                     [&name](const ParameterEntry& entry) { return entry.name == name; });
    const int parameter = static_cast<int>(found - entries.begin());
    if (found == entries.end()) {
      width.Fail("expected the name of a parameter of the fit, got " + name);
    } else if (!StaysOverTakes(input, problem, parameter)) {
      width.Fail("expected a parameter that stays from take to take, got " + name);
    } else {
      request->wanted.push_back({parameter, width.Number(NumberKind::kPositive)});
    }
  }
}

std::string Candidate(size_t index) { return "candidate " + std::to_string(index); }

std::string Short(double x) { return std::isfinite(x) ? CompactNumber(x, 4) : "none"; }

// "12 takes", "the fit has it already", or that none are enough.
std::string Takes(const std::optional<long>& takes) {
  if (!takes) return "no number of takes";
  if (*takes == 0) return "none, the fit has it";
  return std::to_string(*takes) + (*takes == 1 ? " take" : " takes");
}

}  // namespace

bool ParseDesign(const std::string& text, const std::string& file, const FitInput& input,
                 const RecordingsProblem& problem, DesignRequest* request, std::string* error) {
  Json json;
  if (!ParseJson(text, file, &json, error)) return false;
  JsonErrors errors(file);
  const JsonReader root(json, &errors);
  root.ExpectKeys({"candidates", "wanted"});
  const JsonReader list = root.At("candidates");
  const int count = list.ExpectArray("an array of candidates");
  if (count == 0) list.Fail("expected at least one candidate, got none");
  for (int i = 0; i < count && errors.ok(); ++i) {
    request->candidates.push_back(ReadCandidate(list.At(i), input));
  }
  if (root.Has("wanted")) ReadWanted(root.At("wanted"), input, problem, request);
  *error = errors.message();
  return errors.ok();
}

OrderedJson DesignToJson(const std::vector<ParameterEntry>& entries, const Design& design) {
  const auto name = [&entries](int k) { return entries[static_cast<size_t>(k)].name; };
  const auto widths = [&](const Eigen::VectorXd& values) {
    OrderedJson json = OrderedJson::object();
    for (size_t i = 0; i < design.parameters.size(); ++i) {
      json[name(design.parameters[i])] = FiniteOrNull(values[static_cast<Eigen::Index>(i)]);
    }
    return json;
  };
  const auto index = [](int i) { return i < 0 ? OrderedJson(nullptr) : OrderedJson(i); };
  OrderedJson candidates = OrderedJson::array();
  for (const CandidateWorth& worth : design.candidates) {
    OrderedJson takes = OrderedJson::object();
    for (size_t i = 0; i < design.wanted.size(); ++i) {
      takes[name(design.wanted[i].parameter)] =
          worth.takes[i] ? OrderedJson(*worth.takes[i]) : OrderedJson(nullptr);
    }
    candidates.push_back({{"message", worth.message},
                          {"observations", worth.observations},
                          {"widths", widths(worth.widths)},
                          {"log_determinant", FiniteOrNull(worth.log_determinant)},
                          {"relative_variance", FiniteOrNull(worth.relative_variance)},
                          {"gain", FiniteOrNull(worth.gain)},
                          {"takes", takes}});
  }
  OrderedJson narrowest = OrderedJson::object();
  for (size_t i = 0; i < design.parameters.size(); ++i) {
    narrowest[name(design.parameters[i])] = index(design.narrowest[i]);
  }
  return {{"widths", widths(design.widths)},
          {"candidates", candidates},
          {"d_optimal", index(design.best_d)},
          {"a_optimal", index(design.best_a)},
          {"narrowest", narrowest}};
}

std::string DesignPart(const std::vector<ParameterEntry>& entries, const Design& design) {
  std::vector<std::string> heads = {"candidate", "observations", "gain (nats)", "D", "A"};
  std::vector<std::string> now = {"the fit alone", "", "", "", ""};
  for (size_t i = 0; i < design.parameters.size(); ++i) {
    heads.push_back("width of " + entries[static_cast<size_t>(design.parameters[i])].name);
    now.push_back(Short(design.widths[static_cast<Eigen::Index>(i)]));
  }
  for (const WantedWidth& wanted : design.wanted) {
    heads.push_back(entries[static_cast<size_t>(wanted.parameter)].name + " to " +
                    CompactNumber(wanted.width, 4));
    now.emplace_back();
  }
  std::vector<std::vector<std::string>> rows = {now};
  for (size_t c = 0; c < design.candidates.size(); ++c) {
    const CandidateWorth& worth = design.candidates[c];
    const int index = static_cast<int>(c);
    std::string label = std::to_string(c);
    if (index == design.best_d) label += ", D-optimal";
    if (index == design.best_a) label += ", A-optimal";
    if (!worth.message.empty()) label += ": " + worth.message;
    std::vector<std::string>& row = rows.emplace_back();
    row = {label, std::to_string(worth.observations), Short(worth.gain),
           Short(worth.log_determinant), Short(worth.relative_variance)};
    for (const double width : worth.widths) row.push_back(Short(width));
    for (const auto& takes : worth.takes) row.push_back(Takes(takes));
  }
  return "<h2>The next experiment</h2>\n<p>Widths of the 95 % intervals that one more take of each "
         "candidate would leave, to first order and by the sigma of the observations, and the "
         "takes "
         "that wanted widths need. D is the logarithm of the determinant of the information, to be "
         "large; A the sum of relative variances, to be small.</p>\n" +
         HtmlTable(heads, rows);
}

std::string DescribeDesign(const std::vector<ParameterEntry>& entries, const Design& design) {
  constexpr size_t kMostShown = 30;
  const auto name = [&entries](int k) { return entries[static_cast<size_t>(k)].name; };
  std::string text;
  for (size_t c = 0; c < std::min(design.candidates.size(), kMostShown); ++c) {
    const CandidateWorth& worth = design.candidates[c];
    text += Candidate(c) + ": ";
    if (!worth.message.empty()) {
      text += worth.message + "\n";
      continue;
    }
    text += "gain " + Short(worth.gain) + " nats, widths";
    for (size_t i = 0; i < std::min(design.parameters.size(), kMostShown); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      text += (i == 0 ? " " : ", ") + name(design.parameters[i]) + " " + Short(design.widths[k]) +
              " -> " + Short(worth.widths[k]);
    }
    for (size_t i = 0; i < design.wanted.size(); ++i) {
      text += "; " + name(design.wanted[i].parameter) + " to " +
              CompactNumber(design.wanted[i].width, 4) + ": " + Takes(worth.takes[i]);
    }
    text += "\n";
  }
  const auto best = [](int index) {
    return index < 0 ? std::string("none") : Candidate(static_cast<size_t>(index));
  };
  text += "D-optimal: " + best(design.best_d) + ", A-optimal: " + best(design.best_a) + "\n";
  for (size_t i = 0; i < std::min(design.parameters.size(), kMostShown); ++i) {
    text += "narrowest of " + name(design.parameters[i]) + ": " + best(design.narrowest[i]) + "\n";
  }
  return text;
}

std::string FirstFailure(const Design& design) {
  for (size_t c = 0; c < design.candidates.size(); ++c) {
    const std::string& message = design.candidates[c].message;
    if (!message.empty()) return "--design: " + Candidate(c) + ": " + message;
  }
  return "";
}

}  // namespace tangible
