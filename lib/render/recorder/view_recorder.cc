// SPDX-License-Identifier: Apache-2.0
#include "tangible/render/recorder/view_recorder.h"

#include "tangible/dynamics/elements/joint.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/stepping/invariants.h"

namespace tangible {
namespace {

// In the view the world has the index −1.
int ViewIndex(const ModelStructure& structure, int body) {
  return body == structure.world() ? -1 : body;
}

Vector2<double> PointAt(const Model<double>& model, int number) {
  return {model.parameters[number], model.parameters[number + 1]};
}

ViewJoint MakeJoint(const Model<double>& model, const JointIndex& joint) {
  ViewJoint view;
  view.name = joint.name;
  view.type = joint.type;
  view.bodies[0] = ViewIndex(*model.structure, joint.a);
  view.bodies[1] = ViewIndex(*model.structure, joint.b);
  if (HasAnchors(joint.type)) {
    view.anchors[0] = PointAt(model, joint.geometry);
    view.anchors[1] = PointAt(model, joint.geometry + 2);
  }
  if (joint.type == JointType::kPrismatic) {
    view.axis = PointAt(model, joint.geometry + 4);
  }
  if (joint.type == JointType::kRope && joint.high >= 0) view.rope = model.parameters[joint.high];
  view.has_motor = joint.motor >= 0;
  if (joint.until >= 0) view.until = model.parameters[joint.until];
  return view;
}

}  // namespace

ViewRecorder::ViewRecorder(const Scene& scene, const Model<double>& model) {
  const ModelStructure& s = *model.structure;
  data_.name = scene.name;
  data_.gravity = scene.gravity;
  for (const auto& body : scene.bodies) {
    ViewBody& view = data_.bodies.emplace_back(
        ViewBody{body.name, body.motion, body.shape, body.contact_points});
    if (!body.support) continue;
    view.support_points = body.support->points;
    view.support_radius = body.support->radius.value_or(0.0);
    if (!body.support->radius && view.support_points.empty()) {
      view.support_points.push_back(Vector2<double>::Zero());
    }
  }
  for (const JointIndex& joint : s.joints) {
    data_.joints.push_back(MakeJoint(model, joint));
  }
  for (const ServoIndex& servo : s.servos) {
    if (servo.joint >= 0) data_.joints[servo.joint].has_servo = true;
  }
  for (const SpringIndex& spring : s.springs) {
    ViewSpring view;
    view.name = spring.name;
    view.bodies[0] = ViewIndex(s, spring.a);
    view.bodies[1] = ViewIndex(s, spring.b);
    view.anchors[0] = PointAt(model, spring.numbers);
    view.anchors[1] = PointAt(model, spring.numbers + 2);
    data_.springs.push_back(view);
  }
}

void ViewRecorder::Add(const Model<double>& model, double t, const State<double>& state,
                       const StepRecord* record) {
  ViewFrame& frame = data_.frames.emplace_back();
  frame.time = t;
  for (int body = 0; body < model.structure->world(); ++body) {
    const double* q = &state.pose[3 * body];
    frame.poses.emplace_back(q[0], q[1], q[2]);
  }
  frame.kinetic_energy = KineticEnergy(model, state);
  frame.potential_energy = PotentialEnergy(model, state);
  if (record != nullptr) {
    AddContacts(model, *record, &frame);
  }
}

void ViewRecorder::AddContacts(const Model<double>& model, const StepRecord& record,
                               ViewFrame* frame) const {
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    if (!contact.IsOfShapes() || record.solution.modes[i] == ContactMode::kOpen) {
      continue;
    }
    ContactRows<double> rows;
    EvaluateContactRows(model, record.before, contact, &rows);
    ViewContact view;
    view.bodies[0] = contact.a;
    view.bodies[1] = contact.b;
    view.point = rows.geometry.point;
    view.normal = rows.geometry.normal;
    view.normal_impulse = record.solution.normal_impulse[i];
    view.tangential_impulse = record.solution.tangent_impulse[i];
    view.mode = ModeName(record.solution.modes[i]);
    frame->contacts.push_back(view);
  }
}

}  // namespace tangible
