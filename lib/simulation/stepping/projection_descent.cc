// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/projection_descent.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

constexpr int kMostSteps = 500;
constexpr int kStepsBetween = 5;  // trials of Newton's method
constexpr int kMostOntoJoints = 12;
constexpr double kFalls = 0.7;  // least reduction of the error in a step onto the joints

// ½|q − q̃|²_M.
double Distance(const Model<double>& model, const ProjectionIterate<double>& p) {
  double sum = 0.0;
  for (const int body : model.structure->moving) {
    const BodyIndex& index = model.structure->bodies[body];
    for (int i = 0; i < 3; ++i) {
      const double moved = p.at.pose[3 * body + i] - p.from.pose[3 * body + i];
      sum += 0.5 * model.parameters[i < 2 ? index.mass : index.inertia] * moved * moved;
    }
  }
  return sum;
}

// at = pose + fraction · step.
void Move(const Model<double>& model, const std::vector<double>& pose, double fraction,
          const std::vector<double>& step, ProjectionIterate<double>* p) {
  p->at.pose = pose;
  const ModelStructure& s = *model.structure;
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      p->at.pose[3 * s.moving[k] + i] += fraction * step[3 * k + i];
    }
  }
}

// Moves repeatedly to the nearest poses on the joints' tangents.
bool GoOntoJoints(const Model<double>& model, ProjectionIterate<double>* p) {
  const ModelStructure& s = *model.structure;
  double last = HUGE_VAL;
  for (int k = 0; k < kMostOntoJoints; ++k) {
    EvaluateProjection(model, p);
    if (JointsHold(model, *p, 0.1 * s.settings.joint_tolerance)) {
      return true;
    }
    if (!(p->error < kFalls * last) || !FactorProjection(model, p, ProjectionWeight::kMass)) {
      return false;
    }
    last = p->error;
    p->rhs.assign(3 * (s.num_blocks() + s.joints.size()), 0.0);
    for (size_t j = 0; j < s.joints.size(); ++j) {
      for (int r = 0; r < p->rows[j].rows; ++r) {
        p->rhs[3 * (s.num_blocks() + j) + r] = -p->rows[j].error[r];
      }
    }
    p->lu.Solve(p->rhs.data(), 1);
    Move(model, std::vector<double>(p->at.pose), 1.0, p->rhs, p);
  }
  return false;
}

}  // namespace

bool DescendToProjection(const Model<double>& model, const std::vector<double>& start,
                         ProjectionIterate<double>* p) {
  const ModelStructure& s = *model.structure;
  p->at.pose = p->from.pose;
  if (!std::isfinite(Distance(model, *p))) {
    return false;  // the run has diverged: q̃ − q̃ is not a number
  }
  for (const int body : s.moving) {
    std::copy_n(&start[3 * body], 3, &p->at.pose[3 * body]);
  }
  std::fill(p->multipliers.begin(), p->multipliers.end(), 0.0);
  if (!GoOntoJoints(model, p)) {
    return false;
  }
  double distance = Distance(model, *p);
  for (int k = 1; k <= kMostSteps; ++k) {
    ++p->damped_steps;
    if (!FactorProjection(model, p, ProjectionWeight::kConvex) ||
        !std::isfinite(SolveProjectionStep(model, p))) {
      return false;
    }
    const std::vector<double> step = p->rhs;
    for (size_t m = 0; m < p->multipliers.size(); ++m) {
      p->multipliers[m] += step[3 * s.num_blocks() + m];
    }
    const std::vector<double> pose = p->at.pose;
    if (k % kStepsBetween == 0) {
      const std::vector<double> multipliers = p->multipliers;
      if (ResumeProjection(model, kMostOfDescent, 0, p)) {
        return true;
      }
      p->multipliers = multipliers;
    }
    double fraction = 1.0;
    double moved = HUGE_VAL;
    for (; fraction > kShortestDescent; fraction *= 0.5) {
      Move(model, pose, fraction, step, p);
      moved = GoOntoJoints(model, p) ? Distance(model, *p) : HUGE_VAL;
      if (moved < distance) {
        break;
      }
    }
    if (!(moved < distance)) {
      Move(model, pose, 0.0, step, p);
      return ResumeProjection(model, kMostOfDescent, 0, p);
    }
    distance = moved;
  }
  return false;
}

}  // namespace tangible
