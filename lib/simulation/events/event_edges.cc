// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_edges.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/force.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The steps of a run may differ in length; both steps of a boundary see the same edges there.
double NearAStepsEnd(const Model<double>& model) {
  return kShortestPart * model.structure->settings.dt;
}

template <typename Visit>
void ForEachWindowEdge(const ModelStructure& structure, const Visit& visit) {
  for (size_t k = 0; k < structure.forces.size(); ++k) {
    const ForceIndex& force = structure.forces[k];
    if (force.start >= 0) visit(WindowEdge{force.start, static_cast<int>(k), -1.0});
    if (force.end >= 0) visit(WindowEdge{force.end, static_cast<int>(k), 1.0});
  }
}

}  // namespace

std::vector<Edge> EdgesWithin(const Model<double>& model, double from, double to) {
  std::vector<Edge> edges;
  const ModelStructure& structure = *model.structure;
  const double near = NearAStepsEnd(model);
  const auto add = [&](double time, const WindowEdge& window) {
    if (time > from + near && time < to - near) {
      edges.push_back({time, window});
    }
  };
  const auto add_signal = [&](int index) {
    if (index >= 0) {
      for (const double time : structure.signals[index].time) {
        add(time, WindowEdge());
      }
    }
  };
  ForEachWindowEdge(
      structure, [&](const WindowEdge& window) { add(model.parameters[window.number], window); });
  for (const ForceIndex& force : structure.forces) {
    add_signal(force.force_signal);
    add_signal(force.torque_signal);
  }
  for (const JointIndex& joint : structure.joints) {
    add_signal(joint.effort_signal);
  }
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& x, const Edge& y) { return x.time < y.time; });
  return edges;
}

void EdgeGroup::Add(const Edge& edge) {
  time = any ? std::min(time, edge.time) : edge.time;
  any = true;
  if (edge.window.number < 0) return;
  if (window.number < 0) {
    window = edge.window;
  } else {
    further.push_back(edge.window);
  }
}

EdgeGroup NextEdges(const std::vector<Edge>& edges, double now, double rounding) {
  EdgeGroup group;
  for (const Edge& edge : edges) {
    if (!(edge.time > now + rounding)) continue;
    if (group.any && edge.time > group.time + rounding) break;
    group.Add(edge);
  }
  return group;
}

EdgeGroup EdgesAt(const Model<double>& model, double time) {
  EdgeGroup group;
  const double near = NearAStepsEnd(model);
  ForEachWindowEdge(*model.structure, [&](const WindowEdge& window) {
    const double edge = model.parameters[window.number];
    if (std::abs(edge - time) <= near) group.Add({edge, window});
  });
  return group;
}

void AddEdgesToCome(const Model<double>& model, const Segment& segment,
                    ContactProblem<double>* problem) {
  const ModelStructure& s = *model.structure;
  for (const WindowEdge& window : segment.further_edges) {
    const ForceIndex& force = s.forces[window.force];
    const int block = s.bodies[force.body].block;
    if (block < 0) continue;
    // Signals are read on the side of the edge on which the force acts.
    const double inside = window.side < 0.0 ? segment.middle : 2.0 * segment.time - segment.middle;
    const double* none = nullptr;
    double load[3];
    ForceAt(s, force, segment.before.pose[3 * force.body + 2], &model.parameters[force.numbers],
            none, none, segment.time, inside, load);
    for (int i = 0; i < 3; ++i) {
      problem->load[3 * block + i] += window.side * load[i];
    }
  }
}

}  // namespace tangible
