"""The derivative of a bounce: event stepping has that of the physics, a fixed step has not."""

import math
import sys

import tangible


def ball(stepping: str) -> tangible.Scene:
    scene = tangible.Scene(simulation={"stepping": stepping, "dt": 0.01, "duration": 0.6})
    scene.add_body(
        "ball", shape={"circle": {"radius": 0.1}}, mass=1.0, position=[0, 1.1], restitution=1.0
    )
    scene.add_body(
        "floor", static=True, restitution=1.0, shape={"half_plane": {"normal": [0, 1], "offset": 0}}
    )
    return scene


# Dropped from h = 1 m, e = 1: after the bounce y = 0.1 + u t - g t^2 / 2 with t = T - u / g, u = sqrt(2 g h).
u = math.sqrt(2.0 * 9.81)
truth = 2.0 * 9.81 * (0.6 - u / 9.81) / u - 1.0
height = ["bodies/ball/position/y"]
by_events = tangible.Rollout(ball("event"), height).jacobian()
by_steps = tangible.Rollout(ball("fixed"), height)
h = 6e-6
difference = (by_steps([1.1 + h])[1] - by_steps([1.1 - h])[1]) / (2.0 * h)

print(f"dy/dh by the formula               {truth:.6f}")
print(f"dy/dh by events                    {by_events.parameters[1, 0]:.6f}")
print(f"dy/dh by differences, fixed steps  {difference:.6f}")
print("certificate by events:", by_events.certificate["verdict"])
print("certificate by fixed steps:", by_steps.certificate()["verdict"])
assert abs(by_events.parameters[1, 0] - truth) < 1e-10
assert abs(difference - truth) > 0.1

if len(sys.argv) > 1:  # the picture: y and its derivative along the run
    times = [0.01 * k for k in range(61)]
    runs = {s: tangible.Rollout(ball(s), height, records=range(61)).jacobian() for s in ("event", "fixed")}
    axes = tangible.simulate(ball("event")).plot("ball/y")
    for stepping, found in runs.items():
        axes.plot(times, found.parameters[:, 1, 0], "--", label=f"dy/dh, {stepping}")
    axes.legend()
    axes.figure.savefig(sys.argv[1], dpi=70)
