// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/coverage.h"

#include <utility>

#include "tangible/geometry/outline.h"
#include "tangible/scene/scene_names.h"
#include "tangible/simulation/stepping/step.h"
#include "tangible/verification/support/coincidences.h"

namespace tangible {
namespace {

std::string PairName(ShapeType a, ShapeType b) {
  if (b < a) {
    std::swap(a, b);
  }
  return "contact " + NameOf(a, kShapeTypeNames) + ", " + NameOf(b, kShapeTypeNames);
}

bool IsConcave(const BasicShape<double>& shape) {
  return IsConcavePolygon(
      {shape.type, shape.numbers.data(), static_cast<int>(shape.numbers.size())});
}

void CoverContacts(const Scene& scene, const RunTrace& run, Coverage* coverage) {
  for (const std::vector<ContactTrace>& step : run.steps) {
    for (const ContactTrace& trace : step) {
      if (trace.event != EventKind::kStepEnd) {
        (*coverage)[std::string("event: ") + NameOf(trace.event)] = 1;
        continue;
      }
      const ActiveContact& c = trace.contact;
      if (c.joint >= 0) {
        (*coverage)["limit of a " + NameOf(scene.joints[c.joint].type, kJointTypeNames)] = 1;
      } else {
        // The parts after a body's contact points are edges of its outline.
        const auto is_point_of = [&](int body, int part) {
          return part > 0 && part <= static_cast<int>(scene.bodies[body].contact_points.size());
        };
        const bool is_point =
            is_point_of(c.a, c.feature.part_a) || is_point_of(c.b, c.feature.part_b);
        if (IsConcave(scene.bodies[c.a].shape) || IsConcave(scene.bodies[c.b].shape)) {
          (*coverage)["outline of a concave polygon"] = 1;
        }
        (*coverage)[is_point
                        ? "point fixed in a body"
                        : PairName(scene.bodies[c.a].shape.type, scene.bodies[c.b].shape.type)] = 1;
      }
    }
  }
  const std::pair<const char*, int> regimes[] = {{"friction sliding", run.sliding},
                                                 {"friction sticking", run.sticking},
                                                 {"impact", run.impacts},
                                                 {"recovery from penetration", run.recoveries},
                                                 {"kink within 1e-7", run.degenerate}};
  for (const auto& [name, count] : regimes) {
    if (count > 0) {
      (*coverage)[name] = 1;
    }
  }
}

void CoverForces(const Scene& scene, Coverage* coverage) {
  const auto cover = [&](bool has, const char* what) {
    if (has) {
      (*coverage)[what] = 1;
    }
  };
  for (const BasicForce<double>& force : scene.forces) {
    cover(!force.force_signal, "force");
    cover(force.torque != 0.0, "torque");
    cover(force.start.has_value(), "start of a force's window");
    cover(force.end.has_value(), "end of a force's window");
    cover(force.force_signal.has_value(), "force from a series");
    cover(force.torque_signal.has_value(), "torque from a series");
    cover(force.force_servos[0] || force.force_servos[1] || force.torque_servo, "servo of a force");
  }
  for (const BasicJoint<double>& joint : scene.joints) {
    cover(joint.effort != 0.0, "effort");
    cover(joint.effort_signal.has_value(), "effort from a series");
    cover(joint.damping > 0.0, "damping of a joint");
    cover(joint.stiffness.has_value(), "spring of a joint");
    cover(joint.friction.has_value(), "friction in a joint");
    cover(joint.kinetic_friction.has_value(), "friction that decays");
    cover(joint.motor.has_value(), "motor");
    cover(joint.effort_servo.has_value(), "servo of a joint");
    cover(joint.limit_restitution.has_value(), "restitution of a limit");
    cover(joint.type == JointType::kDistance && joint.limits, "rope");
    cover(joint.type == JointType::kCoupling && joint.limits, "coupling with limits");
    cover(joint.until.has_value(), "end of a joint");
  }
  cover(!scene.springs.empty(), "spring");
  cover(scene.gravity.isZero(), "no gravity");
}

}  // namespace

Coverage CoverageOf(const Scene& scene, const RunTrace& run) {
  Coverage coverage;
  int moving = 0;
  for (const BasicBody<double>& body : scene.bodies) {
    moving += body.motion == Motion::kMoving ? 1 : 0;
    if (body.motion == Motion::kKinematic) {
      coverage["kinematic body"] = 1;
    }
    if (body.linear_damping > 0.0 || body.angular_damping > 0.0) {
      coverage["damping of a body"] = 1;
    }
    if (body.quadratic_drag) {
      coverage["drag of a body"] = 1;
    }
    if (body.support) {
      coverage[body.support->radius           ? "support of a disc"
               : body.support->points.empty() ? "support of a centre"
                                              : "support of points"] = 1;
    }
    if (body.kinetic_friction) {
      coverage["friction of a body that decays"] = 1;
    }
    if (body.rolling_friction) coverage["rolling friction of a body"] = 1;
  }
  coverage["bodies " + std::to_string(moving)] = 1;
  const SimulationSettings& settings = scene.simulation;
  const long steps = NumSteps(settings);
  coverage[steps <= 2 ? "steps 1 to 2" : steps <= 40 ? "steps 3 to 40" : "steps 41 to 200"] = 1;
  coverage["stepping " + NameOf(settings.stepping, kSteppingNames)] = 1;
  coverage["integrator " + NameOf(IntegratorOf(settings), kIntegratorNames)] = 1;
  coverage["impact law " + NameOf(settings.impact_law, kImpactLawNames)] = 1;
  coverage["joint correction " + NameOf(JointCorrectionOf(settings), kJointCorrectionNames)] = 1;
  coverage["mixing of friction " + NameOf(settings.friction_mixing, kMixingNames)] = 1;
  coverage["mixing of restitution " + NameOf(settings.restitution_mixing, kMixingNames)] = 1;
  for (const BasicJoint<double>& joint : scene.joints) {
    coverage["joint " + NameOf(joint.type, kJointTypeNames)] = 1;
  }
  if (!scene.pairs.empty()) {
    coverage["coefficients of a pair"] = 1;
  }
  CoverContacts(scene, run, &coverage);
  CoverForces(scene, &coverage);
  return coverage;
}

void Add(const Coverage& one, Coverage* sum) {
  for (const auto& [what, count] : one) {
    (*sum)[what] += count;
  }
}

std::vector<std::string> ExpectedCoverage() {
  std::vector<std::string> expected;
  for (const auto& [name_a, a] : kShapeTypeNames) {
    for (const auto& [name_b, b] : kShapeTypeNames) {
      // Two half-planes or splines are left out, because neither moves; random scenes draw no
      // polylines, whose derivatives have tests of their own
      // (tests/simulation/gradient/polylines_test.cc).
      const bool drawn = a != ShapeType::kPolyline && b != ShapeType::kPolyline;
      const auto stays = [](ShapeType type) {
        return type == ShapeType::kHalfPlane || type == ShapeType::kSpline;
      };
      if (drawn && a <= b && !(stays(a) && stays(b))) {
        expected.push_back(PairName(a, b));
      }
    }
  }
  expected.push_back("outline of a concave polygon");
  for (const auto& [name, type] : kJointTypeNames) {
    expected.push_back("joint " + std::string(name));
  }
  for (const auto& [name, mixing] : kMixingNames) {
    expected.push_back("mixing of friction " + std::string(name));
    expected.push_back("mixing of restitution " + std::string(name));
  }
  for (const auto& [name, law] : kImpactLawNames) {
    expected.push_back("impact law " + std::string(name));
  }
  for (const auto& [name, correction] : kJointCorrectionNames) {
    expected.push_back("joint correction " + std::string(name));
  }
  for (int bodies = 1; bodies <= 8; ++bodies) {
    expected.push_back("bodies " + std::to_string(bodies));
  }
  for (const char* what : {"limit of a revolute",
                           "limit of a prismatic",
                           "friction sliding",
                           "friction sticking",
                           "impact",
                           "recovery from penetration",
                           "force",
                           "torque",
                           "start of a force's window",
                           "end of a force's window",
                           "force from a series",
                           "torque from a series",
                           "effort",
                           "effort from a series",
                           "damping of a joint",
                           "damping of a body",
                           "spring of a joint",
                           "friction in a joint",
                           "friction that decays",
                           "coupling with limits",
                           "end of a joint",
                           "point fixed in a body",
                           "drag of a body",
                           "spring",
                           "no gravity",
                           "coefficients of a pair",
                           "kinematic body",
                           "steps 1 to 2",
                           "steps 3 to 40",
                           "steps 41 to 200"}) {
    expected.emplace_back(what);
  }
  return expected;
}

bool HasCoincidences(const Coverage& coverage) {
  const auto first = coverage.lower_bound(kCoincidencePrefix);
  return first != coverage.end() && first->first.rfind(kCoincidencePrefix, 0) == 0;
}

std::vector<std::string> MissingCoverage(const Coverage& coverage) {
  std::vector<std::string> missing;
  std::vector<std::string> expected = ExpectedCoverage();
  if (HasCoincidences(coverage)) {
    const std::vector<std::string>& kinds = CoincidenceKinds();
    expected.insert(expected.end(), kinds.begin(), kinds.end());
  }
  for (std::string& what : expected) {
    if (coverage.count(what) == 0) {
      missing.push_back(std::move(what));
    }
  }
  return missing;
}

}  // namespace tangible
