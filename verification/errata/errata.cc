// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/errata/errata.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "tangible/lcp/dense/solver.h"
#include "tangible/math/median.h"

namespace tangible {
namespace {

constexpr double kStep = 0.01;                    // s, h
constexpr double kGravity = 9.81;                 // m/s²
constexpr double kWeights[3] = {1.0, 0.4, 0.15};  // w of the loss
constexpr int kRandomBodies = 200;
constexpr double kExampleBound = 1e-9;  // of the right formulas
constexpr double kRightBound = 1e-6;  // the same of random bodies, some of whose entries are near 0
constexpr double kWrongBound = 1e-2;

using Matrix34 = Eigen::Matrix<double, 4, 3>;

// The data of (1) and their derivatives with respect to a parameter: the same struct.
struct Data {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  // M v + h f
  Matrix34 G = Matrix34::Zero();
  Eigen::Matrix4d F = Eigen::Matrix4d::Zero();  // as printed
  Eigen::Vector4d c = Eigen::Vector4d::Zero();
};

// The normal is (0, 1), the tangent (1, 0).
Data DataOf(const SlidingBody& body) {
  Data d;
  d.M.diagonal() << body[kMass], body[kMass], body[kInertia];
  d.p << body[kMass] * body[kVelocityX] + kStep * body[kForceX],
      body[kMass] * body[kVelocityY] - kStep * body[kMass] * kGravity,
      body[kInertia] * body[kAngularVelocity];
  d.G.row(0) << 0.0, 1.0, body[kArmX];
  d.G.row(1) << 1.0, 0.0, -body[kArmY];
  d.G.row(2) = -d.G.row(1);
  d.F(1, 3) = d.F(2, 3) = 1.0;
  d.F(3, 0) = body[kFrictionCoefficient];
  d.F(3, 1) = d.F(3, 2) = -1.0;
  d.c[0] = body[kGapSpeed];
  return d;
}

Data DerivativeOf(const SlidingBody& body, int parameter) {
  Data d;
  switch (parameter) {
    case kMass:
      d.M(0, 0) = d.M(1, 1) = 1.0;
      d.p << body[kVelocityX], body[kVelocityY] - kStep * kGravity, 0.0;
      break;
    case kInertia:
      d.M(2, 2) = 1.0;
      d.p[2] = body[kAngularVelocity];
      break;
    case kFrictionCoefficient:
      d.F(3, 0) = 1.0;
      break;
    case kArmX:
      d.G(0, 2) = 1.0;
      break;
    case kArmY:
      d.G(1, 2) = -1.0;
      d.G(2, 2) = 1.0;
      break;
    case kVelocityX:
      d.p[0] = body[kMass];
      break;
    case kVelocityY:
      d.p[1] = body[kMass];
      break;
    case kAngularVelocity:
      d.p[2] = body[kInertia];
      break;
    case kForceX:
      d.p[0] = kStep;
      break;
    default:
      d.c[0] = 1.0;
  }
  return d;
}

MixedLcp<double> ToLcp(const Data& d) {
  MixedLcp<double> problem;
  problem.M = d.M;
  problem.p = d.p;
  problem.G = d.G;
  problem.F = d.F;
  problem.c = d.c;
  ConformEmptyBlocks(problem);
  return problem;
}

bool Slides(const LcpSolution<double>& solution) {
  return solution.status == LcpStatus::kSolved && solution.z[0] > 1e-3 && solution.z[3] > 1e-2;
}

double Loss(const LcpSolution<double>& solution) {
  return kWeights[0] * solution.v[0] + kWeights[1] * solution.v[1] + kWeights[2] * solution.v[2];
}

// The loss; NaN where the problem is not solved.
double LossOf(const SlidingBody& body, Misprint misprint) {
  const LcpSolution<double> solution = SolveLcp(ProblemOf(body, misprint));
  return solution.status == LcpStatus::kSolved ? Loss(solution)
                                               : std::numeric_limits<double>::quiet_NaN();
}

double Quotient(const SlidingBody& body, int parameter, double h, Misprint misprint) {
  SlidingBody high = body;
  SlidingBody low = body;
  high[parameter] += h;
  low[parameter] -= h;
  return (LossOf(high, misprint) - LossOf(low, misprint)) / (high[parameter] - low[parameter]);
}

double Uniform(std::mt19937_64* engine, double low, double high) {
  return low + (high - low) * (static_cast<double>((*engine)() >> 11) * 0x1p-53);
}

SlidingBody RandomBody(std::mt19937_64* engine) {
  SlidingBody body{};
  body[kMass] = Uniform(engine, 0.5, 3.0);
  body[kInertia] = body[kMass] * Uniform(engine, 0.005, 0.05);
  body[kFrictionCoefficient] = Uniform(engine, 0.1, 0.6);
  body[kArmX] = Uniform(engine, -0.15, 0.15);
  body[kArmY] = Uniform(engine, -0.3, -0.1);
  body[kVelocityX] = Uniform(engine, 1.0, 3.0) * (Uniform(engine, -1.0, 1.0) < 0.0 ? -1.0 : 1.0);
  body[kVelocityY] = Uniform(engine, -1.0, 0.0);
  body[kAngularVelocity] = Uniform(engine, -1.0, 1.0);
  body[kForceX] = Uniform(engine, -5.0, 5.0);
  body[kGapSpeed] = Uniform(engine, 0.0, 0.05);
  return body;
}

double RelativeError(double a, double b) { return std::abs(a - b) / std::abs(b); }

// The gradient by the formulas as printed, or for the problem as printed.
std::vector<double> Printed(const SlidingBody& body, Misprint misprint) {
  return misprint == Misprint::kSignOfQ || misprint == Misprint::kSignOfF
             ? GradientByDifferences(body, misprint)
             : GradientByFormulas(body, misprint);
}

std::string Cell(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

std::string TwistText(const std::array<double, 3>& twist) {
  char text[96];
  std::snprintf(text, sizeof(text), "(%.4f, %.4f, %.4f)", twist[0], twist[1], twist[2]);
  return text;
}

std::string Row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) {
    line += " " + cell + " |";
  }
  return line + "\n";
}

}  // namespace

const char* NameOf(Misprint misprint) {
  switch (misprint) {
    case Misprint::kNone:
      return "none";
    case Misprint::kDifferential:
      return "differential";
    case Misprint::kGradientOfG:
      return "gradient of G";
    case Misprint::kSignOfQ:
      return "sign of q";
    case Misprint::kSignOfF:
      return "sign of F";
  }
  return "";
}

const char* NameOf(SlidingParameter parameter) {
  static const char* const kNames[kNumSlidingParameters] = {
      "mass",       "inertia",    "friction",         "arm x",   "arm y",
      "velocity x", "velocity y", "angular velocity", "force x", "gap speed"};
  return kNames[parameter];
}

SlidingBody ExampleBody() { return {2.0, 0.03, 0.4, 0.05, -0.2, 1.5, -0.3, 0.5, 3.0, 0.02}; }

MixedLcp<double> ProblemOf(const SlidingBody& body, Misprint misprint) {
  MixedLcp<double> problem = ToLcp(DataOf(body));
  if (misprint == Misprint::kSignOfQ) {
    problem.p = -problem.p;
  } else if (misprint == Misprint::kSignOfF) {
    problem.F = -problem.F;
  }
  return problem;
}

std::vector<double> GradientByFormulas(const SlidingBody& body, Misprint misprint) {
  const Data data = DataOf(body);
  const LcpSolution<double> solution = SolveLcp(ToLcp(data));
  if (!Slides(solution)) {
    return {};
  }
  const Eigen::Vector3d x = -solution.v;
  const Eigen::Vector4d z = solution.z;
  const Eigen::Matrix4d F = -data.F;
  Eigen::Matrix<double, 7, 7> K;
  K.topLeftCorner<3, 3>() = data.M;
  K.topRightCorner<3, 4>() = data.G.transpose();
  K.bottomLeftCorner<4, 3>() = z.asDiagonal() * data.G;
  K.bottomRightCorner<4, 4>() =
      misprint == Misprint::kDifferential ? F : Eigen::Matrix4d(z.asDiagonal() * F);
  K.bottomRightCorner<4, 4>().diagonal() -= solution.s;
  Eigen::Matrix<double, 7, 1> loss_gradient = Eigen::Matrix<double, 7, 1>::Zero();
  loss_gradient.head<3>() << -kWeights[0], -kWeights[1], -kWeights[2];  // ∂ℓ/∂x
  const Eigen::Matrix<double, 7, 1> adjoint = K.transpose().fullPivLu().solve(loss_gradient);
  const Eigen::Vector3d dx = adjoint.head<3>();
  const Eigen::Vector4d dz = adjoint.tail<4>();
  const Eigen::Vector4d weighted = z.cwiseProduct(dz);  // D(z) dz
  const Eigen::Matrix3d of_m_matrix = -0.5 * (dx * x.transpose() + x * dx.transpose());
  const Eigen::Matrix4d of_f = -weighted * z.transpose();
  const Matrix34 of_g =
      misprint == Misprint::kGradientOfG
          ? Matrix34(-(weighted * x.transpose() + z.cwiseProduct(z) * dx.transpose()))
          : Matrix34(-(weighted * x.transpose() + z * dx.transpose()));
  std::vector<double> gradient;
  for (int k = 0; k < kNumSlidingParameters; ++k) {
    const Data d = DerivativeOf(body, k);
    gradient.push_back(-dx.dot(d.p) + weighted.dot(d.c) + of_m_matrix.cwiseProduct(d.M).sum() -
                       of_f.cwiseProduct(d.F).sum() + of_g.cwiseProduct(d.G).sum());
  }
  return gradient;
}

std::vector<double> GradientByDifferences(const SlidingBody& body, Misprint misprint) {
  std::vector<double> gradient;
  for (int k = 0; k < kNumSlidingParameters; ++k) {
    const double h = 1e-3 * std::max(std::abs(body[k]), 0.01);
    gradient.push_back(
        (4.0 * Quotient(body, k, 0.5 * h, misprint) - Quotient(body, k, h, misprint)) / 3.0);
    if (std::isnan(gradient.back())) {
      return {};
    }
  }
  return gradient;
}

ErrataTable ComputeErrata() {
  ErrataTable table;
  table.body = ExampleBody();
  table.differences = GradientByDifferences(table.body, Misprint::kNone);
  table.right = GradientByFormulas(table.body, Misprint::kNone);
  for (size_t i = 0; i < kMisprints.size(); ++i) {
    table.printed[i] = Printed(table.body, kMisprints[i]);
    const VectorX<double> v = SolveLcp(ProblemOf(table.body, kMisprints[i])).v;
    std::copy(v.begin(), v.end(), table.twist[i + 1].begin());
  }
  const VectorX<double> v = SolveLcp(ProblemOf(table.body)).v;
  std::copy(v.begin(), v.end(), table.twist[0].begin());
  std::mt19937_64 engine(2018);
  std::array<std::vector<double>, 4> errors;
  while (table.bodies < kRandomBodies) {
    const SlidingBody body = RandomBody(&engine);
    const std::vector<double> right = GradientByFormulas(body, Misprint::kNone);
    if (right.empty()) {
      continue;
    }
    ++table.bodies;
    const std::vector<double> differences = GradientByDifferences(body, Misprint::kNone);
    for (int k = 0; k < kNumSlidingParameters; ++k) {
      table.largest_right = std::max(table.largest_right, RelativeError(right[k], differences[k]));
    }
    for (size_t i = 0; i < kMisprints.size(); ++i) {
      const std::vector<double> printed = Printed(body, kMisprints[i]);
      for (size_t k = 0; k < printed.size(); ++k) {
        const double error = RelativeError(printed[k], differences[k]);
        if (error > kRightBound) {
          errors[i].push_back(error);
        }
      }
    }
  }
  for (size_t i = 0; i < kMisprints.size(); ++i) {
    table.wrong[i] = static_cast<long>(errors[i].size());
    table.median_printed[i] = UpperMedian(errors[i]);
  }
  return table;
}

std::string ErrataText(const ErrataTable& table) {
  std::vector<std::string> head = {"gradient with respect to", "at", "differences", "right",
                                   "its error"};
  std::vector<std::string> line(head.size() + kMisprints.size(), "---");
  for (const Misprint misprint : kMisprints) {
    head.push_back(std::string("printed: ") + NameOf(misprint));
  }
  std::string text = Row(head) + Row(line);
  for (int k = 0; k < kNumSlidingParameters; ++k) {
    std::vector<std::string> cells = {
        NameOf(static_cast<SlidingParameter>(k)), Cell("%g", table.body[k]),
        Cell("%.8f", table.differences[k]), Cell("%.8f", table.right[k]),
        Cell("%.0e", RelativeError(table.right[k], table.differences[k]))};
    for (const std::vector<double>& printed : table.printed) {
      if (printed.empty()) {
        cells.emplace_back("not solved");
        continue;
      }
      const double off = RelativeError(printed[k], table.differences[k]);
      cells.push_back(off < kRightBound ? "right"
                                        : Cell("%.5f", printed[k]) + Cell(" (%.0f %%)", 100 * off));
    }
    text += Row(cells);
  }
  std::vector<std::string> cells = {"v+ = (vx, vy, omega)", "", "", TwistText(table.twist[0]), ""};
  for (size_t i = 0; i < kMisprints.size(); ++i) {
    cells.push_back(table.twist[i + 1] == table.twist[0] ? "right" : TwistText(table.twist[i + 1]));
  }
  text += Row(cells);
  text += "\n" + std::to_string(table.bodies) + " random sliding bodies, " +
          std::to_string(table.bodies * kNumSlidingParameters) +
          " entries; changed by the misprint, and the median error of these:\n";
  for (size_t i = 0; i < kMisprints.size(); ++i) {
    text += std::string("  ") + NameOf(kMisprints[i]) + ": " + std::to_string(table.wrong[i]) +
            Cell(", %.0f %%\n", 100.0 * table.median_printed[i]);
  }
  return text + Cell("  right formulas: none; largest error %.0e\n", table.largest_right);
}

std::string BrokenErrata(const ErrataTable& table) {
  for (int k = 0; k < kNumSlidingParameters; ++k) {
    if (!(RelativeError(table.right[k], table.differences[k]) <= kExampleBound)) {
      return std::string("errata: the right gradient with respect to ") +
             NameOf(static_cast<SlidingParameter>(k)) + " is off";
    }
  }
  if (!(table.largest_right <= kRightBound)) {
    return "errata: the right gradient of a random body is off";
  }
  for (size_t i = 0; i < kMisprints.size(); ++i) {
    double worst = 0.0;
    for (size_t k = 0; k < table.printed[i].size(); ++k) {
      worst = std::max(worst, RelativeError(table.printed[i][k], table.differences[k]));
    }
    if (!(worst >= kWrongBound)) {
      return std::string("errata: printed ") + NameOf(kMisprints[i]) + " is not off";
    }
  }
  return "";
}

}  // namespace tangible
