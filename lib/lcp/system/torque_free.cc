// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/torque_free.h"

#include <algorithm>

namespace tangible {

void FindTurning(const ContactProblem<double>& problem, std::vector<Turning>* turning) {
  turning->clear();
  AddTurning(problem, turning);
}

void AddTurning(const ContactProblem<double>& problem, std::vector<Turning>* turning) {
  turning->resize(problem.num_bodies, Turning::kUntouched);
  const auto part = [&](int body, const RowPart<double>& row) {
    if (body >= 0) {
      Turning& of_body = (*turning)[body];
      of_body = std::max(of_body, row[2] != 0.0 ? Turning::kTurned : Turning::kNone);
    }
  };
  for (const DamperBlock<double>& damper : problem.dampers) {
    part(damper.a, damper.row_a);
    part(damper.b, damper.row_b);
  }
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      part(joint.a, joint.row_a[k]);
      part(joint.b, joint.row_b[k]);
    }
    if (joint.c >= 0) {
      part(joint.c, joint.row_c);
      part(joint.d, joint.row_d);
    }
  }
  for (const ContactBlock<double>& contact : problem.contacts) {
    part(contact.a, contact.normal_a);
    part(contact.b, contact.normal_b);
    if (contact.has_friction) {
      part(contact.a, contact.tangent_a);
      part(contact.b, contact.tangent_b);
    }
  }
}

int CountAnglesLeftOut(const std::vector<Turning>& turning) {
  return static_cast<int>(std::count(turning.begin(), turning.end(), Turning::kNone));
}

}  // namespace tangible
