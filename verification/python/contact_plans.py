# SPDX-License-Identifier: Apache-2.0
"""How often do plans from several starts succeed where a contact has to be found: a bat that lifts
a ball over a wall, a box that a finger pushes to a stop, a cup that catches a ball?

Masses, sizes, friction and initial states are drawn by seed, and then controls that are constant in
pieces, until their motion is one of the kind; where it ends is the target. The problem begins with
controls of zero. A plan is judged by the end of its replay by event stepping:

    bat    the ball is within 2 cm of its target, which is behind the wall
    box    the box is within 1 cm of its target, and slower than 0.05 m/s
    catch  the ball is within 2 cm of its target and of its seat in the cup, and its speed relative
           to the cup is below 0.05 m/s

    /usr/bin/python3 verification/python/contact_plans.py [--count=20] [--seed=1] \\
        [--kinds=bat,box,catch] [--programs=build/release/bin] [--write=DIR]
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
from collections.abc import Callable
from typing import Any, NamedTuple

Json = dict[str, Any]
State = dict[str, float]

LARGEST_DISTANCES = {"bat": 0.02, "box": 0.01, "catch": 0.02}  # m
LARGEST_SPEED = 0.05  # m/s
SPEED_AT_REST = 1e-6  # m/s, of a box whose motion has ended
SPEED_OF_CAUGHT = 0.01  # m/s, relative to the cup, of drawn motions
BALL_RADIUS = 0.04  # m
NOTCH = (0.13, 0.1)  # m, half the width and the depth of the cup's notch, which is a V
SEAT = BALL_RADIUS * math.hypot(*NOTCH) / NOTCH[0]  # m, of the ball's centre above the V's bottom
FARTHEST_TARGET = 2.0  # m, behind the wall and above the floor
FARTHEST_CUP = 1.0  # m from the middle of its rail, at the end of drawn motions
MOTIONS_OF_SETTING = 20  # drawn before masses, sizes and initial states are drawn again
FLOOR = {"name": "floor", "static": True,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}


class Setting(NamedTuple):
    """A scene, the controls and how a drawn motion is made; the cost follows from its end."""

    scene: Json
    path: str
    bound: float
    pieces: int


class Kind(NamedTuple):
    draw: Callable[[random.Random], Setting]
    is_instance: Callable[[Json, State, set[str]], bool]
    cost: Callable[[State], list[Json]]
    distance: Callable[[State, State], float]
    speed: Callable[[State], float]
    search: Json


def rounded(draw: random.Random, low: float, high: float) -> float:
    return round(draw.uniform(low, high), 3)


def simulation(duration: float) -> Json:
    return {"dt": 0.01, "duration": duration, "stepping": "event"}


def bat(draw: random.Random) -> Setting:
    """A ball falls beside a bat that hangs from a hinge and can swing up and forwards."""
    length, hinge, height = rounded(draw, 0.4, 0.5), 0.6, rounded(draw, 0.3, 0.7)
    scene = {
        "bodies": [
            FLOOR,
            {"name": "wall", "static": True, "shape": {"box": {"size": [0.06, height]}},
             "position": [rounded(draw, 0.8, 1.2), height / 2]},
            {"name": "bat", "shape": {"box": {"size": [length, 0.04]}},
             "mass": rounded(draw, 0.3, 0.6), "position": [length / 2, hinge]},
            {"name": "ball", "shape": {"circle": {"radius": BALL_RADIUS}},
             "mass": rounded(draw, 0.05, 0.15),
             "position": [rounded(draw, 0.25, 0.4), rounded(draw, 0.9, 1.3)],
             "velocity": [rounded(draw, -0.2, 0.2), rounded(draw, -0.5, 0.5)]}],
        "joints": [{"name": "hinge", "type": "revolute", "bodies": ["bat", "world"],
                    "anchor": [0, hinge], "angle": rounded(draw, -1.4, -0.9)}],
        "pairs": [{"bodies": ["ball", "*"], "friction": rounded(draw, 0.1, 0.5),
                   "restitution": rounded(draw, 0.5, 0.8)}],
        "simulation": simulation(1.2)}
    return Setting(scene, "joints/hinge/effort", 4.0, 6)


def passed_over_the_wall(scene: Json, end: State, touched: set[str]) -> bool:
    wall = scene["bodies"][1]["position"][0]
    return ("ball:bat" in touched and "ball:wall" not in touched and "ball:floor" not in touched
            and wall + 0.1 < end["ball/x"] < wall + FARTHEST_TARGET
            and end["ball/y"] < FARTHEST_TARGET)


def box(draw: random.Random) -> Setting:
    """A finger on a rail, in front of a box that friction holds.

    The finger has no friction: with it, its rail and the floor could wedge the box with any force,
    and what an impact does would not be unique.
    """
    width = rounded(draw, 0.2, 0.4)
    start = rounded(draw, 0.05, 0.3)
    scene = {
        "bodies": [
            FLOOR,
            {"name": "finger", "shape": {"circle": {"radius": 0.05}},
             "mass": rounded(draw, 0.5, 1.5), "position": [0, 0.1]},
            {"name": "box", "shape": {"box": {"size": [width, 0.2]}},
             "mass": rounded(draw, 0.5, 2), "position": [round(0.05 + start + width / 2, 4), 0.1]}],
        "joints": [{"name": "rail", "type": "prismatic", "bodies": ["finger", "world"],
                    "anchor": [0, 0.1], "axis": [1, 0], "damping": rounded(draw, 2, 5)}],
        "pairs": [{"bodies": ["box", "floor"], "friction": rounded(draw, 0.2, 0.5)},
                  {"bodies": ["finger", "box"], "restitution": rounded(draw, 0, 0.5)}],
        "no_contact": [["finger", "floor"]],
        "simulation": simulation(1.5)}
    return Setting(scene, "joints/rail/effort", 20.0, 5)


def came_to_rest(scene: Json, end: State, _: set[str]) -> bool:
    moved = end["box/x"] - scene["bodies"][2]["position"][0]
    return moved > 0.2 and math.hypot(end["box/vx"], end["box/vy"]) < SPEED_AT_REST


def catch(draw: random.Random) -> Setting:
    """A ball is thrown towards a cup on a rail, which would be elsewhere when it lands."""
    w, d = NOTCH
    cup, mass = rounded(draw, -0.5, 0.5), rounded(draw, 0.25, 0.75)
    half = [(-w, -0.05), (0.0, -0.05), (0.0, 0.0), (-w, d)]
    other = [(-x, y) for x, y in reversed(half)]
    scene = {
        "bodies": [
            FLOOR,
            *({"name": name, "shape": {"polygon": {"vertices": vertices}}, "mass": mass,
               "inertia": 0.01, "position": [cup, 0.3]}
              for name, vertices in (("cup", half), ("other_half", other))),
            {"name": "ball", "shape": {"circle": {"radius": BALL_RADIUS}},
             "mass": rounded(draw, 0.05, 0.3),
             "position": [rounded(draw, -1.2, -0.8), rounded(draw, 0.8, 1.3)],
             "velocity": [rounded(draw, 0.8, 2), rounded(draw, 0, 1.5)]}],
        "joints": [{"name": "rail", "type": "prismatic", "bodies": ["cup", "world"],
                    "anchor": [cup, 0.3], "axis": [1, 0], "damping": rounded(draw, 1, 3)},
                   {"name": "weld", "type": "weld", "bodies": ["other_half", "cup"],
                    "anchor": [cup, 0.3]}],
        "pairs": [{"bodies": ["ball", "*"], "friction": rounded(draw, 0.1, 0.5),
                   "restitution": rounded(draw, 0, 0.3)}],
        "no_contact": [["cup", "floor"], ["other_half", "floor"]],
        "simulation": simulation(1.2)}
    return Setting(scene, "joints/rail/effort", 10.0, 6)


def off_seat(end: State) -> float:
    return math.hypot(end["ball/x"] - end["cup/x"], end["ball/y"] - end["cup/y"] - SEAT)


def relative_speed(end: State) -> float:
    return math.hypot(end["ball/vx"] - end["cup/vx"], end["ball/vy"] - end["cup/vy"])


def was_caught(_: Json, end: State, touched: set[str]) -> bool:
    return (off_seat(end) < 0.5 * LARGEST_DISTANCES["catch"]
            and relative_speed(end) < SPEED_OF_CAUGHT and "ball:floor" not in touched
            and abs(end["cup/x"]) < FARTHEST_CUP)


def at_end(end: State, weights: dict[str, float]) -> list[Json]:
    return [{"state": state, "target": round(end[state], 6), "weight": weight, "at": "end"}
            for state, weight in weights.items()]


def apart(end: State, target: State, *states: str) -> float:
    return math.hypot(*(end[state] - target[state] for state in states))


KINDS = {
    "bat": Kind(bat, passed_over_the_wall,
                lambda end: at_end(end, {"ball/x": 1000, "ball/y": 1000}),
                lambda end, target: apart(end, target, "ball/x", "ball/y"), lambda _: 0.0,
                {"starts": {"count": 6, "pieces": 6}}),
    "box": Kind(box, came_to_rest,
                lambda end: at_end(end, {"box/x": 1000, "box/vx": 100}),
                lambda end, target: apart(end, target, "box/x"),
                lambda end: math.hypot(end["box/vx"], end["box/vy"]),
                {"starts": {"count": 5, "pieces": 5}, "max_iterations": 30}),
    "catch": Kind(catch, was_caught,
                  lambda end: at_end(end, {"ball/x": 1000, "ball/y": 1e4, "ball/vx": 10,
                                           "ball/vy": 10, "cup/x": 1000, "cup/vx": 10}),
                  lambda end, target: max(apart(end, target, "ball/x", "ball/y"), off_seat(end)),
                  relative_speed,
                  {"starts": {"count": 6, "pieces": 6}, "max_iterations": 40})}


class Programs:
    def __init__(self, programs: pathlib.Path, folder: pathlib.Path) -> None:
        self.programs, self.folder = programs, folder

    def motion(self, setting: Setting, efforts: list[float]) -> tuple[State, set[str]] | None:
        """The end of the motion with efforts in pieces, and the pairs of bodies that touched."""
        duration = setting.scene["simulation"]["duration"]
        with open(self.folder / "effort.csv", "w") as file:
            rows = csv.writer(file)
            rows.writerow(["time", "value"])
            for number, effort in enumerate(efforts):
                rows.writerow([round(duration * number / len(efforts), 9), effort])
        joints = [{**setting.scene["joints"][0],
                   "effort": {"file": "effort.csv", "interpolation": "constant"}},
                  *setting.scene["joints"][1:]]
        (self.folder / "drawn.json").write_text(json.dumps({**setting.scene, "joints": joints}))
        motion, contacts = self.folder / "motion.csv", self.folder / "contacts.csv"
        done = subprocess.run([self.programs / "tangible-simulate", self.folder / "drawn.json",
                               f"--out={motion}", f"--contacts={contacts}", "--every=1000000"],
                              capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"a drawn motion failed: {done.returncode} {done.stderr.strip()}", flush=True)
            return None
        end: State = {}
        with open(motion) as rows_of_motion:
            for row in csv.DictReader(rows_of_motion):
                end.update({f"{row['body']}/{name}": float(row[name])
                            for name in ("x", "y", "vx", "vy")})
        touched = set()
        with open(contacts) as rows_of_contacts:
            for row in csv.DictReader(rows_of_contacts):
                if row["kind"] == "contact" and float(row["normal_impulse"]) > 0:
                    touched.add(":".join(sorted((row["first"], row["second"]))))
        return end, touched

    def plan(self, file: pathlib.Path) -> Json | None:
        """The result of tangible-control; None where there is none."""
        result = self.folder / "result.json"
        result.unlink(missing_ok=True)
        done = subprocess.run([self.programs / "tangible-control", file, f"--out={result}",
                               "--threads=1"], capture_output=True, text=True, check=False)
        if not result.exists():
            print(f"{file.name}: no result: {done.returncode} {done.stderr.strip()}", flush=True)
            return None
        written: Json = json.loads(result.read_text())
        return written


def text_of(document: Json) -> str:
    """JSON with a line for each key, and for each element of a list of objects."""
    lines = []
    for key, value in document.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            value_text = "[\n    " + ",\n    ".join(json.dumps(v) for v in value) + "]"
        else:
            value_text = json.dumps(value)
        lines.append(f"{json.dumps(key)}: {value_text}")
    return "{ " + ",\n  ".join(lines) + " }\n"


def drawn(name: str, number: int, seed: int, programs: Programs) -> tuple[Json, Json, State]:
    """A scene, a problem in it and the end of a motion that solves it."""
    kind = KINDS[name]
    draw = random.Random(f"{name} {seed} {number}")
    while True:
        setting = kind.draw(draw)
        for _ in range(MOTIONS_OF_SETTING):
            efforts = [rounded(draw, -setting.bound, setting.bound) for _ in range(setting.pieces)]
            motion = programs.motion(setting, efforts)
            if motion is None or not kind.is_instance(setting.scene, *motion):
                continue
            return setting.scene, {
                "scene": f"{name}_{number:02}_scene.json",
                "controls": [{"path": setting.path, "low": -setting.bound, "high": setting.bound}],
                "cost": [{"control": setting.path, "weight": 0.001}, *kind.cost(motion[0])],
                **kind.search}, motion[0]


def study(name: str, folder: pathlib.Path, programs: Programs, options: argparse.Namespace) -> str:
    """Draws and plans problems of a kind; prints those that fail; the kind's row of the table."""
    kind = KINDS[name]
    succeeded, held = 0, 0
    distances: list[float] = []
    seconds: list[float] = []
    for number in range(options.count):
        scene, problem, target = drawn(name, number, options.seed, programs)
        (folder / problem["scene"]).write_text(text_of(scene))
        file = folder / f"{name}_{number:02}.json"
        file.write_text(text_of(problem))
        result = programs.plan(file)
        end = result["motion"]["final_state"] if result else {}
        if result is None or None in end.values():  # there is no plan, or its replay failed
            if result is not None:
                print(f"{file.name}: {result['status']}; {result['motion']['message']}", flush=True)
            distances.append(math.inf)
            continue
        held += result["status"] != "differs_from_motion"
        seconds.append(result["cpu_seconds"])
        distances.append(kind.distance(end, target))
        speed = kind.speed(end)
        if distances[-1] < LARGEST_DISTANCES[name] and speed < LARGEST_SPEED:
            succeeded += 1
        else:
            print(f"{file.name}: {result['status']}; {distances[-1]:.4f} m from its target"
                  + (f", {speed:.4f} m/s" if speed > 0 else ""), flush=True)
    return (f"{name:5}  {succeeded:3} of {options.count:3}  {held:3} of {options.count:3}     "
            f"  {statistics.median(distances):18.6f}  {statistics.median(seconds):19.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--count", type=int, default=20, help="problems of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", default=",".join(KINDS), help="with commas between them")
    parser.add_argument("--programs", type=pathlib.Path,
                        default=pathlib.Path(__file__).parents[2] / "build/release/bin")
    parser.add_argument("--write", type=pathlib.Path, help="folder for scenes and problems")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = options.write or pathlib.Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        programs = Programs(options.programs, pathlib.Path(name))
        table = [study(kind, folder, programs, options) for kind in options.kinds.split(",")]
    print("kind    succeeded  hold in motion  median distance (m)  median CPU time (s)")
    print("\n".join(table))


if __name__ == "__main__":
    main()
