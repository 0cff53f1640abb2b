// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/support_slacks.h"

#include <cmath>

#include "tangible/dynamics/elements/support.h"

namespace tangible {

namespace {

SupportSlack SlackOf(const ModelStructure& structure, size_t support) {
  SupportSlack slack;
  slack.support = static_cast<int>(support);
  slack.contact.a = structure.supports[support].body;
  slack.contact.b = structure.world();
  slack.contact.is_support = true;
  return slack;
}

// Of a body that is held as a whole, by the forces of its rows.
void SetReserve(const SupportFriction& friction, const double* held, SupportSlack* slack) {
  const double wrench[3] = {-held[0], -held[1], -held[2]};
  slack->margin = friction.Reserve(wrench);
  slack->slack = HUGE_VAL;
}

// Of one of its points.
void SetPointReserve(const SupportPoint& point, const double* held, SupportSlack* slack) {
  slack->slides = false;
  slack->slack = point.limit - std::hypot(held[0], held[1]);
  slack->scale = point.limit;
  slack->margin = slack->slack / slack->scale;
}

}  // namespace

void ForEachSupportSlack(const Model<double>& model, const StepRecord& record,
                         const std::function<void(const SupportSlack&)>& visit) {
  const ModelStructure& s = *model.structure;
  if (record.before.supports.size() != s.supports.size()) return;
  SupportFriction friction;
  for (size_t k = 0; k < s.supports.size(); ++k) {
    const SupportIndex& support = s.supports[k];
    const SupportState& at = record.before.supports[k];
    friction.Set(model, record.before, support, record.h);
    if (!(friction.limit() > 0.0)) continue;
    const double mass = model.parameters[s.bodies[support.body].mass];
    const double* held = &record.solution.joint_impulse[3 * (s.joints.size() + k)];
    SupportSlack slack = SlackOf(s, k);
    if (at.holds == SupportState::kBody) {
      SetReserve(friction, held, &slack);
      visit(slack);
      continue;
    }
    const auto slides = [&](double speed, double limit) {
      slack.slides = true;
      slack.slack = mass * speed;
      slack.scale = mass * speed + limit;
      slack.margin = slack.slack / slack.scale;
      visit(slack);
    };
    const double* twist = &record.new_twist[3 * static_cast<size_t>(support.body)];
    if (friction.is_disc()) {
      slides(std::hypot(twist[0], twist[1], friction.arm() * twist[2]), friction.limit());
      continue;
    }
    for (size_t i = 0; i < friction.points().size(); ++i) {
      const SupportPoint& point = friction.points()[i];
      slack.point = static_cast<int>(i);
      if (slack.point == at.holds) {
        SetPointReserve(point, held, &slack);
        visit(slack);
        continue;
      }
      double velocity[2];
      point.VelocityAt(twist, velocity);
      slides(std::hypot(velocity[0], velocity[1]), point.limit);
    }
  }
}

void ForEachHeldSupport(const Model<double>& model, const Segment& segment,
                        const std::function<void(const SupportSlack&)>& visit) {
  const ModelStructure& s = *model.structure;
  SupportFriction friction;
  for (size_t k = 0; k < segment.before.supports.size(); ++k) {
    const int holds = segment.before.supports[k].holds;
    if (holds == SupportState::kNothing) continue;
    friction.Set(model, segment.before, s.supports[k], 1.0);
    const double* held = &segment.stages[0].solution.joint_impulse[3 * (s.joints.size() + k)];
    SupportSlack slack = SlackOf(s, k);
    if (holds == SupportState::kBody) {
      SetReserve(friction, held, &slack);
    } else {
      slack.point = holds;
      SetPointReserve(friction.points()[static_cast<size_t>(holds)], held, &slack);
    }
    visit(slack);
  }
}

}  // namespace tangible
