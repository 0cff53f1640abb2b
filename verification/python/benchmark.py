"""What Python costs: a call over the C++ rollout, batches on two cores, torch's forward and backward pass.

Best CPU or wall times of repeated runs; ratios are of runs in one process, one after the other.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import tangible
import torch
from tangible.torch import rollout as torch_rollout

ROOT = Path(__file__).resolve().parents[2]
CHAIN = ROOT / "data" / "scenes" / "chain.json"


def best(work: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def cpp_seconds(scene: Path, parameter: str, repeats: int) -> float:
    """CPU time of a plain rollout in C++, the best of several."""
    program = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/release/bin") / "tangible-gradient"
    text = subprocess.run(
        [program, scene, f"--parameters={parameter}", f"--repeat={repeats}"],
        check=True, capture_output=True, text=True,
    ).stdout
    return float(json.loads(text)["rollout_seconds"])


# A box of 1 kg on a floor is pushed for 1 s: it sticks while the force is below mu m g, then slides. In MuJoCo it is a
# sphere that does not turn, with one contact: a box hops and rocks there, and its differences are off by far more.
DURATION, DT, FRICTION, GRAVITY = 1.0, 0.002, 0.5, 9.81
MUJOCO = f"""<mujoco><option timestep="{DT}" gravity="0 0 -{GRAVITY}"/><worldbody>
<geom type="plane" size="0 0 1" friction="{FRICTION} 0 0" condim="3"/><body pos="0 0 0.05">
<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<geom type="sphere" size="0.05" friction="{FRICTION} 0 0" condim="3"/></body></worldbody></mujoco>"""


def pushed(stepping: str) -> tangible.Rollout:
    scene = tangible.Scene(simulation={"dt": DT, "duration": DURATION, "stepping": stepping}, gravity=[0, -GRAVITY])
    scene.add_body("floor", static=True, friction=FRICTION, shape={"half_plane": {"normal": [0, 1], "offset": 0}})
    scene.add_body("box", mass=1.0, friction=FRICTION, shape={"box": {"size": [0.2, 0.1]}}, position=[0, 0.05])
    scene.add_force("push", body="box", force=[0, 0])
    return tangible.Rollout(scene, controls=["forces/push/force/x"])


def differences(function: Callable[[np.ndarray], float], controls: np.ndarray) -> np.ndarray:
    """Central differences of a step of 1e-4 N."""
    result = np.empty(len(controls))
    for i in range(len(controls)):
        step = np.zeros(len(controls))
        step[i] = 1e-4
        result[i] = (function(controls + step) - function(controls - step)) / 2e-4
    return result


def compare_controls() -> None:
    """Gradient of the final position with respect to forces that are held over shares of the run."""
    steps = round(DURATION / DT)
    peer = None
    try:
        import mujoco_peer

        with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
            file.write(MUJOCO)
            file.flush()
            peer = mujoco_peer.Model(file.name)
    except ImportError:
        print("MuJoCo's library was not found when the package was built")
    for count in (1, 10, 100):
        held = steps // count
        controls = np.where((np.arange(count) + 0.5) / count < 0.3, 3.0, 8.0)
        # By hand: what a share pushes moves the box from then on; while it sticks, nothing.
        end = DURATION - DURATION * np.arange(count) / count
        exact = np.where(controls > FRICTION * GRAVITY, 0.5 * (end**2 - (end - DURATION / count) ** 2), 0.0)
        ways: dict[str, Callable[[], np.ndarray]] = {}
        for stepping in ("fixed", "event"):
            rollout = pushed(stepping)

            def by_adjoint(rollout: tangible.Rollout = rollout, count: int = count, held: int = held) -> np.ndarray:
                bar = np.eye(6)[0]
                _, pull = rollout.vjp(controls=np.repeat(controls, held)[:, None])
                return np.asarray(pull(bar)[2][:, 0].reshape(count, held).sum(axis=1))

            ways[f"tangible, adjoint, {stepping}"] = by_adjoint
            ways[f"tangible, differences, {stepping}"] = lambda rollout=rollout, held=held: differences(  # type: ignore[misc]
                lambda u: float(rollout(controls=np.repeat(u, held)[:, None])[0]), controls
            )
        if peer is not None:
            ways["MuJoCo, differences"] = lambda held=held: differences(  # type: ignore[misc]
                lambda u: float(peer.run(np.repeat(u, held)[:, None] * np.array([1.0, 0.0]))[0]), controls
            )
        for name, way in ways.items():
            error = np.abs(way() - exact).max() / np.abs(exact).max()
            print(f"{count:3d} controls, {name:28s} {1e3 * best(way, 3):8.2f} ms, largest error {error:.1e}")


def main() -> None:
    torch.set_num_threads(1)
    short = tangible.Scene(CHAIN, simulation={"dt": 0.002, "duration": 0.02})
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "short.json"
        short.save(file)
        mass = "bodies/link*/mass"
        cpp = min(cpp_seconds(file, mass, 200) for _ in range(5))
    ten = tangible.Rollout(short, [mass])
    call = best(ten, 2000)
    print(f"call of 10 steps of the chain: {1e6 * call:.1f} us, C++ {1e6 * cpp:.1f} us, over {1e6 * (call - cpp):.1f} us")

    one = tangible.Rollout(CHAIN, [mass], threads=1)
    two = tangible.Rollout(CHAIN, [mass], threads=2)
    masses = np.linspace(0.3, 1.299, 1000)[:, None]
    seconds = {1: [], 2: []}  # type: dict[int, list[float]]
    for _ in range(10):
        for threads, function in ((1, one), (2, two)):
            seconds[threads].append(best(lambda f=function: f(masses), 1))  # type: ignore[misc]
    ratio = min(seconds[1]) / min(seconds[2])
    print(f"1000 rollouts of the chain: {min(seconds[1]):.2f} s on one thread, {min(seconds[2]):.2f} s on two: {ratio:.2f} times")

    full = cpp_seconds(CHAIN, mass, 50)
    p = torch.tensor(one.default_parameters, requires_grad=True)

    def both() -> None:
        p.grad = None
        torch_rollout(one, p).sum().backward()

    layer = best(both, 50)
    print(f"torch forward and backward, 750 steps: {1e3 * layer:.2f} ms, C++ rollout {1e3 * full:.2f} ms: {layer / full:.2f} times")
    compare_controls()


if __name__ == "__main__":
    main()
