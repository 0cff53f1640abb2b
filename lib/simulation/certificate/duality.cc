// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/duality.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/events/load_speed.h"

namespace tangible {
namespace internal {

// The largest entries of the state, and of its derivative along each direction, during a run.
class RunExtents {
 public:
  RunExtents(const Model<double>& model, Eigen::Index columns)
      : model_(model), lengths_(model), columns_(columns) {
    for (const int body : model.structure->moving) {
      const BodyIndex& index = model.structure->bodies[body];
      radius_.push_back(std::sqrt(model.parameters[index.inertia] / model.parameters[index.mass]));
    }
  }
  void Add(long k, double t, const State<double>& state, const RowMatrixXd& w_dot);
  // S of the header for each of the three entries of a body's pose or twist.
  double Scale(Eigen::Index column, bool pose, double size) const {
    const Extent& change = columns_[column];
    return pose ? std::max(change.pose, state_.pose / size)
                : std::max(change.twist, state_.twist / size);
  }
  /// Of gyration, of a moving block.
  double radius(size_t block) const { return radius_[block]; }

 private:
  // Largest magnitudes of poses and twists, angles at the radius of gyration.
  struct Extent {
    double pose = 0.0;   // m
    double twist = 0.0;  // m/s
  };
  const Model<double>& model_;
  Lengths lengths_;
  std::vector<double> radius_;  // of moving blocks
  Extent state_;
  std::vector<Extent> columns_;
  ContactProblem<double> problem_;
  AssemblyScratch<double> scratch_;
};

void RunExtents::Add(long k, double t, const State<double>& state, const RowMatrixXd& w_dot) {
  const ModelStructure& s = *model_.structure;
  if (k < NumSteps(s.settings)) {
    const double h = StepLength(s.settings, k);
    AssembleWithoutContacts(model_, state, t, h, &problem_, &scratch_);
    // Loads that friction holds, of bodies at rest.
    state_.twist = std::max(state_.twist, LoadSpeed(model_, lengths_, t, h, state));
  }
  for (size_t block = 0; block < radius_.size(); ++block) {
    const int body = s.moving[block];
    const size_t pose = s.PoseVariable(body, 0);
    const size_t twist = s.TwistVariable(body, 0);
    state_.pose = std::max(state_.pose, radius_[block]);
    for (int i = 0; i < 3; ++i) {
      const double arm = i == 2 ? radius_[block] : 1.0;
      const size_t row = 3 * block + i;
      const double free = problem_.load[row] / problem_.mass[row];
      const double speed = std::max(std::abs(state.twist[3 * body + i]), std::abs(free));
      state_.twist = std::max(state_.twist, arm * speed);
      if (i < 2) {
        state_.pose = std::max(state_.pose, std::abs(state.pose[3 * body + i]));
      }
      for (size_t c = 0; c < columns_.size(); ++c) {
        const auto at = static_cast<Eigen::Index>(c);
        columns_[c].pose = std::max(columns_[c].pose, arm * std::abs(w_dot(pose + i, at)));
        columns_[c].twist = std::max(columns_[c].twist, arm * std::abs(w_dot(twist + i, at)));
      }
    }
  }
}

}  // namespace internal

namespace {

// The outputs that are compared, and the right-hand sides of (1).
struct Comparison {
  std::vector<int> variables;  // of outputs, among [poses | twists]
  RowMatrixXd by_tangent;      // b, outputs x directions
  RowMatrixXd allowed;         // |b| + kStateRounding S, likewise
};

Comparison Compare(const ModelStructure& s, const internal::RunExtents& extents,
                   const RowMatrixXd& w_dot, const std::vector<double>& sizes) {
  Comparison comparison;
  for (const bool pose : {true, false}) {
    for (const int body : s.moving) {
      for (int i = 0; i < 3; ++i) {
        comparison.variables.push_back(pose ? s.PoseVariable(body, i) : s.TwistVariable(body, i));
      }
    }
  }
  const auto outputs = static_cast<Eigen::Index>(comparison.variables.size());
  comparison.by_tangent.resize(outputs, w_dot.cols());
  comparison.allowed.resize(outputs, w_dot.cols());
  for (Eigen::Index row = 0; row < outputs; ++row) {
    const bool pose = row < outputs / 2;
    const Eigen::Index place = pose ? row : row - outputs / 2;
    const double arm = place % 3 == 2 ? extents.radius(static_cast<size_t>(place / 3)) : 1.0;
    for (Eigen::Index c = 0; c < w_dot.cols(); ++c) {
      const double size = sizes.empty() ? 1.0 : sizes[static_cast<size_t>(c)];
      const double b = w_dot(comparison.variables[static_cast<size_t>(row)], c);
      comparison.by_tangent(row, c) = b;
      comparison.allowed(row, c) =
          std::abs(b) + kStateRounding * extents.Scale(c, pose, size) / arm;
    }
  }
  return comparison;
}

// Outputs that have a column of their own where not all do: those with an entry of rounding size
// that is not 0. For such an output the residual of a solve with a single unit load is refined
// further than that of several loads together (beside far greater masses a round of refinement
// removes only 1 % of the residual).
std::vector<Eigen::Index> Singles(const Comparison& comparison) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < comparison.allowed.rows(); ++row) {
    for (Eigen::Index c = 0; c < comparison.allowed.cols(); ++c) {
      const double b = std::abs(comparison.by_tangent(row, c));
      if (b > 0.0 && b < kRoundingEntry * comparison.allowed(row, c)) {
        rows.push_back(row);
        break;
      }
    }
  }
  // If there are too many, they are chosen at even intervals.
  constexpr size_t kMost = kMostDualityColumns / 2;
  std::vector<Eigen::Index> chosen;
  for (size_t k = 0; k < std::min(rows.size(), kMost); ++k) {
    chosen.push_back(rows[k * rows.size() / std::min(rows.size(), kMost)]);
  }
  return chosen;
}

// Outputs in classes whose sizes are similar along every direction; similar means within the
// smallest number of decades for which there are no more classes than columns.
using Classes = std::map<std::vector<int>, std::vector<Eigen::Index>>;
Classes ClassesOf(const RowMatrixXd& allowed, const std::vector<char>& left_out, size_t columns) {
  const Eigen::RowVectorXd largest = allowed.colwise().maxCoeff();
  constexpr double kMostDecades = 1e3;  // doubles have fewer
  Classes classes;
  for (double decades = 1.0; decades <= kMostDecades; decades *= 2.0) {
    classes.clear();
    for (Eigen::Index row = 0; row < allowed.rows(); ++row) {
      if (left_out[static_cast<size_t>(row)] != 0) {
        continue;
      }
      std::vector<int> sizes;
      for (Eigen::Index c = 0; c < allowed.cols(); ++c) {
        const double size = allowed(row, c) / largest[c];
        sizes.push_back(size > 0.0 && std::isfinite(size)
                            ? static_cast<int>(std::floor(-std::log10(size) / decades))
                            : -1);
      }
      classes[sizes].push_back(row);
    }
    if (classes.size() <= columns) {
      break;
    }
  }
  return classes;
}

// The outputs' weights in the columns of an adjoint, outputs x columns.
RowMatrixXd WeightsOf(const Comparison& comparison) {
  const RowMatrixXd& allowed = comparison.allowed;
  const Eigen::Index outputs = allowed.rows();
  if (outputs <= kMostDualityColumns) {
    return RowMatrixXd::Identity(outputs, outputs);
  }
  RowMatrixXd weights = RowMatrixXd::Zero(outputs, kMostDualityColumns);
  Eigen::Index column = 0;
  std::vector<char> left_out(static_cast<size_t>(outputs), 0);
  for (const Eigen::Index row : Singles(comparison)) {
    weights(row, column++) = 1.0;
    left_out[static_cast<size_t>(row)] = 1;
  }
  const size_t columns = static_cast<size_t>(kMostDualityColumns - column);
  const Classes classes = ClassesOf(allowed, left_out, columns);
  size_t share = 0;  // outputs for each column
  for (size_t needed = columns + 1; needed > columns;) {
    ++share;
    needed = 0;
    for (const auto& [sizes, rows] : classes) {
      needed += (rows.size() + share - 1) / share;
    }
  }
  const Eigen::RowVectorXd largest = allowed.colwise().maxCoeff();
  for (const auto& [sizes, rows] : classes) {
    for (size_t k = 0; k < rows.size(); ++k) {
      const double size = allowed.row(rows[k]).cwiseQuotient(largest).maxCoeff();
      weights(rows[k], column + static_cast<Eigen::Index>(k / share)) =
          size > 0.0 ? (k % 2 == 0 ? 1.0 : -1.0) / size : 1.0;
    }
    column += static_cast<Eigen::Index>((rows.size() + share - 1) / share);
  }
  return weights;
}

}  // namespace

DualityTest::DualityTest(const Model<double>& model, const State<double>& initial,
                         const RowMatrixXd& directions)
    : model_(model),
      directions_(directions),
      w_dot_(directions),
      extents_(std::make_unique<internal::RunExtents>(model, directions.cols())) {
  StepTangent tangent;
  tangent.FixNumbers(*model.structure, w_dot_);
  State<double> final;
  status_ = tape_
                .Record(
                    model, initial, Factorisations::kKeep,
                    [&](long k, double t, const State<double>& state, Stepper* stepper) {
                      if (stepper != nullptr) {
                        const double measured = tangent.ApplyAndMeasure(model, stepper, &w_dot_);
                        contradiction_ = measured <= contradiction_ ? contradiction_ : measured;
                      }
                      extents_->Add(k, t, state, w_dot_);
                    },
                    &final)
                .status;
}

DualityTest::~DualityTest() = default;

double DualityTest::Gap(const std::vector<double>& sizes) {
  const ModelStructure& s = *model_.structure;
  if (directions_.cols() == 0 || s.moving.empty()) return 0.0;
  if (status_ != StepStatus::kDone) return HUGE_VAL;
  const Comparison comparison = Compare(s, *extents_, w_dot_, sizes);
  const RowMatrixXd weights = WeightsOf(comparison);
  const long last = tape_.steps();
  RowMatrixXd w_bar;
  tape_.Adjoint(
      model_, static_cast<int>(weights.cols()),
      [&](long k, RowMatrixXd* w) {
        for (size_t i = 0; k == last && i < comparison.variables.size(); ++i) {
          w->row(comparison.variables[i]) += weights.row(static_cast<Eigen::Index>(i));
        }
      },
      &w_bar);
  const RowMatrixXd by_adjoint = w_bar.transpose() * directions_;
  const RowMatrixXd by_tangent = weights.transpose() * comparison.by_tangent;
  const RowMatrixXd allowed =
      (weights.cwiseAbs2().transpose() * comparison.allowed.cwiseAbs2()).cwiseSqrt();
  double worst = 0.0;
  for (Eigen::Index row = 0; row < allowed.rows(); ++row) {
    for (Eigen::Index c = 0; c < allowed.cols(); ++c) {
      const double gap = std::abs(by_adjoint(row, c) - by_tangent(row, c));
      if (gap != 0.0) {
        const double relative = gap / allowed(row, c);
        worst = relative <= worst ? worst : relative;
      }
    }
  }
  // Where no digit of an entry is right the size of the error does not matter.
  return std::isfinite(worst) ? std::min(worst, 1.0) : HUGE_VAL;
}

double DualityGap(const Model<double>& model, const State<double>& initial,
                  const RowMatrixXd& directions, const std::vector<double>& sizes) {
  return DualityTest(model, initial, directions).Gap(sizes);
}

bool HasWideMasses(const Model<double>& model) {
  constexpr double kWide = 999.0;
  const ModelStructure& s = *model.structure;
  double least[2] = {HUGE_VAL, HUGE_VAL};
  double most[2] = {0.0, 0.0};
  for (const int body : s.moving) {
    const double of_body[2] = {model.parameters[s.bodies[body].mass],
                               model.parameters[s.bodies[body].inertia]};
    for (int k = 0; k < 2; ++k) {
      least[k] = std::min(least[k], of_body[k]);
      most[k] = std::max(most[k], of_body[k]);
    }
  }
  return most[0] > kWide * least[0] || most[1] > kWide * kWide * least[1];
}

}  // namespace tangible
