// SPDX-License-Identifier: Apache-2.0
//
// Coincidences of wheels on an axle and sliders on a rail.
#include <algorithm>
#include <cmath>

#include "tangible/verification/support/coincidence_maker.h"

namespace tangible::internal {
namespace {

constexpr double kSlowest = 0.1;  // m/s, rad/s: for the decay of what stays at rest

// Poses and twists of a wheel or slider whose coordinate is known.
std::vector<Real> OutputsOf(bool is_wheel, Real x, Real y, const Coordinate& at) {
  return is_wheel ? std::vector<Real>{x, y, at.position, 0.0L, 0.0L, at.speed}
                  : std::vector<Real>{x + at.position, y, 0.0L, at.speed, 0.0L, 0.0L};
}

}  // namespace

CoincidenceMaker::Jointed CoincidenceMaker::AddJointed() {
  Jointed made{Named("part"), Named("joint"), random_.Chance(0.5)};
  BasicBody<double> body;
  body.name = made.body;
  body.mass = Pick({1.0, 2.0, 0.5});
  body.inertia = Pick({0.005, 0.5, 1.0});
  body.position = Vector2<double>(place_, 3.0);
  made_.scene.bodies.push_back(body);
  BasicJoint<double> joint;
  joint.name = made.joint;
  joint.type = made.is_wheel ? JointType::kRevolute : JointType::kPrismatic;
  joint.bodies[0] = static_cast<int>(made_.scene.bodies.size()) - 1;
  joint.anchors[0] = body.position;
  made_.scene.joints.push_back(joint);
  const std::string path = "bodies/" + made.body + "/";
  paths_.push_back(path + (made.is_wheel ? "inertia" : "mass"));
  paths_.push_back(path + (made.is_wheel ? "angular_velocity" : "velocity/x"));
  return made;
}

double& CoincidenceMaker::MassOf(const Jointed& of) {
  BasicBody<double>& body = made_.scene.bodies.back();
  return of.is_wheel ? *body.inertia : body.mass;
}

double& CoincidenceMaker::SpeedOf(const Jointed& of) {
  BasicBody<double>& body = made_.scene.bodies.back();
  return of.is_wheel ? body.angular_velocity : body.velocity.x();
}

void CoincidenceMaker::SlideJointed(const Jointed& of) {
  const std::string body = "bodies/" + of.body + "/";
  const std::string joint = "joints/" + of.joint + "/";
  paths_.push_back(joint + "friction");
  const BasicJoint<double>& made = made_.scene.joints.back();
  Load signal;
  if (made.effort_signal) {
    signal.times.assign(made.effort_signal->time.begin(), made.effort_signal->time.end());
    signal.values.assign(made.effort_signal->value.begin(), made.effort_signal->value.end());
  } else {
    paths_.push_back(joint + "effort");
  }
  parts_.emplace_back([=, course = course_, is_wheel = of.is_wheel](const NumberAt& at) {
    Load load = signal;
    if (load.times.empty()) load.constant = at(joint + "effort");
    const Real mass = at(body + (is_wheel ? "inertia" : "mass"));
    const Coordinate end = Slide({0.0L, at(body + (is_wheel ? "angular_velocity" : "velocity/x"))},
                                 mass, at(joint + "friction"), load, course);
    return OutputsOf(is_wheel, at(body + "position/x"), at(body + "position/y"), end);
  });
}

void CoincidenceMaker::StopJointed(const Jointed& of, double friction, double share) {
  made_.scene.joints.back().friction = friction;
  SpeedOf(of) = mirror_ * share * friction * at_ / MassOf(of);
  SlideJointed(of);
}

void CoincidenceMaker::JointStops() {
  const Jointed of = AddJointed();
  const double friction = Pick({0.5, 0.001, 2.0});
  // Every fourth one goes on beyond the end.
  StopJointed(of, friction, random_.Chance(0.25) ? 10.0 : 1.0);
}

void CoincidenceMaker::JointBreaksLoose() {
  const Jointed of = AddJointed();
  const double friction = Pick({0.5, 1.0, 2.0});
  BasicJoint<double>& joint = made_.scene.joints.back();
  joint.friction = friction;
  joint.effort_signal = Ramp(mirror_ * friction);
  varies_ = true;
  SlideJointed(of);
}

void CoincidenceMaker::JointTurns() {
  const Jointed of = AddJointed();
  const double friction = Pick({0.5, 1.0});
  BasicJoint<double>& joint = made_.scene.joints.back();
  joint.friction = friction;
  joint.effort = -mirror_ * Pick({2.0, 3.0}) * friction;
  SpeedOf(of) = mirror_ * (friction - mirror_ * joint.effort) * at_ / MassOf(of);
  SlideJointed(of);
}

void CoincidenceMaker::JointReachesItsLimit() {
  JumpsAt();
  const Jointed of = AddJointed();
  const double speed = Pick({0.5, 1.0, 0.0});
  const double dt = made_.scene.simulation.dt;
  const double mass = MassOf(of);
  // An effort drives it against the limit, and then, from a step's end on, away from it.
  const double acceleration = Pick({1.0, 2.0, 4.0});
  SpeedOf(of) = mirror_ * speed;
  BasicJoint<double>& joint = made_.scene.joints.back();
  const double way = speed * at_ + 0.5 * acceleration * at_ * at_;
  joint.limits = mirror_ > 0.0 ? std::pair(-100.0, way) : std::pair(-way, 100.0);
  BasicForce<double>& drive = AddForce(of.body);
  const double force = mirror_ * mass * acceleration;
  (of.is_wheel ? drive.torque : drive.force.x()) = force;
  drive.start = -1.0;
  drive.end = (count_ + random_.Integer(1, 2)) * dt;
  const std::string drive_path = "forces/" + drive.name + "/";
  BasicForce<double> back = drive;
  back.name = Named("back");
  back.start = drive.end;
  back.end = 1000.0;
  (of.is_wheel ? back.torque : back.force.x()) = -force;
  made_.scene.forces.push_back(back);
  const std::string back_path = "forces/" + back.name + "/";
  const std::string body = "bodies/" + of.body + "/";
  const std::string limit = "joints/" + of.joint + (mirror_ > 0.0 ? "/limits/1" : "/limits/0");
  const std::string what = of.is_wheel ? "torque" : "force/x";
  if (count_ > 0) paths_.push_back(limit);
  paths_.push_back(drive_path + what);
  paths_.push_back(back_path + what);
  paths_.push_back(back_path + "start");
  parts_.emplace_back(
      [=, course = course_, side = mirror_, is_wheel = of.is_wheel](const NumberAt& at) {
        Load load;
        for (const std::string& path : {drive_path, back_path}) {
          load.windows.push_back({at(path + "start"), at(path + "end"), -side * at(path + what)});
        }
        const Real speed_now = at(body + (is_wheel ? "angular_velocity" : "velocity/x"));
        const Coordinate gap =
            Bounce({side * at(limit), -side * speed_now},
                   at(body + (is_wheel ? "inertia" : "mass")), Surface(), load, course);
        return OutputsOf(is_wheel, at(body + "position/x"), at(body + "position/y"),
                         {at(limit) - side * gap.position, -side * gap.speed});
      });
}

void CoincidenceMaker::JointSignalCorner() {
  const Jointed of = AddJointed();
  const double dt = made_.scene.simulation.dt;
  const double effort = mirror_ * Pick({1.0, 2.0, 4.0});
  BasicJoint<double>& joint = made_.scene.joints.back();
  const double friction = 0.5;
  joint.friction = friction;
  Signal signal;
  signal.file = Named("corner") + ".csv";
  signal.interpolation = Signal::Interpolation::kLinear;
  signal.time = {at_, at_ + dt, at_ + 3.0 * dt};
  signal.value = {0.0, effort, -effort};
  joint.effort_signal = signal;
  varies_ = true;
  SpeedOf(of) = mirror_ * Pick({0.0, 10.0}) * friction * at_ / MassOf(of);
  SlideJointed(of);
}

void CoincidenceMaker::AddStribeck(const Jointed& of, double friction, double speed) {
  BasicJoint<double>& joint = made_.scene.joints.back();
  joint.friction = friction;
  if (course_.stepping != Stepping::kEvent) return;
  joint.kinetic_friction = 0.5 * friction;
  joint.stribeck_speed = speed;
  paths_.push_back("joints/" + of.joint + "/kinetic_friction");
}

void CoincidenceMaker::StopByStribeck(const Jointed& of) {
  const std::string body = "bodies/" + of.body + "/";
  const std::string joint = "joints/" + of.joint + "/";
  paths_.push_back(joint + "friction");
  paths_.push_back(joint + "stribeck_speed");
  parts_.emplace_back([=, course = course_, is_wheel = of.is_wheel](const NumberAt& at) {
    const Stribeck law = {at(joint + "friction"), at(joint + "kinetic_friction"),
                          at(joint + "stribeck_speed")};
    const Real speed = at(body + (is_wheel ? "angular_velocity" : "velocity/x"));
    const Coordinate end = SlideByStribeck(
        {0.0L, speed}, at(body + (is_wheel ? "inertia" : "mass")), law, Load(), course.duration);
    return OutputsOf(is_wheel, at(body + "position/x"), at(body + "position/y"), end);
  });
}

void CoincidenceMaker::StribeckBreaksLoose() {
  const Jointed of = AddJointed();
  const double friction = Pick({1.0, 2.0});
  AddStribeck(of, friction, Pick({0.05, 0.5}));
  unknown_ = unknown_ || course_.stepping == Stepping::kEvent;
  made_.scene.joints.back().effort_signal = Ramp(mirror_ * friction);
  varies_ = true;
  SlideJointed(of);
}

void CoincidenceMaker::StribeckStops() {
  const Jointed of = AddJointed();
  const double friction = Pick({0.5, 1.0});
  AddStribeck(of, friction, Pick({0.05, 0.5}));
  unknown_ = unknown_ || course_.stepping == Stepping::kEvent;
  StopJointed(of, friction, 1.0);
}

void CoincidenceMaker::SlowStribeckStops() {
  const Jointed of = AddJointed();
  const double friction = Pick({0.5, 1.0});
  if (course_.stepping != Stepping::kEvent) {
    StopJointed(of, friction, 1.0);
    return;
  }
  varies_ = true;
  const double speed = count_ == 0 ? 0.0 : Pick({0.5, 1.0});
  AddStribeck(of, friction, Pick({500.0, 600.0}) * std::max(speed, kSlowest));
  SpeedOf(of) = mirror_ * speed;
  if (count_ > 0) {
    const BasicJoint<double>& joint = made_.scene.joints.back();
    const Stribeck law = {friction, *joint.kinetic_friction, joint.stribeck_speed};
    MassOf(of) = static_cast<double>(at_ / TimeToStop(1.0L, law, speed));
  }
  // At the run's end the decay's share of a speed is less than what kinks are named for.
  if (count_ > 0 && after_ == 0) unknown_ = true;
  StopByStribeck(of);
}

}  // namespace tangible::internal
