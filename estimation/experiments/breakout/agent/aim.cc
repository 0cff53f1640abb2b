// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/aim.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr int kMostFlights = 160;        // followed for one aim
constexpr double kMostFrames = 1000.0;   // of a flight
constexpr double kDiscount = 0.997;      // a frame
constexpr double kLeastDeviation = 0.7;  // pixels: of where the ball meets a paddle in whole ones
constexpr double kLife = 30.0;           // points that a life is worth
constexpr double kAnyReturn = 1.0;       // points that a return is worth which breaks nothing soon

struct Node {
  BallState ball;  // arriving
  double frames = 0.0;
  int first = 0;  // option
};

double PointsOf(const Bricks& before, const Bricks& after, const Responses& responses,
                const FlightModel& flights) {
  const Bricks broken = before & ~after;
  double points = 0.0;
  for (int i = 0; i < kMostBricks && broken.any(); ++i) {
    if (broken[i]) points += responses.Points(flights.RowOf(i));
  }
  return points;
}

class Search {
 public:
  Search(const AimProblem& problem, const Responses& responses, FlightModel* flights,
         const std::vector<AimOption>& options)
      : problem_(problem), responses_(responses), flights_(flights), values_(options.size(), 0.0) {
    std::vector<Node> level;
    for (size_t i = 0; i < options.size(); ++i) {
      Follow({problem.arrival, problem.frames, static_cast<int>(i)}, options[i], &level);
    }
    while (!found_ && !level.empty() && num_flights_ < kMostFlights) {
      std::vector<Node> next;
      for (const Node& node : level) {
        for (const AimOption& option : AimOptions(responses_, node.ball.v, problem_.width)) {
          if (num_flights_ < kMostFlights) Follow(node, option, &next);
        }
      }
      level = std::move(next);
    }
  }
  bool found() const { return found_; }
  int num_flights() const { return num_flights_; }
  const std::vector<double>& values() const { return values_; }

 private:
  void Follow(const Node& node, const AimOption& option, std::vector<Node>* next) {
    BallState ball = node.ball;
    ball.v = option.after;
    ball.armed = true;
    if (ball.v.y() >= 0.0) return;
    ++num_flights_;
    const Flight flight = flights_->Predict(ball, problem_.bricks, kMostFrames);
    const double points = PointsOf(problem_.bricks, flight.bricks, responses_, *flights_);
    if (points > 0.0) {
      double first = flight.frames;
      for (const FlightMeeting& one : flight.meetings) {
        if (one.brick >= 0) first = std::min(first, one.frames);
      }
      found_ = true;
      values_[node.first] =
          std::max(values_[node.first], points * std::pow(kDiscount, node.frames + first));
    } else if (flight.arrives) {
      const auto place = std::make_tuple(std::lround(flight.end.at.x()), flight.end.v.x() > 0.0,
                                         std::lround(2.0 * flight.end.v.y()));
      if (visited_.insert(place).second) {
        next->push_back({flight.end, node.frames + flight.frames, node.first});
      }
    }
  }

  const AimProblem& problem_;
  const Responses& responses_;
  FlightModel* flights_;
  std::vector<double> values_;
  bool found_ = false;
  int num_flights_ = 0;
  std::set<std::tuple<long, bool, long>> visited_;
};

}  // namespace

std::vector<AimOption> AimOptions(const Responses& responses, const Vector2<double>& v,
                                  double width) {
  std::vector<AimOption> options;
  const Vector2<double> rigid(v.x(), -v.y());
  for (double offset = 0.0; offset <= width - kBallAcross; offset += 1.0) {
    const Vector2<double> after = responses.After(Meeting::kPaddle, 0, offset, v, rigid);
    if (options.empty() || (options.back().after - after).norm() > 0.0) {
      options.push_back({offset, offset, after});
    }
    options.back().high = offset;
  }
  return options;
}

namespace {

// The probability that a normal variable with this mean and deviation is below x.
double Below(double x, double mean, double deviation) {
  return 0.5 * std::erfc((mean - x) / (deviation * std::numbers::sqrt2));
}

// The expected value of meeting the ball at an offset.
double Worth(const std::vector<AimOption>& options, const std::vector<double>& values,
             double offset, double deviation) {
  // The ball is at whole pixels, and options end between them.
  double worth = -kLife;
  for (size_t i = 0; i < options.size(); ++i) {
    const double chance = Below(options[i].high + 0.5, offset, deviation) -
                          Below(options[i].low - 0.5, offset, deviation);
    worth += chance * (kLife + kAnyReturn + values[i]);
  }
  return worth;
}

}  // namespace

Aim ChooseAim(const AimProblem& problem, const Responses& responses, FlightModel* flights,
              std::mt19937_64* random, bool break_loop) {
  const std::vector<AimOption> options = AimOptions(responses, problem.arrival.v, problem.width);
  const Search search(problem, responses, flights, options);
  Aim aim;
  aim.flights = search.num_flights();
  aim.random = break_loop || !search.found();
  std::vector<double> values = search.values();
  if (aim.random) {
    // One option at random, whatever its value.
    std::fill(values.begin(), values.end(), 0.0);
    values[static_cast<size_t>(Uniform(random) * static_cast<double>(values.size()))] = kLife;
  }
  const double deviation = std::max(problem.uncertainty, kLeastDeviation);
  const double reach = problem.speed * problem.frames;
  double best = -HUGE_VAL;
  for (const AimOption& option : options) {
    for (double offset = option.low; offset <= option.high; offset += 1.0) {
      const double way = std::abs(problem.arrival.at.x() - offset - problem.paddle_x);
      const double worth =
          Worth(options, values, offset, deviation) - (way > reach ? way - reach : 0.0) * kLife;
      if (worth <= best) continue;
      best = worth;
      aim.option = option;
      aim.offset = offset;
    }
  }
  return aim;
}

}  // namespace tangible
