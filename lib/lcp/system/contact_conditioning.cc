// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_conditioning.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "tangible/lcp/system/tolerances.h"

namespace tangible {
namespace {

// An active constraint row, and the direction in which its impulse acts, which sliding turns.
struct ActiveRow {
  int index;  // of the unknown
  int a, b;
  RowPart<double> row_a, row_b;
  RowPart<double> push_a, push_b;
  double scale;  // (r M⁻¹ rᵀ)^(-1/2)
};

RowPart<double> Slanted(const RowPart<double>& n, double factor, const RowPart<double>& t) {
  return {n[0] + factor * t[0], n[1] + factor * t[1], n[2] + factor * t[2]};
}

std::vector<ActiveRow> ListActiveRows(const ContactProblem<double>& problem,
                                      const std::vector<ContactMode>& modes) {
  std::vector<ActiveRow> rows;
  const auto add = [&](int index, int a, int b, const RowPart<double>& row_a,
                       const RowPart<double>& row_b) -> ActiveRow& {
    const double mobility = RowMobility(problem.mass, a, row_a, b, row_b);
    const double scale = mobility > 0.0 ? 1.0 / std::sqrt(mobility) : 1.0;
    return rows.emplace_back(ActiveRow{index, a, b, row_a, row_b, row_a, row_b, scale});
  };
  int block = problem.num_bodies;
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      add(3 * block + k, joint.a, joint.b, joint.row_a[k], joint.row_b[k]);
    }
    ++block;
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (modes[i] == ContactMode::kOpen) {
      continue;
    }
    const ContactBlock<double>& c = problem.contacts[i];
    // The impulse of a driven contact is known beforehand: what remains are the other rows.
    if (!c.driven) {
      ActiveRow& normal = add(3 * block, c.a, c.b, c.normal_a, c.normal_b);
      if (const double along = -SlidingSign(modes[i]) * c.friction; along != 0.0) {
        normal.push_a = Slanted(c.normal_a, along, c.tangent_a);
        normal.push_b = Slanted(c.normal_b, along, c.tangent_b);
      }
    }
    if (modes[i] == ContactMode::kSticking) {
      add(3 * block + 1, c.a, c.b, c.tangent_a, c.tangent_b);
    }
    ++block;
  }
  return rows;
}

// D of the header, 0 on unused unknowns.
std::vector<double> Scales(const ContactProblem<double>& problem,
                           const std::vector<ActiveRow>& rows, size_t size) {
  std::vector<double> scales(size, 0.0);
  for (int i = 0; i < 3 * problem.num_bodies; ++i) {
    scales[i] = 1.0 / std::sqrt(problem.mass[i]);
  }
  for (const ActiveRow& row : rows) {
    scales[row.index] = row.scale;
  }
  return scales;
}

// ‖D K D‖₁: the largest column sum.
double NormOfSystem(const ContactProblem<double>& problem, const std::vector<ActiveRow>& rows,
                    const std::vector<double>& d) {
  std::vector<double> sums(d.size(), 0.0);
  std::fill_n(sums.begin(), 3 * problem.num_bodies, 1.0);
  const auto each = [&](int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
                        const auto& visit) {
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) visit(3 * a + i, std::abs(row_a[i]) * d[3 * a + i]);
      if (b >= 0) visit(3 * b + i, std::abs(row_b[i]) * d[3 * b + i]);
    }
  };
  for (const DamperBlock<double>& damper : problem.dampers) {
    double total = 0.0;
    each(damper.a, damper.row_a, damper.b, damper.row_b, [&](int, double x) { total += x; });
    each(damper.a, damper.row_a, damper.b, damper.row_b,
         [&](int i, double x) { sums[i] += damper.weight * x * total; });
  }
  for (const ActiveRow& row : rows) {
    each(row.a, row.row_a, row.b, row.row_b, [&](int i, double x) { sums[i] += row.scale * x; });
    each(row.a, row.push_a, row.b, row.push_b,
         [&](int, double x) { sums[row.index] += row.scale * x; });
  }
  return sums.empty() ? 0.0 : *std::max_element(sums.begin(), sums.end());
}

double SumOfMagnitudes(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double value : x) {
    sum += std::abs(value);
  }
  return sum;
}

// x := D⁻¹ x, unused unknowns 0.
void Unscale(const std::vector<double>& d, std::vector<double>* x) {
  for (size_t i = 0; i < d.size(); ++i) {
    (*x)[i] = d[i] > 0.0 ? (*x)[i] / d[i] : 0.0;
  }
}

// Estimate of ‖(D K D)⁻¹‖₁.
double NormOfInverse(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                     const std::vector<double>& d, ContactSystem* system) {
  constexpr int kRounds = 5;
  const long used = std::count_if(d.begin(), d.end(), [](double x) { return x > 0.0; });
  std::vector<double> x(d.size());
  for (size_t i = 0; i < d.size(); ++i) {
    x[i] = d[i] > 0.0 ? 1.0 / static_cast<double>(used) : 0.0;
  }
  double norm = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> y = x;
    Unscale(d, &y);
    system->Solve(problem, modes, y.data(), 1);
    Unscale(d, &y);
    const double found = SumOfMagnitudes(y);
    if (!(found > norm)) {
      break;
    }
    norm = found;
    for (double& value : y) {
      value = value < 0.0 ? -1.0 : 1.0;
    }
    Unscale(d, &y);
    system->SolveTransposed(problem, modes, y.data(), 1);
    Unscale(d, &y);
    const auto largest = std::max_element(
        y.begin(), y.end(), [](double p, double q) { return std::abs(p) < std::abs(q); });
    std::fill(x.begin(), x.end(), 0.0);
    x[largest - y.begin()] = 1.0;
  }
  return norm;
}

// Of the scaled rows, or of the directions in which their impulses act.
enum class Side { kRows, kPushes };
int RankOf(const ContactProblem<double>& problem, const std::vector<ActiveRow>& rows, Side side) {
  Eigen::MatrixXd scaled =
      Eigen::MatrixXd::Zero(3 * problem.num_bodies, static_cast<Eigen::Index>(rows.size()));
  for (size_t k = 0; k < rows.size(); ++k) {
    for (int i = 0; i < 3; ++i) {
      const auto set = [&](int body, const RowPart<double>& part) {
        if (body >= 0) {
          scaled(3 * body + i, static_cast<Eigen::Index>(k)) =
              rows[k].scale * part[i] / std::sqrt(problem.mass[3 * body + i]);
        }
      };
      set(rows[k].a, side == Side::kRows ? rows[k].row_a : rows[k].push_a);
      set(rows[k].b, side == Side::kRows ? rows[k].row_b : rows[k].push_b);
    }
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
  // Columns have norm 1; poses are known to about 1e-12 of their size. What tells pushes apart has
  // to be more than that.
  qr.setThreshold(side == Side::kRows ? kRowRank : kPushRank);
  return static_cast<int>(qr.rank());
}

}  // namespace

int CountRedundantRows(const ContactProblem<double>& problem,
                       const std::vector<ContactMode>& modes) {
  const std::vector<ActiveRow> rows = ListActiveRows(problem, modes);
  return rows.size() < 2 ? 0 : static_cast<int>(rows.size()) - RankOf(problem, rows, Side::kRows);
}

int CountUndeterminedMotions(const ContactProblem<double>& problem,
                             const std::vector<ContactMode>& modes) {
  const std::vector<ActiveRow> rows = ListActiveRows(problem, modes);
  const bool slide = std::any_of(rows.begin(), rows.end(), [](const ActiveRow& row) {
    return row.push_a != row.row_a || row.push_b != row.row_b;
  });
  if (!slide || rows.size() < 2) {
    return 0;
  }
  const int rank = RankOf(problem, rows, Side::kRows);
  return rank == static_cast<int>(rows.size())
             ? 0
             : std::max(RankOf(problem, rows, Side::kPushes) - rank, 0);
}

SystemQuality MeasureSystem(const ContactProblem<double>& problem,
                            const std::vector<ContactMode>& modes, ContactSystem* system) {
  SystemQuality quality;
  const size_t size = 3 * static_cast<size_t>(system->num_blocks());
  if (size == 0) {
    return quality;
  }
  const std::vector<ActiveRow> rows = ListActiveRows(problem, modes);
  const std::vector<double> d = Scales(problem, rows, size);
  quality.condition = NormOfSystem(problem, rows, d) * NormOfInverse(problem, modes, d, system);
  // K x of a random x is consistent, even where rows are redundant.
  std::mt19937 random(20240229);
  std::vector<double> x(size), rhs(size), left(size);
  for (size_t i = 0; i < size; ++i) {
    x[i] = d[i] * (2.0 * (static_cast<double>(random()) / 4294967296.0) - 1.0);
  }
  const std::vector<double> zero(size, 0.0);
  system->Residual<false>(problem, modes, zero.data(), x.data(), 1, rhs.data());
  x = rhs;
  system->Solve(problem, modes, x.data(), 1);
  quality.residual = system->Residual<false>(problem, modes, rhs.data(), x.data(), 1, left.data());
  return quality;
}

}  // namespace tangible
