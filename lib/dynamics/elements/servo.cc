// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/servo_inl.h"

namespace tangible {

std::string NameOfServo(const ModelStructure& structure, const ActiveContact& contact) {
  return contact.joint >= 0 ? "servo of joint " + structure.joints[contact.joint].name
                            : "servo on body " + structure.bodies[contact.a].name;
}

bool Slides(const ModelStructure& structure, const ServoIndex& servo) {
  return servo.joint >= 0 ? structure.joints[servo.joint].type == JointType::kPrismatic
                          : servo.axis != ServoIndex::kAngle;
}

bool IsServoOn(const Model<double>& model, int k, double middle) {
  const ServoIndex& servo = model.structure->servos[k];
  if (servo.joint >= 0) return true;
  const ForceIndex& force = model.structure->forces[servo.force];
  return !(force.start >= 0 && model.parameters[force.start] > middle) &&
         !(force.end >= 0 && model.parameters[force.end] < middle);
}

void AddServoLoad(const Model<double>& model, const State<double>& state, int k,
                  const ServoTime<double>& at, double factor, std::vector<double>* load) {
  const ModelStructure& s = *model.structure;
  const ServoIndex& servo = s.servos[k];
  const int mode = ServoMode(model, state, k, at);
  const double effort = mode == 0 ? UnboundedEffort(model, state, k, at)
                                  : mode * model.parameters[servo.Number(ServoIndex::kLimit)];
  ServoRows<double> rows;
  EvaluateServo(model, state, servo, &rows);
  for (int i = 0; i < 3; ++i) {
    const int a = s.bodies[rows.a].block;
    const int b = s.bodies[rows.b].block;
    if (a >= 0) (*load)[3 * a + i] += factor * effort * rows.row_a[i];
    if (b >= 0) (*load)[3 * b + i] += factor * effort * rows.row_b[i];
  }
}

#define TANGIBLE_INSTANTIATE(T)                                                             \
  template ServoTarget<T> TargetOf<T>(const ModelStructure&, const ServoIndex&, const T&,   \
                                      const ServoTime<T>&);                                 \
  template T UnboundedEffort<T>(const Model<T>&, const State<T>&, int, const ServoTime<T>&, \
                                double*);                                                   \
  template int ServoMode<T>(const Model<T>&, const State<T>&, int, const ServoTime<T>&);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
