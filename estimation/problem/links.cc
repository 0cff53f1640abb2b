// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/estimation/problem/tolerances.h"

namespace tangible {
namespace {

constexpr int kWorld = -1;

/// What a link moves, and which way.
struct Moved {
  Vector2<double> from{0.0, 0.0}, to{0.0, 0.0};  ///< m, world
  int body = kWorld;                             ///< of the link
  std::vector<int> beyond;                       ///< bodies
  bool carries = false;                          ///< the body's centre of mass is at `to`
  double Length() const { return (to - from).norm(); }
  bool Has(int one) const { return std::find(beyond.begin(), beyond.end(), one) != beyond.end(); }
};

Vector2<double> Turned(double angle, const Vector2<double>& v) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

/// A world place of a point, before joints turn.
Vector2<double> PlaceOf(const Scene& scene, const BodyPoint& point) {
  const auto& body = scene.bodies[static_cast<size_t>(point.body)];
  return body.position + Turned(body.angle, point.at);
}

bool IsFixed(const Scene& scene, int body) {
  return body == kWorld || scene.bodies[static_cast<size_t>(body)].motion != Motion::kMoving;
}

/// The bodies that hang from `outer` when joint `at` is cut; returns what is wrong or empty.
std::string FindBeyond(const Scene& scene, int at, int outer, Moved* moved) {
  moved->beyond = {outer};
  for (size_t next = 0; next < moved->beyond.size(); ++next) {
    const int body = moved->beyond[next];
    if (body == moved->body || IsFixed(scene, body)) {
      return "expected bodies beyond '" + scene.joints[static_cast<size_t>(at)].name +
             "' that hang from it alone, got other joints that hold them";
    }
    for (size_t j = 0; j < scene.joints.size(); ++j) {
      const auto& joint = scene.joints[j];
      for (const int side : {0, 1}) {
        const int other = joint.bodies[1 - side];
        if (static_cast<int>(j) != at && joint.bodies[side] == body && !moved->Has(other)) {
          moved->beyond.push_back(other);
        }
      }
    }
  }
  return "";
}

std::string Find(const Scene& scene, const std::vector<BodyPoint>& points, const Link& link,
                 Moved* moved) {
  const auto& from = scene.joints[static_cast<size_t>(link.from)];
  moved->from = from.anchors[0];
  if (from.type == JointType::kDistance || from.type == JointType::kFixedAngle) {
    return "expected a joint with one anchor as from, got '" + from.name + "'";
  }
  int outer = kWorld;
  if (link.to_joint >= 0) {
    const auto& to = scene.joints[static_cast<size_t>(link.to_joint)];
    if (to.type == JointType::kDistance || to.type == JointType::kFixedAngle) {
      return "expected a joint with one anchor as to, got '" + to.name + "'";
    }
    moved->to = to.anchors[0];
    for (const int side : {0, 1}) {
      const int body = to.bodies[side];
      if (!IsFixed(scene, body) && (body == from.bodies[0] || body == from.bodies[1])) {
        moved->body = body;
        outer = to.bodies[1 - side];
      }
    }
    if (moved->body == kWorld) {
      return "expected joints of the same body, got '" + from.name + "' and '" + to.name + "'";
    }
    std::string wrong = FindBeyond(scene, link.to_joint, outer, moved);
    if (!wrong.empty()) return wrong;
  } else {
    const BodyPoint& to = points[static_cast<size_t>(link.to_point)];
    if (to.body != from.bodies[0] && to.body != from.bodies[1]) {
      return "expected a point of a body of '" + from.name + "', got '" + to.name + "'";
    }
    moved->body = to.body;
    moved->to = PlaceOf(scene, to);
  }
  const Vector2<double>& centre = scene.bodies[static_cast<size_t>(moved->body)].position;
  moved->carries = (centre - moved->to).norm() <= kLinkEnd * moved->Length();
  return moved->Length() > 0.0 ? "" : "expected two places, got a length of 0";
}

/// Gathers the sets of one length.
class Sets {
 public:
  Sets(const ParameterSet& length, const Moved& moved)
      : length_(length), moved_(moved), along_((moved.to - moved.from) / moved.Length()) {}

  void Move(const std::string& path, const Vector2<double>& along) {
    for (const int axis : {0, 1}) {
      // What is only rounding of a direction along an axis moves nothing.
      if (std::abs(along[axis]) > kLinkDirection) {
        all_.push_back({path + (axis == 0 ? "/x" : "/y"), along[axis] * length_.scale,
                        along[axis] * (length_.offset - moved_.Length()), SetMode::kAdd});
      }
    }
  }
  void Move(const std::string& path) { Move(path, along_); }
  const Vector2<double>& along() const { return along_; }
  std::vector<ParameterSet> all() && { return std::move(all_); }

 private:
  const ParameterSet& length_;
  const Moved& moved_;
  Vector2<double> along_;
  std::vector<ParameterSet> all_;
};

std::vector<ParameterSet> SetsOf(const Scene& scene, const std::vector<BodyPoint>& points,
                                 const Link& link, const Moved& moved, const ParameterSet& length) {
  Sets sets(length, moved);
  const auto move_body = [&](int body) {
    sets.Move("bodies/" + scene.bodies[static_cast<size_t>(body)].name + "/position");
  };
  if (moved.carries) move_body(moved.body);
  for (const int body : moved.beyond) move_body(body);
  for (size_t j = 0; j < scene.joints.size(); ++j) {
    const auto& joint = scene.joints[j];
    const std::string path = "joints/" + joint.name + "/anchor";
    if (joint.type == JointType::kDistance) {
      for (const int side : {0, 1}) {
        if (moved.Has(joint.bodies[side])) sets.Move(path + "s/" + std::to_string(side));
      }
    } else if (joint.type != JointType::kFixedAngle && joint.type != JointType::kCoupling &&
               (static_cast<int>(j) == link.to_joint || moved.Has(joint.bodies[0]) ||
                moved.Has(joint.bodies[1]))) {
      sets.Move(path);
    }
  }
  for (const auto& spring : scene.springs) {
    for (const int side : {0, 1}) {
      if (moved.Has(spring.bodies[side])) {
        sets.Move("springs/" + spring.name + "/anchors/" + std::to_string(side));
      }
    }
  }
  for (size_t i = 0; i < points.size(); ++i) {
    const BodyPoint& point = points[i];
    if (point.body != moved.body) continue;
    const bool is_at_end = static_cast<int>(i) == link.to_point ||
                           (PlaceOf(scene, point) - moved.to).norm() <= kLinkEnd * moved.Length();
    if (is_at_end == moved.carries) continue;
    const double angle = scene.bodies[static_cast<size_t>(point.body)].angle;
    const double sign = moved.carries ? -1.0 : 1.0;
    sets.Move("points/" + point.name + "/at", sign * Turned(-angle, sets.along()));
  }
  return std::move(sets).all();
}

/// Sets of the same number are one.
void Merge(std::vector<ParameterSet> from, std::vector<ParameterSet>* into) {
  for (ParameterSet& set : from) {
    const auto same = std::find_if(into->begin(), into->end(), [&set](const ParameterSet& other) {
      return other.path == set.path && other.mode == SetMode::kAdd;
    });
    if (same == into->end()) {
      into->push_back(std::move(set));
    } else {
      same->scale += set.scale;
      same->offset += set.offset;
    }
  }
}

}  // namespace

std::string LengthPath(const Link& link) { return "links/" + link.name + "/length"; }

std::string CheckLink(const Scene& scene, const std::vector<BodyPoint>& points, const Link& link) {
  Moved moved;
  return Find(scene, points, link, &moved);
}

bool ExpandLengths(const Scene& scene, const std::vector<BodyPoint>& points,
                   const std::vector<Link>& links, std::vector<FitParameter>* parameters,
                   ParameterError* error) {
  for (size_t k = 0; k < parameters->size(); ++k) {
    FitParameter& parameter = (*parameters)[k];
    std::vector<ParameterSet> expanded;
    for (size_t i = 0; i < parameter.sets.size(); ++i) {
      const ParameterSet& set = parameter.sets[i];
      if (set.path.rfind("links/", 0) != 0) {
        Merge({set}, &expanded);
        continue;
      }
      std::vector<const Link*> of_path;
      for (const Link& one : links) {
        if (MatchesPath(set.path, LengthPath(one))) of_path.push_back(&one);
      }
      *error = {static_cast<int>(k), static_cast<int>(i), "path", ""};
      if (of_path.empty()) {
        std::string names;
        for (const Link& one : links) names += (names.empty() ? "" : ", ") + LengthPath(one);
        error->what = "parameter " + set.path + ": matches no number; of links there are: " +
                      (names.empty() ? "none" : names);
        return false;
      }
      if (set.scale == 0.0) {
        error->key = "scale";
        error->what = "expected a number other than 0, got 0";
        return false;
      }
      for (const Link* link : of_path) {
        Moved moved;
        error->what = Find(scene, points, *link, &moved);
        if (!error->what.empty()) return false;
        if (i == 0) {
          parameter.initial = parameter.initial.value_or((moved.Length() - set.offset) / set.scale);
          if (set.scale > 0.0 && !parameter.lower) parameter.lower = -set.offset / set.scale;
        }
        Merge(SetsOf(scene, points, *link, moved, set), &expanded);
      }
    }
    parameter.sets = std::move(expanded);
  }
  return true;
}

}  // namespace tangible
