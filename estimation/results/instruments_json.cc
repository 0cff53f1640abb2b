// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/instruments_json.h"

#include <limits>

#include "tangible/estimation/results/fit_names.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

/// Reads an object of items by name with `read(name, entry)`.
template <typename Read>
void ReadByName(const JsonReader& json, const std::string& what, const Read& read) {
  if (!json.exists()) {
    return;
  }
  if (!json.IsObject()) {
    json.FailExpected("an object of " + what + " by name");
  }
  for (const std::string& name : json.Keys()) {
    const JsonReader entry = json.At(name);
    // The name is part of a path and of a table's cell.
    if (!IsName(name)) {
      entry.Fail("expected a name of letters, digits and _.- , got " + name);
    }
    read(name, entry);
  }
}

void ReadNumber(const JsonReader& json, const char* key, NumberKind kind, double* value) {
  if (json.Has(key)) {
    *value = json.At(key).Number(kind);
  }
}

std::string TargetNames(const ObservedScene& scene) {
  return "the name of a body (" + BodyNames(scene.scene) + ") or point (" +
         PointNames(scene.points) + ")";
}

/// The body or point that a key names; the world is body −1.
BodyOrPoint ReadTarget(const JsonReader& json, const ObservedScene& scene) {
  const std::string name = json.String();
  const BodyOrPoint target = FindTarget(scene.scene, scene.points, name);
  if (target.body < 0 && name != "world") {
    json.FailExpected(TargetNames(scene));
  }
  return target;
}

/// The index of the item that a key names, −1 without the key.
template <typename Items>
int ReadIndex(const JsonReader& json, const char* key, const Items& items) {
  if (!json.Has(key)) {
    return -1;
  }
  const std::string name = json.At(key).String();
  std::string names;
  for (size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) {
      return static_cast<int>(i);
    }
    names += (i == 0 ? "" : ", ") + items[i].name;
  }
  json.At(key).FailExpected(std::string("the name of a ") + key + " (" +
                            (names.empty() ? "none" : names) + ")");
  return -1;
}

/// One standard deviation of all coordinates and events.
ObservationSigma SameSigma(double all, const std::vector<ObservedEvent>& events) {
  ObservationSigma sigma;
  for (double* value : {&sigma.x, &sigma.y, &sigma.angle, &sigma.vx, &sigma.vy, &sigma.omega,
                        &sigma.distance, &sigma.ax, &sigma.ay, &sigma.alpha, &sigma.fx, &sigma.fy,
                        &sigma.torque, &sigma.normal, &sigma.tangent}) {
    *value = all;
  }
  sigma.events.assign(events.size(), all);
  return sigma;
}

ObservationSigma ReadSigma(const JsonReader& json, const std::vector<ObservedEvent>& events) {
  if (!json.IsObject()) return SameSigma(json.Number(NumberKind::kPositive), events);
  ObservationSigma sigma;
  double* const values[kCoordinates] = {&sigma.x,      &sigma.y,      &sigma.angle,    &sigma.vx,
                                        &sigma.vy,     &sigma.omega,  &sigma.distance, &sigma.ax,
                                        &sigma.ay,     &sigma.alpha,  &sigma.fx,       &sigma.fy,
                                        &sigma.torque, &sigma.normal, &sigma.tangent};
  std::vector<std::string> keys;
  keys.reserve(kCoordinates + events.size());
  for (int i = 0; i < kCoordinates; ++i) keys.emplace_back(NameOf(static_cast<Coordinate>(i)));
  for (const ObservedEvent& event : events) {
    keys.push_back(event.name);
    sigma.events.push_back(json.Has(event.name) ? json.At(event.name).Number(NumberKind::kPositive)
                                                : std::numeric_limits<double>::quiet_NaN());
  }
  json.ExpectKeys(keys, " of sigma");
  for (int i = 0; i < kCoordinates; ++i) {
    const char* const key = NameOf(static_cast<Coordinate>(i));
    // A coordinate without a sigma may not be measured, which NaN marks.
    *values[i] = json.Has(key) ? json.At(key).Number(NumberKind::kPositive)
                               : std::numeric_limits<double>::quiet_NaN();
  }
  return sigma;
}

Sensor ReadSensor(const std::string& name, const JsonReader& json) {
  json.ExpectKeys({"delay", "gain", "bias", "sigma", "estimate_sigma"}, " of a sensor");
  Sensor sensor;
  sensor.name = name;
  ReadNumber(json, "delay", NumberKind::kFree, &sensor.delay);
  ReadNumber(json, "gain", NumberKind::kFree, &sensor.gain);
  ReadNumber(json, "bias", NumberKind::kFree, &sensor.bias);
  ReadNumber(json, "sigma", NumberKind::kPositive, &sensor.sigma);
  sensor.estimate_sigma = json.Has("estimate_sigma") && json.At("estimate_sigma").Boolean();
  if (json.Has("gain") && sensor.gain == 0.0) {
    json.At("gain").FailExpected("a number other than 0");
  }
  return sensor;
}

Camera ReadCamera(const std::string& name, const JsonReader& json, const ObservedScene& scene) {
  json.ExpectKeys({"scale", "rotation", "origin", "marker", "aspect", "radial", "radial_length"},
                  " of a camera");
  Camera camera;
  camera.name = name;
  ReadNumber(json, "scale", NumberKind::kPositive, &camera.scale);
  ReadNumber(json, "rotation", NumberKind::kFree, &camera.rotation);
  if (json.Has("origin")) {
    camera.origin = json.At("origin").Point();
  }
  if (json.Has("marker")) {
    const BodyOrPoint marker = ReadTarget(json.At("marker"), scene);
    camera.marker_body = marker.body;
    camera.marker_point = marker.point;
  }
  ReadNumber(json, "aspect", NumberKind::kPositive, &camera.aspect);
  ReadNumber(json, "radial", NumberKind::kFree, &camera.radial);
  if (json.Has("radial") || json.Has("radial_length")) {
    camera.radial_length = json.At("radial_length").Number(NumberKind::kPositive);
  }
  return camera;
}

Clock ReadClock(const std::string& name, const JsonReader& json) {
  json.ExpectKeys({"rate", "offset"}, " of a clock");
  Clock clock;
  clock.name = name;
  ReadNumber(json, "rate", NumberKind::kPositive, &clock.rate);
  ReadNumber(json, "offset", NumberKind::kFree, &clock.offset);
  return clock;
}

}  // namespace

std::vector<BodyPoint> ReadPoints(const JsonReader& json, const Scene& scene) {
  std::vector<BodyPoint> points;
  ReadByName(json, "points", [&](const std::string& name, const JsonReader& entry) {
    entry.ExpectKeys({"body", "at"}, " of a point");
    BodyPoint point;
    point.name = name;
    point.body = FindTarget(scene, {}, entry.At("body").String()).body;
    if (point.body < 0) {
      entry.At("body").FailExpected("the name of a body (" + BodyNames(scene) + ")");
    }
    if (entry.Has("at")) {
      point.at = entry.At("at").Point();
    }
    points.push_back(point);
  });
  return points;
}

Instruments ReadInstruments(const JsonReader& root, const Scene& scene,
                            const std::vector<BodyPoint>& points) {
  Instruments instruments;
  const ObservedScene observed{scene, points, instruments};
  ReadByName(root.At("sensors"), "sensors", [&](const std::string& name, const JsonReader& entry) {
    instruments.sensors.push_back(ReadSensor(name, entry));
  });
  ReadByName(root.At("cameras"), "cameras", [&](const std::string& name, const JsonReader& entry) {
    instruments.cameras.push_back(ReadCamera(name, entry, observed));
  });
  ReadByName(root.At("clocks"), "clocks", [&](const std::string& name, const JsonReader& entry) {
    instruments.clocks.push_back(ReadClock(name, entry));
  });
  return instruments;
}

std::vector<ObservedEvent> ReadEvents(const JsonReader& json, const Scene& scene) {
  std::vector<ObservedEvent> events;
  if (json.exists() && scene.simulation.stepping != Stepping::kEvent) {
    json.Fail(
        "expected a scene with \"stepping\": \"event\", which locates events, got fixed steps");
    return events;
  }
  ReadByName(json, "events", [&](const std::string& name, const JsonReader& entry) {
    entry.ExpectKeys({"bodies", "kind"}, " of an event");
    ObservedEvent event;
    event.name = name;
    const JsonReader bodies = entry.At("bodies");
    if (bodies.ExpectArray("an array of two names of bodies") != 2 && bodies.exists()) {
      bodies.Fail("expected the names of two bodies");
      return;
    }
    for (int i = 0; i < 2; ++i) {
      event.bodies[i] = FindTarget(scene, {}, bodies.At(i).String()).body;
      if (event.bodies[i] < 0) {
        bodies.At(i).FailExpected("the name of a body (" + BodyNames(scene) + ")");
        return;
      }
    }
    if (event.bodies[0] == event.bodies[1]) {
      bodies.At(1).FailExpected("another body than the first");
      return;
    }
    event.kind = entry.At("kind").Choice(kObservedEventKinds);
    events.push_back(event);
  });
  return events;
}

ObservationEntry ReadObservationEntry(const JsonReader& json, const ObservedScene& scene) {
  json.ExpectKeys(
      {"file", "sigma", "sensor", "camera", "clock", "relative_to", "unwrap", "frame", "gravity"},
      " of observations");
  ObservationEntry entry;
  entry.file = json.At("file").String();
  Channel& channel = entry.options.channel;
  channel.sensor = ReadIndex(json, "sensor", scene.instruments.sensors);
  channel.camera = ReadIndex(json, "camera", scene.instruments.cameras);
  channel.clock = ReadIndex(json, "clock", scene.instruments.clocks);
  const double of_sensor =
      channel.sensor < 0 ? 0.0 : scene.instruments.sensors[channel.sensor].sigma;
  if (of_sensor > 0.0 && !json.Has("sigma")) {
    entry.sigma = SameSigma(of_sensor, scene.instruments.events);
  } else {
    entry.sigma = ReadSigma(json.At("sigma"), scene.instruments.events);
  }
  if (json.Has("relative_to")) {
    const BodyOrPoint target = ReadTarget(json.At("relative_to"), scene);
    channel.to_body = target.body;
    channel.to_point = target.point;
  }
  channel.body_frame = json.Has("frame") && json.At("frame").Choice(kFrames);
  channel.gravity = json.Has("gravity") && json.At("gravity").Boolean();
  entry.options.unwrap = json.Has("unwrap") && json.At("unwrap").Boolean();
  return entry;
}

}  // namespace tangible
