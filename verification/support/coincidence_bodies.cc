// SPDX-License-Identifier: Apache-2.0
//
// Coincidences of bodies on a floor, between walls, and of forces.
#include <cmath>
#include <utility>

#include "tangible/verification/support/coincidence_maker.h"

namespace tangible::internal {
namespace {

constexpr double kHalfBox = 0.05;  // m, its height over two

Load LoadOf(const Signal& signal, const std::vector<double>& column) {
  Load load;
  load.times.assign(signal.time.begin(), signal.time.end());
  load.values.assign(column.begin(), column.end());
  return load;
}

Real InertiaOfDisc(const NumberAt& at, const std::string& body) {
  const Real radius = at(body + "shape/radius");
  return 0.5L * at(body + "mass") * radius * radius;
}

}  // namespace

const std::vector<CoincidenceMaker::Element>& CoincidenceMaker::ElementsOf(Group group) {
  using Maker = CoincidenceMaker;
  static const std::vector<Element> level = {
      {"slip ends", &Maker::SlipEnds},
      {"slip begins", &Maker::SlipBegins},
      {"slip begins at once", &Maker::SlipStartsAtOnce},
      {"slip ends as a force begins", &Maker::SlipEndsAsAForceBegins},
      {"force window", &Maker::ForceWindow},
      {"rolling", &Maker::Rolls},
      {"touch", &Maker::Lands},
      {"touch with a face", &Maker::LandsFlat},
      {"lift-off", &Maker::LiftsOff},
      {"slip ends in an impact", &Maker::SlipEndsInAnImpact},
      {"feature change", &Maker::PassesASeam},
      {"feature change, off a face", &Maker::LeavesAFace},
      {"joint friction ends", &Maker::JointStops},
      {"Stribeck, begins", &Maker::StribeckBreaksLoose},
      {"Stribeck, ends", &Maker::StribeckStops},
      {"slow Stribeck, ends", &Maker::SlowStribeckStops}};
  static const std::vector<Element> steep = {{"reversal", &Maker::SlipEnds},
                                             {"slip begins at once", &Maker::SlipStartsAtOnce}};
  static const std::vector<Element> shallow = {{"slip ends", &Maker::SlipEnds}};
  static const std::vector<Element> no_gravity = {
      {"joint friction ends", &Maker::JointStops},
      {"joint friction begins", &Maker::JointBreaksLoose},
      {"joint friction, reversal", &Maker::JointTurns},
      {"joint limit", &Maker::JointReachesItsLimit},
      {"force window", &Maker::FreeForceWindow},
      {"corner of a signal", &Maker::SignalCorner},
      {"corner of a joint's signal", &Maker::JointSignalCorner},
      {"touch", &Maker::HitsAWall},
      {"touch with a corner", &Maker::StrikesAtACorner},
      {"two touches of one disc", &Maker::HitsACorner}};
  return group == Group::kLevel     ? level
         : group == Group::kSteep   ? steep
         : group == Group::kShallow ? shallow
                                    : no_gravity;
}

BasicBody<double>& CoincidenceMaker::AddBox() {
  BasicBody<double> box;
  box.name = Named("box");
  box.shape = {ShapeType::kBox, {0.2, 2.0 * kHalfBox}};
  box.mass = Pick({1.0, 2.0, 0.5});
  box.position = Vector2<double>(place_, kHalfBox);
  for (const char* what : {"velocity/x", "mass", "position/x"}) {
    paths_.push_back("bodies/" + box.name + "/" + what);
  }
  made_.scene.bodies.push_back(box);
  return made_.scene.bodies.back();
}

BasicBody<double>& CoincidenceMaker::AddDisc() {
  BasicBody<double> disc;
  disc.name = Named("disc");
  const double radius = Pick({0.1, 0.2, 0.25});
  disc.shape = {ShapeType::kCircle, {radius}};
  disc.mass = Pick({1.0, 2.0, 0.5});
  disc.position = Vector2<double>(place_, radius);
  for (const char* what : {"velocity/x", "mass", "position/x"}) {
    paths_.push_back("bodies/" + disc.name + "/" + what);
  }
  made_.scene.bodies.push_back(disc);
  return made_.scene.bodies.back();
}

void CoincidenceMaker::AddPair(const std::string& body, double friction, double restitution) {
  BasicPair<double> pair;
  pair.bodies[0] = body;
  pair.bodies[1] = "floor";
  pair.friction = friction;
  pair.restitution = restitution;
  // At the end of their range they have one derivative alone.
  const std::string path = "pairs/" + body + ":floor/";
  if (friction > 0.0) paths_.push_back(path + "friction");
  if (restitution > 0.0 && restitution < 1.0) paths_.push_back(path + "restitution");
  made_.scene.pairs.push_back(pair);
}

BasicForce<double>& CoincidenceMaker::AddForce(const std::string& body) {
  BasicForce<double> force;
  force.name = Named("force");
  for (size_t i = 0; i < made_.scene.bodies.size(); ++i) {
    if (made_.scene.bodies[i].name == body) force.body = static_cast<int>(i);
  }
  made_.scene.forces.push_back(force);
  return made_.scene.forces.back();
}

Signal CoincidenceMaker::Ramp(double at_force) const {
  const double dt = made_.scene.simulation.dt;
  const double rate = at_force / (count_ > 0 ? at_ : dt);
  Signal signal;
  signal.file = Named("ramp") + ".csv";
  signal.interpolation = Signal::Interpolation::kLinear;
  signal.time = {0.0, 20.0 * dt};
  signal.value = {at_force - rate * at_, at_force - rate * at_ + rate * 20.0 * dt};
  return signal;
}

void CoincidenceMaker::SlideBox(const std::string& box, const Signal* ramp) {
  const Load signal = ramp != nullptr ? LoadOf(*ramp, ramp->value) : Load();
  const std::string body = "bodies/" + box + "/";
  const std::string friction = "pairs/" + box + ":floor/friction";
  std::string force;
  for (const BasicForce<double>& one : made_.scene.forces) {
    const bool is_own = made_.scene.bodies[one.body].name == box && !one.force_signal;
    if (is_own) force = "forces/" + one.name + "/";
  }
  const bool has_window = !force.empty();
  parts_.emplace_back([=, course = course_, is_slope = is_slope()](const NumberAt& at) {
    const Real mass = at(body + "mass");
    Load load = signal;
    load.constant = is_slope ? mass * at("gravity/x") : 0.0L;
    if (has_window) {
      load.windows = {{at(force + "start"), at(force + "end"), at(force + "force/x")}};
    }
    const Coordinate end = Slide({at(body + "position/x"), at(body + "velocity/x")}, mass,
                                 -at(friction) * mass * at("gravity/y"), load, course);
    return std::vector<Real>{end.position, kHalfBox, 0.0L, end.speed, 0.0L, 0.0L};
  });
}

void CoincidenceMaker::SlipEnds() {
  BasicBody<double>& box = AddBox();
  const double friction = is_slope() ? friction_ : Pick({0.5, 0.25, 0.2, 0.1});
  // On a slope it stops on its way up.
  const double pull = made_.scene.gravity.x();
  const double side = is_slope() ? -1.0 : mirror_;
  box.velocity.x() = side * (friction * gravity_ + pull) * at_;
  const std::string name = box.name;
  AddPair(name, friction, 0.0);
  SlideBox(name, nullptr);
}

void CoincidenceMaker::SlipStartsAtOnce() {
  const std::string name = AddBox().name;
  const double friction = is_slope() ? friction_ : Pick({0.5, 0.25, 0.2, 0.1});
  AddPair(name, friction, 0.0);
  if (group_ == Group::kLevel) {
    const double mass = made_.scene.bodies.back().mass;
    BasicForce<double>& push = AddForce(name);
    push.force.x() = mirror_ * Pick({1.5, 2.0, 3.0}) * friction * mass * gravity_;
    push.start = -1.0;
    push.end = 1000.0;
    paths_.push_back("forces/" + push.name + "/force/x");
  }
  SlideBox(name, nullptr);
}

void CoincidenceMaker::SlipBegins() {
  BasicBody<double>& box = AddBox();
  const std::string name = box.name;
  const double friction = Pick({0.5, 0.25, 0.2});
  const Signal ramp = Ramp(mirror_ * friction * box.mass * gravity_);
  AddPair(name, friction, 0.0);
  BasicForce<double>& force = AddForce(name);
  force.force_signal = ramp;
  force.force_signal->x = ramp.value;
  force.force_signal->y.assign(ramp.value.size(), 0.0);
  force.force_signal->value.clear();
  varies_ = true;
  SlideBox(name, &ramp);
}

void CoincidenceMaker::ForceWindow() {
  BasicBody<double>& box = AddBox();
  const std::string name = box.name;
  const double mass = box.mass;
  const double friction = Pick({0.5, 0.25, 0.2});
  AddPair(name, friction, 0.0);
  const double dt = made_.scene.simulation.dt;
  BasicForce<double>& push = AddForce(name);
  // With twice the friction it slides for as long after the push, and stops on a step's end.
  push.force.x() = mirror_ * Pick({2.0, 3.0, 1.5}) * friction * mass * gravity_;
  push.start = at_;
  push.end = (count_ + random_.Integer(1, 2)) * dt;
  for (const char* what : {"/force/x", "/start", "/end"}) {
    paths_.push_back("forces/" + push.name + what);
  }
  SlideBox(name, nullptr);
}

void CoincidenceMaker::SlipEndsAsAForceBegins() {
  BasicBody<double>& box = AddBox();
  const std::string name = box.name;
  const double friction = Pick({0.5, 0.25, 0.2});
  box.velocity.x() = mirror_ * friction * gravity_ * at_;
  const double limit = friction * box.mass * gravity_;
  AddPair(name, friction, 0.0);
  BasicForce<double>& push = AddForce(name);
  // It slides on, turns, or stays where it has stopped.
  push.force.x() = mirror_ * Pick({2.0, -2.0, 0.5, -0.5}) * limit;
  push.start = at_;
  push.end = 1000.0;
  for (const char* what : {"/force/x", "/start"}) {
    paths_.push_back("forces/" + push.name + what);
  }
  SlideBox(name, nullptr);
}

void CoincidenceMaker::FreeForceWindow() {
  BasicBody<double>& box = AddBox();
  const std::string name = box.name;
  box.velocity.x() = Pick({0.0, 0.5, -1.0});
  const double dt = made_.scene.simulation.dt;
  BasicForce<double>& push = AddForce(name);
  push.force = Vector2<double>(mirror_ * Pick({1.0, 4.0, -2.0}), 0.0);
  push.start = at_;
  push.end = (count_ + random_.Integer(1, 3)) * dt;
  const std::string force = "forces/" + push.name + "/";
  for (const char* what : {"force/x", "start", "end"}) {
    paths_.push_back(force + what);
  }
  const std::string body = "bodies/" + name + "/";
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    Load load;
    load.windows = {{at(force + "start"), at(force + "end"), at(force + "force/x")}};
    const Coordinate end = Slide({at(body + "position/x"), at(body + "velocity/x")},
                                 at(body + "mass"), 0.0L, load, course);
    return std::vector<Real>{end.position, kHalfBox, 0.0L, end.speed, 0.0L, 0.0L};
  });
}

void CoincidenceMaker::SignalCorner() {
  BasicBody<double>& box = AddBox();
  const std::string body = "bodies/" + box.name + "/";
  box.velocity.x() = Pick({0.0, 0.5, -1.0});
  const double dt = made_.scene.simulation.dt;
  const double force = mirror_ * Pick({1.0, 2.0, 4.0});
  BasicForce<double>& push = AddForce(box.name);
  Signal signal;
  signal.file = Named("corner") + ".csv";
  signal.interpolation = Signal::Interpolation::kLinear;
  signal.time = {at_, at_ + dt, at_ + 3.0 * dt};
  signal.x = {0.0, force, -force};
  signal.y.assign(3, 0.0);
  push.force_signal = signal;
  varies_ = true;
  const Load load = LoadOf(signal, signal.x);
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    const Coordinate end = Slide({at(body + "position/x"), at(body + "velocity/x")},
                                 at(body + "mass"), 0.0L, load, course);
    return std::vector<Real>{end.position, kHalfBox, 0.0L, end.speed, 0.0L, 0.0L};
  });
}

void CoincidenceMaker::RollDisc(const std::string& disc) {
  const std::string body = "bodies/" + disc + "/";
  const std::string pair = "pairs/" + disc + ":floor/";
  paths_.push_back(body + "angular_velocity");
  // A disc that touches as the run starts is in the floor on one side.
  if (made_.scene.bodies.back().position.y() > made_.scene.bodies.back().shape.numbers[0]) {
    paths_.push_back(body + "position/y");
    paths_.push_back(body + "velocity/y");
    paths_.push_back(body + "shape/radius");
  }
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    const Real radius = at(body + "shape/radius");
    Disc start;
    start.along = {at(body + "position/x"), at(body + "velocity/x")};
    start.gap = {at(body + "position/y") - radius, at(body + "velocity/y")};
    start.turn = {0.0L, at(body + "angular_velocity")};
    Surface surface;
    surface.restitution = at(pair + "restitution");
    const Disc end = FallAndRoll(start, radius, at(body + "mass"), InertiaOfDisc(at, body),
                                 at(pair + "friction"), -at("gravity/y"), surface, course);
    return std::vector<Real>{end.along.position, radius + end.gap.position,
                             end.turn.position,  end.along.speed,
                             end.gap.speed,      end.turn.speed};
  });
}

void CoincidenceMaker::Rolls() {
  BasicBody<double>& disc = AddDisc();
  const std::string name = disc.name;
  const double friction = Pick({0.1, 0.2, 0.5});
  // The slip falls by 3 μ g in a second.
  disc.angular_velocity = mirror_ * Pick({0.0, 0.0, 2.0, -1.0});
  disc.velocity.x() =
      mirror_ * 3.0 * friction * gravity_ * at_ - disc.angular_velocity * disc.shape.numbers[0];
  AddPair(name, friction, 0.0);
  RollDisc(name);
}

void CoincidenceMaker::Lands() {
  JumpsAt();
  NameLaw();
  BasicBody<double>& disc = AddDisc();
  const std::string name = disc.name;
  const double speed = count_ == 0 ? -1.0 : Pick({0.0, -1.0, -0.5});
  disc.velocity = Vector2<double>(mirror_ * Pick({0.0, 1.0, 0.5}), speed);
  disc.angular_velocity = mirror_ * Pick({0.0, 0.0, 4.0, -2.0});
  disc.position.y() += 0.5 * gravity_ * at_ * at_ - speed * at_;
  AddPair(name, Pick({0.0, 0.1, 0.5}), Pick({0.0, 0.5, 0.8, 1.0}));
  MayLandAtTheEnd(gravity_ * at_ - speed);
  RollDisc(name);
}

void CoincidenceMaker::MayLandAtTheEnd(double speed) {
  constexpr int kMostLandings = 100;
  constexpr double kSameMoment = 1e-9;
  const double end = made_.scene.simulation.duration;
  const double restitution = *made_.scene.pairs.back().restitution;
  double time = at_;
  for (int k = 0; k < kMostLandings && time < end - kSameMoment; ++k) {
    speed *= restitution;
    time += 2.0 * speed / gravity_;
  }
  if (course_.stepping == Stepping::kEvent && std::abs(time - end) <= kSameMoment) unknown_ = true;
}

void CoincidenceMaker::LandsFlat() {
  JumpsAt();
  NameLaw();
  BasicBody<double>& box = AddBox();
  const std::string body = "bodies/" + box.name + "/";
  const std::string pair = "pairs/" + box.name + ":floor/";
  const double speed = count_ == 0 ? -1.0 : Pick({0.0, -1.0, -0.5});
  box.velocity = Vector2<double>(mirror_ * Pick({0.0, 1.0}), speed);
  box.position.y() += 0.5 * gravity_ * at_ * at_ - speed * at_;
  if (count_ > 0) {
    paths_.push_back(body + "position/y");
    paths_.push_back(body + "velocity/y");
  }
  AddPair(box.name, 0.0, Pick({0.0, 0.5, 0.8}));
  MayLandAtTheEnd(gravity_ * at_ - speed);
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    Surface surface;
    surface.restitution = at(pair + "restitution");
    Load load;
    load.constant = at("gravity/y");
    const Coordinate gap = Bounce({at(body + "position/y") - kHalfBox, at(body + "velocity/y")},
                                  1.0L, surface, load, course);
    const Real speed_x = at(body + "velocity/x");
    return std::vector<Real>{at(body + "position/x") + speed_x * course.duration,
                             kHalfBox + gap.position,
                             0.0L,
                             speed_x,
                             gap.speed,
                             0.0L};
  });
}

void CoincidenceMaker::LiftsOff() {
  BasicBody<double>& disc = AddDisc();
  const std::string body = "bodies/" + disc.name + "/";
  disc.velocity.x() = mirror_ * Pick({0.0, 1.0});
  const Signal ramp = Ramp(disc.mass * gravity_);
  const std::string name = disc.name;
  AddPair(name, 0.0, 0.0);
  BasicForce<double>& force = AddForce(name);
  force.force_signal = ramp;
  force.force_signal->y = ramp.value;
  force.force_signal->x.assign(ramp.value.size(), 0.0);
  force.force_signal->value.clear();
  varies_ = true;
  const Load signal = LoadOf(ramp, ramp.value);
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    const Real mass = at(body + "mass");
    Load load = signal;
    load.constant = mass * at("gravity/y");
    const Coordinate gap = Bounce({0.0L, 0.0L}, mass, Surface(), load, course);
    const Real speed = at(body + "velocity/x");
    return std::vector<Real>{at(body + "position/x") + speed * course.duration,
                             at(body + "shape/radius") + gap.position,
                             0.0L,
                             speed,
                             gap.speed,
                             0.0L};
  });
}

void CoincidenceMaker::AddWall(const char* name, int axis, double face) {
  BasicBody<double> wall;
  wall.name = Named(name);
  wall.motion = Motion::kStatic;
  // A roof is as long as the way of what moves along it in any run.
  wall.shape = {ShapeType::kBox, {axis == 0 ? 1.0 : 8.0, axis == 0 ? 4.0 : 1.0}};
  wall.position =
      axis == 0 ? Vector2<double>(face + 0.5, 0.0) : Vector2<double>(place_, face + 0.5);
  wall.restitution = made_.scene.bodies.back().restitution;
  made_.scene.bodies.push_back(wall);
}

void CoincidenceMaker::HitsAWall() {
  JumpsAt();
  NameLaw();
  BasicBody<double>& disc = AddDisc();
  const std::string body = "bodies/" + disc.name + "/";
  disc.restitution = Pick({0.0, 0.5, 0.8, 1.0});
  const double speed = Pick({1.0, 2.0, 0.5});
  disc.velocity = Vector2<double>(speed, mirror_ * Pick({0.0, 0.25}));
  disc.position.y() = 0.0;
  const double face = place_ + speed * at_ + disc.shape.numbers[0];
  const std::string wall = "bodies/" + Named("wall") + "/";
  paths_.push_back(body + "velocity/y");
  if (count_ > 0) paths_.push_back(wall + "position/x");
  AddWall("wall", 0, face);
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    Surface surface;
    surface.restitution = 0.5L * (at(body + "restitution") + at(wall + "restitution"));
    const Real contact = at(wall + "position/x") - 0.5L - at(body + "shape/radius");
    const Coordinate gap = Bounce({contact - at(body + "position/x"), -at(body + "velocity/x")},
                                  1.0L, surface, Load(), course);
    const Real speed_y = at(body + "velocity/y");
    return std::vector<Real>{
        contact - gap.position, speed_y * course.duration, 0.0L, -gap.speed, speed_y, 0.0L};
  });
}

void CoincidenceMaker::HitsACorner() {
  JumpsAt();
  NameLaw();
  BasicBody<double>& disc = AddDisc();
  const std::string body = "bodies/" + disc.name + "/";
  disc.restitution = Pick({0.0, 0.5, 0.8, 1.0});
  disc.velocity = Vector2<double>(Pick({1.0, 2.0, 0.5}), Pick({1.0, 0.5}));
  disc.position.y() = 0.0;
  const Vector2<double> velocity = disc.velocity;
  const double radius = disc.shape.numbers[0];
  const std::string wall = "bodies/" + Named("wall") + "/";
  const std::string roof = "bodies/" + Named("roof") + "/";
  paths_.push_back(body + "velocity/y");
  AddWall("wall", 0, place_ + velocity.x() * at_ + radius);
  AddWall("roof", 1, velocity.y() * at_ + radius);
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    Surface surface;
    surface.restitution = at(body + "restitution");
    const auto along = [&](const char* axis, const std::string& face) {
      const Real contact = at(face + "position/" + axis) - 0.5L - at(body + "shape/radius");
      const Coordinate gap = Bounce(
          {contact - at(body + "position/" + axis), -at(body + std::string("velocity/") + axis)},
          1.0L, surface, Load(), course);
      return Coordinate{contact - gap.position, -gap.speed};
    };
    const Coordinate x = along("x", wall);
    const Coordinate y = along("y", roof);
    return std::vector<Real>{x.position, y.position, 0.0L, x.speed, y.speed, 0.0L};
  });
}

void CoincidenceMaker::PassesASeam() {
  BasicBody<double>& disc = AddDisc();
  const std::string body = "bodies/" + disc.name + "/";
  const double radius = disc.shape.numbers[0];
  const double speed = Pick({1.0, 0.5, 2.0});
  // Above the floor, on tiles whose upper faces are at y = 1.
  disc.position.y() = 1.0 + radius;
  disc.velocity.x() = mirror_ * speed;
  const bool rolls = random_.Chance(0.5);
  disc.friction = rolls ? 0.5 : 0.0;
  disc.angular_velocity = rolls ? -mirror_ * speed / radius : 0.0;
  if (!rolls) paths_.push_back(body + "angular_velocity");
  const double seam = place_ + mirror_ * speed * at_;
  for (const int side : {-1, 1}) {
    BasicBody<double> tile;
    tile.name = Named(side < 0 ? "left" : "right");
    tile.motion = Motion::kStatic;
    // A box, a line along its outline from right to left, or a polygon with a notch in its foot.
    switch ((made_.scene.bodies.size() + (side < 0 ? 0 : 2)) % 3) {
      case 0:
        tile.shape = {ShapeType::kBox, {4.0, 0.5}};
        break;
      case 1:
        tile.shape = {ShapeType::kPolyline, {2.0, -0.25, 2.0, 0.25, -2.0, 0.25, -2.0, -0.25}};
        break;
      default:
        tile.shape = {
            ShapeType::kPolygon,
            {-2.0, -0.25, -0.5, -0.25, 0.0, 0.0, 0.5, -0.25, 2.0, -0.25, 2.0, 0.25, -2.0, 0.25}};
    }
    tile.position = Vector2<double>(seam + 2.0 * side, 0.75);
    tile.friction = disc.friction;
    made_.scene.bodies.push_back(tile);
  }
  parts_.emplace_back([=, course = course_](const NumberAt& at) {
    // Beside its value a speed lets it slip, until it rolls.
    const Real radius_now = at(body + "shape/radius");
    Disc start;
    start.along = {at(body + "position/x"), at(body + "velocity/x")};
    start.turn = {0.0L, at(body + "angular_velocity")};
    const Disc end = FallAndRoll(start, radius_now, at(body + "mass"), InertiaOfDisc(at, body),
                                 at(body + "friction"), -at("gravity/y"), Surface(), course);
    return std::vector<Real>{
        end.along.position, 1.0L + radius_now, end.turn.position, end.along.speed, 0.0L,
        end.turn.speed};
  });
}

}  // namespace tangible::internal
