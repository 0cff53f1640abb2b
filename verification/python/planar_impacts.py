# SPDX-License-Identifier: Apache-2.0
"""Restitution and friction of 1000 real impacts in one fit, and how well they predict 200 others.

    python3 verification/python/planar_impacts.py FILE

FILE is planar_impact/impacts.csv (mcubelab/planar-impact-dataset; Fazeli et al. 2017): a dropped
ellipse meets a plane, a row an impact, with the state before and the velocities after. A row is a
recording: the body starts at the place and at the speed at which it was before the impact, with a
corner of its shape where the contact was, and its velocities are observed just after. Restitution
and friction are shared by rows 1 to 1000. The error is the data's own measure,

    mean over impacts of sqrt((v − v1)ᵀ M (v − v1)) / sqrt(v0ᵀ M v0)

of rows 1001 to 1200, beside that of the models whose velocities came with the data.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import tangible

Floats = npt.NDArray[np.float64]

MASS = 0.0364  # kg
INERTIA = MASS * 0.0192**2  # kg m²
METRIC = np.array([MASS, MASS, INERTIA])
MODELS = ("DrumShell", "APPoisson", "APNewton", "Mirtich", "Wang", "Whittaker")
STEP = 1e-4  # s, in which the impact happens
ABOVE = 1e-6  # m, above the plane at the start

# Errors of velocities are about a third of the speeds before, of energy rather than of speed.
SIGMA = 0.3


def scene() -> dict[str, Any]:
    """The body, a corner of which is its contact, above the plane."""
    return {
        "name": "impact",
        "gravity": [0, -9.81],
        "bodies": [
            {"name": "body", "mass": MASS, "inertia": INERTIA, "position": [0, 1],
             "shape": {"polygon": {"vertices": [[0, -0.03], [0.01, 0.03], [-0.01, 0.03]]}}},
            {"name": "plane", "static": True,
             "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
        ],
        "pairs": [{"bodies": ["body", "plane"], "friction": 0.1, "restitution": 0.5}],
        "simulation": {"dt": STEP, "duration": STEP, "stepping": "event"},
    }  # fmt: skip


def values(row: Floats, names: dict[str, int]) -> dict[str, float]:
    """What is special to an impact: the arm of the contact and the velocities before."""
    across, down = row[names["n_th"]], row[names["d_th"]]
    corner = "bodies/body/shape/vertices"
    return {
        "bodies/body/position/y": down + ABOVE,
        "bodies/body/velocity/x": row[names["vx0"]],
        "bodies/body/velocity/y": row[names["vy0"]],
        "bodies/body/angular_velocity": row[names["w0"]],
        f"{corner}/0/x": across,
        f"{corner}/0/y": -down,
        f"{corner}/1/x": across + 0.01,
        f"{corner}/2/x": across - 0.01,
    }


def measure(v: Floats, after: Floats, before: Floats) -> float:
    """The mean of the relative errors, of (N, 3) velocities."""
    error = np.sqrt(((v - after) ** 2 * METRIC).sum(axis=1))
    return float(np.mean(error / np.sqrt((before**2 * METRIC).sum(axis=1))))


def main() -> int:
    """Prints the table."""
    if len(sys.argv) != 2:
        print(f"usage: {sys.argv[0]} FILE", file=sys.stderr)
        return 2
    header = Path(sys.argv[1]).open(encoding="utf-8").readline().strip().split(",")
    names = {name: k for k, name in enumerate(header)}
    table = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
    before = table[:, [names[n] for n in ("vx0", "vy0", "w0")]]
    after = table[:, [names[n] for n in ("vx1", "vy1", "w1")]]

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.json").write_text(json.dumps(scene()))
        recordings = []
        for k, row in enumerate(table[:1000]):
            (folder / f"{k}.csv").write_text(
                f"time,body,vx,vy,omega\n{STEP},body," + ",".join(f"{v:.9g}" for v in after[k]))
            size = SIGMA * np.sqrt((before[k] ** 2 * METRIC).sum())
            sigma = dict(zip(("vx", "vy", "omega"), map(float, size / np.sqrt(METRIC))))
            recordings.append({"name": str(k + 1), "values": values(row, names),
                               "observations": [{"file": f"{k}.csv", "sigma": sigma}]})  # fmt: skip
        began = time.perf_counter()
        result = tangible.fit(
            {"scene": "scene.json", "recordings": recordings, "loss": {"huber": 1},
             "parameters": [
                 {"name": "restitution", "path": "pairs/body:plane/restitution"},
                 {"name": "friction", "path": "pairs/body:plane/friction"}]},
            folder=folder, on_failure="return")  # fmt: skip
        seconds = time.perf_counter() - began

    print(f"{len(recordings)} impacts in one fit: {result.status}, {seconds:.1f} s")
    for parameter in result.names:
        low, high = result.interval(parameter) or (np.nan, np.nan)
        print(f"  {parameter:11s} {result[parameter]:.4f} (95 %: {low:.4f} to {high:.4f})")
    later = range(1000, len(table))
    pair = "pairs/body:plane/"
    shared = {pair + name: result[name] for name in result.names}
    runs = [tangible.simulate(scene(), parameters={**shared, **values(table[k], names)}) for k in later]
    ours = np.array([[run[f"body/{c}"][-1] for c in ("vx", "vy", "omega")] for run in runs])
    print(f"mean relative error of rows {later[0] + 1} to {later[-1] + 1}")
    print(f"  this fit    {measure(ours, after[1000:], before[1000:]):.4f}")
    for model in MODELS:
        v = table[1000:, [names[f"{model}_{c}"] for c in ("vx", "vy", "w")]]
        print(f"  {model:11s} {measure(v, after[1000:], before[1000:]):.4f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
