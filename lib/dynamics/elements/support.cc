// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

#include "tangible/dynamics/elements/support_inl.h"

namespace tangible {
namespace {

// The rounding of a number of size 1.
double Rounding() { return 0x1p-52; }

// The root of a decreasing function on [low, high] that is ≥ 0 at `low` and ≤ 0 at `high`, by the
// Illinois variant of the method of false position.
template <typename F>
double RootOf(const F& f, double low, double high) {
  constexpr int kMost = 200;
  double at_low = f(low), at_high = f(high);
  if (!(at_low > 0.0)) return low;
  if (!(at_high < 0.0)) return high;
  int side = 0;
  double x = low;
  for (int k = 0; k < kMost; ++k) {
    const double last = x;
    x = (low * at_high - high * at_low) / (at_high - at_low);
    if (!(x > low && x < high)) x = 0.5 * (low + high);
    const double value = f(x);
    if (value == 0.0 || (k > 0 && x == last)) return x;
    if (value > 0.0) {
      low = x;
      at_low = value;
      if (side > 0) at_high *= 0.5;
      side = 1;
    } else {
      high = x;
      at_high = value;
      if (side < 0) at_low *= 0.5;
      side = -1;
    }
    if (!(high - low > 2.0 * Rounding() * high)) return x;
  }
  return x;
}

// Ψ'' of a disc with μ N = 1, 3 x 3 by rows.
void DiscCurvature(double radius, const double twist[3], double curvature[9]) {
  LocalJet at[3], friction[3];
  for (int i = 0; i < 3; ++i) at[i] = LocalJet(twist[i], i);
  DiscFriction(LocalJet(radius), at, friction);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      curvature[3 * i + k] = -0.5 * (friction[i].v[k] + friction[k].v[i]);
    }
  }
}

}  // namespace

// Elimination with the largest pivot first; that of the last row is rounding, for Ψ'' û = 0.
void DiscDampers(double radius, const double twist[3], double rows[3][3], double weights[3]) {
  double a[9];
  DiscCurvature(radius, twist, a);
  for (int r = 0; r < 3; ++r) {
    int pivot = 0;
    for (int i = 1; i < 3; ++i) pivot = a[4 * i] > a[4 * pivot] ? i : pivot;
    weights[r] = std::max(0.0, a[4 * pivot]);
    for (int i = 0; i < 3; ++i) rows[r][i] = weights[r] > 0.0 ? a[3 * i + pivot] / weights[r] : 0.0;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) a[3 * i + k] -= weights[r] * rows[r][i] * rows[r][k];
    }
  }
}

void DiscSecant(double radius, const double twist[3], double secant, double dampers[3]) {
  const double at[3] = {std::hypot(twist[0], twist[1], secant), 0.0,
                        std::hypot(twist[2], secant / radius)};
  double friction[3];
  DiscFriction(radius, at, friction);
  dampers[0] = dampers[1] = -friction[0] / at[0];
  dampers[2] = -friction[2] / at[2];
}

void SupportFriction::Set(const Model<double>& model, const State<double>& state,
                          const SupportIndex& support, double weight) {
  const double* x = &model.parameters[support.numbers];
  kind_ = support.kind;
  radius_ = kind_ == SupportIndex::kDisc ? x[SupportIndex::kRadius] : 0.0;
  limit_ = weight * x[SupportIndex::kFriction] * x[SupportIndex::kLoad];
  arm_ = radius_;
  points_.clear();
  if (kind_ == SupportIndex::kDisc) return;
  const Pose<double> pose = state.PoseOf(support.body);
  for (int i = 0; i < support.num_points; ++i) {
    SupportPoint& point = points_.emplace_back(SupportPoint{{0.0, 0.0}, limit_});
    if (kind_ == SupportIndex::kCentre) break;
    const double* at = &model.parameters[support.Point(i)];
    const Vector2<double> arm = pose.rotation * Vector2<double>(at[0], at[1]);
    point = {{arm.x(), arm.y()}, limit_ * at[2]};
    arm_ = std::max(arm_, arm.norm());
  }
}

void SupportFriction::KeepPoint(int point) {
  points_ = {points_[static_cast<size_t>(point)]};
  limit_ = points_[0].limit;
  arm_ = std::hypot(points_[0].arm[0], points_[0].arm[1]);
}

void SupportFriction::At(const double twist[3], double wrench[3]) const {
  if (is_disc()) {
    DiscFriction(radius_, twist, wrench);
    for (int i = 0; i < 3; ++i) wrench[i] *= limit_;
    return;
  }
  std::fill_n(wrench, 3, 0.0);
  for (const SupportPoint& point : points_) {
    double v[2];
    point.VelocityAt(twist, v);
    const double speed = std::hypot(v[0], v[1]);
    if (!(speed > 0.0)) continue;
    const double fx = -point.limit * v[0] / speed;
    const double fy = -point.limit * v[1] / speed;
    wrench[0] += fx;
    wrench[1] += fy;
    wrench[2] += point.arm[0] * fy - point.arm[1] * fx;
  }
}

void SupportFriction::Curvature(const double twist[3], double curvature[9]) const {
  std::fill_n(curvature, 9, 0.0);
  if (is_disc()) {
    DiscCurvature(radius_, twist, curvature);
    for (int i = 0; i < 9; ++i) curvature[i] *= limit_;
    return;
  }
  for (const SupportPoint& point : points_) {
    double v[2];
    point.VelocityAt(twist, v);
    const double speed = std::hypot(v[0], v[1]);
    if (!(speed > 0.0)) continue;
    const double across[2] = {-v[1] / speed, v[0] / speed};
    const RowPart<double> row{across[0], across[1],
                              point.arm[0] * across[1] - point.arm[1] * across[0]};
    AddOuter(row, row, point.limit / speed, curvature);
  }
}

bool SupportFriction::CanHold(const double wrench[3]) const {
  const double unit[3] = {1.0, 1.0, arm_ > 0.0 ? arm_ * arm_ : 1.0};
  const SupportState alone = SolveAlone(unit, wrench);
  return alone.holds == SupportState::kBody || (kind_ == SupportIndex::kCentre && alone.holds == 0);
}

double SupportFriction::Reserve(const double wrench[3]) const {
  constexpr double kMost = 1000.0;
  for (double more = kMost; more > kLeastReserve; more *= 0.5) {
    const double larger[3] = {(1.0 + more) * wrench[0], (1.0 + more) * wrench[1],
                              (1.0 + more) * wrench[2]};
    if (CanHold(larger)) return more / (1.0 + more);
  }
  return 0.0;
}

SupportState SupportFriction::SolveAlone(const double mass[3], const double momentum[3]) const {
  if (limit_ > 0.0 && kind_ == SupportIndex::kCentre) return SolveCentre(mass, momentum);
  if (limit_ > 0.0 && kind_ == SupportIndex::kDisc) return SolveDisc(mass, momentum);
  if (limit_ > 0.0) return SolvePoints(mass, momentum);
  SupportState free;
  for (int i = 0; i < 3; ++i) free.twist[i] = momentum[i] / mass[i];
  return free;
}

SupportState SupportFriction::SolveCentre(const double mass[3], const double momentum[3]) const {
  SupportState state;
  const double size = std::hypot(momentum[0], momentum[1]);
  state.twist[2] = momentum[2] / mass[2];
  if (size <= limit_) {
    state.holds = 0;
    return state;
  }
  for (int i = 0; i < 2; ++i) state.twist[i] = momentum[i] * (1.0 - limit_ / size) / mass[i];
  return state;
}

// By symmetry the velocity is along the momentum: unknown are its size and that of the angular
// velocity, or the angle α with |v| : |ω| R = sin α : cos α. Where the support cannot hold the body
// α is the root of a decreasing function.
SupportState SupportFriction::SolveDisc(const double mass[3], const double momentum[3]) const {
  SupportState state;
  const double push = std::hypot(momentum[0], momentum[1]);
  const double turn = std::abs(momentum[2]);
  const auto friction = [&](double angle, double* force, double* torque) {
    const double twist[3] = {std::sin(angle), 0.0, std::cos(angle) / radius_};
    double wrench[3];
    At(twist, wrench);
    *force = -wrench[0];
    *torque = -wrench[2];
  };
  constexpr double kRight = 0.5 * std::numbers::pi;
  double force, torque;
  const double limit_angle = RootOf(
      [&](double angle) {
        friction(angle, &force, &torque);
        return push * torque - turn * force;
      },
      0.0, kRight);
  friction(limit_angle, &force, &torque);
  if (push <= force && turn <= torque) {
    state.holds = SupportState::kBody;
    return state;
  }
  const double angle = RootOf(
      [&](double at) {
        friction(at, &force, &torque);
        return std::cos(at) * (push - force) / mass[0] -
               std::sin(at) * radius_ * (turn - torque) / mass[2];
      },
      0.0, kRight);
  friction(angle, &force, &torque);
  // Of a wrench that is hardly too large for the support both differences are rounding, and their
  // ratio is not; the angle is right there too.
  const double along = push > 0.0 ? std::sin(angle) : 0.0;
  const double about = turn > 0.0 ? std::cos(angle) : 0.0;
  const double size = along * std::max(0.0, push - force) / mass[0] +
                      about * radius_ * std::max(0.0, turn - torque) / mass[2];
  for (int i = 0; i < 2 && push > 0.0; ++i) state.twist[i] = size * along * momentum[i] / push;
  state.twist[2] = std::copysign(size * about / radius_, momentum[2]);
  return state;
}

// Σ μ N_i √(v_i² + ε²) with its gradient and curvature.
void SupportFriction::Smoothed(const double twist[3], double epsilon, double* value,
                               double gradient[3], double curvature[9]) const {
  for (const SupportPoint& point : points_) {
    double v[2];
    point.VelocityAt(twist, v);
    const double speed = std::hypot(v[0], v[1], epsilon);
    const RowPart<double> x{1.0, 0.0, -point.arm[1]};
    const RowPart<double> y{0.0, 1.0, point.arm[0]};
    const double d[2] = {v[0] / speed, v[1] / speed};
    const RowPart<double> along{d[0], d[1], d[0] * x[2] + d[1] * y[2]};
    const RowPart<double> across{-d[1], d[0], -d[1] * x[2] + d[0] * y[2]};
    *value += point.limit * speed;
    for (int i = 0; i < 3; ++i) gradient[i] += point.limit * along[i];
    // The curvature of the norm: I − d dᵀ over the speed, with |d| < 1.
    const double square = d[0] * d[0] + d[1] * d[1];
    const double weight = point.limit / speed;
    const double smooth = epsilon / speed * (epsilon / speed);
    if (square > 0.0) {
      AddOuter(along, along, weight * smooth / square, curvature);
      AddOuter(across, across, weight / square, curvature);
    } else {
      AddOuter(x, x, weight, curvature);
      AddOuter(y, y, weight, curvature);
    }
  }
}

// Whether f_i = (μ N_i) J_i λ with Σ J_iᵀ f_i = p, the shares with the least Σ |f_i|² / (μ N_i),
// are within the limits: then the points hold the body.
bool SupportFriction::HoldsByShares(const double momentum[3]) const {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  for (const SupportPoint& point : points_) {
    const Eigen::Vector3d x(1.0, 0.0, -point.arm[1]), y(0.0, 1.0, point.arm[0]);
    a += point.limit * (x * x.transpose() + y * y.transpose());
  }
  const Eigen::Vector3d p(momentum[0], momentum[1], momentum[2]);
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(a);
  const Eigen::Vector3d share = lu.solve(p);
  if (!((a * share - p).norm() <= kHeldPoint * p.norm())) return false;
  for (const SupportPoint& point : points_) {
    double f[2];
    point.VelocityAt(share.data(), f);
    if (!(std::hypot(f[0], f[1]) <= 1.0)) return false;
  }
  return true;
}

// Newton's method without smoothing, from the free motion; false where a point comes near to rest.
bool SupportFriction::Slides(const double mass[3], const double momentum[3], double scale,
                             double twist[3]) const {
  constexpr int kMost = 20;
  using Vector = Eigen::Vector3d;
  const Vector m(mass[0], mass[1], mass[2]), p(momentum[0], momentum[1], momentum[2]);
  const Vector unit(1.0, 1.0, arm_ > 0.0 ? 1.0 / arm_ : 1.0);
  Vector u = p.cwiseQuotient(m);
  for (int k = 0; k < kMost; ++k) {
    for (const SupportPoint& point : points_) {
      double v[2];
      point.VelocityAt(u.data(), v);
      if (!(std::hypot(v[0], v[1]) > kSlowPoint * scale)) return false;
    }
    double value = 0.0;
    Vector gradient = m.cwiseProduct(u) - p;
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> curvature = m.asDiagonal();
    Smoothed(u.data(), 0.0, &value, gradient.data(), curvature.data());
    if (gradient.cwiseProduct(unit).norm() <= 64.0 * Rounding() * p.cwiseProduct(unit).norm()) {
      std::copy_n(u.data(), 3, twist);
      return true;
    }
    u -= curvature.ldlt().solve(gradient);
  }
  return false;
}

// Newton's method on the smoothed problem, which is strictly convex, with ε that falls to 0.
SupportState SupportFriction::SolvePoints(const double mass[3], const double momentum[3]) const {
  constexpr double kReduction = 0.03;
  constexpr int kMostNewton = 60;
  constexpr int kMostHalvings = 40;
  SupportState state;
  double scale = 0.0;
  for (int i = 0; i < 3; ++i) {
    scale = std::max(scale, std::abs(momentum[i]) / mass[i] * (i == 2 ? arm_ : 1.0));
  }
  if (!(scale > 0.0) && momentum[2] == 0.0) {
    state.holds = points_.size() > 1 ? SupportState::kBody : 0;
    return state;
  }
  if (!(scale > 0.0)) scale = std::abs(momentum[2]) / mass[2];
  if (points_.size() > 1 && HoldsByShares(momentum)) {
    state.holds = SupportState::kBody;
    return state;
  }
  if (Slides(mass, momentum, scale, state.twist.data())) return state;
  using Vector = Eigen::Vector3d;
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Vector m(mass[0], mass[1], mass[2]);
  const Vector p(momentum[0], momentum[1], momentum[2]);
  Vector u = p.cwiseQuotient(m);
  const auto evaluate = [&](const Vector& at, double epsilon, Vector* gradient, Matrix* curvature) {
    double value = 0.5 * at.dot(m.cwiseProduct(at)) - p.dot(at);
    *gradient = m.cwiseProduct(at) - p;
    *curvature = m.asDiagonal();
    Smoothed(at.data(), epsilon, &value, gradient->data(), curvature->data());
    return value;
  };
  for (double epsilon = scale;; epsilon = std::max(kReduction * epsilon, kSmoothedSpeed * scale)) {
    for (int k = 0; k < kMostNewton; ++k) {
      Vector gradient;
      Matrix curvature;
      const double value = evaluate(u, epsilon, &gradient, &curvature);
      const Vector step = -curvature.ldlt().solve(gradient);
      const double slope = gradient.dot(step);
      if (!(slope < 0.0)) break;
      double length = 1.0;
      Vector next = u + step;
      for (int halving = 0; halving < kMostHalvings; ++halving) {
        Vector unused;
        Matrix unused_curvature;
        if (evaluate(next, epsilon, &unused, &unused_curvature) <= value + 0.1 * length * slope) {
          break;
        }
        length *= 0.5;
        next = u + length * step;
      }
      const double terms = std::abs(value) + p.cwiseAbs().dot(u.cwiseAbs());
      const bool small = -slope <= Rounding() * Rounding() * terms;
      u = next;
      if (small || length < kSlowPoint * kSlowPoint) break;
    }
    if (epsilon <= kSmoothedSpeed * scale) break;
  }
  int held = 0;
  for (size_t i = 0; i < points_.size(); ++i) {
    double v[2];
    points_[i].VelocityAt(u.data(), v);
    if (std::hypot(v[0], v[1]) > kHeldPoint * scale) continue;
    state.holds = held == 0 ? static_cast<int>(i) : SupportState::kBody;
    ++held;
  }
  for (int i = 0; i < 3; ++i) state.twist[i] = u[i];
  return state;
}

#define TANGIBLE_INSTANTIATE(T) template void DiscFriction<T>(const T&, const T[3], T[3]);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
