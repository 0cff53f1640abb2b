// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/instruments.h"

namespace tangible {

std::vector<InstrumentNumber> EnumerateNumbers(Instruments* instruments) {
  std::vector<InstrumentNumber> numbers;
  for (Sensor& sensor : instruments->sensors) {
    const std::string path = "sensors/" + sensor.name;
    numbers.push_back({path + "/delay", &sensor.delay, NumberKind::kFree, true});
    numbers.push_back({path + "/gain", &sensor.gain, NumberKind::kFree});
    numbers.push_back({path + "/bias", &sensor.bias, NumberKind::kFree});
  }
  for (Camera& camera : instruments->cameras) {
    const std::string path = "cameras/" + camera.name;
    numbers.push_back({path + "/scale", &camera.scale, NumberKind::kPositive});
    numbers.push_back({path + "/rotation", &camera.rotation, NumberKind::kFree});
    numbers.push_back({path + "/origin/x", &camera.origin.x(), NumberKind::kFree});
    numbers.push_back({path + "/origin/y", &camera.origin.y(), NumberKind::kFree});
    numbers.push_back({path + "/aspect", &camera.aspect, NumberKind::kPositive});
    numbers.push_back({path + "/radial", &camera.radial, NumberKind::kFree, false,
                       camera.radial_length > 0.0 ? nullptr : "radial_length"});
  }
  for (Clock& clock : instruments->clocks) {
    const std::string path = "clocks/" + clock.name;
    numbers.push_back({path + "/rate", &clock.rate, NumberKind::kPositive, true});
    numbers.push_back({path + "/offset", &clock.offset, NumberKind::kFree, true});
  }
  return numbers;
}

double RunTime(const Instruments& instruments, const Channel& channel, double recorded) {
  double time = recorded;
  if (channel.clock >= 0) {
    const Clock& clock = instruments.clocks[channel.clock];
    time = clock.offset + clock.rate * recorded;
  }
  return channel.sensor >= 0 ? time - instruments.sensors[channel.sensor].delay : time;
}

}  // namespace tangible
