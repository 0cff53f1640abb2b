// SPDX-License-Identifier: Apache-2.0
//
// The entries of ∂R/∂w at each level, by both routes, against differences of the residual.
#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

constexpr double kStep = 0.01;

// Bodies in every joint type, a spring, forces, a limit, contacts of boxes, discs and planes.
std::string Everything() {
  return R"({"bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1],
       "velocity": [1, 0.1], "angular_velocity": 2, "friction": 0.3, "linear_damping": 0.1},
      {"name": "crate", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [-1.5, 0.15],
       "angle": 0.2, "velocity": [0.3, -0.2], "angular_velocity": -0.7, "friction": 0.4},
      {"name": "tri", "shape": {"polygon": {"vertices": [[-0.2, -0.1], [0.2, -0.1], [0, 0.2]]}},
       "mass": 0.7, "position": [-1.4, 0.5], "angle": 0.3, "velocity": [0.1, 0.2],
       "angular_velocity": 0.4, "friction": 0.2},
      {"name": "rod", "mass": 0.5, "inertia": 0.02, "position": [1.3, 0.9], "velocity": [0, -0.05],
       "angular_velocity": -0.2},
      {"name": "slider", "mass": 0.4, "inertia": 0.01, "position": [2, 1], "velocity": [0.2, 0.1]},
      {"name": "tip", "mass": 0.3, "inertia": 0.01, "position": [1.6, 0.9], "velocity": [0, 0.3],
       "angular_velocity": 0.2},
      {"name": "floor", "static": true, "friction": 0.3,
       "shape": {"half_plane": {"normal": [0.1, 1], "offset": 0}}},
      {"name": "hand", "mass": 0.2, "inertia": 0.02, "position": [1.9, 1.2], "angle": 0.4,
       "velocity": [0.1, -0.3], "angular_velocity": 1.2},
      {"name": "crank", "kinematic": true, "position": [2.4, 1.3], "angle": 0.1,
       "velocity": [0.2, 0.1], "angular_velocity": -0.9}],
    "joints": [
      {"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [1.05, 0.9],
       "damping": 0.1, "limits": [-1.5, 2], "effort": 0.05},
      {"name": "rail", "type": "prismatic", "bodies": ["slider", "rod"], "anchor": [1.8, 1],
       "axis": [1, 0.3], "damping": 0.2, "effort": 0.1},
      {"name": "guide", "type": "prismatic", "bodies": ["slider", "crank"], "anchor": [2.2, 0.9],
       "axis": [-0.4, 1], "damping": 0.15, "effort": -0.1},
      {"name": "rod_guide", "type": "prismatic", "bodies": ["crank", "hand"], "anchor": [2.1, 1.1],
       "axis": [0.6, 1], "damping": 0.05, "effort": 0.3},
      {"name": "elbow", "type": "revolute", "bodies": ["hand", "tip"], "anchor": [1.7, 1.1],
       "damping": 0.3, "effort": -0.2},
      {"name": "wrist", "type": "revolute", "bodies": ["crank", "hand"], "anchor": [2.2, 1.25],
       "damping": 0.2},
      {"name": "wire", "type": "distance", "bodies": ["tip", "rod"], "anchors": [[1.6, 0.9], [1.4, 0.8]]}],
    "springs": [{"name": "s", "bodies": ["rod", "tip"], "anchors": [[1.5, 0.9], [1.6, 1.1]],
                 "stiffness": 5, "damping": 0.3, "rest_length": 0.1}],
    "forces": [{"name": "push", "body": "crate", "force": [1, 0.2], "torque": 0.01, "at": [0.1, 0.02]}],
    "simulation": {"joint_correction": "projection"}})";
}

struct Case {
  Level level;
  JacobianRoute route;
};

class EquationLevelsTest : public ::testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    BuildModel(test_scenes::SceneOf(Everything()), &model_, &state_);
    const auto add = [&](int a, int b, ContactMode mode) {
      ContactFeature features[2];
      const int count = FindContactFeatures(model_.Shape(a), state_.PoseOf(a), model_.Shape(b),
                                            state_.PoseOf(b), 10.0, features);
      ASSERT_GT(count, 0);
      ActiveContact contact;
      contact.a = a;
      contact.b = b;
      contact.feature = features[0];
      contact.law = ContactLaw::kInelastic;
      contacts_.push_back(contact);
      friction_.push_back(MixedFriction(model_, a, b));
      restitution_.push_back(MixedRestitution(model_, a, b));
      modes_.push_back(mode);
    };
    add(0, 6, ContactMode::kSticking);
    add(1, 6, ContactMode::kSlidingPositive);
    add(1, 2, ContactMode::kSlidingNegative);
    ActiveContact limit;
    limit.a = model_.structure->joints[0].a;
    limit.b = model_.structure->joints[0].b;
    limit.joint = 0;
    limit.side = -1.0;
    limit.law = ContactLaw::kInelastic;
    contacts_.push_back(limit);
    friction_.emplace_back();
    restitution_.emplace_back();
    modes_.push_back(ContactMode::kClosed);
  }

  // Assembles at the variables w = [poses | twists | parameters | t].
  void Assemble(const std::vector<double>& w, ContactProblem<double>* problem) {
    const int n = 3 * model_.structure->num_bodies();
    Model<double> model{model_.structure, {}};
    State<double> state;
    state.pose.assign(w.begin(), w.begin() + n);
    state.twist.assign(w.begin() + n, w.begin() + 2 * n);
    model.parameters.assign(w.begin() + 2 * n, w.end() - 1);
    AssemblyScratch<double> scratch;
    if (GetParam().level == Level::kVelocity) {
      AssembleWithoutContacts(model, state, 0.5, kStep, problem, &scratch);
      AssembleContacts(model, state, kStep, contacts_, friction_, restitution_, &scratch, problem);
    } else if (GetParam().level == Level::kCorrection) {
      AssembleCorrection(model, state, contacts_, friction_, 1.0, &scratch, problem);
    } else {
      AssembleAcceleration(model, state, w.back(), 0.5, contacts_, friction_, &scratch, problem);
    }
    // Coefficients follow the numbers they are mixed from.
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const CoefficientSource& source = friction_[i];
      problem->contacts[i].friction = source.value;
      for (int k = 0; k < 2; ++k) {
        if (source.numbers[k] >= 0) {
          problem->contacts[i].friction +=
              source.derivatives[k] *
              (model.parameters[source.numbers[k]] - model_.parameters[source.numbers[k]]);
        }
      }
    }
  }

  // R(x; w) at fixed x.
  std::vector<double> Residual(const ContactProblem<double>& p,
                               const ContactSolution<double>& s) const {
    std::vector<double> r(3 * (p.num_bodies + p.joints.size() + p.contacts.size()), 0.0);
    for (int i = 0; i < 3 * p.num_bodies; ++i) {
      r[i] = p.mass[i] * s.motion[i] - p.load[i];
    }
    for (const DamperBlock<double>& d : p.dampers) {
      AddRowTransposed(d.a, d.row_a, d.b, d.row_b,
                       d.weight * RowDot(d.a, d.row_a, d.b, d.row_b, s.motion.data()), r.data());
    }
    for (size_t j = 0; j < p.joints.size(); ++j) {
      const JointBlock<double>& joint = p.joints[j];
      for (int k = 0; k < joint.rows; ++k) {
        AddRowTransposed(joint.a, joint.row_a[k], joint.b, joint.row_b[k],
                         -s.joint_impulse[3 * j + k], r.data());
        r[3 * (p.num_bodies + j) + k] =
            RowDot(joint.a, joint.row_a[k], joint.b, joint.row_b[k], s.motion.data()) -
            joint.rhs[k];
      }
    }
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      const ContactBlock<double>& c = p.contacts[i];
      const size_t row = 3 * (p.num_bodies + p.joints.size() + i);
      const double normal = s.normal_impulse[i];
      const double tangent = modes_[i] == ContactMode::kSticking
                                 ? s.tangent_impulse[i]
                                 : -SlidingSign(modes_[i]) * c.friction * normal;
      AddRowTransposed(c.a, c.normal_a, c.b, c.normal_b, -normal, r.data());
      AddRowTransposed(c.a, c.tangent_a, c.b, c.tangent_b, -tangent, r.data());
      r[row] = RowDot(c.a, c.normal_a, c.b, c.normal_b, s.motion.data()) + c.c_n;
      if (modes_[i] == ContactMode::kSticking) {
        r[row + 1] = RowDot(c.a, c.tangent_a, c.b, c.tangent_b, s.motion.data()) + c.c_t;
      }
    }
    return r;
  }

  Model<double> model_;
  State<double> state_;
  std::vector<ActiveContact> contacts_;
  std::vector<CoefficientSource> friction_, restitution_;
  std::vector<ContactMode> modes_;
};

TEST_P(EquationLevelsTest, EntriesAreTheDifferencesOfTheResidual) {
  const ModelStructure& s = *model_.structure;
  std::vector<double> w = state_.pose;
  w.insert(w.end(), state_.twist.begin(), state_.twist.end());
  w.insert(w.end(), model_.parameters.begin(), model_.parameters.end());
  w.push_back(0.5);
  ContactProblem<double> problem;
  Assemble(w, &problem);
  ContactSolution<double> solution;
  solution.modes = modes_;
  for (int i = 0; i < 3 * s.num_blocks(); ++i) {
    solution.motion.push_back(std::sin(1.0 + i));
  }
  for (size_t i = 0; i < 3 * s.joints.size(); ++i) {
    solution.joint_impulse.push_back(std::cos(2.0 + i));
  }
  for (size_t i = 0; i < contacts_.size(); ++i) {
    solution.normal_impulse.push_back(1.0 + i);
    solution.tangent_impulse.push_back(modes_[i] == ContactMode::kSticking
                                           ? 0.2
                                           : -SlidingSign(modes_[i]) * friction_[i].value *
                                                 solution.normal_impulse[i]);
  }
  ContactSystem system;
  ASSERT_TRUE(system.Factor(problem, modes_));
  SolvedEquations view;
  view.level = GetParam().level;
  view.instant.t = 0.5;
  view.instant.h = kStep;
  view.instant.time = 0.5;
  view.instant.middle = 0.5;
  view.restitution = &restitution_;
  // Of all bodies: of a step the new twists, those of prescribed motion too.
  std::vector<double> new_twist = state_.twist;
  for (int k = 0; k < s.num_blocks(); ++k) {
    std::copy_n(&solution.motion[3 * k], 3, &new_twist[3 * s.moving[k]]);
  }
  view.new_twist = &new_twist;
  view.state = &state_;
  view.contacts = &contacts_;
  view.friction = &friction_;
  view.problem = &problem;
  view.solution = &solution;
  view.contact_block = &system.contact_block();
  LocalJacobianScratch scratch;
  std::vector<JacobianEntry> entries;
  VisitJacobian(model_, view, GetParam().route, &scratch, EntryListSink{&entries});
  const int rows = 3 * system.num_blocks();
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows, w.size());
  for (const JacobianEntry& entry : entries) {
    jacobian(entry.row, entry.variable) += entry.value;
  }
  const int statics = 3 * 6;  // the floor's pose and twist rows: twists of static bodies are 0
  int checked = 0;
  for (size_t k = 0; k < w.size(); ++k) {
    const int twist = static_cast<int>(k) - 3 * s.num_bodies();
    const int world = 3 * s.world();
    const bool of_world = static_cast<int>(k) >= world && static_cast<int>(k) < world + 3;
    if (of_world || (twist >= statics && twist < 3 * s.num_bodies())) {
      continue;
    }
    const double h = 1e-6;
    ContactProblem<double> plus, minus;
    std::vector<double> moved = w;
    moved[k] += h;
    Assemble(moved, &plus);
    moved[k] -= 2.0 * h;
    Assemble(moved, &minus);
    const std::vector<double> above = Residual(plus, solution);
    const std::vector<double> below = Residual(minus, solution);
    for (int r = 0; r < rows; ++r) {
      const double difference = (above[r] - below[r]) / (2.0 * h);
      EXPECT_NEAR(jacobian(r, k), difference, 2e-8 * (1.0 + std::abs(difference)))
          << "row " << r << " variable " << k;
      checked += std::abs(difference) > 1e-6 ? 1 : 0;
    }
  }
  EXPECT_GT(checked, GetParam().level == Level::kCorrection ? 80 : 200);
}

INSTANTIATE_TEST_SUITE_P(Levels, EquationLevelsTest,
                         ::testing::Values(Case{Level::kVelocity, JacobianRoute::kByHand},
                                           Case{Level::kVelocity, JacobianRoute::kGeneric},
                                           Case{Level::kAcceleration, JacobianRoute::kByHand},
                                           Case{Level::kAcceleration, JacobianRoute::kGeneric},
                                           Case{Level::kCorrection, JacobianRoute::kByHand},
                                           Case{Level::kCorrection, JacobianRoute::kGeneric}),
                         [](const auto& kind) {
                           const Level level = kind.param.level;
                           const std::string name = level == Level::kVelocity       ? "velocity"
                                                    : level == Level::kAcceleration ? "acceleration"
                                                                                    : "correction";
                           return name + (kind.param.route == JacobianRoute::kByHand ? "_by_hand"
                                                                                     : "_generic");
                         });

}  // namespace
}  // namespace tangible
