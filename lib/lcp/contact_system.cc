// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact_system.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/joint_damping.h"

namespace tangible {
namespace {

// Refinement ends where the residual is at rounding level, or no longer falls.
constexpr double kResidualGoal = 1e-15;
constexpr int kMaxRefinements = 8;
// Rows that leave more than this contradict each other.
constexpr double kConsistent = 1e-14;

// Adds (left)ᵀ (right) weight to a 3 x 3 block.
void AddOuter(const RowPart<double>& left, const RowPart<double>& right, double weight,
              double* block) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      block[3 * i + j] += weight * left[i] * right[j];
    }
  }
}

// block(row, :) += part, of a constraint's 3 x 3 block on a body.
void AddToRow(const RowPart<double>& part, int row, double* block) {
  for (int i = 0; i < 3; ++i) {
    block[3 * row + i] += part[i];
  }
}

// block(:, column) −= part.
void SubtractFromColumn(const RowPart<double>& part, int column, double* block) {
  for (int i = 0; i < 3; ++i) {
    block[3 * i + column] -= part[i];
  }
}

RowPart<double> Combine(const RowPart<double>& x, double factor, const RowPart<double>& y) {
  return {x[0] + factor * y[0], x[1] + factor * y[1], x[2] + factor * y[2]};
}

// Largest magnitudes of a kind of row: of its terms and of what is left.
struct RowScale {
  double terms = 0.0;
  // Of the products that a constraint's value sums, and of the free motion: at rest all terms
  // cancel to rounding, which is relative to these.
  double parts = 0.0;
  double left = 0.0;
  void Term(double x) { terms = std::max(terms, std::abs(x)); }
  double Relative() const { return terms > 0.0 ? left / terms : left > 0.0 ? HUGE_VAL : 0.0; }
  double RelativeToParts() const {
    const double scale = std::max(terms, parts);
    return scale > 0.0 ? left / scale : left > 0.0 ? HUGE_VAL : 0.0;
  }
};

// residual := rhs − K x for one column of strided vectors; sign −1 and exchanged directions for Kᵀ.
template <bool kTransposed>
class ColumnResidual {
 public:
  ColumnResidual(const ContactProblem<double>& problem, const double* x, int columns,
                 double* residual, RowScale* momentum, RowScale* constraint)
      : p_(problem),
        x_(x),
        columns_(columns),
        r_(residual),
        momentum_(*momentum),
        constraint_(*constraint) {}

  void Bodies() {
    for (int i = 0; i < 3 * p_.num_bodies; ++i) {
      const double term = p_.mass[i] * x_[i * columns_];
      momentum_.Term(r_[i * columns_]);
      momentum_.Term(term);
      r_[i * columns_] -= term;
    }
    for (const DamperBlock<double>& d : p_.dampers) {
      Push(d.a, d.row_a, d.b, d.row_b, -d.weight * Dot(d.a, d.row_a, d.b, d.row_b));
    }
  }

  void Joints() {
    int block = p_.num_bodies;
    for (const JointBlock<double>& j : p_.joints) {
      for (int k = 0; k < j.rows; ++k) {
        Constrain(block, k, Dot(j.a, j.row_a[k], j.b, j.row_b[k]));
        Push(j.a, j.row_a[k], j.b, j.row_b[k], kSign * At(block, k));
      }
      ++block;
    }
  }

  void Contact(const ContactBlock<double>& c, ContactMode mode, int block) {
    const double along = -SlidingSign(mode) * c.friction;  // the impulse's part on the tangent
    const double impulse = At(block, 0);
    // A driven contact has a column as others, and of rows λn alone.
    double row = c.driven && !kTransposed ? impulse : Dot(c.a, c.normal_a, c.b, c.normal_b);
    if (c.driven && kTransposed) {
      row -= impulse;
    } else {
      Push(c.a, c.normal_a, c.b, c.normal_b, kSign * impulse);
    }
    if (mode == ContactMode::kSticking) {
      Constrain(block, 1, Dot(c.a, c.tangent_a, c.b, c.tangent_b));
      Push(c.a, c.tangent_a, c.b, c.tangent_b, kSign * At(block, 1));
    } else if (along != 0.0) {
      if (kTransposed) {
        row += along * Dot(c.a, c.tangent_a, c.b, c.tangent_b);
      } else {
        Push(c.a, c.tangent_a, c.b, c.tangent_b, along * impulse);
      }
    }
    Constrain(block, 0, row);
  }

 private:
  static constexpr double kSign = kTransposed ? -1.0 : 1.0;

  double At(int block, int i) const { return x_[(3 * block + i) * columns_]; }
  double Dot(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double part_a = a >= 0 ? row_a[i] * At(a, i) : 0.0;
      const double part_b = b >= 0 ? row_b[i] * At(b, i) : 0.0;
      sum += part_a + part_b;
      constraint_.parts = std::max({constraint_.parts, std::abs(part_a), std::abs(part_b)});
    }
    return sum;
  }
  // Momentum rows: += rowᵀ impulse.
  void Push(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
            double impulse) {
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) {
        r_[(3 * a + i) * columns_] += row_a[i] * impulse;
        momentum_.Term(row_a[i] * impulse);
      }
      if (b >= 0) {
        r_[(3 * b + i) * columns_] += row_b[i] * impulse;
        momentum_.Term(row_b[i] * impulse);
      }
    }
  }
  void Constrain(int block, int i, double value) {
    double& r = r_[(3 * block + i) * columns_];
    constraint_.Term(r);
    constraint_.Term(value);
    r -= kSign * value;
  }

  const ContactProblem<double>& p_;
  const double* x_;
  const int columns_;
  double* r_;
  RowScale& momentum_;
  RowScale& constraint_;
};

// Masses that differ by more than this lose so many digits in a factorisation (a chain with an end
// of 1e6 of its links' mass: residuals of 2e-10 without refinement).
constexpr double kRefinedRatio = 1e4;

bool MassesDiffer(const ContactProblem<double>& problem) {
  double least = HUGE_VAL, most = 0.0;
  for (size_t i = 0; i < problem.mass.size(); i += 3) {
    least = std::min(least, problem.mass[i]);
    most = std::max(most, problem.mass[i]);
  }
  return most > kRefinedRatio * least;
}

}  // namespace

void ContactSystem::Reserve(int num_blocks, int num_edges) {
  lu_.Reserve(num_blocks, num_edges);
  edges_.reserve(num_edges);
  contact_block_.reserve(num_blocks);
  regularisation_.reserve(3 * num_blocks);
  rhs_.reserve(3 * num_blocks);
  correction_.reserve(3 * num_blocks);
  last_.reserve(3 * num_blocks);
}

void ContactSystem::MoveFactorsTo(ContactSystem* other) {
  lu_.MoveFactorsTo(&other->lu_);
  contact_block_.swap(other->contact_block_);
  other->regularised_ = regularised_;
}

void ContactSystem::SetPattern(const ContactProblem<double>& problem,
                               const std::vector<ContactMode>& modes) {
  edges_.clear();
  contact_block_.clear();
  for (const DamperBlock<double>& damper : problem.dampers) {
    if (damper.a >= 0 && damper.b >= 0) {
      edges_.emplace_back(damper.a, damper.b);
    }
  }
  int block = problem.num_bodies;
  const auto add = [&](int a, int b) {
    if (a >= 0) {
      edges_.emplace_back(a, block);
    }
    if (b >= 0) {
      edges_.emplace_back(b, block);
    }
    ++block;
  };
  for (const JointBlock<double>& joint : problem.joints) {
    add(joint.a, joint.b);
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (modes[i] == ContactMode::kOpen) {
      contact_block_.push_back(-1);
    } else {
      contact_block_.push_back(block);
      add(problem.contacts[i].a, problem.contacts[i].b);
    }
  }
  lu_.SetPattern(block, problem.num_bodies, edges_);
}

void ContactSystem::AddBodies(const ContactProblem<double>& problem) {
  for (int body = 0; body < problem.num_bodies; ++body) {
    double* block = lu_.Diagonal(body);
    for (int i = 0; i < 3; ++i) {
      block[4 * i] += problem.mass[3 * body + i];
    }
  }
  int edge = 0;
  for (const DamperBlock<double>& damper : problem.dampers) {
    if (damper.a >= 0) {
      AddOuter(damper.row_a, damper.row_a, damper.weight, lu_.Diagonal(damper.a));
    }
    if (damper.b >= 0) {
      AddOuter(damper.row_b, damper.row_b, damper.weight, lu_.Diagonal(damper.b));
    }
    if (damper.a >= 0 && damper.b >= 0) {
      AddOuter(damper.row_a, damper.row_b, damper.weight, lu_.FirstSecond(edge));
      AddOuter(damper.row_b, damper.row_a, damper.weight, lu_.SecondFirst(edge));
      ++edge;
    }
  }
}

void ContactSystem::AddJoints(const ContactProblem<double>& problem, double regularisation) {
  int edge = 0;
  for (const DamperBlock<double>& damper : problem.dampers) {
    edge += damper.a >= 0 && damper.b >= 0 ? 1 : 0;
  }
  int block = problem.num_bodies;
  for (const JointBlock<double>& joint : problem.joints) {
    double* diagonal = lu_.Diagonal(block++);
    for (int r = 0; r < 3; ++r) {
      if (r >= joint.rows) {
        diagonal[4 * r] = 1.0;
      } else if (problem.redundant_joints) {
        diagonal[4 * r] = regularisation * RowMobility(problem.mass, joint.a, joint.row_a[r],
                                                       joint.b, joint.row_b[r]);
        regularisation_[3 * (block - 1) + r] = diagonal[4 * r];
      }
    }
    const auto add = [&](const RowPart<double>* rows) {
      for (int r = 0; r < joint.rows; ++r) {
        AddToRow(rows[r], r, lu_.SecondFirst(edge));
        SubtractFromColumn(rows[r], r, lu_.FirstSecond(edge));
      }
      ++edge;
    };
    if (joint.a >= 0) {
      add(joint.row_a);
    }
    if (joint.b >= 0) {
      add(joint.row_b);
    }
  }
}

void ContactSystem::AddContacts(const ContactProblem<double>& problem,
                                const std::vector<ContactMode>& modes, double regularisation) {
  // Edges of contacts come last: of a, then of b, where these move.
  int edge = static_cast<int>(edges_.size());
  for (size_t i = problem.contacts.size(); i-- > 0;) {
    if (modes[i] == ContactMode::kOpen) {
      continue;
    }
    const ContactBlock<double>& contact = problem.contacts[i];
    const bool sticks = modes[i] == ContactMode::kSticking;
    double* diagonal = lu_.Diagonal(contact_block_[i]);
    diagonal[0] = contact.driven
                      ? 1.0
                      : regularisation * RowMobility(problem.mass, contact.a, contact.normal_a,
                                                     contact.b, contact.normal_b);
    diagonal[4] = sticks ? regularisation * RowMobility(problem.mass, contact.a, contact.tangent_a,
                                                        contact.b, contact.tangent_b)
                         : 1.0;
    diagonal[8] = 1.0;
    regularisation_[3 * contact_block_[i]] = contact.driven ? 0.0 : diagonal[0];
    regularisation_[3 * contact_block_[i] + 1] = sticks ? diagonal[4] : 0.0;
    const double along = -SlidingSign(modes[i]) * contact.friction;
    const auto add = [&](const RowPart<double>& normal, const RowPart<double>& tangent) {
      --edge;
      if (!contact.driven) {
        AddToRow(normal, 0, lu_.SecondFirst(edge));
      }
      SubtractFromColumn(Combine(normal, along, tangent), 0, lu_.FirstSecond(edge));
      if (sticks) {
        AddToRow(tangent, 1, lu_.SecondFirst(edge));
        SubtractFromColumn(tangent, 1, lu_.FirstSecond(edge));
      }
    };
    if (contact.b >= 0) {
      add(contact.normal_b, contact.tangent_b);
    }
    if (contact.a >= 0) {
      add(contact.normal_a, contact.tangent_a);
    }
  }
}

bool ContactSystem::Factor(const ContactProblem<double>& given,
                           const std::vector<ContactMode>& modes, double regularisation) {
  const bool spread = HasSpreadJoints(given);
  const ContactProblem<double> damped = spread ? WithJointDampers(given) : ContactProblem<double>();
  const ContactProblem<double>& problem = spread ? damped : given;
  SetPattern(problem, modes);
  lu_.SetZero();
  regularisation_.assign(3 * static_cast<size_t>(lu_.num_blocks()), 0.0);
  AddBodies(problem);
  AddJoints(problem, regularisation);
  AddContacts(problem, modes, regularisation);
  // What is solved in another form is refined as what is regularised.
  regularised_ = spread || (problem.redundant_joints && !problem.joints.empty());
  for (const int block : contact_block_) {
    regularised_ = regularised_ || block >= 0;
  }
  return lu_.Factor();
}

template <bool kTransposed>
double ContactSystem::Residual(const ContactProblem<double>& problem,
                               const std::vector<ContactMode>& modes, const double* rhs,
                               const double* x, int columns, double* residual) const {
  return ResidualWith<kTransposed>(problem, modes, Regularisation::kLeftOut, rhs, x, columns,
                                   residual)
      .to_terms;
}

template <bool kTransposed>
ContactSystem::ResidualSize ContactSystem::ResidualWith(const ContactProblem<double>& problem,
                                                        const std::vector<ContactMode>& modes,
                                                        Regularisation regularisation,
                                                        const double* rhs, const double* x,
                                                        int columns, double* residual) const {
  const size_t size = 3 * static_cast<size_t>(num_blocks()) * columns;
  std::copy(rhs, rhs + size, residual);
  RowScale momentum, constraint;
  for (int c = 0; c < columns; ++c) {
    ColumnResidual<kTransposed> column(problem, x + c, columns, residual + c, &momentum,
                                       &constraint);
    column.Bodies();
    column.Joints();
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      if (contact_block_[i] >= 0) {
        column.Contact(problem.contacts[i], modes[i], contact_block_[i]);
      }
    }
  }
  // Unused rows of constraints have a right-hand side of 0.
  const size_t momentum_size = 3 * static_cast<size_t>(problem.num_bodies) * columns;
  const std::vector<double>& free = problem.scale_momentum();
  for (int i = 0; i < 3 * problem.num_bodies; ++i) {
    momentum.parts = std::max(momentum.parts, std::abs(free[i]));
    if (i % 3 != 2) {
      constraint.parts = std::max(constraint.parts, std::abs(free[i]) / problem.mass[i]);
    }
  }
  if (regularisation == Regularisation::kKept) {
    for (size_t i = momentum_size; i < size; ++i) {
      residual[i] -= regularisation_[i / columns] * x[i];
    }
  }
  for (size_t i = 0; i < size; ++i) {
    RowScale& kind = i < momentum_size ? momentum : constraint;
    kind.left = std::max(kind.left, std::abs(residual[i]));
  }
  return {std::max(momentum.Relative(), constraint.Relative()),
          std::max(momentum.RelativeToParts(), constraint.RelativeToParts())};
}

template <bool kTransposed>
double ContactSystem::RefinedSolve(const ContactProblem<double>& problem,
                                   const std::vector<ContactMode>& modes, double* x, int columns) {
  const size_t size = 3 * static_cast<size_t>(num_blocks()) * columns;
  rhs_.assign(x, x + size);
  correction_.resize(size);
  const auto solve = kTransposed ? SolveTransposedByFactors : SolveByFactors;
  solve(lu_, problem, x, columns);
  double left = Residual<kTransposed>(problem, modes, rhs_.data(), x, columns, correction_.data());
  for (int i = 0; i < kMaxRefinements && left > kResidualGoal; ++i) {
    solve(lu_, problem, correction_.data(), columns);
    for (size_t k = 0; k < size; ++k) {
      x[k] += correction_[k];
    }
    const double before = left;
    left = Residual<kTransposed>(problem, modes, rhs_.data(), x, columns, correction_.data());
    if (!(left < 0.1 * before)) {
      break;
    }
  }
  return left;
}

double ContactSystem::Solve(const ContactProblem<double>& problem,
                            const std::vector<ContactMode>& modes, double* x, int columns) {
  if (!regularised_ && !MassesDiffer(problem)) {
    lu_.Solve(x, columns);
    return 0.0;
  }
  return RefinedSolve<false>(problem, modes, x, columns);
}

double ContactSystem::SolveTransposed(const ContactProblem<double>& problem,
                                      const std::vector<ContactMode>& modes, double* x,
                                      int columns) {
  if (!regularised_ && !MassesDiffer(problem)) {
    lu_.SolveTransposed(x, columns);
    return 0.0;
  }
  return RefinedSolve<true>(problem, modes, x, columns);
}

double ContactSystem::SolveRegularised(const ContactProblem<double>& problem,
                                       const std::vector<ContactMode>& modes, double* x,
                                       int columns) {
  const size_t size = 3 * static_cast<size_t>(num_blocks()) * columns;
  rhs_.assign(x, x + size);
  SolveByFactors(lu_, problem, x, columns);
  return Refine(problem, modes, Regularisation::kKept, x, columns);
}

double ContactSystem::SolveProximal(const ContactProblem<double>& problem,
                                    const std::vector<ContactMode>& modes, double* x, int columns) {
  if (!regularised_) {
    return Solve(problem, modes, x, columns);
  }
  const size_t size = 3 * static_cast<size_t>(num_blocks()) * columns;
  rhs_.assign(x, x + size);
  SolveByFactors(lu_, problem, x, columns);
  const double left = Refine(problem, modes, Regularisation::kLeftOut, x, columns);
  if (left <= kConsistent) {
    return left;
  }
  std::copy(rhs_.begin(), rhs_.end(), x);
  SolveByFactors(lu_, problem, x, columns);
  Refine(problem, modes, Regularisation::kKept, x, columns);
  return Refine(problem, modes, Regularisation::kLeftOut, x, columns);
}

// Refines x for the right-hand side rhs_ as long as a round halves what is left of it.
double ContactSystem::Refine(const ContactProblem<double>& problem,
                             const std::vector<ContactMode>& modes, Regularisation regularisation,
                             double* x, int columns) {
  const size_t size = rhs_.size();
  correction_.resize(size);
  const auto residual = [&]() {
    return ResidualWith<false>(problem, modes, regularisation, rhs_.data(), x, columns,
                               correction_.data())
        .to_parts;
  };
  double left = residual();
  for (int i = 0; i < kMaxRefinements && left > kResidualGoal; ++i) {
    last_.assign(x, x + size);
    SolveByFactors(lu_, problem, correction_.data(), columns);
    for (size_t k = 0; k < size; ++k) {
      x[k] += correction_[k];
    }
    const double before = left;
    left = residual();
    if (!(left < 0.5 * before)) {
      std::copy(last_.begin(), last_.end(), x);
      return before;
    }
  }
  return left;
}

template double ContactSystem::Residual<false>(const ContactProblem<double>&,
                                               const std::vector<ContactMode>&, const double*,
                                               const double*, int, double*) const;
template double ContactSystem::Residual<true>(const ContactProblem<double>&,
                                              const std::vector<ContactMode>&, const double*,
                                              const double*, int, double*) const;

}  // namespace tangible
