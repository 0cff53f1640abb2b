// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/observation_csv.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "tangible/app/program.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

ObservedPoint ReadPoint(const JsonReader& json, const std::string& name,
                        const std::unordered_map<std::string, int>& bodies) {
  json.ExpectKeys({"body", "at"}, " of a point");
  ObservedPoint point;
  point.name = name;
  const JsonReader body = json.At("body");
  const auto found = bodies.find(body.String());
  if (found == bodies.end()) {
    body.FailExpected("a body of the scene");
  } else {
    point.body = found->second;
  }
  if (json.Has("at")) {
    point.at = json.At("at").Point();
  }
  return point;
}

}  // namespace

std::string ReadPoints(const std::string& file, const ModelStructure& structure,
                       std::vector<ObservedPoint>* points) {
  Json json;
  std::string error;
  if (!ParseJsonFile(file, &json, &error)) {
    return error;
  }
  JsonErrors errors(file);
  const JsonReader root(json, &errors);
  if (!root.IsObject()) {
    root.FailExpected("an object of points");
  } else if (root.Keys().empty()) {
    root.Fail("expected at least one point, got none");
  }
  std::unordered_map<std::string, int> bodies;
  for (int body = 0; body < structure.world(); ++body) {
    bodies.emplace(structure.bodies[body].name, body);
  }
  for (const std::string& name : root.Keys()) {
    // The name is written in a cell of the observations.
    if (!IsName(name)) {
      root.At(name).Fail("expected a name of letters, digits and _.- , got " + name);
    }
    points->push_back(ReadPoint(root.At(name), name, bodies));
  }
  return errors.message();
}

ObservationCsv::ObservationCsv(const ModelStructure& structure, ObserveOptions options)
    : options_(std::move(options)),
      duration_(structure.settings.duration),
      dt_(structure.settings.dt),
      random_(options_.seed),
      text_(options_.points.empty() ? "time,body,x,y\n" : "time,point,x,y\n") {
  if (options_.points.empty()) {
    for (const int body : structure.moving) {
      options_.points.push_back({structure.bodies[body].name, body, {0.0, 0.0}});
    }
  }
}

void ObservationCsv::Add(long k, double t, const State<double>& state) {
  if (options_.rate == 0.0) {
    Write(t, state, 0.0, state);
    return;
  }
  while (Writes(t)) {
    const double time = std::min(static_cast<double>(next_) / options_.rate, duration_);
    if (k == 0 || time >= t - Near()) {
      Write(time, state, 0.0, state);
    } else {
      Write(time, last_, (time - last_time_) / (t - last_time_), state);
    }
    ++next_;
  }
  last_time_ = t;
  last_ = state;
}

bool ObservationCsv::Writes(double t) const {
  const double next = static_cast<double>(next_) / options_.rate;
  return options_.rate == 0.0 ||
         (next <= duration_ + Near() && std::min(next, duration_) <= t + Near());
}

void ObservationCsv::Write(double time, const State<double>& before, double part,
                           const State<double>& after) {
  for (const ObservedPoint& point : options_.points) {
    double q[3];
    for (int i = 0; i < 3; ++i) {
      const double from = before.pose[3 * point.body + i];
      q[i] = from + part * (after.pose[3 * point.body + i] - from);
    }
    const Vector2<double> r = Pose<double>(Vector2<double>(q[0], q[1]), q[2]) * point.at;
    // Without noise nothing is added, not even 0 · g, so that the positions are those of the run
    // bit for bit.
    const double dx = options_.noise > 0.0 ? options_.noise * Normal() : 0.0;
    const double dy = options_.noise > 0.0 ? options_.noise * Normal() : 0.0;
    AppendNumber(time, &text_);
    text_ += ',';
    text_ += point.name;
    text_ += ',';
    AppendNumber(r.x() + dx, &text_);
    text_ += ',';
    AppendNumber(r.y() + dy, &text_);
    text_ += '\n';
  }
}

double ObservationCsv::Normal() {
  // Box and Muller: u in (0, 1], so that the logarithm is finite.
  constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
  const double u = static_cast<double>((random_() >> 11) + 1) * kUnit;
  const double w = static_cast<double>(random_() >> 11) * kUnit;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * w);
}

}  // namespace tangible
