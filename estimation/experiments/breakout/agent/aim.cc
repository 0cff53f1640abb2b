// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/aim.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "tangible/estimation/experiments/random.h"

namespace tangible {
namespace {

constexpr int kMostFlights = 160;       // followed for one aim
constexpr double kMostFrames = 1000.0;  // of a flight
constexpr double kDiscount = 0.997;     // a frame
constexpr double kEdge = 1.0;    // pixels at the paddle's ends that are no option if others are
constexpr double kNarrow = 3.0;  // pixels: narrower options are missed at times
constexpr double kMissed = 0.7;  // share of their value that these have

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
      const double sure = option.high - option.low < kNarrow ? kMissed : 1.0;
      values_[node.first] =
          std::max(values_[node.first], sure * points * std::pow(kDiscount, node.frames + first));
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
  for (AimOption& option : options) {
    if (option.high >= kEdge) option.low = std::max(option.low, kEdge);
    if (option.low <= width - kBallAcross - kEdge) {
      option.high = std::min(option.high, width - kBallAcross - kEdge);
    }
  }
  return options;
}

Aim ChooseAim(const AimProblem& problem, const Responses& responses, FlightModel* flights,
              std::mt19937_64* random, bool break_loop) {
  std::vector<AimOption> options = AimOptions(responses, problem.arrival.v, problem.width);
  const double reach = problem.speed * problem.frames;
  const auto out_of_reach = [&](const AimOption& option) {
    return std::abs(problem.arrival.at.x() - option.middle() - problem.paddle_x) > reach;
  };
  std::vector<AimOption> near = options;
  near.erase(std::remove_if(near.begin(), near.end(), out_of_reach), near.end());
  if (!near.empty()) options = std::move(near);
  Aim aim;
  const Search search(problem, responses, flights, options);
  aim.flights = search.num_flights();
  aim.random = break_loop || !search.found();
  const size_t best =
      aim.random
          ? static_cast<size_t>(Uniform(random) * static_cast<double>(options.size()))
          : static_cast<size_t>(std::max_element(search.values().begin(), search.values().end()) -
                                search.values().begin());
  aim.option = options[best];
  return aim;
}

}  // namespace tangible
