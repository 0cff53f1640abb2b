// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/driven_bodies.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tangible/dynamics/model/tolerances.h"

namespace tangible {
namespace {

using PathPoint = RecordedPath::Point;

// How much later than its time a knot of a path counts where a time tells the pieces: knots of
// several paths that differ by rounding are told apart, in the order of the paths.
double ShiftOf(const ModelStructure& structure, int path, double time) {
  return 4.0 * path * InstantWidth(structure, time);
}
double ShiftOf(const ModelStructure& structure, const PathIndex& index, double time) {
  return ShiftOf(structure, static_cast<int>(&index - structure.paths.data()), time);
}

// A column of a body's path at a time of the run.
PathPoint PointOf(const Model<double>& model, const PathIndex& index, int column, double time,
                  double inside) {
  const double delay = model.parameters[index.numbers + kPathDelay];
  return index.path->At(column, time - delay,
                        inside - ShiftOf(*model.structure, index, time) - delay);
}

// The point with the means of its one-sided derivatives at an instant.
PathPoint MeanAt(const PathIndex& index, int column, double time, double delay,
                 const ModelStructure& structure) {
  const auto at = [&](PathSide side) {
    const double inside = BesideInstant(structure, time, side) - ShiftOf(structure, index, time);
    return index.path->At(column, time - delay, inside - delay);
  };
  const PathPoint before = at(PathSide::kBefore);
  const PathPoint after = at(PathSide::kAfter);
  return {after.value, 0.5 * (before.rate + after.rate), 0.0, 0.0};
}

// The value at u of a function with this value and slope at the value of u.
template <typename T>
T Linear(double value, double slope, const T& u) {
  return T(value + slope * (u - ValueOf(u)));
}

// A coordinate of a body: offset + scale · x, and for angles offset + x.
template <typename T>
T Placed(const T* numbers, int column, const T& x) {
  if (column == 2) return T(numbers[kPathOffsetAngle] + x);
  return T(numbers[kPathOffsetX + column] + numbers[kPathScale] * x);
}
template <typename T>
T Scaled(const T* numbers, int column, const T& x) {
  return column == 2 ? x : T(numbers[kPathScale] * x);
}

template <typename T, typename Visit>
void ForEachColumn(const Model<T>& model, const Visit& visit) {
  for (const PathIndex& index : model.structure->paths) {
    for (int column = 0; column < RecordedPath::kNumColumns; ++column) {
      if (index.path->Has(column)) visit(index, column);
    }
  }
}

// Calls visit(variable, value) for the derivatives of a coordinate whose function has the given
// value and slope, or of its rate or acceleration: there is no offset then. The time is the
// variable after all others.
enum class Order { kValue, kRate };
template <typename Visit>
void ForEachDerivative(const Model<double>& model, const PathIndex& index, int column, Order order,
                       double value, double slope, const Visit& visit) {
  const ModelStructure& s = *model.structure;
  const double scale = column == 2 ? 1.0 : model.parameters[index.numbers + kPathScale];
  visit(s.num_variables(), scale * slope);
  visit(s.ParameterVariable(index.numbers + kPathDelay), -scale * slope);
  if (column != 2) visit(s.ParameterVariable(index.numbers + kPathScale), value);
  if (order == Order::kValue) {
    visit(s.ParameterVariable(index.numbers +
                              (column == 2 ? +kPathOffsetAngle : kPathOffsetX + column)),
          1.0);
  }
}

// Calls visit(row, variable, value) for the derivatives of the poses and twists of driven bodies.
template <typename Visit>
void ForEachEntry(const Model<double>& model, double time, double inside, const Visit& visit) {
  const ModelStructure& s = *model.structure;
  ForEachColumn(model, [&](const PathIndex& index, int column) {
    const PathPoint p = PointOf(model, index, column, time, inside);
    const int pose = s.PoseVariable(index.body, column);
    const int twist = s.TwistVariable(index.body, column);
    ForEachDerivative(model, index, column, Order::kValue, p.value, p.rate,
                      [&](int variable, double value) { visit(pose, variable, value); });
    ForEachDerivative(model, index, column, Order::kRate, p.rate, p.acceleration,
                      [&](int variable, double value) { visit(twist, variable, value); });
  });
}

// The same of a fixed step's start; the time is given.
template <typename Visit>
void ForEachStepEntry(const Model<double>& model, double t, double h, const Visit& visit) {
  const ModelStructure& s = *model.structure;
  ForEachColumn(model, [&](const PathIndex& index, int column) {
    const double delay = model.parameters[index.numbers + kPathDelay];
    const PathPoint start = MeanAt(index, column, t, delay, s);
    const PathPoint end = MeanAt(index, column, t + h, delay, s);
    const int pose = s.PoseVariable(index.body, column);
    const int twist = s.TwistVariable(index.body, column);
    ForEachDerivative(model, index, column, Order::kValue, start.value, start.rate,
                      [&](int variable, double value) { visit(pose, variable, value); });
    ForEachDerivative(model, index, column, Order::kRate, (end.value - start.value) / h,
                      (end.rate - start.rate) / h,
                      [&](int variable, double value) { visit(twist, variable, value); });
  });
}

void ClearRows(const Model<double>& model, RowMatrixXd* w) {
  const ModelStructure& s = *model.structure;
  ForEachColumn(model, [&](const PathIndex& index, int column) {
    w->row(s.PoseVariable(index.body, column)).setZero();
    w->row(s.TwistVariable(index.body, column)).setZero();
  });
}

// Applies entries forwards or backwards; a matrix without a row of the time has it given.
template <typename ForEach>
void Forwards(const Model<double>& model, const ForEach& for_each, RowMatrixXd* w) {
  ClearRows(model, w);
  for_each([&](int row, int variable, double value) {
    if (variable < w->rows()) w->row(row) += value * w->row(variable);
  });
}
template <typename ForEach>
void Backwards(const Model<double>& model, const ForEach& for_each, RowMatrixXd* w) {
  for_each([&](int row, int variable, double value) {
    if (variable < w->rows()) w->row(variable) += value * w->row(row);
  });
  ClearRows(model, w);
}

}  // namespace

double InstantWidth(const ModelStructure& structure, double time) {
  return std::max(kSameInstantShare * structure.settings.dt, kInstantRounding * std::abs(time));
}

double BesideInstant(const ModelStructure& structure, double time, PathSide side) {
  const int last = std::max(static_cast<int>(structure.paths.size()) - 1, 0);
  if (side == PathSide::kAfter) return BehindPath(structure, time, last);
  return time - 2.0 * InstantWidth(structure, time);
}

double BehindPath(const ModelStructure& structure, double time, int path) {
  return time + (ShiftOf(structure, path, time) + 2.0 * InstantWidth(structure, time));
}

bool IsSameInstant(const ModelStructure& structure, double a, double b) {
  return std::abs(a - b) <= InstantWidth(structure, std::max(std::abs(a), std::abs(b)));
}

template <typename T>
void FollowPathsAt(const Model<T>& model, const T& time, double inside, State<T>* state) {
  ForEachColumn(model, [&](const PathIndex& index, int column) {
    const T* numbers = &model.parameters[index.numbers];
    const T u = time - numbers[kPathDelay];
    const double shift = ShiftOf(*model.structure, index, ValueOf(time));
    const PathPoint p =
        index.path->At(column, ValueOf(u), inside - shift - ValueOf(numbers[kPathDelay]));
    const std::size_t place = 3 * static_cast<std::size_t>(index.body) + column;
    state->pose[place] = Placed(numbers, column, Linear(p.value, p.rate, u));
    state->twist[place] = Scaled(numbers, column, Linear(p.rate, p.acceleration, u));
  });
}

template <typename T>
void FollowPathsOverStep(const Model<T>& model, double t, double h, State<T>* state) {
  ForEachColumn(model, [&](const PathIndex& index, int column) {
    const T* numbers = &model.parameters[index.numbers];
    const auto at = [&](double time) {
      const T u = time - numbers[kPathDelay];
      const PathPoint p =
          MeanAt(index, column, time, ValueOf(numbers[kPathDelay]), *model.structure);
      return Linear(p.value, p.rate, u);
    };
    const T start = at(t);
    const std::size_t place = 3 * static_cast<std::size_t>(index.body) + column;
    state->pose[place] = Placed(numbers, column, start);
    state->twist[place] = Scaled(numbers, column, T((at(t + h) - start) / h));
  });
}

template <typename T>
void GivenAccelerations(const Model<T>& model, const T& time, double inside,
                        std::vector<T>* accelerations) {
  accelerations->assign(3 * static_cast<std::size_t>(model.structure->num_bodies()), T(0.0));
  ForEachColumn(model, [&](const PathIndex& index, int column) {
    const T* numbers = &model.parameters[index.numbers];
    const T u = time - numbers[kPathDelay];
    const double shift = ShiftOf(*model.structure, index, ValueOf(time));
    const PathPoint p =
        index.path->At(column, ValueOf(u), inside - shift - ValueOf(numbers[kPathDelay]));
    (*accelerations)[3 * static_cast<std::size_t>(index.body) + column] =
        Scaled(numbers, column, Linear(p.acceleration, p.jerk, u));
  });
}

void FollowPathsTangent(const Model<double>& model, double time, double inside,
                        RowMatrixXd* w_dot) {
  if (model.structure->paths.empty()) return;
  Forwards(
      model, [&](const auto& visit) { ForEachEntry(model, time, inside, visit); }, w_dot);
}

void FollowPathsAdjoint(const Model<double>& model, double time, double inside,
                        RowMatrixXd* w_bar) {
  if (model.structure->paths.empty()) return;
  Backwards(
      model, [&](const auto& visit) { ForEachEntry(model, time, inside, visit); }, w_bar);
}

void FollowStepTangent(const Model<double>& model, double t, double h, RowMatrixXd* w_dot) {
  if (model.structure->paths.empty()) return;
  Forwards(
      model, [&](const auto& visit) { ForEachStepEntry(model, t, h, visit); }, w_dot);
}

void FollowStepAdjoint(const Model<double>& model, double t, double h, RowMatrixXd* w_bar) {
  if (model.structure->paths.empty()) return;
  Backwards(
      model, [&](const auto& visit) { ForEachStepEntry(model, t, h, visit); }, w_bar);
}

void AccelerationEntries(const Model<double>& model, int body, double time, double inside,
                         std::vector<GivenEntry>* entries) {
  entries->clear();
  const int path = PathOfBody(*model.structure, body);
  if (path < 0) return;
  const PathIndex& index = model.structure->paths[path];
  for (int column = 0; column < RecordedPath::kNumColumns; ++column) {
    if (!index.path->Has(column)) continue;
    const PathPoint p = PointOf(model, index, column, time, inside);
    ForEachDerivative(model, index, column, Order::kRate, p.acceleration, p.jerk,
                      [&](int variable, double value) {
                        entries->push_back({column, variable, value});
                      });
  }
}

int PathOfBody(const ModelStructure& structure, int body) {
  const auto& paths = structure.paths;
  const auto found =
      std::lower_bound(paths.begin(), paths.end(), body,
                       [](const PathIndex& index, int value) { return index.body < value; });
  return found == paths.end() || found->body != body ? -1 : static_cast<int>(found - paths.begin());
}

bool TurnsAlongPath(const ModelStructure& structure, int body) {
  const int path = PathOfBody(structure, body);
  return path >= 0 && structure.paths[path].path->Has(2);
}

double LargestGivenTurn(const Model<double>& model, int body, double from, double to) {
  const int path = PathOfBody(*model.structure, body);
  if (path < 0 || !model.structure->paths[path].path->Has(2)) return 0.0;
  const PathIndex& index = model.structure->paths[path];
  const double delay = model.parameters[index.numbers + kPathDelay];
  return index.path->LargestRate(2, from - delay, to - delay);
}

double LargestGivenSpeed(const Model<double>& model, int body, double from, double to,
                         double radius) {
  const int path = PathOfBody(*model.structure, body);
  if (path < 0) return 0.0;
  const PathIndex& index = model.structure->paths[path];
  const double delay = model.parameters[index.numbers + kPathDelay];
  const double scale = std::abs(model.parameters[index.numbers + kPathScale]);
  std::array<double, 2> rate = {0.0, 0.0};
  for (int i = 0; i < 2; ++i) {
    if (index.path->Has(i)) rate[i] = scale * index.path->LargestRate(i, from - delay, to - delay);
  }
  const double turn = LargestGivenTurn(model, body, from, to);
  return std::hypot(rate[0], rate[1]) + (turn > 0.0 ? turn * radius : 0.0);
}

#define TANGIBLE_INSTANTIATE(T)                                                     \
  template void FollowPathsAt<T>(const Model<T>&, const T&, double, State<T>*);     \
  template void FollowPathsOverStep<T>(const Model<T>&, double, double, State<T>*); \
  template void GivenAccelerations<T>(const Model<T>&, const T&, double, std::vector<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
