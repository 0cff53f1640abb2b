# SPDX-License-Identifier: Apache-2.0
"""Do robust intervals contain the best parameters of a model that leaves dry friction out?

    python3 verification/python/wrong_model.py [--replicas=500] [--reference=1000] [--seed=1]

A double pendulum has dry friction in its hinges; the model that is fitted has viscous friction
alone. Each recording begins at angles and rates that are drawn by the seed and known. The best
parameters of the wrong model are those of a fit to many recordings without noise. A replica is a
fit to five others, with noise; counted is how often its 95 % interval contains the best value: the
robust interval (`confidence_95_robust`), and the one that trusts sigma and the model.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import tangible

SIGMA = 1e-3  # m
RECORDINGS = 5
FRICTION = (0.02, 0.01)  # N m
START = {"joints/pivot/angle": 1.5, "joints/pivot/rate": 3.0,
         "joints/elbow/angle": 1.5, "joints/elbow/rate": 3.0}  # fmt: skip
PARAMETERS = {"mass": "bodies/lower/mass", "pivot": "joints/pivot/damping",
              "elbow": "joints/elbow/damping"}  # fmt: skip


def scene(friction: tuple[float, float]) -> dict[str, Any]:
    """The pendulum, hanging."""
    return {
        "gravity": [0, -9.81],
        "bodies": [
            {"name": name, "mass": 0.5, "shape": {"box": {"size": [0.02, 0.4]}}, "position": [0, y]}
            for name, y in (("upper", -0.2), ("lower", -0.6))
        ],
        "joints": [
            {"name": "pivot", "type": "revolute", "bodies": ["upper", "world"], "anchor": [0, 0],
             "damping": 0.01, "friction": friction[0]},
            {"name": "elbow", "type": "revolute", "bodies": ["lower", "upper"],
             "anchor": [0, -0.4], "damping": 0.01, "friction": friction[1]},
        ],
        "simulation": {"dt": 0.01, "duration": 1.0, "stepping": "event"},
    }  # fmt: skip


def record(random: np.random.Generator, noise: float, file: Path) -> dict[str, float]:
    """Writes a recording of the ends of the links' bodies; returns where it began."""
    start = {path: float(random.uniform(-most, most)) for path, most in START.items()}
    run = tangible.simulate(scene(FRICTION), parameters=start)
    rows = ["time,body,x,y"]
    for k in range(0, len(run.times), 2):
        for body in ("upper", "lower"):
            x, y = (run[f"{body}/{c}"][k] + noise * random.standard_normal() for c in "xy")
            rows.append(f"{run.times[k]:.17g},{body},{x:.17g},{y:.17g}")
    file.write_text("\n".join(rows))
    return start


def fit(random: np.random.Generator, count: int, noise: float, begin: dict[str, float],
        folder: Path) -> tangible.FitResult:  # fmt: skip
    """The wrong model's fit to some new recordings."""
    recordings = []
    for k in range(count):
        values = record(random, noise, folder / f"{k}.csv")
        recordings.append({"name": str(k), "values": values,
                           "observations": [{"file": f"{k}.csv", "sigma": SIGMA}]})  # fmt: skip
    parameters = [
        {"name": name, "path": path, "initial": begin[name]} for name, path in PARAMETERS.items()
    ]
    return tangible.fit(
        {"scene": "scene.json", "recordings": recordings, "parameters": parameters},
        folder=folder, on_failure="return")  # fmt: skip


def main() -> int:
    """Prints the coverage; 1 where robust intervals contain less than 90 %."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--replicas", type=int, default=500)
    parser.add_argument("--reference", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    flags = parser.parse_args()
    random = np.random.default_rng(flags.seed)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.json").write_text(json.dumps(scene((0.0, 0.0))))
        guess = {"mass": 0.5, "pivot": 0.01, "elbow": 0.01}
        reference = fit(random, flags.reference, 0.0, guess, folder)
        best = {name: reference[name] for name in PARAMETERS}
        print(f"best of the wrong model, from {flags.reference} recordings ({reference.status}): "
              + ", ".join(f"{name} {value:.5g}" for name, value in best.items()))  # fmt: skip
        held = {name: np.zeros(2, dtype=int) for name in PARAMETERS}
        failed = 0
        for _ in range(flags.replicas):
            result = fit(random, RECORDINGS, SIGMA, best, folder)
            if result.status != "converged":
                failed += 1
                continue
            for parameter in result.data["parameters"]:
                name = parameter["name"]
                for k, key in enumerate(("confidence_95_robust", "confidence_95")):
                    low, high = parameter[key]
                    held[name][k] += low <= best[name] <= high
    done = flags.replicas - failed
    print(f"{flags.replicas} replicas of {RECORDINGS} recordings, {failed} of which did not "
          f"converge; {time.monotonic() - began:.0f} s")  # fmt: skip
    print(f"{'contained (%)':14s} {'robust':>8s} {'trusting sigma':>15s}")
    for name, counts in held.items():
        robust, trusting = 100.0 * counts / done
        print(f"{name:14s} {robust:8.1f} {trusting:15.1f}")
    pooled = 100.0 * sum(held.values()) / (done * len(held))
    print(f"{'pooled':14s} {pooled[0]:8.1f} {pooled[1]:15.1f}")
    holds = min(counts[0] for counts in held.values()) >= 0.9 * done and failed == 0
    print("robust intervals contain at least 90 %:", "holds" if holds else "DOES NOT HOLD")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
