// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A scene that uses every kind of thing, for the tests of this folder.

namespace tangible {

/// Bodies 0 ball, 1 rod, 2 hull (moving), 3 floor (static), 4 paddle (kinematic), 5 mass (moving,
/// no shape); joints 0 to 4 of each type; two springs; two forces; two pairs.
inline constexpr char kFullScene[] = R"({
  "name": "everything", "gravity": [0.5, -1.62],
  "bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1.5, "inertia": 0.005,
     "position": [0.25, 1], "angle": 0.125, "velocity": [1, 2], "angular_velocity": 3,
     "friction": 0.3, "restitution": 0.5, "linear_damping": 0.01, "angular_damping": 0.02},
    {"name": "rod", "shape": {"capsule": {"length": 1, "radius": 0.05}}, "mass": 2,
     "position": [1, 1]},
    {"name": "hull", "shape": {"polygon": {"vertices": [[-1, -1], [2, -1], [-1, 2]]}}, "mass": 3,
     "position": [5, 5]},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 2], "offset": 0.1}},
     "friction": 0.7},
    {"name": "paddle", "kinematic": true, "shape": {"box": {"size": [0.5, 0.25]}},
     "velocity": [0, 1], "angular_velocity": 0.5},
    {"name": "mass", "mass": 4, "inertia": 0.5, "position": [-3, 0]}
  ],
  "joints": [
    {"name": "hinge", "type": "revolute", "bodies": ["ball", "world"], "anchor": [0, 2],
     "angle": 0.1, "rate": -0.2, "damping": 0.3, "limits": [-1, 2], "effort": 0.4,
     "limit_restitution": 0.25, "motor": {"speed": 1.5, "limit": 2}},
    {"name": "slider", "type": "prismatic", "bodies": ["rod", "ball"], "anchor": [1, 0],
     "axis": [3, 4], "displacement": 0.6, "rate": 0.7, "damping": 0.8, "limits": [-0.5, 0.5],
     "effort": 0.9, "contact": true},
    {"name": "glue", "type": "weld", "bodies": ["hull", "rod"], "anchor": [2, 3]},
    {"name": "rope", "type": "distance", "bodies": ["mass", "hull"], "anchors": [[-3, 0], [5, 5]]},
    {"name": "level", "type": "fixed_angle", "bodies": ["mass", "hull"]}
  ],
  "springs": [
    {"name": "s", "bodies": ["ball", "world"], "anchors": [[0, 1], [0, 2]], "stiffness": 10,
     "damping": 0.1, "rest_length": 1},
    {"name": "t", "bodies": ["floor", "mass"], "anchors": [[0, 0], [-3, 0]], "stiffness": 0,
     "rest_length": 0}
  ],
  "forces": [
    {"name": "push", "body": "ball", "force": [1, 2], "torque": 3, "at": [4, 5], "start": 0.25,
     "end": 0.5},
    {"name": "thrust", "body": "rod"}
  ],
  "pairs": [
    {"bodies": ["ball", "floor"], "friction": 0.9, "restitution": 0.8},
    {"bodies": ["h*", "*"], "friction": 0.2}
  ],
  "no_contact": [["ball", "rod"], ["paddle", "*"]],
  "simulation": {
    "dt": 0.002, "duration": 3, "stepping": "event", "integrator": "trapezoidal",
    "joint_correction": "projection", "joint_tolerance": 1e-9,
    "friction_mixing": "average", "restitution_mixing": "geometric_mean", "impact_law": "poisson",
    "restitution_threshold": 0.01, "recovery_speed": 2, "contact_margin": 0.001,
    "max_events_per_step": 7, "lcp_tolerance": 1e-11, "lcp_max_iterations": 50}
})";

}  // namespace tangible
