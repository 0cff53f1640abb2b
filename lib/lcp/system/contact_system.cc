// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/lcp/system/contact_condensation.h"
#include "tangible/lcp/system/joint_damping.h"
#include "tangible/lcp/system/tolerances.h"
#include "tangible/lcp/system/torque_free.h"
#include "tangible/math/leased.h"
#include "tangible/math/scratch.h"

namespace tangible {
namespace {

// Refinement ends where the residual is at rounding level, or no longer falls. Derivatives of many
// steps add up the residuals of each: they take two rounds or more, as long as that helps a column.
constexpr int kMaxRefinements = 40;
// The contradictory part of redundant rows remains in the residual; a correction after which the
// residual exceeds this multiple of it is rejected.
constexpr double kStays = 2.0;
// Impulses that exceed the largest momentum by more than this squeeze bodies between rows that
// nearly depend on each other; those of a pile at rest exceed a body's by its height in bodies.
constexpr double kSqueezes = 30.0;

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

// If masses differ by more than this factor, a factorisation loses so many digits that solutions
// are refined (a chain whose last body has 1e6 of its links' mass: residuals of 2e-10 without
// refinement).
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
  turning_.reserve(num_blocks);
}

void ContactSystem::MoveFactorsTo(ContactSystem* other) {
  lu_.MoveFactorsTo(&other->lu_);
  contact_block_.swap(other->contact_block_);
  regularisation_.swap(other->regularisation_);
  other->num_blocks_ = num_blocks_;
  other->regularised_ = regularised_;
  other->give_ = give_;
  other->masses_differ_ = masses_differ_;
  other->condensed_ = condensed_;
  other->fraction_ = fraction_;
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
    if (joint.c < 0) continue;
    --block;
    add(joint.c, joint.d);
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (modes[i] == ContactMode::kOpen) {
      contact_block_.push_back(-1);
    } else {
      contact_block_.push_back(block);
      if (condensed_) {
        ++block;
      } else {
        add(problem.contacts[i].a, problem.contacts[i].b);
      }
    }
  }
  num_blocks_ = block;
  if (condensed_) {
    first_contact_edge_ = static_cast<int>(edges_.size());
    AddContactEdges(problem, &edges_);
    block = problem.num_bodies + static_cast<int>(problem.joints.size());
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

// Hinges and bars have fewer than three rows, contacts two.
void ContactSystem::NarrowBlocks(const ContactProblem<double>& problem) {
  FindTurning(problem, &turning_);
  int block = 0;
  for (const Turning turning : turning_) {
    if (turning != Turning::kTurned) {
      lu_.SetNarrow(block);
    }
    ++block;
  }
  for (const JointBlock<double>& joint : problem.joints) {
    if (joint.rows < 3) {
      lu_.SetNarrow(block);
    }
    ++block;
  }
  for (; block < lu_.num_blocks(); ++block) {
    lu_.SetNarrow(block);
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
        diagonal[4 * r] = regularisation * joint.give[r] * JointMobility(problem.mass, joint, r);
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
    if (joint.c >= 0) {
      add(&joint.row_c);
    }
    if (joint.d >= 0) {
      add(&joint.row_d);
    }
  }
}

void ContactSystem::AddContacts(const ContactProblem<double>& problem,
                                const std::vector<ContactMode>& modes) {
  // Edges of contacts come last: those to body a, then those to body b, where these move.
  int edge = static_cast<int>(edges_.size());
  for (size_t i = problem.contacts.size(); i-- > 0;) {
    if (modes[i] == ContactMode::kOpen) {
      continue;
    }
    const ContactBlock<double>& contact = problem.contacts[i];
    const bool sticks = modes[i] == ContactMode::kSticking;
    double* diagonal = lu_.Diagonal(contact_block_[i]);
    const double* delta = &regularisation_[3 * static_cast<size_t>(contact_block_[i])];
    diagonal[0] = contact.driven ? 1.0 : delta[0];
    diagonal[4] = sticks ? delta[1] : 1.0;
    diagonal[8] = 1.0;
    const double along = contact.rolls ? 0.0 : -SlidingSign(modes[i]) * contact.friction;
    const RollingColumn rolling = RollingColumnOf(problem, modes, i);
    const auto add = [&](const RowPart<double>& normal, const RowPart<double>& tangent,
                         const RowPart<double>& turn) {
      --edge;
      if (!contact.driven) {
        AddToRow(normal, 0, lu_.SecondFirst(edge));
      }
      SubtractFromColumn(rolling.AddedTo(Combine(normal, along, tangent), turn), 0,
                         lu_.FirstSecond(edge));
      if (sticks) {
        AddToRow(tangent, 1, lu_.SecondFirst(edge));
        SubtractFromColumn(tangent, 1, lu_.FirstSecond(edge));
      }
    };
    if (contact.b >= 0) {
      add(contact.normal_b, contact.tangent_b, rolling.row_b);
    }
    if (contact.a >= 0) {
      add(contact.normal_a, contact.tangent_a, rolling.row_a);
    }
  }
}

void ContactSystem::RegulariseContacts(const ContactProblem<double>& problem,
                                       const std::vector<ContactMode>& modes) {
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (contact_block_[i] < 0) {
      continue;
    }
    const ContactBlock<double>& c = problem.contacts[i];
    double* delta = &regularisation_[3 * static_cast<size_t>(contact_block_[i])];
    if (!c.driven) {
      delta[0] = fraction_ * RowMobility(problem.mass, c.a, c.normal_a, c.b, c.normal_b);
    }
    if (modes[i] == ContactMode::kSticking) {
      delta[1] = fraction_ * (c.limit_given ? give_ : 1.0) *
                 RowMobility(problem.mass, c.a, c.tangent_a, c.b, c.tangent_b);
    }
  }
}

bool ContactSystem::Factor(const ContactProblem<double>& problem,
                           const std::vector<ContactMode>& modes, double regularisation) {
  fraction_ = regularisation;
  const bool condensed = WorthCondensing(problem, modes);
  if (FactorAs(condensed, problem, modes)) {
    return true;
  }
  expansions_ += condensed ? 1 : 0;
  return condensed && FactorAs(false, problem, modes);
}

bool ContactSystem::FactorAs(bool condensed, const ContactProblem<double>& given,
                             const std::vector<ContactMode>& modes) {
  const bool spread = HasSpreadJoints(given);
  const ContactProblem<double> damped = spread ? WithJointDampers(given) : ContactProblem<double>();
  const ContactProblem<double>& problem = spread ? damped : given;
  condensed_ = condensed;
  SetPattern(problem, modes);
  lu_.SetZero();
  NarrowBlocks(problem);
  regularisation_.assign(3 * static_cast<size_t>(num_blocks_), 0.0);
  give_ = LargestGive(problem);
  RegulariseContacts(problem, modes);
  AddBodies(problem);
  AddJoints(problem, fraction_);
  if (condensed) {
    AddCondensedContacts({problem, modes, contact_block_, regularisation_}, first_contact_edge_,
                         &lu_);
  } else {
    AddContacts(problem, modes);
  }
  // A system that is factorised in the equivalent form is refined like a regularised one.
  regularised_ = spread || (problem.redundant_joints && !problem.joints.empty());
  for (const int block : contact_block_) {
    regularised_ = regularised_ || block >= 0;
  }
  masses_differ_ = MassesDiffer(problem);
  return lu_.Factor();
}

bool ContactSystem::Expand(double left, const ContactProblem<double>& problem,
                           const std::vector<ContactMode>& modes) {
  if (!condensed_ || left <= kStalled) {
    return false;
  }
  ++expansions_;
  if (FactorAs(false, problem, modes)) {
    return true;
  }
  FactorAs(true, problem, modes);
  return false;
}

template <bool kTransposed>
void ContactSystem::SolveOnce(const ContactProblem<double>& problem,
                              const std::vector<ContactMode>& modes, double* x, int columns) const {
  const ClosedContacts contacts = {problem, modes, contact_block_, regularisation_};
  if (condensed_) {
    CondenseRightHandSide<kTransposed>(contacts, x, columns);
  }
  const auto solve = kTransposed ? SolveTransposedByFactors : SolveByFactors;
  solve(lu_, problem, x, columns);
  if (condensed_) {
    RecoverImpulses<kTransposed>(contacts, x, columns);
  }
}

template <bool kTransposed>
double ContactSystem::RefinedSolve(const ContactProblem<double>& problem,
                                   const std::vector<ContactMode>& modes, double* x, int columns) {
  const size_t size = 3 * static_cast<size_t>(num_blocks()) * columns;
  rhs_.assign(x, x + size);
  SolveOnce<kTransposed>(problem, modes, x, columns);
  // The speeds of bodies that are held at rest are rounding: the residual of their rows is compared
  // with the speeds that they would have if they were free.
  const double left = Refine<kTransposed>(problem, modes, Regularisation::kLeftOut,
                                          {rhs_.data(), columns}, x, columns, kDerivativeGoal);
  if (Expand(left, problem, modes)) {
    std::copy(rhs_.begin(), rhs_.end(), x);
    return RefinedSolve<kTransposed>(problem, modes, x, columns);
  }
  return left;
}

double ContactSystem::Solve(const ContactProblem<double>& problem,
                            const std::vector<ContactMode>& modes, double* x, int columns) {
  if (!needs_problem()) {
    lu_.Solve(x, columns);
    return 0.0;
  }
  return RefinedSolve<false>(problem, modes, x, columns);
}

double ContactSystem::SolveTransposed(const ContactProblem<double>& problem,
                                      const std::vector<ContactMode>& modes, double* x,
                                      int columns) {
  if (!needs_problem()) {
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
  SolveOnce<false>(problem, modes, x, columns);
  const FreeMomenta free = {problem.scale_load().data(), 1};
  double left =
      Refine<false>(problem, modes, Regularisation::kKept, free, x, columns, kResidualGoal);
  if (Expand(left, problem, modes)) {
    std::copy(rhs_.begin(), rhs_.end(), x);
    SolveOnce<false>(problem, modes, x, columns);
    left = Refine<false>(problem, modes, Regularisation::kKept, free, x, columns, kResidualGoal);
  }
  return left;
}

// Whether impulses in the first column of x are so large.
bool ContactSystem::Squeezes(const ContactProblem<double>& problem, const double* x,
                             int columns) const {
  double momentum = 0.0;
  for (const double load : problem.scale_load()) {
    momentum = std::max(momentum, std::abs(load));
  }
  for (const int block : contact_block_) {
    if (block >= 0 &&
        std::abs(x[3 * static_cast<size_t>(block) * columns]) > kSqueezes * momentum) {
      return true;
    }
  }
  return false;
}

double ContactSystem::SolveWhole(const ContactProblem<double>& problem,
                                 const std::vector<ContactMode>& modes, const FreeMomenta& free,
                                 double* x, int columns) {
  const double fraction = std::exchange(fraction_, kWholeRegularisation);
  if (FactorAs(false, problem, modes)) {
    std::copy(rhs_.begin(), rhs_.end(), x);
    SolveOnce<false>(problem, modes, x, columns);
    const double left =
        Refine<false>(problem, modes, Regularisation::kLeftOut, free, x, columns, kResidualGoal);
    if (left <= kContradictory) {
      ++expansions_;
      return left;
    }
  }
  fraction_ = fraction;
  FactorAs(true, problem, modes);
  return HUGE_VAL;
}

double ContactSystem::SolveProximal(const ContactProblem<double>& problem,
                                    const std::vector<ContactMode>& modes, double* x, int columns,
                                    const std::function<bool()>& hopeless) {
  if (!regularised_) {
    return Solve(problem, modes, x, columns);
  }
  const size_t size = 3 * static_cast<size_t>(num_blocks()) * columns;
  rhs_.assign(x, x + size);
  SolveOnce<false>(problem, modes, x, columns);
  if (hopeless && hopeless()) {
    return HUGE_VAL;
  }
  const FreeMomenta free = {problem.scale_load().data(), 1};
  const double left =
      Refine<false>(problem, modes, Regularisation::kLeftOut, free, x, columns, kResidualGoal);
  if (left <= kContradictory) {
    return left;
  }
  if (condensed_ && (left > kStalled || Squeezes(problem, x, columns))) {
    // Rows of bodies that just fit between others depend on each other to a millionth, whose square
    // is lost beside δ. The whole system does not square it, and needs a smaller δ.
    const double whole = SolveWhole(problem, modes, free, x, columns);
    if (whole <= kContradictory) {
      return whole;
    }
  }
  ++regularised_steps_;
  std::copy(rhs_.begin(), rhs_.end(), x);
  SolveOnce<false>(problem, modes, x, columns);
  const double kept =
      Refine<false>(problem, modes, Regularisation::kKept, free, x, columns, kResidualGoal);
  if (Expand(kept, problem, modes)) {
    std::copy(rhs_.begin(), rhs_.end(), x);
    return SolveProximal(problem, modes, x, columns);
  }
  return Refine<false>(problem, modes, Regularisation::kLeftOut, free, x, columns, kResidualGoal);
}

// Refines x for the right-hand side rhs_ as long as a round halves the residual of some column.
template <bool kTransposed>
double ContactSystem::Refine(const ContactProblem<double>& problem,
                             const std::vector<ContactMode>& modes, Regularisation regularisation,
                             const FreeMomenta& free, double* x, int columns, double goal) {
  const size_t size = rhs_.size();
  SizeScratch(size, &correction_);
  Leased<RefinementScratch> lease;
  RefinementScratch& scratch = *lease;
  std::vector<ResidualSize>& sizes = scratch.sizes;
  std::vector<ResidualSize>& next_sizes = scratch.next_sizes;
  std::vector<char>& refined = scratch.refined;
  sizes.resize(columns);
  next_sizes.resize(columns);
  refined.assign(columns, 0);
  const auto residual = [&](std::vector<ResidualSize>* of_columns) {
    ResidualWith<kTransposed>(problem, modes, regularisation, free, rhs_.data(), x, columns,
                              correction_.data(), of_columns->data());
  };
  residual(&sizes);
  bool lessens = true;
  for (int i = 0; i < kMaxRefinements && lessens; ++i) {
    bool all_refined = true;
    // Rows that give more keep more of their proximal term than the others' rounding.
    const bool must = i == 0 && give_ > 1.0;
    for (int c = 0; c < columns; ++c) {
      refined[c] = refined[c] != 0 || !(must || sizes[c].ToParts() > goal) ? 1 : 0;
      all_refined = all_refined && refined[c] != 0;
    }
    if (all_refined) {
      break;
    }
    last_.assign(x, x + size);
    SolveOnce<kTransposed>(problem, modes, correction_.data(), columns);
    for (size_t k = 0; k < size; k += columns) {
      for (int c = 0; c < columns; ++c) {
        x[k + c] += refined[c] != 0 ? 0.0 : correction_[k + c];
      }
    }
    residual(&next_sizes);
    // For a derivative the first round is always kept.
    const bool derivative = goal < kResidualGoal;
    lessens = (derivative && i == 0) || must;
    for (int c = 0; c < columns; ++c) {
      const double before = sizes[c].ToParts();
      const double left = next_sizes[c].ToParts();
      const bool halves = refined[c] == 0 && left < 0.5 * before;
      lessens = lessens || (halves && before > kResidualGoal);
      // The contradictory part of redundant rows does not fall, nor does rounding; neither must
      // prevent the rest of the column from being improved.
      const bool stays = (derivative || must) && left <= std::max(kStays * before, kResidualGoal);
      if (refined[c] != 0 || halves || stays) {
        sizes[c] = next_sizes[c];
        continue;
      }
      refined[c] = 1;
      for (size_t k = c; k < size; k += columns) {
        x[k] = last_[k];
      }
    }
  }
  ResidualSize all;
  for (int c = 0; c < columns; ++c) {
    if (masses_differ_ && sizes[c].ToParts() > kContradictory) {
      RefineConjugate<kTransposed>(problem, modes, regularisation, free, x, columns, c, &scratch);
    }
    all.Include(sizes[c]);
  }
  return all.ToParts();
}

template void ContactSystem::SolveOnce<false>(const ContactProblem<double>&,
                                              const std::vector<ContactMode>&, double*, int) const;
template void ContactSystem::SolveOnce<true>(const ContactProblem<double>&,
                                             const std::vector<ContactMode>&, double*, int) const;

}  // namespace tangible
