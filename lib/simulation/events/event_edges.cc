// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tangible/dynamics/elements/force.h"
#include "tangible/dynamics/elements/servo.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The steps of a run may differ in length; both steps of a boundary see the same edges there.
double NearAStepsEnd(const Model<double>& model) {
  return kShortestPart * model.structure->settings.dt;
}

// Calls visit(edge) for the knots of paths within [from, to].
template <typename Visit>
void ForEachKnot(const Model<double>& model, double from, double to, const Visit& visit) {
  const std::vector<PathIndex>& paths = model.structure->paths;
  for (const PathIndex& index : paths) {
    const int number = index.numbers + kPathDelay;
    const int path = static_cast<int>(&index - paths.data());
    const double delay = model.parameters[number];
    const std::vector<double>& times = index.path->times();
    auto knot = std::lower_bound(times.begin(), times.end(), from - delay);
    for (; knot != times.end() && *knot + delay <= to; ++knot) {
      const bool jumps = index.path->JumpsAt(static_cast<int>(knot - times.begin()));
      visit(Edge{*knot + delay, WindowEdge{number, -1, 0.0, jumps ? path : -1}, !jumps});
    }
  }
}

template <typename Visit>
void ForEachWindowEdge(const ModelStructure& structure, const Visit& visit) {
  for (size_t k = 0; k < structure.forces.size(); ++k) {
    const ForceIndex& force = structure.forces[k];
    if (force.start >= 0) visit(WindowEdge{force.start, static_cast<int>(k), -1.0});
    if (force.end >= 0) visit(WindowEdge{force.end, static_cast<int>(k), 1.0});
  }
  for (const JointIndex& joint : structure.joints) {
    if (joint.until >= 0) visit(WindowEdge{joint.until});
  }
}

// Whether a signal's values before and from row k on differ.
bool JumpsAt(const Signal& signal, size_t k) {
  if (k == 0 || signal.interpolation != Signal::Interpolation::kConstant) return false;
  const auto differs = [k](const std::vector<double>& column) {
    return k < column.size() && column[k - 1] != column[k];
  };
  return differs(signal.x) || differs(signal.y) || differs(signal.value);
}

// Calls visit(signal, row) for the rows of the signals of forces, joints and servos.
template <typename Visit>
void ForEachCorner(const ModelStructure& structure, const Visit& visit) {
  const auto rows_of = [&](int index) {
    if (index < 0) return;
    const Signal& signal = structure.signals[index];
    for (size_t k = 0; k < signal.time.size(); ++k) visit(signal, k);
  };
  for (const ForceIndex& force : structure.forces) {
    rows_of(force.force_signal);
    rows_of(force.torque_signal);
  }
  for (const JointIndex& joint : structure.joints) rows_of(joint.effort_signal);
  for (const ServoIndex& servo : structure.servos) rows_of(servo.signal);
}

// Whether the edge is the end of a joint.
bool IsRelease(const ModelStructure& s, const Edge& edge) {
  return std::any_of(s.joints.begin(), s.joints.end(), [&](const JointIndex& joint) {
    return joint.until >= 0 && joint.until == edge.window.number;
  });
}

}  // namespace

std::vector<Edge> EdgesWithin(const Model<double>& model, double from, double to) {
  std::vector<Edge> edges;
  const ModelStructure& structure = *model.structure;
  const double near = NearAStepsEnd(model);
  const auto add = [&](double time, const WindowEdge& window, bool steps) {
    if (time > from + near && time < to - near) {
      edges.push_back({time, window, false, steps});
    }
  };
  ForEachWindowEdge(structure, [&](const WindowEdge& window) {
    add(model.parameters[window.number], window, false);
  });
  ForEachCorner(structure, [&](const Signal& signal, size_t k) {
    add(signal.time[k], WindowEdge(), JumpsAt(signal, k));
  });
  ForEachKnot(model, from, to, [&](const Edge& edge) {
    if (IsSameInstant(structure, edge.time, from) || IsSameInstant(structure, edge.time, to))
      return;
    edges.push_back(edge);
  });
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& x, const Edge& y) { return x.time < y.time; });
  return edges;
}

void EdgeGroup::Add(const Edge& edge) {
  time = any ? std::min(time, edge.time) : edge.time;
  any = true;
  steps = steps || edge.steps;
  if (edge.window.number < 0) return;
  if (edge.window.path >= 0) {
    const auto place =
        std::lower_bound(paths.begin(), paths.end(), edge.window.path,
                         [](const WindowEdge& one, int path) { return one.path < path; });
    if (place == paths.end() || place->path != edge.window.path) paths.insert(place, edge.window);
    return;
  }
  if (window.number < 0 || (gives_way && !edge.gives_way)) {
    window = edge.window;
    gives_way = edge.gives_way;
  } else if (edge.window.force >= 0) {
    further.push_back(edge.window);
  }
}

void EdgeGroup::PutInOrder() {
  if ((window.number < 0 || gives_way) && !paths.empty()) {
    window = paths.front();
    gives_way = false;
    paths.erase(paths.begin());
  } else {
    paths.clear();
  }
  if (!steps || window.number < 0) return;
  if (gives_way) window = WindowEdge();
  if (window.force < 0) return;
  further.insert(further.begin(), window);
  window = WindowEdge();
}

EdgeGroup EdgeGroup::Rest() const {
  EdgeGroup rest;
  if (paths.empty()) return rest;
  rest.any = rest.follows = true;
  rest.time = time;
  rest.window = paths.front();
  rest.gives_way = false;
  rest.paths.assign(paths.begin() + 1, paths.end());
  return rest;
}

EdgeGroup NextEdges(const std::vector<Edge>& edges, double now, double rounding, double width) {
  EdgeGroup group;
  for (const Edge& edge : edges) {
    if (!(edge.time > now + rounding)) continue;
    if (group.any && edge.time > group.time + std::max(rounding, width)) break;
    group.Add(edge);
  }
  group.PutInOrder();
  return group;
}

EdgeGroup EdgesAt(const Model<double>& model, double time) {
  EdgeGroup group;
  const double near = NearAStepsEnd(model);
  ForEachWindowEdge(*model.structure, [&](const WindowEdge& window) {
    const double edge = model.parameters[window.number];
    if (std::abs(edge - time) <= near) group.Add({edge, window});
  });
  const ModelStructure& s = *model.structure;
  if (group.any && !s.signals.empty()) {
    ForEachCorner(s, [&](const Signal& signal, size_t k) {
      group.steps = group.steps || (std::abs(signal.time[k] - time) <= near && JumpsAt(signal, k));
    });
  }
  if (!s.paths.empty()) {
    ForEachKnot(model, BesideInstant(s, time, PathSide::kBefore),
                BesideInstant(s, time, PathSide::kAfter), [&](const Edge& edge) {
                  if (!edge.gives_way && IsSameInstant(s, edge.time, time)) group.Add(edge);
                });
  }
  group.PutInOrder();
  return group;
}

std::vector<LoadJump> LoadJumpsWithin(const Model<double>& model, double from, double to) {
  const ModelStructure& s = *model.structure;
  std::vector<LoadJump> jumps;
  const auto add = [&](double time, const std::vector<int>& bodies, const std::string& what) {
    if (time >= from && time <= to) jumps.push_back({time, bodies, what});
  };
  const auto add_number = [&](int number, const std::vector<int>& bodies, const std::string& what) {
    if (number >= 0) add(model.parameters[number], bodies, what);
  };
  const auto add_signal = [&](int index, const std::vector<int>& bodies, const std::string& what) {
    if (index < 0) return;
    const Signal& signal = s.signals[index];
    for (size_t k = 1; k < signal.time.size(); ++k) {
      if (JumpsAt(signal, k)) add(signal.time[k], bodies, what);
    }
  };
  for (const ForceIndex& force : s.forces) {
    add_number(force.start, {force.body}, "the window of force " + force.name);
    add_number(force.end, {force.body}, "the window of force " + force.name);
    add_signal(force.force_signal, {force.body}, "the signal of force " + force.name);
    add_signal(force.torque_signal, {force.body}, "the signal of force " + force.name);
  }
  for (const JointIndex& joint : s.joints) {
    const size_t before = jumps.size();
    add_number(joint.until, {joint.a, joint.b}, "joint " + joint.name);
    if (jumps.size() > before) jumps.back().is_of_a_joint = true;
    add_signal(joint.effort_signal, {joint.a, joint.b}, "the effort of joint " + joint.name);
  }
  for (const ServoIndex& servo : s.servos) {
    if (servo.joint >= 0) {
      const JointIndex& joint = s.joints[servo.joint];
      add_signal(servo.signal, {joint.a, joint.b}, "the target of joint " + joint.name);
    } else {
      const ForceIndex& force = s.forces[servo.force];
      add_signal(servo.signal, {force.body}, "the target of force " + force.name);
    }
  }
  ForEachKnot(model, from, to, [&](const Edge& edge) {
    for (const PathIndex& path : s.paths) {
      if (edge.gives_way || path.numbers + kPathDelay != edge.window.number) continue;
      const size_t before = jumps.size();
      add(edge.time, {path.body}, "the speed of body " + s.bodies[path.body].name);
      if (jumps.size() > before) jumps.back().driven = path.body;
    }
  });
  return jumps;
}

bool OwnSignalSteps(const ModelStructure& structure, const ForceIndex& force, double from,
                    double to) {
  const auto steps = [&](int index) {
    if (index < 0) return false;
    const Signal& signal = structure.signals[index];
    for (size_t k = 1; k < signal.time.size(); ++k) {
      if (signal.time[k] >= from && signal.time[k] <= to && JumpsAt(signal, k)) return true;
    }
    return false;
  };
  if (steps(force.force_signal) || steps(force.torque_signal)) return true;
  return std::any_of(
      structure.servos.begin(), structure.servos.end(), [&](const ServoIndex& servo) {
        return servo.force >= 0 && &structure.forces[servo.force] == &force && steps(servo.signal);
      });
}

namespace {

// Calls visit(path) for the paths whose rate jumps at a time.
template <typename Visit>
void ForEachJump(const Model<double>& model, double time, const Visit& visit) {
  const ModelStructure& s = *model.structure;
  ForEachKnot(model, BesideInstant(s, time, PathSide::kBefore),
              BesideInstant(s, time, PathSide::kAfter), [&](const Edge& edge) {
                if (edge.gives_way || !IsSameInstant(s, edge.time, time)) return;
                for (const PathIndex& path : s.paths) {
                  if (path.numbers + kPathDelay == edge.window.number) visit(path);
                }
              });
}

}  // namespace

bool JumpPullsJoint(const Model<double>& model, double time) {
  bool pulls = false;
  ForEachJump(model, time, [&](const PathIndex& path) {
    for (const JointIndex& joint : model.structure->joints) {
      pulls = pulls || joint.a == path.body || joint.b == path.body;
    }
  });
  return pulls;
}

bool PathJumps(const Model<double>& model, double time) {
  bool jumps = false;
  ForEachJump(model, time, [&](const PathIndex&) { jumps = true; });
  return jumps;
}

double JustBefore(const Model<double>& model, double t) {
  const ModelStructure& s = *model.structure;
  const double before = std::nextafter(t - NearAStepsEnd(model), -HUGE_VAL);
  return s.paths.empty() ? before : std::min(before, BesideInstant(s, t, PathSide::kBefore));
}

double JustAfter(const Model<double>& model, double t) {
  const ModelStructure& s = *model.structure;
  const double after = std::nextafter(t + NearAStepsEnd(model), HUGE_VAL);
  return s.paths.empty() ? after : std::max(after, BesideInstant(s, t, PathSide::kAfter));
}

namespace {

// Whether the directions vary the time of an edge, or those of both edges alike.
bool Varies(const ModelStructure& s, const RowMatrixXd& directions, int number) {
  return !directions.row(s.ParameterVariable(number)).isZero(0.0);
}
bool VaryAlike(const ModelStructure& s, const RowMatrixXd& directions, int number, int other) {
  return directions.row(s.ParameterVariable(number)) == directions.row(s.ParameterVariable(other));
}

std::string NameOfEdge(const ModelStructure& s, const WindowEdge& window) {
  if (window.force >= 0) return "the window of force " + s.forces[window.force].name;
  for (const JointIndex& joint : s.joints) {
    if (joint.until == window.number) return "the end of joint " + joint.name;
  }
  const auto index = std::find_if(s.paths.begin(), s.paths.end(), [&](const PathIndex& path) {
    return path.numbers == window.number - kPathDelay;
  });
  return "the speed of body " + s.bodies[index->body].name;
}

std::string CoincideAt(const ModelStructure& s, const WindowEdge& a, const WindowEdge& b,
                       double time) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", time);
  return "expected jumps of paths and ends of joints at times of their own where their "
         "derivatives are asked for, got " +
         NameOfEdge(s, a) + " and " + NameOfEdge(s, b) + ", which both change at t = " + text +
         " s: the derivative depends on their order (set one a little apart)";
}

// Calls visit(a, b) for neighbours among the edges at one instant of which the directions vary the
// time of one at least, until it returns false. Two windows of forces, and knots at which nothing
// jumps, do not count: their order is decided elsewhere, or does not matter.
template <typename Visit>
void ForEachCoincidence(const Model<double>& model, const RowMatrixXd& directions,
                        const Visit& visit) {
  const ModelStructure& s = *model.structure;
  if ((s.paths.empty() && !s.has_releases) || s.settings.stepping == Stepping::kFixed) return;
  std::vector<Edge> edges;
  ForEachKnot(model, 0.0, s.settings.duration, [&](const Edge& edge) {
    if (!edge.gives_way) edges.push_back(edge);
  });
  ForEachWindowEdge(s, [&](const WindowEdge& window) {
    edges.push_back({model.parameters[window.number], window});
  });
  std::sort(edges.begin(), edges.end(),
            [](const Edge& x, const Edge& y) { return x.time < y.time; });
  for (size_t i = 1; i < edges.size(); ++i) {
    const Edge& a = edges[i - 1];
    const Edge& b = edges[i];
    if (a.window.number == b.window.number || !IsSameInstant(s, a.time, b.time)) continue;
    if (a.window.force >= 0 && b.window.force >= 0) continue;
    if (a.time <= 0.0) continue;
    if (!Varies(s, directions, a.window.number) && !Varies(s, directions, b.window.number))
      continue;
    if (!visit(a, b)) return;
  }
}

}  // namespace

std::string CoincidingEdges(const Model<double>& model, const RowMatrixXd& directions) {
  const ModelStructure& s = *model.structure;
  std::string message;
  ForEachCoincidence(model, directions, [&](const Edge& a, const Edge& b) {
    if (a.window.path >= 0 && b.window.path >= 0) return true;
    const bool alike = VaryAlike(s, directions, a.window.number, b.window.number);
    if (alike && IsRelease(s, a) && IsRelease(s, b)) return true;
    message = CoincideAt(s, a.window, b.window, b.time);
    return false;
  });
  return message;
}

bool IsPathsDelay(const ModelStructure& structure, int number) {
  return std::any_of(structure.paths.begin(), structure.paths.end(),
                     [&](const PathIndex& index) { return index.numbers + kPathDelay == number; });
}

bool HasCoincidingPaths(const Model<double>& model, const RowMatrixXd& directions) {
  bool has = false;
  ForEachCoincidence(model, directions, [&](const Edge& a, const Edge& b) {
    has = a.window.path >= 0 && b.window.path >= 0 &&
          !VaryAlike(*model.structure, directions, a.window.number, b.window.number);
    return !has;
  });
  return has;
}

std::string CoupledPaths(const Model<double>& model, const RowMatrixXd& directions, int number,
                         int other, double time) {
  const ModelStructure& s = *model.structure;
  if (!IsPathsDelay(s, number) || !IsPathsDelay(s, other) ||
      VaryAlike(s, directions, number, other)) {
    return "";
  }
  return CoincideAt(s, WindowEdge{number}, WindowEdge{other}, time);
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
    for (size_t k = 0; k < s.servos.size(); ++k) {
      if (s.servos[k].force != window.force) continue;
      AddServoLoad(model, segment.before, static_cast<int>(k), {segment.time, inside, 0.0},
                   window.side, &problem->load);
    }
  }
}

}  // namespace tangible
