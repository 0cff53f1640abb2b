// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/crowd_scene.h"

#include <algorithm>
#include <cmath>

#include "tangible/verification/support/random_scene.h"

namespace tangible::corpus {
namespace {

// Half of the side of the cell in which a body of a pile starts, m.
constexpr double kHalfCell = 0.18;

class CrowdMaker {
 public:
  CrowdMaker(std::uint64_t seed, int kind, int most_bodies, int steps) : random_(seed) {
    scene_.name = CrowdKinds()[static_cast<size_t>(kind)];
    round_ = random_.Chance(0.5);
    friction_ = round_ ? 0.25 * random_.Integer(0, 4) : random_.Uniform(0.0, 1.0);
    restitution_ = round_ ? 0.5 * random_.Integer(0, 1) : random_.Uniform(0.0, 0.9);
    const int shapes = random_.Integer(0, 3);
    const double least = std::log(20.0);
    const double most = std::log(std::max(20.0, static_cast<double>(most_bodies)));
    const int count = static_cast<int>(std::exp(random_.Uniform(least, most)));
    width_ = std::max(1.2, 0.3 * std::sqrt(count) * random_.Uniform(0.8, 1.6));
    AddWalls();
    double floor = 0.0;
    if (scene_.name == "stir") floor = AddPaddle();
    if (scene_.name == "bricks") {
      AddBricks(count);
    } else {
      const double top = AddPile(count, shapes, floor);
      if (scene_.name == "squeeze") AddPress(top);
    }
    static constexpr double kSteps[] = {0.002, 0.005, 0.01};
    scene_.simulation.dt = kSteps[random_.Integer(0, 2)];
    scene_.simulation.duration = steps * scene_.simulation.dt;
    if (!scene_.forces.empty()) scene_.forces[0].end = 0.4 * scene_.simulation.duration;
  }

  Scene Take() { return std::move(scene_); }

 private:
  BasicBody<double>& Add(const std::string& name, BasicShape<double> shape) {
    BasicBody<double>& body = scene_.bodies.emplace_back();
    body.name = name;
    body.shape = std::move(shape);
    body.friction = friction_;
    body.restitution = restitution_;
    return body;
  }

  void AddWalls() {
    Add("floor", {ShapeType::kHalfPlane, {0.0, 1.0, 0.0}}).motion = Motion::kStatic;
    Add("left", {ShapeType::kHalfPlane, {1.0, 0.0, -0.5 * width_}}).motion = Motion::kStatic;
    Add("right", {ShapeType::kHalfPlane, {-1.0, 0.0, -0.5 * width_}}).motion = Motion::kStatic;
  }

  // Turns in the middle; returns a height above it.
  double AddPaddle() {
    BasicBody<double>& paddle = Add("paddle", {ShapeType::kBox, {0.3 * width_, 0.08}});
    paddle.motion = Motion::kKinematic;
    paddle.position = {0.0, 0.5 + 0.15 * width_};
    paddle.angular_velocity = (random_.Chance(0.5) ? 1.0 : -1.0) * random_.Uniform(1.0, 6.0);
    return paddle.position.y() + 0.15 * width_;
  }

  BasicShape<double> ShapeOf(int shapes) {
    const double size = random_.Uniform(0.05, 0.15);
    switch (shapes < 3 ? shapes : random_.Integer(0, 2)) {
      case 0:
        return {ShapeType::kCircle, {size}};
      case 1:
        return {ShapeType::kBox, {1.6 * size, 1.2 * size}};
      default:
        return {ShapeType::kCapsule, {size, 0.5 * size}};
    }
  }

  // Rows of cells; returns the height of the last one.
  double AddPile(int count, int shapes, double floor) {
    const int columns = std::max(1, static_cast<int>(0.5 * width_ / kHalfCell));
    for (int i = 0; i < count; ++i) {
      BasicBody<double>& body = Add("b" + std::to_string(i), ShapeOf(shapes));
      const double x = (i % columns + 0.5) * width_ / columns - 0.5 * width_;
      const int row = i / columns;
      const double y = floor + (2 * row + 1) * kHalfCell;
      body.mass = random_.Uniform(0.1, 3.0);
      body.angle = round_ ? 0.0 : random_.Uniform(-3.0, 3.0);
      body.position = {x + random_.Uniform(0.0, 0.01), y + random_.Uniform(0.0, 0.01)};
      body.velocity = {random_.Uniform(-1.0, 1.0), 0.0};
    }
    const int rows = count / columns + 1;
    return floor + 2 * rows * kHalfCell;
  }

  // A board in a vertical guide that a force presses down and then releases.
  void AddPress(double top) {
    BasicBody<double>& press = Add("press", {ShapeType::kBox, {0.98 * width_, 0.1}});
    press.mass = random_.Uniform(1.0, 50.0);
    press.position = {0.0, top + 0.1};
    BasicJoint<double>& guide = scene_.joints.emplace_back();
    guide.name = "guide";
    guide.type = JointType::kPrismatic;
    guide.bodies[0] = static_cast<int>(scene_.bodies.size()) - 1;
    guide.anchors[0] = press.position;
    guide.axis = {0.0, 1.0};
    BasicForce<double>& force = scene_.forces.emplace_back();
    force.name = "push";
    force.body = guide.bodies[0];
    force.force = {0.0, -press.mass * random_.Uniform(10.0, 300.0)};
    force.start = 0.0;
  }

  // In rows that are half a brick apart, their faces at one place.
  void AddBricks(int count) {
    constexpr double kWidth = 0.25;
    constexpr double kHeight = 0.125;
    const int columns = std::max(2, static_cast<int>(width_ / kWidth) - 1);
    for (int i = 0; i < count; ++i) {
      BasicBody<double>& brick = Add("b" + std::to_string(i), {ShapeType::kBox, {kWidth, kHeight}});
      const int row = i / columns;
      brick.mass = round_ ? 1.0 : random_.Uniform(0.1, 10.0);
      brick.position = {kWidth * (i % columns - 0.5 * columns + 0.25 + 0.5 * (row % 2)),
                        kHeight * (row + 0.5)};
    }
  }

  RandomNumbers random_;
  Scene scene_;
  bool round_ = false;
  double friction_ = 0.0;
  double restitution_ = 0.0;
  double width_ = 0.0;
};

}  // namespace

const std::vector<std::string>& CrowdKinds() {
  static const std::vector<std::string> kinds = {"fall", "stir", "squeeze", "bricks"};
  return kinds;
}

Scene CrowdScene(std::uint64_t seed, int number, int kind, int most_bodies, int steps) {
  constexpr std::uint64_t kApart = 1000003;  // so that neighbouring seeds share no scene
  const auto own =
      static_cast<std::uint64_t>(number) * CrowdKinds().size() + static_cast<std::uint64_t>(kind);
  return CrowdMaker(seed * kApart + own, kind, most_bodies, steps).Take();
}

}  // namespace tangible::corpus
