// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/support_slacks.h"

#include <cmath>

#include "tangible/dynamics/elements/support.h"

namespace tangible {

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
    SupportSlack slack;
    slack.support = static_cast<int>(k);
    slack.contact.a = support.body;
    slack.contact.b = s.world();
    slack.contact.is_support = true;
    if (at.holds == SupportState::kBody) {
      const double wrench[3] = {-held[0], -held[1], -held[2]};
      slack.margin = friction.Reserve(wrench);
      slack.slack = HUGE_VAL;
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
        slack.slides = false;
        slack.slack = point.limit - std::hypot(held[0], held[1]);
        slack.scale = point.limit;
        slack.margin = slack.slack / slack.scale;
        visit(slack);
        continue;
      }
      double velocity[2];
      point.VelocityAt(twist, velocity);
      slides(std::hypot(velocity[0], velocity[1]), point.limit);
    }
  }
}

}  // namespace tangible
