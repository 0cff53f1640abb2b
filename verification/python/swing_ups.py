# SPDX-License-Identifier: Apache-2.0
"""How often is a cart-pole, or a double pendulum, swung up by plans from several starts, and how
often does a receding horizon swing up a cart-pole whose parameters are not the model's?

Masses, lengths and initial angles are drawn by seed. A plan has succeeded where its replay by event
stepping ends within 0.1 rad and 0.5 rad/s of upright, a receding horizon where the pole is within
0.1 rad of upright in the whole last second of 10 s.

    /usr/bin/python3 verification/python/swing_ups.py [--problems=20] [--plants=100] [--seed=11]
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import pathlib
import random
import statistics
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from typing import Any

Json = dict[str, Any]
Make = Callable[[random.Random], tuple[Json, Json]]

PROGRAM = pathlib.Path(__file__).parents[2] / "build/release/bin/tangible-control"
UPRIGHT_ANGLE = 0.1  # rad
UPRIGHT_RATE = 0.5  # rad/s
LARGEST_FORCE = 10.0  # N, on carts of 0.7 to 1.3 kg
LARGEST_TORQUES = (4.0, 2.0)  # N m, of shoulder and elbow


def cart_pole(length: float, cart: float, pole: float, angle: float,
              dampings: tuple[float, float] = (0.0, 0.0)) -> Json:
    """A scene; `angle` is that of the pole from upright."""
    return {
        "bodies": [
            {"name": "cart", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": cart,
             "position": [0, 0]},
            {"name": "pole", "shape": {"box": {"size": [0.05, length]}}, "mass": pole,
             "position": [0, length / 2]}],
        "joints": [
            {"name": "rail", "type": "prismatic", "bodies": ["cart", "world"], "anchor": [0, 0],
             "axis": [1, 0], "damping": dampings[0]},
            {"name": "pin", "type": "revolute", "bodies": ["pole", "cart"], "anchor": [0, 0],
             "angle": angle, "damping": dampings[1]}],
        "no_contact": [["cart", "pole"]],
        "simulation": {"dt": 0.02, "duration": 2.5, "stepping": "event"}}


def double_pendulum(lengths: Sequence[float], masses: Sequence[float],
                    angles: Sequence[float]) -> Json:
    """A scene of two rods that hang at angles."""
    return {
        "bodies": [
            {"name": "upper", "shape": {"box": {"size": [0.05, lengths[0]]}}, "mass": masses[0],
             "position": [0, -lengths[0] / 2]},
            {"name": "lower", "shape": {"box": {"size": [0.05, lengths[1]]}}, "mass": masses[1],
             "position": [0, -lengths[0] - lengths[1] / 2]}],
        "joints": [
            {"name": "shoulder", "type": "revolute", "bodies": ["upper", "world"],
             "anchor": [0, 0], "damping": 0.02, "angle": angles[0]},
            {"name": "elbow", "type": "revolute", "bodies": ["lower", "upper"],
             "anchor": [0, -lengths[0]], "damping": 0.02, "angle": angles[1]}],
        "no_contact": [["upper", "lower"]],
        "simulation": {"dt": 0.02, "duration": 2, "stepping": "event"}}


def end_terms(targets: list[tuple[str, float, float]]) -> list[Json]:
    return [{"state": state, "target": target, "weight": weight, "at": "end",
             **({"wrap": True} if state.endswith("angle") else {})}
            for state, target, weight in targets]


CART_TERMS = end_terms([("pole/angle", 0, 100), ("pole/omega", 0, 20), ("cart/x", 0, 10),
                        ("cart/vx", 0, 10)])
DOUBLE_TERMS = end_terms([("upper/angle", math.pi, 100), ("lower/angle", math.pi, 100),
                          ("upper/omega", 0, 10), ("lower/omega", 0, 10)])


def control(path: str, bound: float, initial: float = 0.0) -> Json:
    return {"path": path, "low": -bound, "high": bound, "initial": initial}


def factor(draw: random.Random) -> float:
    return draw.uniform(0.7, 1.3)


def cart_pole_problem(draw: random.Random) -> tuple[Json, Json]:
    scene = cart_pole(factor(draw), factor(draw), 0.2 * factor(draw),
                      math.pi + draw.uniform(-0.5, 0.5))
    return scene, {
        "controls": [control("joints/rail/effort", LARGEST_FORCE, 0.1)],
        "cost": [{"control": "joints/rail/effort", "weight": 0.01}, *CART_TERMS],
        "second_order": "secants", "starts": {"count": 6, "pieces": 5}, "max_iterations": 200}


def double_pendulum_problem(draw: random.Random) -> tuple[Json, Json]:
    """The weight of the rates keeps plans from whirling, which no motion follows in open loop."""
    scene = double_pendulum((0.5 * factor(draw), 0.5 * factor(draw)),
                            (factor(draw), 0.5 * factor(draw)),
                            (draw.uniform(-0.5, 0.5), draw.uniform(-0.5, 0.5)))
    paths = ("joints/shoulder/effort", "joints/elbow/effort")
    rates = ("upper/omega", "lower/omega")
    return scene, {
        "controls": [control(path, bound, 0.1) for path, bound in zip(paths, LARGEST_TORQUES)],
        "cost": [*({"control": path, "weight": 0.02} for path in paths),
                 *({"state": rate, "weight": 0.05} for rate in rates), *DOUBLE_TERMS],
        "second_order": "secants", "starts": {"count": 8, "pieces": 5}, "max_iterations": 60}


def run(folder: pathlib.Path, scene: Json, problem: Json, *flags: str) -> Json | None:
    """The result of tangible-control; None where there is none."""
    (folder / "scene.json").write_text(json.dumps(scene))
    (folder / "problem.json").write_text(json.dumps({"scene": "scene.json", **problem}))
    result = folder / "result.json"
    result.unlink(missing_ok=True)
    subprocess.run([PROGRAM, folder / "problem.json", f"--out={result}", *flags],
                   capture_output=True, check=False)
    written: Json | None = json.loads(result.read_text()) if result.exists() else None
    return written


def is_upright(state: Json, body: str, upright: float) -> bool:
    angle, rate = state[body + "/angle"], state[body + "/omega"]
    if angle is None or rate is None:  # the replay failed
        return False
    turned = abs(math.remainder(angle - upright, 2 * math.pi))
    return bool(turned < UPRIGHT_ANGLE and abs(rate) < UPRIGHT_RATE)


def swing_ups(folder: pathlib.Path, name: str, make: Make, bodies: list[str], upright: float,
              options: argparse.Namespace) -> None:
    succeeded, held, converged = 0, 0, 0
    seconds: list[float] = []
    for number in range(options.problems):
        scene, problem = make(random.Random(f"{name} {options.seed} {number}"))
        result = run(folder, scene, problem)
        if result is None:
            continue
        end = result["motion"]["final_state"]
        succeeded += all(is_upright(end, body, upright) for body in bodies)
        held += result["status"] != "differs_from_motion"
        converged += result["planned_status"] == "converged"
        seconds.append(result["cpu_seconds"])
    print(f"{name}: {succeeded} of {options.problems} upright at the end of the replay, "
          f"{held} plans hold in the motion, {converged} have converged; "
          f"median CPU {statistics.median(seconds):.2f} s", flush=True)


# A camera that sees the cart to 2 mm and the pole to 0.01 rad, and no speeds. A filter that trusts
# its model less, by accelerations of 5 m/s2, estimates the rate of a hanging pole to 0.13 rad/s only,
# and plans swing it to one side and the other in turn.
OBSERVATIONS = {"sensors": [{"state": "cart/x", "sigma": 0.002},
                            {"state": "pole/angle", "sigma": 0.01}]}


def receding_horizon(folder: pathlib.Path, options: argparse.Namespace,
                     observations: Json | None) -> None:
    """The model's parameters, each multiplied by a factor of its own, are the plant's.

    The weights are those of a controller that does not trust its model: where force is cheap plans
    use all of it and swing the pole fast, and next to upright they ask for a gain that is too
    large for a plant that reacts twice as strongly (0.7 of the length and of the mass). The model
    goes by fixed steps, whose errors are small beside those of its parameters, so that a plan takes
    less time than a step; the plant goes by event stepping.
    """
    model = cart_pole(1.0, 1.0, 0.2, math.pi, (0.1, 0.005))
    model["simulation"]["stepping"] = "fixed"
    problem = {
        "controls": [control("joints/rail/effort", 20.0)],
        "cost": [{"control": "joints/rail/effort", "weight": 0.2},
                 {"state": "pole/angle", "weight": 10, "wrap": True},
                 {"state": "pole/omega", "weight": 0.3}, {"state": "cart/x"},
                 *end_terms([("pole/angle", 0, 100), ("pole/omega", 0, 10), ("cart/x", 0, 10),
                             ("cart/vx", 0, 10)])],
        "mpc": {"duration": 10, "horizon": 1.2,
                **({} if observations is None else {"observations": observations})}}
    succeeded, failed = 0, 0
    seconds: list[float] = []
    for number in range(options.plants):
        draw = random.Random(f"plant {options.seed} {number}")
        factors = [factor(draw) for _ in range(5)]
        plant = cart_pole(factors[0], factors[1], 0.2 * factors[2], math.pi,
                          (0.1 * factors[3], 0.005 * factors[4]))
        (folder / "plant.json").write_text(json.dumps(plant))
        motion = folder / "motion.csv"
        result = run(folder, model, problem, "--mpc", f"--plant={folder / 'plant.json'}",
                     f"--trajectory={motion}")
        if result is None:
            continue
        failed += result["plans_failed"]
        seconds.append(result["cpu_seconds_median"])
        with open(motion) as rows:
            angles = [float(row["angle"]) for row in csv.DictReader(rows)
                      if row["body"] == "pole" and float(row["time"]) >= 9 - 1e-9]
        succeeded += max(abs(math.remainder(a, 2 * math.pi)) for a in angles) < UPRIGHT_ANGLE
    seen = "" if observations is None else ", from noisy observations"
    print(f"receding horizon of a cart-pole with parameters off by up to 30 %{seen}: {succeeded} "
          f"of {options.plants} upright in the last second, {failed} plans failed; median CPU of a "
          f"plan {1e3 * statistics.median(seconds):.1f} ms", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--problems", type=int, default=20, help="swing-ups of each kind")
    parser.add_argument("--plants", type=int, default=100, help="of the receding horizon")
    parser.add_argument("--seed", type=int, default=11)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if options.problems > 0:
            swing_ups(folder, "cart-pole", cart_pole_problem, ["pole"], 0.0, options)
            swing_ups(folder, "double pendulum", double_pendulum_problem, ["upper", "lower"],
                      math.pi, options)
        if options.plants > 0:
            receding_horizon(folder, options, None)
            receding_horizon(folder, options, OBSERVATIONS)


if __name__ == "__main__":
    main()
