// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/differences.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tangible/dynamics/model/lengths.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// The effect of a relative rounding of 1 in a coordinate L on each output: a twist that a gap or a
// joint's drift determines changes by L / h, its angular part by that over the radius of gyration.
// The rounding itself stays the same where the initial state is changed a little.
VectorX<double> GapNoise(const Scene& scene, const ModelStructure& structure) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  double coordinate = 0.0;
  for (const int body : structure.moving) {
    coordinate =
        std::max({coordinate, std::abs(state.pose[3 * body]), std::abs(state.pose[3 * body + 1])});
  }
  VectorX<double> noise = VectorX<double>::Zero(6 * structure.num_blocks());
  for (int k = 0; k < structure.num_blocks(); ++k) {
    const BodyIndex& body = structure.bodies[structure.moving[k]];
    const double arm = std::sqrt(model.parameters[body.inertia] / model.parameters[body.mass]);
    const double speed = coordinate / scene.simulation.dt;
    noise.segment<3>(6 * k + 3) << speed, speed, speed / arm;
  }
  return noise;
}

// A body that rises by less than the touching tolerance, 1e-10 of the body, lands that much lower
// than the surface: this changes poses, and twists as the motion continues.
enum class Uncertain { kPoses, kPosesAndTwists };
VectorX<double> TouchNoise(const Scene& scene, const ModelStructure& structure, Uncertain what) {
  if (scene.simulation.stepping != Stepping::kEvent) {
    return VectorX<double>::Zero(6 * structure.num_blocks());
  }
  constexpr double kTouch = 2e-10;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const double gravity = scene.gravity.norm();
  VectorX<double> noise = VectorX<double>::Zero(6 * structure.num_blocks());
  for (int k = 0; k < structure.num_blocks(); ++k) {
    const int body = structure.moving[k];
    const double size = RadiusOf(model, body);
    if (!(size > 0.0)) continue;
    const double speed = std::hypot(state.twist[3 * body], state.twist[3 * body + 1]) +
                         size * std::abs(state.twist[3 * body + 2]) + std::sqrt(gravity * size);
    noise.segment<3>(6 * k) << kTouch * size, kTouch * size, kTouch;
    if (what == Uncertain::kPoses) continue;
    noise.segment<3>(6 * k + 3) << kTouch * speed, kTouch * speed, kTouch * speed / size;
  }
  return noise;
}

// Runs with one parameter changed by several steps, and the extrapolation of their differences.
class Differences {
 public:
  Differences(const Scene& scene, const RunTrace& at, const VectorX<double>& noise,
              const ParameterPath& parameter)
      : scene_(scene), at_(at), noise_(noise), parameter_(parameter), choices_(&at) {
    // Scenes have sizes of about 1 in SI units, unlike the scale of a large floor.
    scale_ = std::max(std::abs(parameter.value), std::min(parameter.scale, 1.0));
    Scene copy = scene;
    const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&copy);
    for (const int number : parameter.numbers) {
      FindRoom(numbers[number].kind, *numbers[number].value);
    }
    side_ = low_end_ ? 1.0 : high_end_ ? -1.0 : 0.0;
  }

  DifferenceColumn Compute(ChoicesDiffer choices_differ) {
    DifferenceColumn column;
    if (low_end_ && high_end_) {
      column.where = "its numbers are at both ends of their range";
      return column;
    }
    AddNoiseOfParameter();
    BestTable(&column);
    // Steps at which choices do not differ may be too short for a table that converges.
    if (side_ == 0.0 && choices_differ == ChoicesDiffer::kCompareSides && !HasConverged(column) &&
        column.status != DifferenceStatus::kRunFailed) {
      DifferenceColumn sides;
      const VectorX<double> noise = noise_;
      noise_ = noise + TouchNoise(scene_, *at_.structure, Uncertain::kPoses);
      bool agree = CompareSides(&sides);
      if (!agree && column.status != DifferenceStatus::kJudged) {
        noise_ = noise + TouchNoise(scene_, *at_.structure, Uncertain::kPosesAndTwists);
        agree = CompareSides(&sides);
      }
      noise_ = noise;
      if (agree && (column.status != DifferenceStatus::kJudged ||
                    sides.errors.maxCoeff() < column.errors.maxCoeff())) {
        column = std::move(sides);
      }
    }
    for (size_t k = 0; k < 2; ++k) {
      column.plain[k] = Plain(Bounded(kPlainSteps[k]));
    }
    return column;
  }

 private:
  static constexpr double kLargest = 1e-3;
  static constexpr double kSmallest = 1e-8;  // of the largest
  static constexpr int kSteps = 4;
  static constexpr int kMostTables = 4;
  static constexpr double kConverged = 1e-6;  // of the column's largest
  static constexpr double kRatio = 2.0;
  static constexpr double kSidesAgree = 1e-5;

  static bool HasConverged(const DifferenceColumn& column) {
    return column.status == DifferenceStatus::kJudged &&
           column.errors.maxCoeff() <= kConverged * column.values.cwiseAbs().maxCoeff();
  }

  void BestTable(DifferenceColumn* best) {
    DifferenceColumn& column = *best;
    const double first = Bounded(kLargest);
    int tables = 0;
    for (double h = first; h > kSmallest * first && tables < kMostTables; h *= 0.125) {
      DifferenceColumn next;
      next.step = h;
      ForgetSide();
      next.status = Table(h, &next);
      if (next.status != DifferenceStatus::kJudged) {
        if (tables == 0) {
          column.status = next.status;
          column.where = where_;
        }
        continue;
      }
      // The error estimate of a table that has not converged may be too small.
      ++tables;
      if (tables == 1 || next.errors.maxCoeff() < column.errors.maxCoeff()) {
        column = std::move(next);
      }
      if (HasConverged(column)) break;
    }
  }

  // The runs on each side are compared with each other, and their values with that at the
  // parameter.
  bool CompareSides(DifferenceColumn* column) {
    DifferenceColumn sides[2];
    apart_ = true;
    for (const int k : {0, 1}) {
      side_ = k == 0 ? 1.0 : -1.0;
      BestTable(&sides[k]);
    }
    side_ = 0.0;
    apart_ = false;
    choices_ = &at_;
    if (sides[0].status != DifferenceStatus::kJudged ||
        sides[1].status != DifferenceStatus::kJudged) {
      return false;
    }
    const VectorX<double> apart = (sides[0].values - sides[1].values).cwiseAbs();
    const VectorX<double> size = sides[0].values.cwiseAbs().cwiseMax(sides[1].values.cwiseAbs());
    const VectorX<double> errors = sides[0].errors + sides[1].errors;
    if (((apart - errors).array() > kSidesAgree * size.maxCoeff()).any()) {
      return false;
    }
    *column = std::move(sides[0]);
    column->values = 0.5 * (column->values + sides[1].values);
    column->errors = errors + apart;
    return true;
  }

  void ForgetSide() { choices_ = apart_ ? nullptr : &at_; }

  double Bounded(double relative) const { return std::min(relative * scale_, room_); }

  void FindRoom(NumberKind kind, double value) {
    if (kind == NumberKind::kFree) {
      return;
    }
    low_end_ = low_end_ || value == 0.0;
    if (value > 0.0) {
      room_ = std::min(room_, 0.1 * value);
    }
    if (kind == NumberKind::kFraction) {
      high_end_ = high_end_ || value == 1.0;
      if (value < 1.0) {
        room_ = std::min(room_, 0.1 * (1.0 - value));
      }
    }
  }

  DifferenceStatus RunAt(double change, VectorX<double>* values) {
    Scene scene = scene_;
    const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
    for (const int number : parameter_.numbers) {
      *numbers[number].value += change;
    }
    RunTrace trace = TraceRun(scene);
    if (!trace.done) {
      where_ = trace.message;
      return DifferenceStatus::kRunFailed;
    }
    if (choices_ == nullptr) {
      *values = trace.values;
      of_side_ = std::move(trace);
      choices_ = &of_side_;
      return DifferenceStatus::kJudged;
    }
    const FrictionAtZero friction =
        side_ != 0.0 ? FrictionAtZero::kMaySlide : FrictionAtZero::kDistinct;
    *values = trace.values;
    std::string difference = FirstDifference(*choices_, trace, friction);
    if (difference.empty()) {
      return DifferenceStatus::kJudged;
    }
    where_ = std::move(difference);
    return DifferenceStatus::kChoicesDiffer;
  }

  DifferenceStatus Quotient(double h, VectorX<double>* quotient) {
    VectorX<double> high = at_.values;
    VectorX<double> low = at_.values;
    if (side_ >= 0.0) {
      const DifferenceStatus status = RunAt(h, &high);
      if (status != DifferenceStatus::kJudged) {
        return status;
      }
    }
    if (side_ <= 0.0) {
      const DifferenceStatus status = RunAt(-h, &low);
      if (status != DifferenceStatus::kJudged) {
        return status;
      }
    }
    *quotient = (high - low) / (side_ == 0.0 ? 2.0 * h : h);
    return DifferenceStatus::kJudged;
  }

  // Second differences of tiny steps are only rounding. Runs from exact numbers (a box on a floor
  // at 0) have less rounding than those beside them, so that changes of the initial state's last
  // digits do not show all of it.
  void AddNoiseOfParameter() {
    for (const double relative : {2.3e-9, 1.0e-9, 3.1e-10, 0.7e-10}) {
      const double h = Bounded(relative);
      VectorX<double> one, two;
      if (RunAt(side_ == 0.0 ? h : side_ * h, &one) != DifferenceStatus::kJudged ||
          RunAt(side_ == 0.0 ? -h : 2.0 * side_ * h, &two) != DifferenceStatus::kJudged) {
        continue;
      }
      const VectorX<double> second = side_ == 0.0 ? VectorX<double>(one - 2.0 * at_.values + two)
                                                  : VectorX<double>(two - 2.0 * one + at_.values);
      noise_ = noise_.cwiseMax(second.cwiseAbs());
    }
  }

  // (f(p + h) − f(p − h)) / 2h, or (−3 f(p) + 4 f(p ± h) − f(p ± 2h)) / ±2h. Where choices differ
  // the quotient is still returned.
  PlainDifference Plain(double h) {
    PlainDifference plain;
    plain.step = h;
    VectorX<double> first, second;
    const DifferenceStatus one = RunAt(side_ == 0.0 ? h : side_ * h, &first);
    const std::string where = one == DifferenceStatus::kJudged ? "" : where_;
    const DifferenceStatus two = RunAt(side_ == 0.0 ? -h : 2.0 * side_ * h, &second);
    plain.status = one != DifferenceStatus::kJudged ? one : two;
    plain.where = one != DifferenceStatus::kJudged   ? where
                  : two != DifferenceStatus::kJudged ? where_
                                                     : "";
    if (first.size() == 0 || second.size() == 0) {
      plain.status = DifferenceStatus::kRunFailed;
    } else if (side_ == 0.0) {
      plain.values = (first - second) / (2.0 * h);
    } else {
      plain.values = (-3.0 * at_.values + 4.0 * first - second) / (2.0 * side_ * h);
    }
    return plain;
  }

  // Ridders' table; errors of central quotients are even in h, of one-sided ones of all orders.
  DifferenceStatus Table(double h, DifferenceColumn* column) {
    VectorX<double> table[kSteps][kSteps];
    const double factor = side_ == 0.0 ? kRatio * kRatio : kRatio;
    for (int k = 0; k < kSteps; ++k) {
      const double step = h / std::pow(kRatio, k);
      const DifferenceStatus status = Quotient(step, &table[0][k]);
      if (status != DifferenceStatus::kJudged) {
        return status;
      }
      // Extrapolation doubles the rounding of a quotient, noise / step, and a few samples may have
      // shown a quarter of it; the table itself need not show it.
      const VectorX<double> rounding = (8.0 / step) * noise_;
      if (k == 0) {
        column->values = table[0][0];
        column->errors.setConstant(noise_.size(), HUGE_VAL);
      }
      double power = factor;
      for (int j = 1; j <= k; ++j, power *= factor) {
        table[j][k] = (power * table[j - 1][k] - table[j - 1][k - 1]) / (power - 1.0);
        const VectorX<double> error =
            (table[j][k] - table[j - 1][k])
                .cwiseAbs()
                .cwiseMax((table[j][k] - table[j - 1][k - 1]).cwiseAbs()) +
            rounding;
        for (Eigen::Index i = 0; i < error.size(); ++i) {
          if (error[i] < column->errors[i]) {
            column->errors[i] = error[i];
            column->values[i] = table[j][k][i];
          }
        }
      }
    }
    return DifferenceStatus::kJudged;
  }

  const Scene& scene_;
  const RunTrace& at_;
  VectorX<double> noise_;
  const ParameterPath& parameter_;
  double scale_ = 0.0;                       // of the parameter
  double room_ = 1e300;                      // how far the parameter may be changed either way
  bool low_end_ = false, high_end_ = false;  // at the end of its range
  double side_ = 0.0;                        // 0: central; else the only side that is allowed
  std::string where_;                        // the runs of the last pair that differed
  const RunTrace* choices_;                  // choices that runs must make; null: of the next run
  bool apart_ = false;                       // each side is a separate function
  RunTrace of_side_;
};

}  // namespace

VectorX<double> RoundingNoise(const Scene& scene, const RunTrace& at) {
  // For a body at rest most runs end with the same bits, and one in ten differs by an ε of a
  // gap / h. Event steps take ten times longer.
  const bool events = scene.simulation.stepping == Stepping::kEvent;
  const int samples = events ? 12 : 32;
  const double epsilon = std::numeric_limits<double>::epsilon();
  VectorX<double> noise = (epsilon * at.values.cwiseAbs().cwiseMax(0.5))
                              .cwiseMax(epsilon * GapNoise(scene, *at.structure));
  RandomNumbers random(32);
  for (int sample = 0; sample < samples; ++sample) {
    Scene changed = scene;
    for (BasicBody<double>& body : changed.bodies) {
      for (double* x : {&body.mass, &body.position.x(), &body.position.y(), &body.angle,
                        &body.velocity.x(), &body.velocity.y(), &body.angular_velocity}) {
        *x += epsilon * std::max(1.0, std::abs(*x)) * random.Integer(-2, 2);
      }
    }
    const RunTrace trace = TraceRun(changed);
    if (trace.done && SameChoices(at, trace, FrictionAtZero::kDistinct)) {
      noise = noise.cwiseMax((trace.values - at.values).cwiseAbs());
    }
  }
  // Fewer samples show less of the noise.
  return events ? VectorX<double>(2.0 * noise) : noise;
}

DifferenceColumn FiniteDifferences(const Scene& scene, const RunTrace& at,
                                   const VectorX<double>& noise, const ParameterPath& parameter,
                                   ChoicesDiffer choices_differ) {
  return Differences(scene, at, noise, parameter).Compute(choices_differ);
}

}  // namespace tangible
