// SPDX-License-Identifier: Apache-2.0
//
// What redundant contacts leave undetermined: the motion, or its derivative by their friction.

#include "tangible/lcp/system/contact_conditioning.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {
namespace {

// The change of a coefficient along a column of directions.
double ChangeOf(const ModelStructure& s, const CoefficientSource& source,
                const RowMatrixXd& directions, Eigen::Index column) {
  double change = 0.0;
  for (int k = 0; k < 2; ++k) {
    if (source.numbers[k] < 0) continue;
    change += source.derivatives[k] * directions(s.ParameterVariable(source.numbers[k]), column);
  }
  return change;
}

// Moves the friction of the contacts that slide along a column, the largest change being a share of
// the largest coefficient. False: it changes none.
bool MoveFriction(const ModelStructure& s, const std::vector<CoefficientSource>& friction,
                  const std::vector<ContactMode>& modes, const RowMatrixXd& directions,
                  Eigen::Index column, ContactProblem<double>* problem) {
  constexpr double kShare = 0.0625;
  std::vector<double> changes(problem->contacts.size(), 0.0);
  double largest = 0.0;
  double coefficient = 0.0;
  for (size_t i = 0; i < changes.size(); ++i) {
    if (SlidingSign(modes[i]) == 0.0) continue;
    changes[i] = ChangeOf(s, friction[i], directions, column);
    largest = std::max(largest, std::abs(changes[i]));
    coefficient = std::max(coefficient, problem->contacts[i].friction);
  }
  if (!(largest > 0.0)) return false;
  for (size_t i = 0; i < changes.size(); ++i) {
    problem->contacts[i].friction += kShare * coefficient * changes[i] / largest;
  }
  return true;
}

}  // namespace

// Contacts that slide with equal friction may share their load in any way, and their friction has
// one sum. With the friction of some of them changed it has many.
void RolloutCertifier::AddRedundancy(const ModelStructure& s, const ContactProblem<double>& problem,
                                     const std::vector<ContactMode>& modes,
                                     const std::vector<CoefficientSource>& friction) {
  if (CountUndeterminedMotions(problem, modes) > 0) return OneSided(kUndeterminedMotion);
  const RowMatrixXd& directions = Directions();
  for (Eigen::Index column = 0; column < directions.cols(); ++column) {
    ContactProblem<double> moved = problem;
    if (MoveFriction(s, friction, modes, directions, column, &moved) &&
        CountUndeterminedMotions(moved, modes) > 0) {
      return OneSided(kUndeterminedFriction);
    }
  }
}

}  // namespace tangible
