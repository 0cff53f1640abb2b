// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/event_file.h"

#include <cmath>
#include <limits>

#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

class EventRowReader {
 public:
  EventRowReader(const CsvTable& table, const ObservedScene& scene, const Channel& channel,
                 std::string* error)
      : table_(table),
        scene_(scene),
        channel_(channel),
        error_(error),
        last_(scene.instruments.events.size(), 0) {}

  bool CheckHeader() {
    for (const std::string& column : table_.columns) {
      if (column != "time" && column != "event" && column != "number") {
        *error_ = table_.file + ": header: expected time, event and number alone, got " + column;
        return false;
      }
    }
    for (const char* name : {"event", "number"}) {
      if (table_.Column(name) >= 0) continue;
      *error_ = table_.file + ": header: expected a column " + name + ", got none";
      return false;
    }
    if (channel_.camera >= 0 || channel_.to_body >= 0) {
      *error_ = table_.file + ": expected no camera and no relative_to of times of events, got one";
      return false;
    }
    return true;
  }

  bool Read(int row, Observation* observation) {
    const std::string& name = table_.rows[row][table_.Column("event")];
    const std::vector<ObservedEvent>& events = scene_.instruments.events;
    observation->event = -1;
    std::string names;
    for (size_t i = 0; i < events.size(); ++i) {
      if (events[i].name == name) observation->event = static_cast<int>(i);
      names += (i == 0 ? "" : ", ") + events[i].name;
    }
    if (observation->event < 0) {
      return Fail(row, "event: expected the name of one of the events (" +
                           (names.empty() ? "none" : names) + "), got \"" + name + "\"");
    }
    std::string what;
    if (!ReadCell(table_, row, table_.Column("time"), &observation->value, error_)) return false;
    observation->time = observation->value;
    if (!CheckTime(scene_, channel_, &observation->time, &what)) return Fail(row, what);
    observation->value = observation->time;
    return ReadNumber(row, observation);
  }

 private:
  bool ReadNumber(int row, Observation* observation) {
    double number = 0.0;
    if (!ReadCell(table_, row, table_.Column("number"), &number, error_)) return false;
    const std::string& text = table_.rows[row][table_.Column("number")];
    if (number < 1.0 || number != std::floor(number) || number > std::numeric_limits<int>::max()) {
      return Fail(row, "number: expected an integer from 1 (the first), got " + text);
    }
    int& last = last_[observation->event];
    observation->number = static_cast<int>(number);
    if (observation->number <= last) {
      return Fail(row, "number: expected more than " + std::to_string(last) + ", the last one of " +
                           scene_.instruments.events[observation->event].name + ", got " + text);
    }
    last = observation->number;
    return true;
  }

  bool Fail(int row, const std::string& what) {
    *error_ = OneLine(table_.file + ": line " + std::to_string(table_.lines[row]) + ": " + what);
    return false;
  }

  const CsvTable& table_;
  const ObservedScene& scene_;
  const Channel& channel_;
  std::string* error_;
  std::vector<int> last_;  ///< number of each event so far
};

}  // namespace

bool ReadEventTimes(const CsvTable& table, const ObservedScene& scene,
                    const ObservationSigma& sigma, const ObservationOptions& options,
                    std::vector<Channel>* channels, std::vector<Observation>* observations,
                    std::string* error) {
  EventRowReader reader(table, scene, options.channel, error);
  if (!reader.CheckHeader()) return false;
  if (table.rows.empty()) {
    *error = table.file + ": expected at least one event, got none";
    return false;
  }
  for (size_t row = 0; row < table.rows.size(); ++row) {
    Observation observation;
    if (!reader.Read(static_cast<int>(row), &observation)) return false;
    observation.coordinate = Coordinate::kTime;
    observation.body = scene.instruments.events[observation.event].bodies[0];
    observation.sigma = sigma.OfEvent(observation.event);
    observation.channel = FindOrAdd(options.channel, channels);
    observations->push_back(observation);
  }
  return true;
}

}  // namespace tangible
