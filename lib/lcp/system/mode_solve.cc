// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/mode_solve.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace tangible {
namespace {

// From this number of closed contacts on a solve for values is refined to rounding and no further:
// the rounds beyond, which serve sums of derivatives, are a large part of the time of a pile.
constexpr long kLeastContactsToRounding = 12;

}  // namespace

void ModeSolve::Reserve(size_t rows) {
  for (std::vector<double>* x : {&rhs_, &start_, &x_}) {
    x->reserve(rows);
  }
}

// The contacts whose impulses start_ + x_ are plainly beyond their limits.
int ModeSolve::CountBeyond(const ContactProblem<double>& problem,
                           const std::vector<ContactMode>& modes,
                           const std::vector<int>& block_of) const {
  const auto normal_of = [&](size_t i) {
    const size_t row = 3 * static_cast<size_t>(block_of[i]);
    return start_[row] + x_[row];
  };
  double largest = 0.0;
  for (size_t i = 0; i < modes.size(); ++i) {
    largest = block_of[i] < 0 ? largest : std::max(largest, std::abs(normal_of(i)));
  }
  const double plainly = kPlainlyBeyond * largest;
  int beyond = 0;
  for (size_t i = 0; i < modes.size(); ++i) {
    if (block_of[i] < 0) {
      continue;
    }
    const size_t row = 3 * static_cast<size_t>(block_of[i]);
    const double normal = normal_of(i);
    const bool pulls = normal < -plainly;
    const bool slips =
        modes[i] == ContactMode::kSticking &&
        std::abs(start_[row + 1] + x_[row + 1]) > problem.contacts[i].friction * normal + plainly;
    beyond += pulls || slips ? 1 : 0;
  }
  return beyond;
}

bool ModeSolve::Solve(const ContactProblem<double>& problem, const ContactSolution<double>* centre,
                      ContactSystem* system, ContactSolution<double>* solution, int most_beyond) {
  const std::vector<ContactMode>& modes = solution->modes;
  if (!system->Factor(problem, modes)) {
    return false;
  }
  const size_t first_joint = 3 * static_cast<size_t>(problem.num_bodies);
  const size_t num_joint_rows = 3 * problem.joints.size();
  const std::vector<int>& block_of = system->contact_block();
  const auto sticks = [&](size_t i) { return modes[i] == ContactMode::kSticking; };
  std::vector<double>& rhs = centre != nullptr ? rhs_ : x_;
  rhs.assign(3 * static_cast<size_t>(system->num_blocks()), 0.0);
  if (centre != nullptr) {
    start_.assign(rhs.size(), 0.0);
  }
  std::copy(problem.load.begin(), problem.load.end(), rhs.begin());
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    const size_t row = first_joint + 3 * j;
    std::copy_n(problem.joints[j].rhs, problem.joints[j].rows, &rhs[row]);
    if (centre != nullptr) {
      std::copy_n(&centre->joint_impulse[3 * j], 3, &start_[row]);
    }
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (block_of[i] < 0) {
      continue;
    }
    const ContactBlock<double>& contact = problem.contacts[i];
    const size_t row = 3 * static_cast<size_t>(block_of[i]);
    const double driven = contact.rolls ? 0.0 : contact.offset;
    rhs[row] = contact.driven ? driven : -contact.c_n;
    rhs[row + 1] = sticks(i) ? -contact.c_t : 0.0;
    if (centre != nullptr) {
      start_[row] = contact.driven ? driven : centre->normal_impulse[i];
      start_[row + 1] = sticks(i) ? centre->tangent_impulse[i] : 0.0;
    }
  }
  if (centre != nullptr) {
    // The solution is x0 + K⁻¹ (rhs − K x0).
    x_.resize(rhs_.size());
    system->Residual<false>(problem, modes, rhs_.data(), start_.data(), 1, x_.data());
    const bool may_give_up = most_beyond < std::numeric_limits<int>::max();
    const auto hopeless = [&] {
      return may_give_up && CountBeyond(problem, modes, block_of) > most_beyond;
    };
    const double left = system->SolveProximal(problem, modes, x_.data(), 1, std::cref(hopeless));
    if (std::isinf(left)) {
      return false;
    }
    for (size_t i = 0; i < x_.size(); ++i) {
      x_[i] += start_[i];
    }
  } else if (std::count_if(block_of.begin(), block_of.end(),
                           [](int block) { return block >= 0; }) >= kLeastContactsToRounding) {
    system->SolveProximal(problem, modes, x_.data(), 1);
  } else {
    system->Solve(problem, modes, x_.data(), 1);
  }
  const auto joints = x_.begin() + static_cast<std::ptrdiff_t>(first_joint);
  solution->motion.assign(x_.begin(), joints);
  solution->joint_impulse.assign(joints, joints + static_cast<std::ptrdiff_t>(num_joint_rows));
  solution->normal_impulse.assign(problem.contacts.size(), 0.0);
  solution->tangent_impulse.assign(problem.contacts.size(), 0.0);
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (block_of[i] < 0) {
      continue;
    }
    const size_t row = 3 * static_cast<size_t>(block_of[i]);
    const bool rolls = problem.contacts[i].rolls;
    solution->normal_impulse[i] = rolls ? solution->normal_impulse[i - 1] : x_[row];
    if (sticks(i)) {
      solution->tangent_impulse[i] = x_[row + 1];
    } else if (SlidingSign(modes[i]) != 0.0) {
      solution->tangent_impulse[i] =
          -SlidingSign(modes[i]) * problem.contacts[i].friction * solution->normal_impulse[i];
    }
  }
  return true;
}

}  // namespace tangible
