"""A ball is thrown so that it bounces into a cup: gradient descent through the bounce."""

import sys

import numpy as np
import tangible

scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.01, "duration": 1.0})
scene.add_body(
    "ball", shape={"circle": {"radius": 0.05}}, mass=0.2, position=[0, 1], velocity=[1.0, 1.0],
    friction=0.2, restitution=0.7,
)
scene.add_body(
    "floor", static=True, friction=0.2, restitution=0.7,
    shape={"half_plane": {"normal": [0, 1], "offset": 0}},
)
rollout = tangible.Rollout(scene, ["bodies/ball/velocity/x", "bodies/ball/velocity/y"])
cup = np.array([2.0, 0.45])  # where the ball is to be after 1 s
velocity = rollout.default_parameters
for iteration in range(50):
    state, pull = rollout.vjp(velocity)
    error = state[:2] - cup
    if np.linalg.norm(error) < 1e-9:
        break
    # Gauss-Newton: two equations, two unknowns.
    rows = np.stack([pull(np.eye(6)[i])[0] for i in range(2)])
    velocity = velocity - np.linalg.solve(rows, error)
run = tangible.simulate(
    scene, {"bodies/ball/velocity/x": velocity[0], "bodies/ball/velocity/y": velocity[1]}
)
print(f"throw with {velocity[0]:.6f}, {velocity[1]:.6f} m/s after {iteration} iterations")
print(f"bounces: {len(run.events.time)}, ends at {run.final['ball/x']:.6f}, {run.final['ball/y']:.6f} m")
assert np.linalg.norm(error) < 1e-9 and len(run.events.time) >= 1

if len(sys.argv) > 1:  # the picture: the throw's path
    import matplotlib.pyplot as plt

    axes = plt.subplots()[1]
    axes.plot(run["ball/x"], run["ball/y"], ".-", label="ball")
    axes.plot(*cup, "s", mfc="none", ms=12, label="cup")
    axes.set_aspect("equal")
    axes.legend()
    axes.figure.savefig(sys.argv[1], dpi=70)
