// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/observation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <sstream>
#include <tuple>

#include "tangible/estimation/problem/event_file.h"
#include "tangible/estimation/problem/tolerances.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

constexpr std::array<const char*, kCoordinates + 1> kNames = {
    "x",  "y",     "angle", "vx", "vy",     "omega",  "distance", "ax",
    "ay", "alpha", "fx",    "fy", "torque", "normal", "tangent",  "time"};

// Number of samples whose mean rate predicts the next angle.
constexpr size_t kUnwrapSamples = 10;

template <typename Items>
std::string Names(const Items& items) {
  std::string names;
  for (const auto& item : items) {
    names += (names.empty() ? "" : ", ") + item.name;
  }
  return names.empty() ? "none" : names;
}

/// Turns the rows of one table into observations.
class RowReader {
 public:
  RowReader(const CsvTable& table, const ObservedScene& scene, const ObservationOptions& options,
            std::vector<Channel>* channels, std::string* error)
      : table_(table), scene_(scene), options_(options), channels_(channels), error_(error) {
    for (const Target target : {Target::kBody, Target::kPoint, Target::kJoint, Target::kContact}) {
      if (table_.Column(NameOf(target)) < 0) continue;
      target_ = target;
      ++num_targets_;
    }
    relative_to_ = table_.Column("relative_to");
  }

  /// Checks that the header names the observed bodies or points and the coordinates.
  bool CheckHeader() {
    if (num_targets_ != 1) {
      *error_ = table_.file + ": header: expected one column body, point, joint or contact, got " +
                (num_targets_ == 0 ? "none" : "several");
      return false;
    }
    bool any = false;
    for (int i = 0; i < kCoordinates; ++i) {
      if (table_.Column(kNames[i]) < 0) continue;
      any = true;
      if (IsOf(static_cast<Coordinate>(i))) continue;
      *error_ = table_.file + ": header: expected the coordinates of a " + NameOf(target_) + " (" +
                CoordinatesOf() + "), got " + kNames[i];
      return false;
    }
    if (!any) {
      *error_ =
          table_.file + ": header: expected a column " + CoordinatesOf() + ", got none of them";
    }
    return any;
  }

  bool Read(int row, const ObservationSigma& sigma, std::vector<Observation>* observations) {
    Observation observation;
    Channel channel = options_.channel;
    if (!ReadCell(table_, row, table_.Column("time"), &observation.time, error_) ||
        !FindObserved(row, &observation) || !FindReference(row, &channel) ||
        !CheckTime(row, channel, &observation.time)) {
      return false;
    }
    for (int i = 0; i < kCoordinates; ++i) {
      const int column = table_.Column(kNames[i]);
      if (column < 0 || table_.rows[row][column].empty()) {
        continue;
      }
      observation.coordinate = static_cast<Coordinate>(i);
      observation.sigma = sigma.Of(observation.coordinate);
      if (observation.coordinate == Coordinate::kDistance && channel.to_body < 0) {
        return Fail(row, "distance: expected relative_to to name a body or point, got the world");
      }
      if (IsAcceleration(observation.coordinate) && (channel.camera >= 0 || channel.to_body >= 0)) {
        return Fail(row, std::string(kNames[i]) +
                             ": expected no camera and no relative_to of an acceleration, got one");
      }
      if (IsForce(observation.coordinate) && (channel.camera >= 0 || channel.to_body >= 0)) {
        return Fail(row, std::string(kNames[i]) +
                             ": expected no camera and no relative_to of a force, got one");
      }
      if (!ReadCell(table_, row, column, &observation.value, error_)) {
        return false;
      }
      observation.channel = FindOrAdd(channel, channels_);
      observations->push_back(observation);
    }
    return true;
  }

 private:
  enum class Target { kBody, kPoint, kJoint, kContact };
  static const char* NameOf(Target target) {
    return target == Target::kBody    ? "body"
           : target == Target::kPoint ? "point"
           : target == Target::kJoint ? "joint"
                                      : "contact";
  }

  /// Whether what is observed has the coordinate.
  bool IsOf(Coordinate coordinate) const {
    if (!IsForce(coordinate)) return target_ == Target::kBody || target_ == Target::kPoint;
    const bool is_of_contact =
        coordinate == Coordinate::kNormal || coordinate == Coordinate::kTangent;
    return target_ == (is_of_contact ? Target::kContact : Target::kJoint);
  }
  std::string CoordinatesOf() const {
    return target_ == Target::kJoint     ? "fx, fy or torque"
           : target_ == Target::kContact ? "normal or tangent"
                                         : "x, y, angle, vx, vy, omega, distance, ax, ay or alpha";
  }

  bool FindJoint(int row, const std::string& name, Observation* observation) {
    for (size_t j = 0; j < scene_.scene.joints.size(); ++j) {
      const BasicJoint<double>& joint = scene_.scene.joints[j];
      if (joint.name != name) continue;
      observation->joint = static_cast<int>(j);
      return joint.type != JointType::kCoupling ||
             Fail(row, "joint: expected a joint of two bodies, got the coupling " + name +
                           " (its force is that of the joints that it couples)");
    }
    return Fail(row, "joint: expected the name of a joint (" + Names(scene_.scene.joints) +
                         "), got \"" + name + "\"");
  }

  bool FindContact(int row, const std::string& name, Observation* observation) {
    const size_t colon = name.find(':');
    bool found = colon != std::string::npos;
    for (int k = 0; k < 2 && found; ++k) {
      const std::string body = k == 0 ? name.substr(0, colon) : name.substr(colon + 1);
      observation->pair[k] = FindTarget(scene_.scene, {}, body).body;
      found = observation->pair[k] >= 0;
    }
    return (found && observation->pair[0] != observation->pair[1]) ||
           Fail(row, "contact: expected the names of two bodies (" + BodyNames(scene_.scene) +
                         ") as \"a:b\", got \"" + name + "\"");
  }

  bool Fail(int row, const std::string& what) {
    *error_ = OneLine(table_.file + ": line " + std::to_string(table_.lines[row]) + ": " + what);
    return false;
  }

  bool CheckTime(int row, const Channel& channel, double* time) {
    std::string what;
    return tangible::CheckTime(scene_, channel, time, &what) || Fail(row, what);
  }

  bool FindObserved(int row, Observation* observation) {
    const std::string& name = table_.rows[row][table_.Column(NameOf(target_))];
    if (target_ == Target::kJoint) return FindJoint(row, name, observation);
    if (target_ == Target::kContact) return FindContact(row, name, observation);
    if (target_ == Target::kPoint) {
      for (size_t i = 0; i < scene_.points.size(); ++i) {
        if (scene_.points[i].name == name) {
          observation->point = static_cast<int>(i);
          observation->body = scene_.points[i].body;
          return true;
        }
      }
      return Fail(row, "point: expected the name of a point (" + PointNames(scene_.points) +
                           "), got \"" + name + "\"");
    }
    observation->body = FindTarget(scene_.scene, {}, name).body;
    return observation->body >= 0 ||
           Fail(row, "body: expected the name of a body (" + BodyNames(scene_.scene) + "), got \"" +
                         name + "\"");
  }

  bool FindReference(int row, Channel* channel) {
    if (relative_to_ < 0 || table_.rows[row][relative_to_].empty()) {
      return true;
    }
    const std::string& name = table_.rows[row][relative_to_];
    const BodyOrPoint target = FindTarget(scene_.scene, scene_.points, name);
    channel->to_body = target.body;
    channel->to_point = target.point;
    return target.body >= 0 || name == "world" ||
           Fail(row, "relative_to: expected the name of a body (" + BodyNames(scene_.scene) +
                         ") or point (" + PointNames(scene_.points) + "), got \"" + name + "\"");
  }

  const CsvTable& table_;
  const ObservedScene& scene_;
  const ObservationOptions& options_;
  std::vector<Channel>* channels_;
  std::string* error_;
  Target target_ = Target::kBody;
  int num_targets_ = 0;
  int relative_to_ = -1;
};

const std::vector<std::string>& AllowedColumns() {
  static const std::vector<std::string> columns = {
      "time",  "body", "point",  "joint",  "contact",  "relative_to", "x",     "y",
      "angle", "vx",   "vy",     "omega",  "distance", "ax",          "ay",    "alpha",
      "fx",    "fy",   "torque", "normal", "tangent",  "event",       "number"};
  return columns;
}

/// Makes the angles of one series continuous; `order` are its observations by time.
void UnwrapSeries(const std::vector<int>& order, std::vector<Observation>* observations) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (size_t k = 1; k < order.size(); ++k) {
    const Observation& last = (*observations)[order[k - 1]];
    const Observation& earlier = (*observations)[order[k - 1 - std::min(k - 1, kUnwrapSamples)]];
    Observation& next = (*observations)[order[k]];
    const double span = last.time - earlier.time;
    const double rate = span > 0.0 ? (last.value - earlier.value) / span : 0.0;
    const double expected = last.value + rate * (next.time - last.time);
    next.value += kTurn * std::round((expected - next.value) / kTurn);
  }
}

void Unwrap(size_t first, std::vector<Observation>* observations) {
  const std::vector<Observation> own(observations->begin() + static_cast<std::ptrdiff_t>(first),
                                     observations->end());
  const ObservationSeries series = IndexSeries(own);
  std::vector<std::vector<int>> members(series.size());
  for (size_t i = 0; i < own.size(); ++i) {
    if (own[i].coordinate == Coordinate::kAngle) {
      members[series.of[i]].push_back(static_cast<int>(first + i));
    }
  }
  for (std::vector<int>& order : members) {
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return (*observations)[a].time < (*observations)[b].time;
    });
    UnwrapSeries(order, observations);
  }
}

bool FromTable(const CsvTable& table, const ObservedScene& scene, const ObservationSigma& sigma,
               const ObservationOptions& options, std::vector<Channel>* channels,
               std::vector<Observation>* observations, std::string* error) {
  if (table.Column("event") >= 0 || table.Column("number") >= 0) {
    return ReadEventTimes(table, scene, sigma, options, channels, observations, error);
  }
  RowReader reader(table, scene, options, channels, error);
  if (!reader.CheckHeader()) {
    return false;
  }
  const size_t before = observations->size();
  for (size_t row = 0; row < table.rows.size(); ++row) {
    if (!reader.Read(static_cast<int>(row), sigma, observations)) {
      return false;
    }
  }
  if (observations->size() == before) {
    *error = table.file + ": expected at least one measured coordinate, got none";
    return false;
  }
  if (options.unwrap) {
    Unwrap(before, observations);
  }
  return true;
}

}  // namespace

const char* NameOf(Coordinate coordinate) { return kNames[static_cast<size_t>(coordinate)]; }

const char* UnitOf(Coordinate coordinate) {
  switch (coordinate) {
    case Coordinate::kX:
    case Coordinate::kY:
    case Coordinate::kDistance:
      return "m";
    case Coordinate::kAngle:
      return "rad";
    case Coordinate::kVx:
    case Coordinate::kVy:
      return "m/s";
    case Coordinate::kOmega:
      return "rad/s";
    case Coordinate::kAx:
    case Coordinate::kAy:
      return "m/s^2";
    case Coordinate::kAlpha:
      return "rad/s^2";
    case Coordinate::kFx:
    case Coordinate::kFy:
    case Coordinate::kNormal:
    case Coordinate::kTangent:
      return "N";
    case Coordinate::kTorque:
      return "N m";
    case Coordinate::kTime:
      return "s";
  }
  return "";
}

double ObservationSigma::Of(Coordinate coordinate) const {
  const double all[kCoordinates] = {x,  y,     angle, vx, vy,     omega,  distance, ax,
                                    ay, alpha, fx,    fy, torque, normal, tangent};
  return all[static_cast<size_t>(coordinate)];
}

double ObservationSigma::OfEvent(int event) const {
  return event < static_cast<int>(events.size()) ? events[event] : 1.0;
}

BodyOrPoint FindTarget(const Scene& scene, const std::vector<BodyPoint>& points,
                       const std::string& name) {
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].name == name) {
      return {points[i].body, static_cast<int>(i)};
    }
  }
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].name == name) {
      return {static_cast<int>(i), -1};
    }
  }
  return {};
}

std::string PointNames(const std::vector<BodyPoint>& points) { return Names(points); }

std::string BodyNames(const Scene& scene) { return Names(scene.bodies); }

std::string TargetName(const ObservedScene& scene, const Observation& observation) {
  if (observation.joint >= 0) return scene.scene.joints[observation.joint].name;
  if (IsForce(observation.coordinate)) {
    return scene.scene.bodies[observation.pair[0]].name + ":" +
           scene.scene.bodies[observation.pair[1]].name;
  }
  return observation.event >= 0   ? scene.instruments.events[observation.event].name
         : observation.point >= 0 ? scene.points[observation.point].name
                                  : scene.scene.bodies[observation.body].name;
}

bool CheckTime(const ObservedScene& scene, const Channel& channel, double* time,
               std::string* what) {
  const double duration = scene.scene.simulation.duration;
  const double slack = kTimeTolerance * scene.scene.simulation.dt;
  const double in_run = RunTime(scene.instruments, channel, *time);
  if (in_run < -slack || in_run > duration + slack) {
    std::ostringstream text;
    text << "time: expected a time within the run, [0, " << CsvNumber(duration) << "] s, got "
         << CsvNumber(*time);
    if (in_run != *time) {
      text << ", which is " << CsvNumber(in_run) << " of the run by clock and delay";
    }
    *what = text.str();
    return false;
  }
  if (in_run == *time) *time = std::clamp(*time, 0.0, duration);
  return true;
}

int FindOrAdd(const Channel& channel, std::vector<Channel>* channels) {
  const auto place = std::find(channels->begin(), channels->end(), channel);
  if (place != channels->end()) return static_cast<int>(place - channels->begin());
  channels->push_back(channel);
  return static_cast<int>(channels->size()) - 1;
}

std::string ReferenceName(const Scene& scene, const std::vector<BodyPoint>& points,
                          const Channel& channel) {
  return channel.to_point >= 0  ? points[channel.to_point].name
         : channel.to_body >= 0 ? scene.bodies[channel.to_body].name
                                : "";
}

ObservationSeries IndexSeries(const std::vector<Observation>& observations) {
  ObservationSeries series;
  series.of.reserve(observations.size());
  std::map<std::tuple<int, int, int, Coordinate, int, int, int, int>, int> known;
  for (size_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    const std::tuple key(observation.channel, observation.body, observation.point,
                         observation.coordinate, observation.event, observation.joint,
                         observation.pair[0], observation.pair[1]);
    const auto [place, inserted] = known.try_emplace(key, series.size());
    if (inserted) {
      series.first.push_back(static_cast<int>(i));
    }
    series.of.push_back(place->second);
  }
  return series;
}

bool ReadObservations(const std::string& file, const ObservedScene& scene,
                      const ObservationSigma& sigma, const ObservationOptions& options,
                      std::vector<Channel>* channels, std::vector<Observation>* observations,
                      std::string* error) {
  CsvTable table;
  return ReadCsv(file, {"time"}, AllowedColumns(), &table, error) &&
         FromTable(table, scene, sigma, options, channels, observations, error);
}

bool ParseObservations(const std::string& text, const std::string& file, const ObservedScene& scene,
                       const ObservationSigma& sigma, const ObservationOptions& options,
                       std::vector<Channel>* channels, std::vector<Observation>* observations,
                       std::string* error) {
  CsvTable table;
  return ParseCsv(text, file, {"time"}, AllowedColumns(), &table, error) &&
         FromTable(table, scene, sigma, options, channels, observations, error);
}

bool ParseObservations(const std::string& text, const std::string& file, const Scene& scene,
                       const std::vector<BodyPoint>& points, const ObservationSigma& sigma,
                       std::vector<Observation>* observations, std::string* error) {
  const Instruments none;
  std::vector<Channel> channels = {Channel()};
  return ParseObservations(text, file, ObservedScene{scene, points, none}, sigma, {}, &channels,
                           observations, error);
}

}  // namespace tangible
