// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/observation.h"

#include <array>
#include <map>
#include <sstream>
#include <tuple>

#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

constexpr std::array<Coordinate, 3> kCoordinates = {Coordinate::kX, Coordinate::kY,
                                                    Coordinate::kAngle};

// Times that were written as a decimal may miss the end of the run by rounding.
constexpr double kTimeTolerance = 1e-9;

double SigmaOf(const ObservationSigma& sigma, Coordinate coordinate) {
  switch (coordinate) {
    case Coordinate::kX:
      return sigma.x;
    case Coordinate::kY:
      return sigma.y;
    case Coordinate::kAngle:
      return sigma.angle;
  }
  return sigma.x;
}

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
  RowReader(const CsvTable& table, const Scene& scene, const std::vector<BodyPoint>& points,
            std::string* error)
      : table_(table), scene_(scene), points_(points), error_(error) {
    by_point_ = table.Column("point") >= 0;
  }

  /// Checks that the header says who is observed and what.
  bool CheckHeader() {
    if (by_point_ == (table_.Column("body") >= 0)) {
      *error_ = table_.file + ": header: expected a column body or a column point, got " +
                (by_point_ ? "both" : "neither");
      return false;
    }
    for (const Coordinate coordinate : kCoordinates) {
      if (table_.Column(NameOf(coordinate)) >= 0) {
        return true;
      }
    }
    *error_ = table_.file + ": header: expected a column x, y or angle, got none of them";
    return false;
  }

  bool Read(int row, const ObservationSigma& sigma, std::vector<Observation>* observations) {
    Observation observation;
    if (!ReadCell(table_, row, table_.Column("time"), &observation.time, error_) ||
        !CheckTime(row, &observation.time) || !FindTarget(row, &observation)) {
      return false;
    }
    for (const Coordinate coordinate : kCoordinates) {
      const int column = table_.Column(NameOf(coordinate));
      if (column < 0 || table_.rows[row][column].empty()) {
        continue;
      }
      observation.coordinate = coordinate;
      observation.sigma = SigmaOf(sigma, coordinate);
      if (!ReadCell(table_, row, column, &observation.value, error_)) {
        return false;
      }
      observations->push_back(observation);
    }
    return true;
  }

 private:
  bool Fail(int row, const std::string& what) {
    *error_ = OneLine(table_.file + ": line " + std::to_string(table_.lines[row]) + ": " + what);
    return false;
  }

  bool CheckTime(int row, double* time) {
    const double duration = scene_.simulation.duration;
    const double slack = kTimeTolerance * scene_.simulation.dt;
    if (*time < -slack || *time > duration + slack) {
      std::ostringstream what;
      what << "time: expected a time within the run, [0, " << duration << "] s, got " << *time;
      return Fail(row, what.str());
    }
    *time = *time < 0.0 ? 0.0 : (*time > duration ? duration : *time);
    return true;
  }

  bool FindTarget(int row, Observation* observation) {
    const std::string& name = table_.rows[row][table_.Column(by_point_ ? "point" : "body")];
    if (by_point_) {
      for (size_t i = 0; i < points_.size(); ++i) {
        if (points_[i].name == name) {
          observation->point = static_cast<int>(i);
          observation->body = points_[i].body;
          return true;
        }
      }
      return Fail(row, "point: expected the name of a point (" + Names(points_) + "), got \"" +
                           name + "\"");
    }
    for (size_t i = 0; i < scene_.bodies.size(); ++i) {
      if (scene_.bodies[i].name == name) {
        observation->body = static_cast<int>(i);
        return true;
      }
    }
    return Fail(row, "body: expected the name of a body (" + Names(scene_.bodies) + "), got \"" +
                         name + "\"");
  }

  const CsvTable& table_;
  const Scene& scene_;
  const std::vector<BodyPoint>& points_;
  std::string* error_;
  bool by_point_ = false;
};

const std::vector<std::string>& AllowedColumns() {
  static const std::vector<std::string> columns = {"time", "body", "point", "x", "y", "angle"};
  return columns;
}

bool FromTable(const CsvTable& table, const Scene& scene, const std::vector<BodyPoint>& points,
               const ObservationSigma& sigma, std::vector<Observation>* observations,
               std::string* error) {
  RowReader reader(table, scene, points, error);
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
  return true;
}

}  // namespace

const char* NameOf(Coordinate coordinate) {
  switch (coordinate) {
    case Coordinate::kX:
      return "x";
    case Coordinate::kY:
      return "y";
    case Coordinate::kAngle:
      return "angle";
  }
  return "";
}

const char* UnitOf(Coordinate coordinate) { return coordinate == Coordinate::kAngle ? "rad" : "m"; }

std::string TargetName(const Scene& scene, const std::vector<BodyPoint>& points,
                       const Observation& observation) {
  return observation.point >= 0 ? points[observation.point].name
                                : scene.bodies[observation.body].name;
}

ObservationSeries IndexSeries(const std::vector<Observation>& observations) {
  ObservationSeries series;
  series.of.reserve(observations.size());
  std::map<std::tuple<int, int, int, Coordinate>, int> known;
  for (size_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    const std::tuple key(observation.file, observation.body, observation.point,
                         observation.coordinate);
    const auto [place, inserted] = known.try_emplace(key, series.size());
    if (inserted) {
      series.first.push_back(static_cast<int>(i));
    }
    series.of.push_back(place->second);
  }
  return series;
}

bool ReadObservations(const std::string& file, const Scene& scene,
                      const std::vector<BodyPoint>& points, const ObservationSigma& sigma,
                      std::vector<Observation>* observations, std::string* error, int file_number) {
  CsvTable table;
  const size_t before = observations->size();
  if (!ReadCsv(file, {"time"}, AllowedColumns(), &table, error) ||
      !FromTable(table, scene, points, sigma, observations, error)) {
    return false;
  }
  for (size_t i = before; i < observations->size(); ++i) {
    (*observations)[i].file = file_number;
  }
  return true;
}

bool ParseObservations(const std::string& text, const std::string& file, const Scene& scene,
                       const std::vector<BodyPoint>& points, const ObservationSigma& sigma,
                       std::vector<Observation>* observations, std::string* error) {
  CsvTable table;
  return ParseCsv(text, file, {"time"}, AllowedColumns(), &table, error) &&
         FromTable(table, scene, points, sigma, observations, error);
}

}  // namespace tangible
