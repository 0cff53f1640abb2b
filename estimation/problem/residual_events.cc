// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/residual_events.h"

#include <sstream>

namespace tangible {

void RolloutResiduals::FinishEvents(const State<double>& final) {
  event_times_.Finish(scene_.model(), final);
  for (int row = 0; row < event_times_.num_rows(); ++row) {
    samples_[static_cast<size_t>(EventRow(row))] = event_times_.Value(row);
  }
}

namespace {

/// The instruments' numbers that act on the time of an event; those of none are neutral.
struct TimeInstruments {
  double gain = 1.0, bias = 0.0, delay = 0.0, rate = 1.0, offset = 0.0;

  TimeInstruments(const Instruments& instruments, const Channel& channel) {
    if (channel.sensor >= 0) {
      const Sensor& sensor = instruments.sensors[channel.sensor];
      gain = sensor.gain;
      bias = sensor.bias;
      delay = sensor.delay;
    }
    if (channel.clock >= 0) {
      rate = instruments.clocks[channel.clock].rate;
      offset = instruments.clocks[channel.clock].offset;
    }
  }
  double OnClock(double time) const { return (time + delay - offset) / rate; }
};

}  // namespace

double RolloutResiduals::RecordedTime(int i, double time) const {
  const TimeInstruments by(scene_.instruments(), ChannelOf(observations_[i]));
  return by.gain * by.OnClock(time) + by.bias;
}

/// The derivative of the residual with respect to the event's time.
double RolloutResiduals::EventFactor(int i) const {
  const TimeInstruments by(scene_.instruments(), ChannelOf(observations_[i]));
  return by.gain / by.rate / observations_[i].sigma;
}

/// What a row of J owes to the instruments' parameters.
Eigen::RowVectorXd RolloutResiduals::EventDirectTerm(int i, double time) const {
  const Channel& channel = ChannelOf(observations_[i]);
  const Instruments& instruments = scene_.instruments();
  const TimeInstruments by(instruments, channel);
  const RowMatrixXd& by_number = scene_.instrument_derivatives();
  Eigen::RowVectorXd term = Eigen::RowVectorXd::Zero(num_parameters());
  if (channel.sensor >= 0) {
    const int first = instruments.SensorNumber(channel.sensor);
    term += by.gain / by.rate * by_number.row(first) + by.OnClock(time) * by_number.row(first + 1) +
            by_number.row(first + 2);
  }
  if (channel.clock >= 0) {
    const int first = instruments.ClockNumber(channel.clock);
    term -=
        by.gain / by.rate * (by.OnClock(time) * by_number.row(first) + by_number.row(first + 1));
  }
  return term / observations_[i].sigma;
}

void RolloutResiduals::AddEventBars(int i, int loss, EventBars* bars) const {
  const int row = event_times_.RowOf(i);
  const double factor = EventFactor(i);
  const EventTimes::Source at = event_times_.SourceOf(row);
  if (at.part >= 0) bars->at_events.push_back({at, loss, factor});
  for (const JacobianEntry& entry : event_times_.ByEnd(row)) {
    bars->at_end.push_back({entry.variable, loss, factor * entry.value});
  }
}

/// The parameters are set.
std::vector<std::string> RolloutResiduals::DescribeMissingEvents() {
  std::vector<std::string> lines;
  if (!HasEvents() || !Plain()) return lines;
  for (int i = 0; i < num_residuals(); ++i) {
    const Observation& one = observations_[i];
    const int row = event_times_.RowOf(i);
    if (row < 0 || !event_times_.IsMissing(row)) continue;
    std::ostringstream line;
    line << "event " << scene_.instruments().events[one.event].name << " " << one.number
         << ", recorded at " << one.time
         << " s, does not happen in this motion; its residual is that of the time "
         << event_times_.Value(row) << " s, which "
         << (event_times_.LeadsTowards(row) ? "leads towards it" : "no parameter changes");
    lines.push_back(line.str());
  }
  return lines;
}

}  // namespace tangible
