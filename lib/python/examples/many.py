"""Two thousand rollouts at once: where a spinning disc stops, against its speed and spin."""

import sys
import time

import numpy as np
import tangible

scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.02, "duration": 1.0})
scene.add_body(
    "disc", shape={"circle": {"radius": 0.1}}, mass=1.0, position=[0, 0.1], velocity=[1, 0],
    friction=0.3,
)
scene.add_body(
    "floor", static=True, friction=0.3, shape={"half_plane": {"normal": [0, 1], "offset": 0}}
)
rollout = tangible.Rollout(scene, ["bodies/disc/velocity/x", "bodies/disc/angular_velocity"])
random = np.random.default_rng(0)
starts = np.column_stack([random.uniform(0.2, 2.0, 2000), random.uniform(-10.0, 10.0, 2000)])
start = time.perf_counter()
finals = rollout(starts)
seconds = time.perf_counter() - start
# Sliding friction acts on the speed and on the spin until the disc rolls: v = (2 v0 - r w0) / 3.
rolling = (2.0 * starts[:, 0] - 0.1 * starts[:, 1]) / 3.0
speed = finals[:, rollout.outputs.index("disc/vx")]
done = np.abs(starts[:, 0] + 0.1 * starts[:, 1]) / (3.0 * 0.3 * 9.81) < 1.0
print(f"2000 rollouts of {rollout.num_steps} steps in {seconds:.2f} s")
print(f"largest error of the rolling speed: {np.abs(speed - rolling)[done].max():.1e} m/s")
assert np.abs(speed - rolling)[done].max() < 1e-9 and done.sum() > 1900

if len(sys.argv) > 1:  # the picture: where each disc stands after 1 s
    import matplotlib.pyplot as plt

    axes = plt.subplots()[1]
    dots = axes.scatter(*starts.T, c=finals[:, rollout.outputs.index("disc/x")], s=6)
    axes.set_xlabel("speed at the start (m/s)")
    axes.set_ylabel("spin at the start (rad/s)")
    axes.figure.colorbar(dots, label="x after 1 s (m)")
    axes.figure.savefig(sys.argv[1], dpi=70)
