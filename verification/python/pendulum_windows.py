# SPDX-License-Identifier: Apache-2.0
"""How far recordings of real pendulums are predicted: MultiArm-Pendulum's single and double arm.

    python3 verification/python/pendulum_windows.py FOLDER

FOLDER holds multiarm_pendulum/single_freeswing_200Hz.csv and double_freeswing_200Hz.csv
(dynamicslab/MultiArm-Pendulum, MIT licence; Kaheman et al., arXiv 2205.06231). A recording is cut
into blocks of five seconds. Parameters are identified from the even blocks together, each with
an initial state of its own: those that were published, dry friction in the hinges, quadratic drag,
and by how much the encoders' zero is not the vertical. In each odd block the initial state is
fitted to the first second, with the parameters held, and the three seconds after it are predicted:
once with the parameters identified here, once with those that were published with the data. Printed
are medians over the windows of the largest error of any angle within 1, 2 and 3 s.
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

BLOCK = 5.0  # s
FITTED = 1.0  # s of a window from which its initial state is found
HORIZONS = (1.0, 2.0, 3.0)  # s after it
SIGMA = 0.005  # rad, about what residuals are


class Arm:
    """A recording: times (s), angles from the lowest position (rad), and its model.

    Attributes:
        published: Parameters that came with the data, in SI units.
        start: The names of the joints' initial angles and rates, of each joint in turn.
    """

    def __init__(self, folder: Path, links: int) -> None:
        name = "single" if links == 1 else "double"
        table = np.loadtxt(
            folder / "multiarm_pendulum" / f"{name}_freeswing_200Hz.csv", delimiter=",", skiprows=1
        )
        self.name, self.links = name, links
        self.times: Floats = table[:, 0]
        self.angles: Floats = table[:, 1 : 1 + links] - np.pi
        self.start = [f"joints/j{k}/{what}" for k in range(links) for what in ("angle", "rate")]
        # Masses and one centre of mass are held: a free swing does not determine them.
        if links == 1:
            self.masses, self.gravity = [0.147585], 9.81001
            self.published = {"a0": 0.147755, "I0": 1.0912e-4, "k0": 2.2394e-4}
        else:
            self.masses, self.gravity = [0.0938440, 0.137596], 9.80858
            self.published = {"a0": 0.108565, "a1": 0.116779, "L": 0.172719, "I0": 4.37529e-4,
                              "I1": 1.268829e-3, "k0": 2.37143e-4, "k1": 1.0e-5}  # fmt: skip

    def scene(self, values: dict[str, float], duration: float) -> dict[str, Any]:
        """The scene with these parameters, hanging."""
        pivots = [0.0, -values.get("L", 0.0)]
        return {
            "name": f"{self.name} pendulum",
            "gravity": [values.get("gx", 0.0), -self.gravity],
            "bodies": [
                {"name": f"l{k}", "mass": self.masses[k], "inertia": values[f"I{k}"],
                 "position": [0, pivots[k] - values[f"a{k}"]],
                 "quadratic_drag": values.get(f"c{k}", 0.0)}
                for k in range(self.links)
            ],
            "joints": [
                {"name": f"j{k}", "type": "revolute", "anchor": [0, pivots[k]],
                 "bodies": [f"l{k}", f"l{k - 1}" if k else "world"], "damping": values[f"k{k}"],
                 "friction": values.get(f"f{k}", 0.0)}
                for k in range(self.links)
            ],
            "simulation": {"dt": 2.5e-3, "duration": duration, "stepping": "event"},
        }  # fmt: skip

    def observe(self, file: Path, start: float, duration: float) -> None:
        """Writes a part of the recording as observations."""
        rows = ["time,body,angle"]
        for t, angles in zip(*self.part(start, duration)):
            rows += [f"{t:.6f},l{k},{angle:.9g}" for k, angle in enumerate(angles)]
        file.write_text("\n".join(rows))

    def part(self, start: float, duration: float) -> tuple[Floats, Floats]:
        """Times since the start, and the angles, of a part."""
        inside = (self.times > start - 1e-6) & (self.times < start + duration + 1e-6)
        return np.maximum(self.times[inside] - start, 0.0), self.angles[inside]

    def guess(self, start: float) -> dict[str, float]:
        """The joints' angles and rates at a time, by parabolas through seven samples."""
        times, angles = self.part(start, 0.03)
        states = [np.polyfit(times, angles[:, k], 2)[:0:-1] for k in range(self.links)]
        relative = [states[k] - (states[k - 1] if k else 0.0) for k in range(self.links)]
        return dict(zip(self.start, map(float, np.concatenate(relative))))

    def identify(self, folder: Path) -> tuple[dict[str, float], tangible.FitResult]:
        """Parameters from the even blocks, beginning at the published ones."""
        begin = {**self.published, "gx": 0.0}
        for k in range(self.links):
            begin.update({f"f{k}": 1e-4, f"c{k}": 1e-3})
        scene = self.scene(begin, BLOCK / 2)
        own: list[dict[str, Any]] = [
            {"name": name, "path": name, "per": "recording"} for name in self.start
        ]
        shared: list[dict[str, Any]] = [
            {"name": f"I{k}", "path": f"bodies/l{k}/inertia", "lower": 1e-6}
            for k in range(self.links)
        ]
        shared += [{"name": name + str(k), "path": f"joints/j{k}/{path}", "lower": 0}
                   for name, path in (("k", "damping"), ("f", "friction"))
                   for k in range(self.links)]  # fmt: skip
        shared += [{"name": f"c{k}", "path": f"bodies/l{k}/quadratic_drag", "lower": 0}
                   for k in range(self.links)]  # fmt: skip
        shared.append({"name": "gx", "path": "gravity/x"})
        if self.links == 2:
            # The second link hangs from the first one's end, at −L, by its centre at −L − a1.
            scene["bodies"][1]["position"] = [0, 0]
            place = {"path": "bodies/l1/position/y", "scale": -1, "add": True}
            shared += [
                {"name": "L", "initial": begin["L"], "lower": 0.01,
                 "sets": [{"path": "joints/j1/anchor/y", "scale": -1}, place]},
                {"name": "a1", "initial": begin["a1"], "lower": 0.01, "sets": [place]},
            ]  # fmt: skip
        recordings = []
        for start in np.arange(0.0, self.times[-1] - BLOCK, BLOCK / 2):
            if int(start / BLOCK) % 2 == 0:
                file = folder / f"{start:g}.csv"
                self.observe(file, start, BLOCK / 2)
                recordings.append({"name": f"{start:g} s", "initial": self.guess(start),
                                   "observations": [{"file": str(file), "sigma": SIGMA}]})  # fmt: skip
        (folder / "scene.json").write_text(json.dumps(scene))
        result = tangible.fit(
            {"scene": "scene.json", "recordings": recordings, "parameters": shared + own},
            folder=folder, on_failure="return")  # fmt: skip
        return {**begin, **{p["name"]: result[p["name"]] for p in shared}}, result

    def predict(self, values: dict[str, float], folder: Path) -> Floats:
        """Largest errors within the horizons, (windows, horizons), of the odd blocks."""
        errors = []
        for start in np.arange(BLOCK, self.times[-1] - BLOCK, 2 * BLOCK):
            scene = self.scene(values, FITTED + HORIZONS[-1])
            (folder / "window.json").write_text(json.dumps(scene))
            self.observe(folder / "window.csv", start, FITTED)
            fit = tangible.fit(
                {"scene": "window.json",
                 "observations": [{"file": "window.csv", "sigma": SIGMA}],
                 "parameters": self.start},
                folder=folder, initial=self.guess(start), on_failure="return")  # fmt: skip
            run = tangible.simulate(scene, parameters=fit.estimates)
            times, angles = self.part(start, FITTED + HORIZONS[-1])
            off = np.max(
                [np.abs(np.interp(times, run.times, run[f"l{k}/angle"]) - angles[:, k])
                 for k in range(self.links)], axis=0)  # fmt: skip
            later = times > FITTED
            errors.append([off[later & (times <= FITTED + h + 1e-6)].max() for h in HORIZONS])
        return np.array(errors)


def main() -> int:
    """Prints the table; 1 where the errors are not half of those of the published parameters."""
    if len(sys.argv) != 2:
        print(f"usage: {sys.argv[0]} FOLDER", file=sys.stderr)
        return 2
    holds = True
    for links in (1, 2):
        arm = Arm(Path(sys.argv[1]), links)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            values, result = arm.identify(folder)
            ours = np.median(arm.predict(values, folder), axis=0)
            windows = arm.predict(arm.published, folder)
        published = np.median(windows, axis=0)
        found = ", ".join(f"{key} {values[key]:.5g}" for key in values)
        print(f"{arm.name}: {result.data['residuals']} angles of {len(result.data['recordings'])} "
              f"recordings, {result.status}, residual rms {SIGMA * result.data['residual_rms']:.2g} rad")  # fmt: skip
        print(f"  identified {found}")
        print(f"  median over {len(windows)} windows of the largest error within "
              f"{', '.join(f'{h:g}' for h in HORIZONS)} s (rad)")  # fmt: skip
        for label, row in (("published", published), ("identified", ours), ("ratio", ours / published)):
            print(f"    {label:10s} " + " ".join(f"{value:8.4f}" for value in row))
        holds &= bool((ours <= 0.5 * published).all())
    print("at most half of the published parameters' errors:", "holds" if holds else "DOES NOT HOLD")
    return 0


if __name__ == "__main__":
    sys.exit(main())
