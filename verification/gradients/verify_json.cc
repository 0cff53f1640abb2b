// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_json.h"

#include <cmath>

#include "tangible/app/certificate_json.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

OrderedJson ToJson(const KindRow& row) {
  OrderedJson errors = OrderedJson::object();
  for (int pair = 0; pair < kNumPairs; ++pair) {
    if (!std::isnan(row.error[pair])) {
      errors[kMethodPairs[pair].name] = row.error[pair];
    }
  }
  return {{"kind", row.kind},
          {"parameters", row.parameters},
          {"entries", row.entries},
          {"errors", errors},
          {"coarse", row.coarse},
          {"named", row.named},
          {"other_solution", row.other_solution},
          {"unexplained", row.unexplained},
          {"zero_columns", row.zero_columns}};
}

OrderedJson ToJson(const CheckedException& exception) {
  return {{"parameter", exception.parameter},
          {"pair", kMethodPairs[exception.pair].name},
          {"entries", exception.entries},
          {"error", exception.error},
          {"what", exception.what},
          {"named", exception.named},
          {"other_solution", exception.other_solution}};
}

OrderedJson ToJson(const CheckedEntry& entry) {
  OrderedJson values = OrderedJson::object();
  for (int m = 0; m < kNumMethods; ++m) {
    if (!std::isnan(entry.values[m])) {
      values[NameOf(static_cast<Method>(m))] = entry.values[m];
    }
  }
  return {{"pair", kMethodPairs[entry.pair].name}, {"output", entry.output},
          {"parameter", entry.parameter},          {"error", entry.error},
          {"share_of_bound", entry.ratio},         {"values", values},
          {"contributions", entry.contributions},  {"ridders_error", entry.ridders_error}};
}

OrderedJson ToJson(const MatrixX<double>& matrix) {
  OrderedJson rows = OrderedJson::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    OrderedJson row = OrderedJson::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      row.push_back(matrix(i, j));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

OrderedJson Jacobians(const SceneCheck& check) {
  OrderedJson methods = OrderedJson::object();
  for (int m = 0; m < kNumMethods; ++m) {
    if (check.jacobian[m].size() > 0) {
      methods[NameOf(static_cast<Method>(m))] = ToJson(check.jacobian[m]);
    }
  }
  return {{"outputs", check.outputs},
          {"parameters", check.parameter_paths},
          {"methods", methods},
          {"contributions", ToJson(check.contributions)},
          {"ridders_error", ToJson(check.ridders_error)}};
}

OrderedJson ToJson(const SceneCheck& check);

template <typename T>
OrderedJson ListOf(const std::vector<T>& items) {
  OrderedJson list = OrderedJson::array();
  for (const T& item : items) {
    list.push_back(ToJson(item));
  }
  return list;
}

OrderedJson ToJson(const SceneCheck& check) {
  OrderedJson json = {{"name", check.name},
                      {"replay", check.replay},
                      {"stepping", NameOf(check.stepping, kSteppingNames)},
                      {"done", check.done},
                      {"message", check.message},
                      {"bodies", check.bodies},
                      {"joints", check.joints},
                      {"steps", check.steps},
                      {"parameters", check.parameters}};
  if (!check.done) {
    return json;
  }
  json["closed_contacts"] = {{"all", check.closed},        {"sliding", check.sliding},
                             {"sticking", check.sticking}, {"limits", check.limits},
                             {"impacts", check.impacts},   {"recovering", check.recoveries}};
  json["unrolled_fallbacks"] = check.unrolled_fallbacks;
  json["certificate"] = ToJson(check.certificate);
  OrderedJson missing = OrderedJson::object();
  for (int m = 0; m < kNumMethods; ++m) {
    if (!check.missing[m].empty()) {
      missing[NameOf(static_cast<Method>(m))] = check.missing[m];
    }
  }
  json["missing"] = missing;
  json["rows"] = ListOf(check.rows);
  json["total"] = ToJson(check.total);
  json["exceptions"] = ListOf(check.exceptions);
  if (!check.outputs.empty()) {
    json["jacobians"] = Jacobians(check);
  }
  return json;
}

}  // namespace

OrderedJson ToJson(const VerifyResult& result) {
  OrderedJson bounds = OrderedJson::array();
  for (const MethodPair& pair : kMethodPairs) {
    OrderedJson bound = {{"pair", pair.name}, {"a", NameOf(pair.a)}, {"b", NameOf(pair.b)}};
    if (pair.bounded && pair.a != kByClosedForm) {
      bound["tolerance"] = pair.tolerance;
    }
    bounds.push_back(std::move(bound));
  }
  OrderedJson worst = OrderedJson::array();
  for (const auto& [scene, entry] : result.worst) {
    OrderedJson item = {{"scene", result.scenes[scene].name},
                        {"replay", result.scenes[scene].replay}};
    item.update(ToJson(entry));
    item["scene_json"] = OrderedJson::parse(result.worst_scenes.at(scene));
    worst.push_back(std::move(item));
  }
  OrderedJson coverage = OrderedJson::object();
  for (const auto& [what, count] : result.coverage) {
    coverage[what] = count;
  }
  return {{"bounds", bounds},
          {"scenes", ListOf(result.scenes)},
          {"kinds", ListOf(result.kinds)},
          {"total", ToJson(result.total)},
          {"not_run", result.not_run},
          {"exceptions_named", result.exceptions_named},
          {"exceptions_other_solution", result.exceptions_other},
          {"exceptions_unexplained", result.exceptions_unexplained},
          {"worst", worst},
          {"coverage", coverage}};
}

}  // namespace tangible
