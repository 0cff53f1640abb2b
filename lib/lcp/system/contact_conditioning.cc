// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_conditioning.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "tangible/lcp/system/tolerances.h"
#include "tangible/math/decompositions.h"
#include "tangible/math/leased.h"

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
  // A row on more than two bodies counts with those of its first joint.
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
    // The impulse of a driven contact is known beforehand, so that only its other rows count.
    if (!c.driven) {
      ActiveRow& normal = add(3 * block, c.a, c.b, c.normal_a, c.normal_b);
      if (const double along = -SlidingSign(modes[i]) * c.friction; along != 0.0) {
        normal.push_a = Combine(c.normal_a, along, c.tangent_a);
        normal.push_b = Combine(c.normal_b, along, c.tangent_b);
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

// Selects the scaled rows, or the directions in which their impulses act.
enum class Side { kRows, kPushes };

// Columns have norm 1; poses are known to about 1e-12 of their size. The difference between
// independent directions of impulses has to exceed that error.
double RankThreshold(Side side) { return side == Side::kRows ? kRowRank : kPushRank; }

// The part of a row on one of its bodies, in units in which the row has norm 1.
Eigen::Vector3d ScaledPart(const ContactProblem<double>& problem, const ActiveRow& row, int body,
                           Side side) {
  const bool rows = side == Side::kRows;
  const RowPart<double>& part =
      row.a == body ? (rows ? row.row_a : row.push_a) : (rows ? row.row_b : row.push_b);
  Eigen::Vector3d scaled;
  for (int i = 0; i < 3; ++i) {
    scaled[i] = row.scale * part[i] / std::sqrt(problem.mass[3 * body + i]);
  }
  return scaled;
}

// Whether up to three columns are independent, by Gram and Schmidt with pivots.
bool AreIndependent(Eigen::Matrix3d columns, int count, double threshold) {
  for (int k = 0; k < count; ++k) {
    Eigen::Index largest = 0;
    const double norm = columns.middleCols(k, count - k).colwise().norm().maxCoeff(&largest);
    if (!(norm > threshold)) {
      return false;
    }
    columns.col(k).swap(columns.col(k + largest));
    const Eigen::Vector3d unit = columns.col(k) / norm;
    for (int other = k + 1; other < count; ++other) {
      columns.col(other) -= unit * unit.dot(columns.col(other));
    }
  }
  return true;
}

// The ranks of the active rows and of their pushes, by groups of bodies that rows connect; the
// ground and static bodies connect none. Before groups are formed joint trees and similar
// structures are removed body by body: where all remaining rows of a body connect it to one other
// body, and their parts on this body alone are independent, they are independent of all other rows.
class RowGroups {
 public:
  RowGroups(const ContactProblem<double>& problem, std::vector<ActiveRow> rows)
      : problem_(problem), rows_(std::move(rows)) {
    Connect();
    TakeOffLeaves();
    FormGroups();
  }
  // Number of operations of the dense factorisations that determine the ranks, for all groups.
  double operations() const;
  // Rows in the group of the most operations, and its bodies.
  RowGroupSize largest() const;
  int num_rows() const { return static_cast<int>(rows_.size()); }
  int RankOf(Side side) const;

 private:
  // All rows between the same two bodies, or between one and the ground (b = −1).
  struct Connection {
    int a, b;
    size_t begin, end;  // in rows_
    bool left = true;
  };
  struct Group {
    std::vector<int> bodies;
    std::vector<size_t> rows;
    double operations() const {
      const auto columns = static_cast<double>(rows.size());
      const auto height = static_cast<double>(3 * bodies.size());
      return 2.0 * columns * height * std::min(columns, height);
    }
  };
  void Connect();
  void TakeOffLeaves();
  void FormGroups();
  bool IsIndependentOn(const Connection& connection, int body) const;
  int RankOf(const Group& group, Side side, std::vector<int>* place) const;

  const ContactProblem<double>& problem_;
  std::vector<ActiveRow> rows_;  // by connection
  std::vector<Connection> connections_;
  std::vector<std::vector<int>> of_body_;  // connections
  int rank_of_leaves_ = 0;
  std::vector<Group> groups_;
};

void RowGroups::Connect() {
  const auto pair = [](const ActiveRow& row) {
    return std::make_pair(std::max(row.a, row.b), std::min(row.a, row.b));
  };
  std::stable_sort(rows_.begin(), rows_.end(),
                   [&](const ActiveRow& p, const ActiveRow& q) { return pair(p) < pair(q); });
  of_body_.resize(problem_.num_bodies);
  for (size_t k = 0; k < rows_.size(); ++k) {
    if (k == 0 || pair(rows_[k]) != pair(rows_[k - 1])) {
      const auto [a, b] = pair(rows_[k]);
      for (const int body : {a, b}) {
        if (body >= 0) of_body_[body].push_back(static_cast<int>(connections_.size()));
      }
      connections_.push_back({a, b, k, k});
    }
    connections_.back().end = k + 1;
  }
}

bool RowGroups::IsIndependentOn(const Connection& connection, int body) const {
  const size_t count = connection.end - connection.begin;
  if (count > 3) {
    return false;
  }
  for (const Side side : {Side::kRows, Side::kPushes}) {
    Eigen::Matrix3d parts = Eigen::Matrix3d::Zero();
    for (size_t k = 0; k < count; ++k) {
      parts.col(static_cast<Eigen::Index>(k)) =
          ScaledPart(problem_, rows_[connection.begin + k], body, side);
    }
    if (!AreIndependent(parts, static_cast<int>(count), RankThreshold(side))) {
      return false;
    }
  }
  return true;
}

void RowGroups::TakeOffLeaves() {
  std::vector<size_t> left(of_body_.size());
  std::vector<int> leaves;
  for (size_t body = 0; body < of_body_.size(); ++body) {
    left[body] = of_body_[body].size();
    if (left[body] == 1) leaves.push_back(static_cast<int>(body));
  }
  while (!leaves.empty()) {
    const int body = leaves.back();
    leaves.pop_back();
    if (left[body] != 1) {
      continue;  // the other end has been removed
    }
    Connection& connection = connections_[*std::find_if(
        of_body_[body].begin(), of_body_[body].end(), [&](int c) { return connections_[c].left; })];
    if (!IsIndependentOn(connection, body)) {
      continue;
    }
    rank_of_leaves_ += static_cast<int>(connection.end - connection.begin);
    connection.left = false;
    for (const int end : {connection.a, connection.b}) {
      if (end >= 0 && --left[end] == 1) leaves.push_back(end);
    }
  }
}

void RowGroups::FormGroups() {
  std::vector<char> seen(of_body_.size(), 0);
  std::vector<int> open;
  for (size_t first = 0; first < of_body_.size(); ++first) {
    if (seen[first] != 0) {
      continue;
    }
    Group group;
    open.assign(1, static_cast<int>(first));
    seen[first] = 1;
    while (!open.empty()) {
      const int body = open.back();
      open.pop_back();
      group.bodies.push_back(body);
      for (const int c : of_body_[body]) {
        const Connection& connection = connections_[c];
        if (!connection.left) {
          continue;
        }
        // Each connection is listed once, at its first body.
        for (size_t k = connection.begin; k < connection.end && connection.a == body; ++k) {
          group.rows.push_back(k);
        }
        for (const int end : {connection.a, connection.b}) {
          if (end >= 0 && seen[end] == 0) {
            seen[end] = 1;
            open.push_back(end);
          }
        }
      }
    }
    if (!group.rows.empty()) groups_.push_back(std::move(group));
  }
}

double RowGroups::operations() const {
  double sum = 0.0;
  for (const Group& group : groups_) {
    sum += group.operations();
  }
  return sum;
}

RowGroupSize RowGroups::largest() const {
  const auto most = std::max_element(
      groups_.begin(), groups_.end(),
      [](const Group& p, const Group& q) { return p.operations() < q.operations(); });
  return most == groups_.end() ? RowGroupSize()
                               : RowGroupSize{static_cast<int>(most->bodies.size()),
                                              static_cast<int>(most->rows.size())};
}

int RowGroups::RankOf(const Group& group, Side side, std::vector<int>* place) const {
  for (size_t k = 0; k < group.bodies.size(); ++k) {
    (*place)[group.bodies[k]] = static_cast<int>(k);
  }
  Eigen::MatrixXd scaled = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * group.bodies.size()),
                                                 static_cast<Eigen::Index>(group.rows.size()));
  for (size_t k = 0; k < group.rows.size(); ++k) {
    const ActiveRow& row = rows_[group.rows[k]];
    for (const int body : {row.a, row.b}) {
      if (body >= 0) {
        scaled.block<3, 1>(3 * (*place)[body], static_cast<Eigen::Index>(k)) =
            ScaledPart(problem_, row, body, side);
      }
    }
  }
  PivotedQr qr(scaled);
  qr.SetThreshold(RankThreshold(side));
  return static_cast<int>(qr.rank());
}

int RowGroups::RankOf(Side side) const {
  std::vector<int> place(problem_.num_bodies, -1);
  int rank = rank_of_leaves_;
  for (const Group& group : groups_) {
    rank += RankOf(group, side, &place);
  }
  return rank;
}

bool AnySlides(const std::vector<ActiveRow>& rows) {
  return std::any_of(rows.begin(), rows.end(), [](const ActiveRow& row) {
    return row.push_a != row.row_a || row.push_b != row.row_b;
  });
}

}  // namespace

int CountRedundantRows(const ContactProblem<double>& problem,
                       const std::vector<ContactMode>& modes) {
  const RowGroups groups(problem, ListActiveRows(problem, modes));
  return groups.num_rows() - groups.RankOf(Side::kRows);
}

int CountUndeterminedMotions(const ContactProblem<double>& problem,
                             const std::vector<ContactMode>& modes) {
  const std::vector<ActiveRow> rows = ListActiveRows(problem, modes);
  if (!AnySlides(rows)) {
    return 0;
  }
  const RowGroups groups(problem, rows);
  const int rank = groups.RankOf(Side::kRows);
  return rank == groups.num_rows() ? 0 : std::max(groups.RankOf(Side::kPushes) - rank, 0);
}

UndeterminedCounts CountUndetermined(const ContactProblem<double>& problem,
                                     const std::vector<ContactMode>& modes,
                                     double most_operations) {
  const std::vector<ActiveRow> rows = ListActiveRows(problem, modes);
  const RowGroups groups(problem, rows);
  UndeterminedCounts counts;
  counts.largest = groups.largest();
  counts.operations = groups.operations();
  counts.counted = counts.operations <= most_operations;
  if (!counts.counted) {
    return counts;
  }
  const int rank = groups.RankOf(Side::kRows);
  counts.impulses = groups.num_rows() - rank;
  if (counts.impulses > 0 && AnySlides(rows)) {
    counts.motions = std::max(groups.RankOf(Side::kPushes) - rank, 0);
  }
  return counts;
}

namespace {

/// Numbers in [−1, 1), always the same; they are drawn only once, because a run measures every
/// step.
struct FixedDraws {
  std::mt19937 random{20240229};
  std::vector<double> draws;

  const std::vector<double>& AtLeast(size_t count) {
    while (draws.size() < count) {
      draws.push_back(2.0 * (static_cast<double>(random()) / 4294967296.0) - 1.0);
    }
    return draws;
  }
};

}  // namespace

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
  Leased<FixedDraws> fixed;
  const std::vector<double>& draws = fixed->AtLeast(size);
  std::vector<double> x(size), rhs(size), left(size);
  for (size_t i = 0; i < size; ++i) {
    x[i] = d[i] * draws[i];
  }
  const std::vector<double> zero(size, 0.0);
  system->Residual<false>(problem, modes, zero.data(), x.data(), 1, rhs.data());
  x = rhs;
  system->Solve(problem, modes, x.data(), 1);
  quality.residual = system->Residual<false>(problem, modes, rhs.data(), x.data(), 1, left.data());
  return quality;
}

}  // namespace tangible
