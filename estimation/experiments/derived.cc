// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/derived.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/experiments/tolerances.h"
#include "tangible/estimation/uncertainty/tolerances.h"

namespace tangible {
namespace {

template <typename T>
const T* Find(const std::vector<T>& items, const std::string& name) {
  const auto found = std::find_if(items.begin(), items.end(),
                                  [&name](const T& item) { return item.name == name; });
  return found == items.end() ? nullptr : &*found;
}

struct Inertia {
  double p1 = 0.0, p2 = 0.0, p3 = 0.0, p4 = 0.0;
  double first_length = 0.0;
};

Inertia InertiaOf(const Scene& scene) {
  const auto* link1 = Find(scene.bodies, "link1");
  const auto* link2 = Find(scene.bodies, "link2");
  const auto* pivot = Find(scene.joints, "pivot");
  const auto* elbow = Find(scene.joints, "elbow");
  Inertia inertia;
  if (link1 == nullptr || link2 == nullptr || pivot == nullptr || elbow == nullptr) {
    inertia.p3 = inertia.first_length = std::nan("");
    return inertia;
  }
  const double a1 = pivot->anchors[0].y() - link1->position.y();
  const double a2 = elbow->anchors[0].y() - link2->position.y();
  const double length = pivot->anchors[0].y() - elbow->anchors[0].y();
  inertia.first_length = length;
  inertia.p1 = link1->mass * a1 * a1 + link1->inertia.value_or(0.0) + link2->mass * length * length;
  inertia.p2 = link2->mass * a2 * a2 + link2->inertia.value_or(0.0);
  inertia.p3 = link2->mass * length * a2;
  inertia.p4 = link1->mass * a1 + link2->mass * length;
  return inertia;
}

struct Single {
  double moment = 0.0;  ///< I + m a², kg m²
  double first = 0.0;   ///< m a, kg m
  double damping = 0.0;
  double gravity = 0.0;
};

Single SingleOf(const Scene& scene) {
  const auto* body = Find(scene.bodies, "pendulum");
  const auto* pivot = Find(scene.joints, "pivot");
  if (body == nullptr || pivot == nullptr) {
    return {std::nan(""), std::nan(""), 0.0, 0.0};
  }
  const double a = pivot->anchors[0].y() - body->position.y();
  return {body->inertia.value_or(0.0) + body->mass * a * a, body->mass * a, pivot->damping,
          -scene.gravity.y()};
}

}  // namespace

std::vector<DerivedQuantity> Derive(const std::vector<DerivedFunction>& functions,
                                    const Eigen::VectorXd& estimate, const RowMatrixXd& covariance,
                                    ParameterizedScene* scene) {
  const Eigen::Index size = estimate.size();
  const auto values = [&](const Eigen::VectorXd& p) {
    Eigen::VectorXd f =
        Eigen::VectorXd::Constant(static_cast<Eigen::Index>(functions.size()), std::nan(""));
    if (scene->Set(p)) {
      for (size_t i = 0; i < functions.size(); ++i) {
        f[static_cast<Eigen::Index>(i)] = functions[i].value(scene->scene());
      }
    }
    return f;
  };
  RowMatrixXd held = covariance;
  RowMatrixXd gradient = RowMatrixXd::Zero(static_cast<Eigen::Index>(functions.size()), size);
  for (Eigen::Index k = 0; k < size; ++k) {
    if (!std::isfinite(covariance(k, k))) {
      held.row(k).setZero();
      held.col(k).setZero();
      continue;
    }
    const double step = kDerivedStep * scene->entries()[k].scale;
    Eigen::VectorXd p = estimate;
    p[k] = estimate[k] + step;
    const Eigen::VectorXd above = values(p);
    p[k] = estimate[k] - step;
    gradient.col(k) = (above - values(p)) / (2.0 * step);
  }
  const Eigen::VectorXd at = values(estimate);
  std::vector<DerivedQuantity> quantities;
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const double deviation = std::sqrt(gradient.row(i).dot(held * gradient.row(i).transpose()));
    quantities.push_back({functions[i].name, at[i], deviation, at[i] - kNormalQuantile * deviation,
                          at[i] + kNormalQuantile * deviation});
  }
  return quantities;
}

std::vector<DerivedFunction> DoublePendulumQuantities() {
  const auto ratio = [](double Inertia::*numerator) {
    return [numerator](const Scene& scene) {
      const Inertia inertia = InertiaOf(scene);
      return inertia.*numerator / inertia.p3;
    };
  };
  return {{"p1/p3", ratio(&Inertia::p1)},
          {"p2/p3", ratio(&Inertia::p2)},
          {"p4/p3", ratio(&Inertia::p4)},
          {"g/L1",
           [](const Scene& scene) { return -scene.gravity.y() / InertiaOf(scene).first_length; }}};
}

std::vector<DerivedFunction> SinglePendulumQuantities() {
  return {{"effective length",
           [](const Scene& scene) {
             const Single single = SingleOf(scene);
             return single.moment / single.first;
           }},
          {"damping ratio", [](const Scene& scene) {
             const Single single = SingleOf(scene);
             return single.damping /
                    (2.0 * std::sqrt(single.moment * single.first * single.gravity));
           }}};
}

}  // namespace tangible
