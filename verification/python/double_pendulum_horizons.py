# SPDX-License-Identifier: Apache-2.0
"""How long the model of a real double pendulum predicts it: the IBM chaotic double pendulum.

    python3 verification/python/double_pendulum_horizons.py FOLDER [PLOT.svg]

FOLDER holds ibm_double_pendulum/0.csv and 5.csv (Asseman et al. 2018, CDLA-Sharing-1.0): tracked
markers of the pivot, the joint and the tip, at a nominal 400 Hz, some 43 s each. Parameters are
identified from both recordings together, from half a second after every 500th frame, each with an
initial state of its own: lengths, centre of mass and inertia of the links, gravity (the time base
and the lengths that came with the data do not give 9.81 m/s²) and its direction in the pictures,
viscous and dry friction in the hinges and quadratic drag. A stretch begins at every 1000th frame,
and is a recording of the same fit with the role `predict`: its state is fitted to its first 400
frames, or to as many of the last of them as the fit chooses, and the 600 after them are predicted.
Printed is the number of frames for which the tip stays within a tenth of the reach.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import tangible

Floats = npt.NDArray[np.float64]

DT = 1.0 / 400.0  # s
LINK = 0.091  # m, the first link; the scale of the pictures follows from it
IDENTIFIED, EVERY = 200, 500  # frames of a part from which parameters are identified
FITTED, AHEAD, STRIDE = 400, 600, 1000  # frames
SIGMA = 2e-4  # m
SHARE = 0.1  # of the reach

START = ["joints/pivot/angle", "joints/pivot/rate", "joints/elbow/angle", "joints/elbow/rate"]

# Where the fit begins, and below what a parameter cannot be.
BEGIN = {"px": 0.0, "py": 0.0, "L1": LINK, "L2": 0.07, "a2": 0.021, "o2": 0.0, "I1": 2.5e-4,
         "I2": 5e-5, "g": 6.3, "gx": 0.0, "k0": 1e-5, "k1": 1e-5, "f0": 1e-4, "f1": 1e-5, "c1": 1e-4,
         "c2": 1e-4}  # fmt: skip
LOWER = {"L1": 0.06, "L2": 0.04, "a2": 0.005, "I1": 1e-6, "I2": 1e-7, "g": 1.0, "k0": 0, "k1": 0,
         "f0": 0, "f1": 0, "c1": 0, "c2": 0}  # fmt: skip
# What each sets in the scene below; the first link's own centre is any point of it.
CENTRE = 0.05  # m below the pivot
SETS: dict[str, list[dict[str, Any]]] = {
    "px": [{"path": "bodies/link*/position/x"}, {"path": "joints/*/anchor/x"}],
    "py": [{"path": "bodies/link*/position/y", "add": True},
           {"path": "joints/*/anchor/y", "add": True}],
    "L1": [{"path": "joints/elbow/anchor/y", "scale": -1},
           {"path": "bodies/link2/position/y", "scale": -1},
           {"path": "points/joint/at/y", "scale": -1, "offset": CENTRE}],
    "L2": [{"path": "points/tip/at/y", "scale": -1}],
    "a2": [{"path": "bodies/link2/position/y", "scale": -1, "add": True},
           {"path": "points/tip/at/y", "add": True}],
    "o2": [{"path": "bodies/link2/position/x", "add": True},
           {"path": "points/tip/at/x", "scale": -1}],
    "I1": [{"path": "bodies/link1/inertia"}],
    "I2": [{"path": "bodies/link2/inertia"}],
    "g": [{"path": "gravity/y", "scale": -1}],
    "gx": [{"path": "gravity/x"}],
    "k0": [{"path": "joints/pivot/damping"}],
    "k1": [{"path": "joints/elbow/damping"}],
    "f0": [{"path": "joints/pivot/friction"}],
    "f1": [{"path": "joints/elbow/friction"}],
    "c1": [{"path": "bodies/link1/quadratic_drag"}],
    "c2": [{"path": "bodies/link2/quadratic_drag"}],
}  # fmt: skip


class Recording:
    """The joint and the tip beside the pivot (m, y up), a row a frame."""

    def __init__(self, file: Path) -> None:
        markers = np.loadtxt(file, delimiter=",")
        pivot, joint, tip = (np.c_[markers[:, 2 * i + 1], -markers[:, 2 * i]] for i in range(3))
        scale = LINK / np.linalg.norm(joint - pivot, axis=1).mean()
        self.name = file.stem
        self.joint: Floats = scale * (joint - pivot)
        self.tip: Floats = scale * (tip - pivot)

    def observe(self, file: Path, first: int, count: int) -> None:
        """Writes some frames as observations."""
        rows = ["time,point,x,y"]
        for k in range(count):
            for name, at in (("joint", self.joint), ("tip", self.tip)):
                rows.append(f"{k * DT:.17g},{name},{at[first + k, 0]:.9g},{at[first + k, 1]:.9g}")
        file.write_text("\n".join(rows))

    def guess(self, first: int) -> dict[str, float]:
        """The joints' angles and rates at a frame, by parabolas through seven."""
        inside = slice(first, first + 7)
        links = (self.joint[inside], (self.tip - self.joint)[inside])
        angles = [np.unwrap(np.arctan2(link[:, 0], -link[:, 1])) for link in links]
        one, two = (np.polyfit(np.arange(7) * DT, angle, 2)[:0:-1] for angle in angles)
        return dict(zip(START, map(float, np.concatenate([one, two - one]))))


def scene(values: dict[str, float], frames: int) -> dict[str, Any]:
    """The scene with these parameters, hanging."""
    x, y = values["px"], values["py"]
    centre = y - values["L1"] - values["a2"]
    return {
        "name": "double pendulum",
        "gravity": [values["gx"], -values["g"]],
        "bodies": [
            {"name": "link1", "mass": 0.1, "inertia": values["I1"], "position": [x, y - CENTRE],
             "quadratic_drag": values["c1"]},
            {"name": "link2", "mass": 0.05, "inertia": values["I2"],
             "position": [x + values["o2"], centre], "quadratic_drag": values["c2"]},
        ],
        "joints": [
            {"name": "pivot", "type": "revolute", "bodies": ["link1", "world"], "anchor": [x, y],
             "damping": values["k0"], "friction": values["f0"]},
            {"name": "elbow", "type": "revolute", "bodies": ["link2", "link1"],
             "anchor": [x, y - values["L1"]], "damping": values["k1"], "friction": values["f1"]},
        ],
        "simulation": {"dt": DT, "duration": frames * DT, "stepping": "event"},
    }  # fmt: skip


def points(values: dict[str, float]) -> dict[str, Any]:
    """The markers, in their links' frames."""
    return {
        "joint": {"body": "link1", "at": [0, CENTRE - values["L1"]]},
        "tip": {"body": "link2", "at": [-values["o2"], values["a2"] - values["L2"]]},
    }


def stretches(recording: Recording) -> range:
    """The frames at which the stretches of a recording begin."""
    return range(0, len(recording.tip) - FITTED - AHEAD, STRIDE)


def fit(recordings: list[Recording], folder: Path) -> tangible.FitResult:
    """Parameters from parts of all recordings, and the stretches that they predict."""
    (folder / "scene.json").write_text(json.dumps(scene(BEGIN, FITTED + AHEAD)))
    parts: list[dict[str, Any]] = []

    def add(recording: Recording, first: int, count: int, **more: Any) -> None:
        file = f"{recording.name}_{first}_{count}.csv"
        recording.observe(folder / file, first, count)
        parts.append({"name": file[:-4], "initial": recording.guess(first),
                      "observations": [{"file": file, "sigma": SIGMA}], **more})  # fmt: skip

    for recording in recordings:
        for first in range(0, len(recording.tip) - IDENTIFIED, EVERY):
            add(recording, first, IDENTIFIED)
    for recording in recordings:
        for first in stretches(recording):
            # Half a frame for rounding.
            add(recording, first, FITTED + AHEAD, role="predict", state_from=(FITTED - 0.5) * DT)
    shared: list[dict[str, Any]] = [
        {"name": name, "sets": SETS[name], "initial": BEGIN[name],
         **({"lower": LOWER[name]} if name in LOWER else {})}
        for name in SETS
    ]  # fmt: skip
    own = [{"name": name, "path": name, "per": "recording"} for name in START]
    return tangible.fit(
        {"scene": "scene.json", "points": points(BEGIN), "recordings": parts,
         "parameters": shared + own, "loss": {"huber": 3}, "approach": "plain"},
        folder=folder, on_failure="return")  # fmt: skip


def tip_errors(result: tangible.FitResult) -> Floats:
    """The tip's distance from where it was seen, as a share of the reach: a row a stretch, a column
    a frame ahead."""
    table = result.predictions
    ahead: dict[str, dict[str, list[float]]] = {}
    for name, target, coordinate, used, residual in zip(
        table["recording"], table["target"], table["coordinate"], table["used"], table["residual"]
    ):
        if target == "tip" and used == "prediction":
            ahead.setdefault(name, {"x": [], "y": []})[coordinate].append(float(residual))
    reach = result["L1"] + result["L2"]
    return np.array([np.hypot(off["x"], off["y"]) / reach for off in ahead.values()])


def plot(errors: Floats, file: str) -> None:
    """Median and quartiles of the error against the horizon."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "tangible"
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.4, 3.6))
    frames = np.arange(1, errors.shape[1] + 1)
    low, middle, high = np.percentile(100 * errors, [25, 50, 75], axis=0)
    axes.fill_between(frames, low, high, alpha=0.3, label="quartiles")
    axes.plot(frames, middle, label=f"median of {len(errors)} stretches")
    axes.axhline(100 * SHARE, color="grey", linewidth=0.8, linestyle="--")
    axes.set_xlabel("frames ahead (400 a second)")
    axes.set_ylabel("error of the tip (% of the reach)")
    axes.set_yscale("log")
    axes.legend()
    figure.tight_layout()
    figure.savefig(file, metadata={"Date": None})


def main() -> int:
    """Prints the parameters and the horizons; 1 where a stretch does not fit."""
    if len(sys.argv) not in (2, 3):
        print(f"usage: {sys.argv[0]} FOLDER [PLOT.svg]", file=sys.stderr)
        return 2
    recordings = [
        Recording(Path(sys.argv[1]) / "ibm_double_pendulum" / f"{name}.csv") for name in "05"
    ]
    with tempfile.TemporaryDirectory() as folder:
        result = fit(recordings, Path(folder))
    identified = [part for part in result.data["recordings"] if part["role"] == "identify"]
    kept = [part for part in result.data["recordings"] if part["role"] == "predict"]
    rms = 1e3 * SIGMA * result.data["residual_rms"]
    print(f"{result.data['residuals']} residuals of {len(identified)} parts, "
          f"{result.status}, residual rms {rms:.2g} mm")  # fmt: skip
    for name in SETS:
        print(f"  {name:3s} {result[name]:.5g}")
    window = result.data["held_out"].get("state_window", {"seconds": None, "tried": []})
    print("states from the last frames, and what they predict of frames that are known (sigma)")
    for one in window["tried"]:
        frames = "all" if one["seconds"] is None else f"{one['seconds'] / DT:.0f}"
        chosen = " chosen" if one["seconds"] == window["seconds"] else ""
        print(f"  {frames:>3s} {one['rms_in_sigma']:.3g}{chosen}")
    failed = sum(part["status"] != "converged" for part in kept)
    errors = tip_errors(result)
    far = errors > SHARE
    horizons = np.where(far.any(axis=1), far.argmax(axis=1), AHEAD)
    low, middle, high = np.percentile(horizons, [25, 50, 75])
    print(f"frames for which the tip stays within {100 * SHARE:g} % of the reach, at most {AHEAD}")
    print(f"  median {middle:.0f}, quartiles {low:.0f} and {high:.0f}; "
          f"{failed} of {len(kept)} stretches do not fit")  # fmt: skip
    print("  " + " ".join(str(h) for h in np.sort(horizons)))
    if len(sys.argv) == 3:
        plot(errors, sys.argv[2])
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
