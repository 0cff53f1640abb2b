// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/contact_coupling.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/model/lengths.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/events/coupled_contacts.h"

namespace tangible {
namespace {

class Sets {
 public:
  Sets(const std::vector<ActiveContact>& first, const std::vector<ActiveContact>& second,
       const std::vector<ActiveContact>& others, FrictionOfFirst friction)
      : friction_(friction),
        first_(first.size()),
        both_(first.size() + second.size()),
        contacts_(first) {
    contacts_.insert(contacts_.end(), second.begin(), second.end());
    contacts_.insert(contacts_.end(), others.begin(), others.end());
  }

  bool Act(const Model<double>& model, const State<double>& state, double t) const {
    std::vector<CoefficientSource> friction;
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const bool is_left_out = i < first_ && friction_ == FrictionOfFirst::kLeftOut;
      friction.push_back(is_left_out ? CoefficientSource() : FrictionOf(model, contacts_[i]));
    }
    const std::vector<CoefficientSource> restitution(contacts_.size());
    ContactProblem<double> problem;
    AssemblyScratch<double> scratch;
    AssembleWithoutContacts(model, state, t, 0.0, &problem, &scratch);
    AssembleContacts(model, state, 0.0, contacts_, friction, restitution, &scratch, &problem);
    std::vector<bool> wanted(contacts_.size(), false);
    std::fill(wanted.begin(), wanted.begin() + static_cast<std::ptrdiff_t>(both_), true);
    const std::vector<int> groups = GroupsOfContacts(problem, wanted);
    for (size_t i = 0; i < first_; ++i) {
      for (size_t k = first_; k < both_; ++k) {
        if (groups[i] == groups[k]) return true;
      }
    }
    return false;
  }

 private:
  FrictionOfFirst friction_;
  size_t first_, both_;
  std::vector<ActiveContact> contacts_;
};

// Deterministic changes between 1/2 and 1 of either sign, no two of them alike.
class Changes {
 public:
  double Next() {
    constexpr double kGolden = 0.6180339887498949;
    place_ = std::fmod(place_ + kGolden, 1.0);
    return place_ < 0.5 ? place_ - 1.0 : place_;
  }

 private:
  double place_ = 0.0;
};

double SizeOf(const Model<double>& model, int body) {
  const double radius = RadiusOf(model, body);
  return radius > 0.0 && std::isfinite(radius) ? radius : 1.0;
}

// Moves the moving bodies by small changes that joints allow: those nearest to the given ones, by
// the metric of the masses.
void MoveBodies(const Model<double>& model, double t, Changes* changes, State<double>* state) {
  ContactProblem<double> problem;
  AssemblyScratch<double> scratch;
  AssembleWithoutContacts(model, *state, t, 0.0, &problem, &scratch);
  ContactSystem system;
  if (!system.Factor(problem, {})) return;
  std::vector<double> x(3 * static_cast<size_t>(system.num_blocks()), 0.0);
  const std::vector<int>& moving = model.structure->moving;
  for (size_t block = 0; block < moving.size(); ++block) {
    const double size = SizeOf(model, moving[block]);
    for (size_t i = 0; i < 3; ++i) {
      x[3 * block + i] =
          problem.mass[3 * block + i] * kFeatureMargin * changes->Next() * (i < 2 ? size : 1.0);
    }
  }
  system.Solve(problem, {}, x.data(), 1);
  for (size_t block = 0; block < moving.size(); ++block) {
    for (size_t i = 0; i < 3; ++i) {
      state->pose[3 * static_cast<size_t>(moving[block]) + i] += x[3 * block + i];
    }
  }
}

}  // namespace

Coupling CouplingOf(const Model<double>& model, const State<double>& state, double t,
                    const std::vector<ActiveContact>& first,
                    const std::vector<ActiveContact>& second,
                    const std::vector<ActiveContact>& others, const RowMatrixXd& directions,
                    FrictionOfFirst friction) {
  const ModelStructure& s = *model.structure;
  const Sets sets(first, second, others, friction);
  if (sets.Act(model, state, t)) return Coupling::kActs;
  const auto varies = [&](int variable) {
    return directions.cols() > 0 && directions.row(variable).cwiseAbs().maxCoeff() > 0.0;
  };
  Model<double> other = model;
  State<double> beside = state;
  Changes changes;
  MoveBodies(model, t, &changes, &beside);
  for (int body = 0; body < s.num_bodies(); ++body) {
    const double size = SizeOf(model, body);
    for (int i = 0; i < 3 && s.bodies[body].block < 0; ++i) {
      const double change = kFeatureMargin * changes.Next() * (i < 2 ? size : 1.0);
      if (varies(s.PoseVariable(body, i)) || varies(s.TwistVariable(body, i))) {
        beside.pose[s.PoseVariable(body, i)] += change;
      }
    }
  }
  for (int number = 0; number < static_cast<int>(other.parameters.size()); ++number) {
    double& value = other.parameters[number];
    const double change = kFeatureMargin * changes.Next() * (value != 0.0 ? std::abs(value) : 1.0);
    if (varies(s.ParameterVariable(number))) value += change;
  }
  return sets.Act(other, beside, t) ? Coupling::kBeside : Coupling::kNone;
}

}  // namespace tangible
