// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of parameter.h; included by parameter.cc alone.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/joint_graph.h"
#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_fields.h"

namespace tangible {
namespace internal {

// The visitor that lists the parameters of the fields.
template <typename T>
class NumberList {
 public:
  explicit NumberList(BasicScene<T>* scene) : scene_(scene), places_(ClassifyJoints(*scene)) {}

  std::vector<SceneNumber<T>> Collect() {
    Point(kGravityField, scene_->gravity);
    for (BasicBody<T>& body : scene_->bodies) {
      prefix_ = "bodies/" + body.name + "/";
      VisitBody(body, this);
      prefix_ += "shape/";
      VisitShape(body.shape, this);
      prefix_ = "bodies/" + body.name + "/";
      VisitContactPoints(body, this);
    }
    for (std::size_t i = 0; i < scene_->joints.size(); ++i) {
      prefix_ = "joints/" + scene_->joints[i].name + "/";
      VisitJoint(scene_->joints[i], places_[i] == JointPlace::kTree, this);
    }
    for (BasicSpring<T>& spring : scene_->springs) {
      prefix_ = "springs/" + spring.name + "/";
      VisitSpring(spring, this);
    }
    for (BasicForce<T>& force : scene_->forces) {
      prefix_ = "forces/" + force.name + "/";
      VisitForce(force, this);
    }
    for (BasicPair<T>& pair : scene_->pairs) {
      prefix_ = "pairs/" + pair.bodies[0] + ":" + pair.bodies[1] + "/";
      VisitPair(pair, this);
    }
    return numbers_;
  }

  void Number(const Field& field, T& value) { Add(field, "", &value); }
  void Optional(const Field& field, std::optional<T>& value) {
    if (value) Add(field, "", &*value);
  }
  void Point(const Field& field, Vector2<T>& value) { Numbers(field, value.x(), value.y()); }
  void Points(const Field& field, std::vector<Vector2<T>>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      AddPoint(field, i, &values[i].x(), &values[i].y());
    }
  }
  void List(const Field& field, std::vector<T>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      Add(field, "/" + std::to_string(i), &values[i]);
    }
  }
  void Anchors(const Field& field, Vector2<T> (&anchors)[2]) {
    for (std::size_t i = 0; i < 2; ++i) AddPoint(field, i, &anchors[i].x(), &anchors[i].y());
  }
  void Interval(const Field& field, std::optional<std::pair<T, T>>& value) {
    if (!value) return;
    if (std::isfinite(ValueOf(value->first))) Add(field, "/0", &value->first);
    if (std::isfinite(ValueOf(value->second))) Add(field, "/1", &value->second);
  }
  void Numbers(const Field& field, T& x, T& y) {
    Add(field, "/x", &x);
    Add(field, "/y", &y);
  }
  void Vertices(const Field& field, std::vector<T>& numbers) {
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
      AddPoint(field, i / 2, &numbers[i], &numbers[i + 1]);
    }
  }
  void NumberOrSignal(const Field& field, T& value, const std::optional<Signal>& signal) {
    if (!signal) Number(field, value);
  }
  void Path(const std::shared_ptr<const RecordedPath>&) {}
  template <typename Item, typename Visit>
  void Part(const Field& field, std::optional<Item>& item, const Visit& visit) {
    if (!item) return;
    const std::string outer = prefix_;
    prefix_ += std::string(field.key) + "/";
    visit(*item, this);
    prefix_ = outer;
  }
  void PointOrSignal(const Field& field, Vector2<T>& value, const std::optional<Signal>& signal) {
    if (!signal) Point(field, value);
  }
  void NumberOrServo(const Field& field, T& value, const std::optional<Signal>& signal,
                     std::optional<BasicServo<T>>& servo, const ServoFields& visit) {
    if (servo) return Part(field, servo, visit);
    NumberOrSignal(field, value, signal);
  }
  void PointOrServos(const Field& field, Vector2<T>& value, const std::optional<Signal>& signal,
                     std::optional<BasicServo<T>> (&servos)[2], const ServoFields& visit) {
    if (signal) return;
    const std::string outer = prefix_;
    for (int i = 0; i < 2; ++i) {
      const char* const component = i == 0 ? "/x" : "/y";
      if (!servos[i]) {
        Add(field, component, &value[i]);
        continue;
      }
      prefix_ += std::string(field.key) + component + "/";
      visit(*servos[i], this);
      prefix_ = outer;
    }
  }

 private:
  void Add(const Field& field, const std::string& component, T* value) {
    if (!field.parameter || !field.present) return;
    numbers_.push_back({prefix_ + field.key + component, value, field.kind, field.dimension});
  }
  void AddPoint(const Field& field, std::size_t index, T* x, T* y) {
    const std::string place = "/" + std::to_string(index);
    Add(field, place + "/x", x);
    Add(field, place + "/y", y);
  }

  BasicScene<T>* scene_;
  std::vector<JointPlace> places_;
  std::string prefix_;
  std::vector<SceneNumber<T>> numbers_;
};

// All numbers of an item in the order of its fields, and which of the optional ones are there.
class ItemNumbers {
 public:
  void Number(const Field&, double value) { numbers_.push_back(value); }
  void Optional(const Field& field, const std::optional<double>& value) {
    Number(field, value ? 1.0 : 0.0);
    if (value) Number(field, *value);
  }
  void Point(const Field& field, const Vector2<double>& value) {
    Numbers(field, value.x(), value.y());
  }
  void Points(const Field& field, const std::vector<Vector2<double>>& values) {
    Number(field, static_cast<double>(values.size()));
    for (const Vector2<double>& value : values) Point(field, value);
  }
  void List(const Field& field, const std::vector<double>& values) {
    Number(field, static_cast<double>(values.size()));
    for (const double value : values) Number(field, value);
  }
  void Anchors(const Field& field, const Vector2<double> (&anchors)[2]) {
    for (const Vector2<double>& anchor : anchors) Point(field, anchor);
  }
  void Interval(const Field& field, const std::optional<std::pair<double, double>>& value) {
    Number(field, value ? 1.0 : 0.0);
    if (value) Numbers(field, value->first, value->second);
  }
  void Numbers(const Field&, double x, double y) { numbers_.insert(numbers_.end(), {x, y}); }
  void Vertices(const Field& field, const std::vector<double>& numbers) {
    for (const double number : numbers) Number(field, number);
  }
  void NumberOrSignal(const Field& field, double value, const std::optional<Signal>&) {
    Number(field, value);
  }
  void Path(const std::shared_ptr<const RecordedPath>&) {}
  template <typename Item, typename Visit>
  void Part(const Field& field, const std::optional<Item>& item, const Visit& visit) {
    Number(field, item ? 1.0 : 0.0);
    if (item) visit(*item, this);
  }
  void PointOrSignal(const Field& field, const Vector2<double>& value,
                     const std::optional<Signal>&) {
    Point(field, value);
  }
  void NumberOrServo(const Field& field, double value, const std::optional<Signal>& signal,
                     const std::optional<BasicServo<double>>& servo, const ServoFields& visit) {
    NumberOrSignal(field, value, signal);
    Part(field, servo, visit);
  }
  void PointOrServos(const Field& field, const Vector2<double>& value,
                     const std::optional<Signal>& signal,
                     const std::optional<BasicServo<double>> (&servos)[2],
                     const ServoFields& visit) {
    PointOrSignal(field, value, signal);
    for (const auto& servo : servos) Part(field, servo, visit);
  }

  const std::vector<double>& numbers() const { return numbers_; }

 private:
  std::vector<double> numbers_;
};

// Sets the numbers of an item to those of another one.
template <typename T>
class SetNumbers {
 public:
  explicit SetNumbers(const ItemNumbers& from) : next_(from.numbers().data()) {}

  void Number(const Field&, T& value) { value = T(*next_++); }
  void Optional(const Field&, std::optional<T>& value) {
    if (Has()) value = T(*next_++);
  }
  void Point(const Field& field, Vector2<T>& value) { Numbers(field, value.x(), value.y()); }
  void Points(const Field& field, std::vector<Vector2<T>>& values) {
    values.resize(static_cast<std::size_t>(*next_++));
    for (Vector2<T>& value : values) Point(field, value);
  }
  void List(const Field& field, std::vector<T>& values) {
    values.resize(static_cast<std::size_t>(*next_++));
    for (T& value : values) Number(field, value);
  }
  void Anchors(const Field& field, Vector2<T> (&anchors)[2]) {
    for (Vector2<T>& anchor : anchors) Point(field, anchor);
  }
  void Interval(const Field& field, std::optional<std::pair<T, T>>& value) {
    if (!Has()) return;
    value.emplace();
    Numbers(field, value->first, value->second);
  }
  void Numbers(const Field& field, T& x, T& y) {
    Number(field, x);
    Number(field, y);
  }
  void Vertices(const Field& field, std::vector<T>& numbers) {
    for (T& number : numbers) Number(field, number);
  }
  void NumberOrSignal(const Field& field, T& value, const std::optional<Signal>&) {
    Number(field, value);
  }
  void PointOrSignal(const Field& field, Vector2<T>& value, const std::optional<Signal>&) {
    Point(field, value);
  }
  void NumberOrServo(const Field& field, T& value, const std::optional<Signal>& signal,
                     std::optional<BasicServo<T>>& servo, const ServoFields& visit) {
    NumberOrSignal(field, value, signal);
    Part(field, servo, visit);
  }
  void PointOrServos(const Field& field, Vector2<T>& value, const std::optional<Signal>& signal,
                     std::optional<BasicServo<T>> (&servos)[2], const ServoFields& visit) {
    PointOrSignal(field, value, signal);
    for (auto& servo : servos) Part(field, servo, visit);
  }
  void Path(const std::shared_ptr<const RecordedPath>&) {}
  template <typename Item, typename Visit>
  void Part(const Field&, std::optional<Item>& item, const Visit& visit) {
    if (!Has()) return;
    if (!item) item.emplace();  // what of it is no number has been copied already
    visit(*item, this);
  }

 private:
  bool Has() { return *next_++ != 0.0; }
  const double* next_;
};

}  // namespace internal

template <typename T>
std::vector<SceneNumber<T>> EnumerateNumbers(BasicScene<T>* scene) {
  return internal::NumberList<T>(scene).Collect();
}

template <typename T>
BasicScene<T> CastScene(const Scene& scene) {
  BasicScene<T> result;
  result.name = scene.name;
  result.path = scene.path;
  const auto copy_series = [](const auto& from, auto* to) {
    if (from) to->emplace().target_signal = from->target_signal;
  };
  // What is no number is copied before the fields are visited, because it tells which there are.
  const auto cast = [](const auto& from, auto* to, const auto& visit) {
    internal::ItemNumbers numbers;
    visit(from, &numbers);
    internal::SetNumbers<T> set(numbers);
    visit(*to, &set);
  };
  cast(scene, &result,
       [](auto& item, auto* visitor) { visitor->Point(kGravityField, item.gravity); });
  for (const auto& from : scene.bodies) {
    BasicBody<T>& body = result.bodies.emplace_back();
    body.name = from.name;
    body.motion = from.motion;
    body.shape.type = from.shape.type;
    body.shape.closed = from.shape.closed;
    body.shape.solid = from.shape.solid;
    body.shape.numbers.resize(from.shape.numbers.size());
    if (from.driven) body.driven.emplace().path = from.driven->path;
    cast(from, &body, [](auto& item, auto* visitor) {
      VisitShape(item.shape, visitor);
      VisitContactPoints(item, visitor);
      VisitBody(item, visitor);
    });
  }
  for (const auto& from : scene.joints) {
    BasicJoint<T>& joint = result.joints.emplace_back();
    joint.name = from.name;
    joint.type = from.type;
    std::copy_n(from.bodies, 2, joint.bodies);
    std::copy_n(from.coupled, 2, joint.coupled);
    joint.effort_signal = from.effort_signal;
    copy_series(from.effort_servo, &joint.effort_servo);
    joint.contact = from.contact;
    cast(from, &joint, [](auto& item, auto* visitor) { VisitJoint(item, true, visitor); });
  }
  for (const auto& from : scene.springs) {
    BasicSpring<T>& spring = result.springs.emplace_back();
    spring.name = from.name;
    std::copy_n(from.bodies, 2, spring.bodies);
    cast(from, &spring, [](auto& item, auto* visitor) { VisitSpring(item, visitor); });
  }
  for (const auto& from : scene.forces) {
    BasicForce<T>& force = result.forces.emplace_back();
    force.name = from.name;
    force.body = from.body;
    force.force_signal = from.force_signal;
    force.torque_signal = from.torque_signal;
    for (int i = 0; i < 2; ++i) copy_series(from.force_servos[i], &force.force_servos[i]);
    copy_series(from.torque_servo, &force.torque_servo);
    cast(from, &force, [](auto& item, auto* visitor) { VisitForce(item, visitor); });
  }
  for (const auto& from : scene.pairs) {
    BasicPair<T>& pair = result.pairs.emplace_back();
    std::copy_n(from.bodies, 2, pair.bodies);
    cast(from, &pair, [](auto& item, auto* visitor) { VisitPair(item, visitor); });
  }
  result.no_contact = scene.no_contact;
  result.simulation = scene.simulation;
  return result;
}

}  // namespace tangible
