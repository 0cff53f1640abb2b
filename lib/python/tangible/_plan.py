"""Plans: forces and efforts with which a scene minimises a cost."""

from __future__ import annotations

import html
import json
import math
import os
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._certificate import Certificate
from ._plain import choice, file_name, flag, function, mapping, number, plain, text, whole, write_whole
from ._problem import Maker, Problem, object_of, text_of
from ._rollout import MOST_THREADS, floats
from ._scene import Scene, SceneLike
from ._trajectory import UNITS, Trajectory, display, simulate
from ._warning import warn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
ProblemLike = Union[Mapping[str, Any], str, "os.PathLike[str]"]
Callback = Callable[[dict[str, Any]], object]


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


class _Controlled:
    """What plans and runs over a receding horizon have in common: controls and a motion."""

    def __init__(self, raw: dict[str, Any]) -> None:
        data: dict[str, Any] = json.loads(raw["result"])
        self.data = data
        self.status: str = data["status"]
        self.cost = float(data["cost"])
        self.certificate = Certificate(data["certificate"])
        self.warnings: list[str] = raw["warnings"]
        self.scene = Scene._of_core(raw["scene"])
        self.paths: list[str] = data["controls"]["paths"]
        values: Floats = raw["controls"]
        self.controls: dict[str, Floats] = {path: values[:, j] for j, path in enumerate(self.paths)}
        self.states: Floats = raw["states"]
        self.final_state: dict[str, float] = data["final_state"]
        self.names = list(self.final_state)
        starts = np.array(data["controls"]["times"])
        dt = float(self.scene.to_dict()["simulation"]["dt"])
        self.times: Floats = np.append(starts, len(starts) * dt)
        self._table: str = raw["plan"]
        self._trajectory: str = raw["trajectory"]
        self._page: str = raw["page"]

    def __getitem__(self, name: str) -> Floats:
        """A coordinate over `times`, "rod/angle", or a control of each step by its path."""
        if text(name, "name", "the path of a control or the name of a coordinate") in self.controls:
            return self.controls[name]
        if name in self.names:
            return np.asarray(self.states[:, self.names.index(name)])
        raise KeyError(f"{name}: expected one of {', '.join([*self.paths, *self.names])}")

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes the controls as `tangible-control --plan` does: a problem with
        `"initial": {"file": ...}` goes on from them."""
        write_whole(file, self._table)

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Writes the motion as a trajectory file, as `tangible-control --trajectory` does."""
        write_whole(file, self._trajectory)

    def html(self) -> str:
        """The animated page, as `tangible-control --view` writes it."""
        return self._page

    def show(self, file: str | os.PathLike[str] | None = None) -> None:
        """Plays the animated page in a notebook, or writes it to a file for a browser.

        Without a file and outside a notebook it raises `RuntimeError`.
        """
        display(self, file)

    def _repr_html_(self) -> str:
        """What a notebook shows: the animated page in a frame of its own."""
        return (
            f'<iframe srcdoc="{html.escape(self.html())}" width="100%" height="640" '
            'style="border:0"></iframe>'
        )

    def _iterations(self) -> list[dict[str, Any]]:
        return []

    def plot(self, *names: str, ax: Axes | None = None) -> Axes:
        """Plots with matplotlib, by default the controls over time; returns the axes.

        Args:
            names: Paths of controls (N or N m), coordinates ("rod/angle"), or "cost" alone: by
                iteration.
            ax: Axes to draw on; absent: new ones.
        """
        import matplotlib.pyplot as plt

        axes: Axes = ax if ax is not None else plt.subplots()[1]
        if names == ("cost",) and self._iterations():
            axes.semilogy([iteration["cost"] for iteration in self._iterations()], marker="o")
            axes.set_xlabel("iteration")
            axes.set_ylabel("cost")
            return axes
        units = self.scene.units()
        shown: list[str] = []
        for name in names or self.paths:
            values = self[name]
            unit = units.get(name, "N or N m") if name in self.controls else UNITS[name.rpartition("/")[2]]
            shown.append(unit)
            if name in self.controls:
                axes.step(self.times, np.append(values, values[-1]), where="post", label=f"{name} ({unit})")
            else:
                axes.plot(self.times, values, label=f"{name} ({unit})")
        axes.set_xlabel("time (s)")
        axes.set_ylabel(", ".join(dict.fromkeys(shown)))
        axes.legend(loc="upper right")
        return axes


@dataclass(frozen=True)
class Motion:
    """What becomes of a plan in the motion: its replay by events, at a quarter of its step.

    Attributes:
        cost: Of the replay; NaN where it failed.
        message: Empty, or why the replay failed.
        states: At `times` of the plan, shape (steps + 1, states); NaN after a failure.
        final_state: {"rod/angle": ...}, NaN where the replay failed; empty where it had no state.
        cost_of_nothing: Of the motion with controls of 0, or of the bounds nearest to it.
        scene: Which the replay runs, stepped by events.
        controls: {path: control of each of its steps}.
        every: Steps of the replay in each step of the plan.
    """

    cost: float
    message: str
    states: Floats
    final_state: dict[str, float]
    cost_of_nothing: float
    scene: Scene
    controls: dict[str, Floats]
    every: int


class Plan(_Controlled):
    """What `plan` has found.

    Attributes:
        status: "converged", "iteration_limit", "no_descent", or why the plan does not hold:
            "differs_from_motion", "no_effect_on_target".
        message: Why, in one line; empty where there is nothing to say.
        planned_status: The optimiser's own status.
        holds: Whether the plan holds in the motion and reaches its targets.
        cost: Of the plan.
        gradient: The share of the cost that is left to gain, to first order.
        paths: Of the controls.
        controls: {path: control in each step, N or N m, shape (steps,)}, which
            `simulate(plan.scene, controls=plan.controls)` takes.
        times: Starts of the steps, and the end of the last one, s, shape (steps + 1,).
        names: Of the states, as a `Rollout` orders them.
        states: Of the planned motion, shape (steps + 1, states).
        final_state: Its last state, {"rod/angle": ...}.
        motion: The replay of the plan by events, beside the plan.
        certificate: Of the derivatives along the plan; `print` shows it in words.
        iterations: A dict each: `cost`, `gradient`, `shift`, `step`.
        warnings: What `tangible-control` warns of.
        scene: The problem's, for the time of the horizon.
        data: The whole result as `tangible-control --out` writes it.
    """

    def __init__(self, raw: dict[str, Any]) -> None:
        super().__init__(raw)
        data = self.data
        self.message: str = data["message"]
        self.planned_status: str = data["planned_status"]
        self.holds: bool = raw["holds"]
        self.gradient = _number(data["gradient"])
        self.iterations: list[dict[str, Any]] = data["iterations"]
        replay = data["motion"]
        values: Floats = raw["replay_controls"]
        self.motion = Motion(
            _number(replay["cost"]),
            replay["message"],
            raw["replay_states"],
            {name: _number(value) for name, value in replay["final_state"].items()},
            _number(replay["cost_of_nothing"]),
            Scene._of_core(raw["replay_scene"]),
            {path: values[:, j] for j, path in enumerate(self.paths)},
            raw["replay_parts"],
        )

    def simulate(self, *, certify: bool = False) -> Trajectory:
        """The replay by events as a run, with its contacts and events: the bits of `motion`.

        It is `simulate(motion.scene, controls=motion.controls, every=motion.every)`.
        """
        motion = self.motion
        return simulate(motion.scene, controls=motion.controls, every=motion.every, certify=certify)

    def _iterations(self) -> list[dict[str, Any]]:
        return self.iterations

    def __repr__(self) -> str:
        return (
            f"Plan({self.status}, cost={self.cost:.6g}, in the motion {self.motion.cost:.6g}, "
            f"{len(self.times) - 1} steps to {self.times[-1]:g} s, controls={self.paths})"
        )


class MpcResult(_Controlled):
    """What a run over a receding horizon has been.

    Attributes:
        status: "done", or "no_effect_on_target" (`data["message"]` says of which).
        cost: Of the run.
        paths, controls, times, names, final_state: As of a `Plan`, of what was played.
        states: Of the plant, shape (steps + 1, states).
        plans: Number of plans.
        plans_failed: Those in whose place the plan before was continued.
        states_projected: States of the plant that were not on the joints of the model.
        joint_error_max: The largest error of one, m or rad.
        seconds_median, seconds_max: CPU time of a plan.
        estimates: Of a problem with `observations`: their number, how far each number of the state
            was estimated off (`error_rms`) and how much surprised; None where plans know the state.
        certificate: Of the model's run with the controls that were played.
        warnings: What `tangible-control` warns of.
        scene: The plant, for the time of the run.
        data: The whole result as `tangible-control --mpc --out` writes it.
    """

    def __init__(self, raw: dict[str, Any]) -> None:
        super().__init__(raw)
        data = self.data
        self.plans = int(data["plans"])
        self.plans_failed = int(data["plans_failed"])
        self.states_projected = int(data["states_projected"])
        self.joint_error_max = float(data["joint_error_max"])
        self.seconds_median = float(data["cpu_seconds_median"])
        self.seconds_max = float(data["cpu_seconds_max"])
        self.estimates: dict[str, Any] | None = data.get("estimates")

    def __repr__(self) -> str:
        return (
            f"MpcResult({self.status}, cost={self.cost:.6g}, {self.plans} plans, {self.plans_failed} of them "
            f"failed, to {self.times[-1]:g} s, controls={self.paths})"
        )


Initial = Union[Plan, MpcResult, Mapping[str, Any], str, "os.PathLike[str]"]


def _table(initial: Any, problem: Problem) -> str:
    """Controls of each step as a file that `initial` names."""
    if isinstance(initial, _Controlled):
        return initial._table
    with problem.open(_core.Control) as (core, _):
        dt, paths = core.dt, core.paths
    if sorted(initial) != sorted(paths):
        raise ValueError(f"initial: expected controls of {', '.join(paths)}, got {', '.join(map(str, initial))}")
    columns = [floats(initial[path], f"initial {path}") for path in paths]
    for path, column in zip(paths, columns):
        if column.ndim != 1 or column.shape != columns[0].shape:
            raise ValueError(f"initial: {path}: expected a number for each step, got shape {column.shape}")
    rows = [",".join(["time", *paths])]
    for k, values in enumerate(zip(*columns)):
        rows.append(",".join(f"{float(value):.17g}" for value in (k * dt, *values)))
    return "\n".join(rows) + "\n"


def _make(problem: ProblemLike, folder: str | os.PathLike[str], initial: Initial | None) -> Problem:
    """A problem from its file, or from its JSON, in which a scene and controls may stand."""
    maker = Maker()
    if isinstance(initial, (str, os.PathLike)):
        initial = {"file": os.path.abspath(initial)}
    if initial is not None and not isinstance(initial, _Controlled):
        mapping(initial, "initial", "a plan, a file that it saved, or a dict {path: a number for each step}")
    if isinstance(problem, Mapping):
        data = dict(problem)
        name = str(Path(file_name(folder, "folder", "a folder's name")) / "plan")
        if isinstance(data.get("scene"), (Scene, Mapping)):
            scene = Scene.of(data["scene"])
            data["scene"] = maker.add("scene", scene.core.to_whole_json(), scene.name)
    else:
        name = file_name(problem, "problem", "a file of a problem or a dict of its JSON")
        written = text_of(name)
        read = object_of(written)
        if initial is None or read is None:
            return Problem(written, name, {}, {})
        data = read
    own = data.pop("initial", None)
    begins = own if initial is None else initial
    if isinstance(begins, _Controlled) or (isinstance(begins, Mapping) and "file" not in begins):
        bare = Problem(json.dumps(plain(data, "plan")), name, maker.files, maker.said)
        begins = {"file": maker.add("initial", _table(begins, bare), "initial")}
    if begins is not None:
        data["initial"] = begins
    return Problem(json.dumps(plain(data, "plan")), name, maker.files, maker.said)


def _check(threads: int, on_failure: str, callback: Callback | None, progress: bool) -> int:
    choice(on_failure, "on_failure", "raise", "return")
    function(callback, "callback")
    flag(progress, "progress")
    return whole(threads, "threads", 0, MOST_THREADS)


def _tell(line: str, said: dict[str, Any], progress: bool, callback: Callback | None) -> None:
    if progress:
        print(f"\r{line}, {said['seconds']:.1f} s\033[K", end="", file=sys.stderr, flush=True)
    if callback is not None:
        callback(said)


def plan(
    problem: ProblemLike,
    *,
    folder: str | os.PathLike[str] = ".",
    initial: Initial | None = None,
    threads: int = 0,
    callback: Callback | None = None,
    progress: bool = False,
    on_failure: str = "raise",
) -> Plan:
    """Plans forces and efforts of a scene, within bounds, as `tangible-control` does.

        tangible.plan("pendulum_swing_up.json")
        tangible.plan({"scene": scene, "controls": [{"path": "joints/motor/effort", "low": -2.5, "high": 2.5}],
                       "cost": [{"state": "rod/angle", "target": 3.14, "weight": 100, "at": "end"}]})

    Args:
        problem: A problem's file, or a dict of its JSON (README of `lib/control`), in which `scene`
            may stand as a `Scene` or dict, and `initial` as a plan or as {path: a number a step}.
        folder: Where files that a dict names are looked for.
        initial: Controls from which the plan begins, in the place of the problem's: a plan, or
            {path: shape (steps,)}, or a file that `Plan.save` has written, as its name or as
            {"file": name}.
        threads: Of `starts` and `sampling`; 0: one a core. Results have the same bits with any.
        callback: Called after each iteration with `start`, `iteration`, `cost` (before the
            iteration), `gradient`, `step` and `seconds`; what it raises ends the plan. With several
            starts several threads call it, one at a time.
        progress: Whether a line on stderr says how far it is.
        on_failure: "raise", or "return" a plan that does not hold in the motion, or that has no
            effect on its targets.

    Raises:
        TangibleError: A mistake in the problem; no plan; a plan that does not hold.
        ValueError, TypeError: An argument that cannot be used.

    Warns:
        TangibleWarning: Of what `Plan.warnings` lists.
    """
    threads = _check(threads, on_failure, callback, progress)
    began = time.perf_counter()

    def told(start: int, iteration: int, cost: float, gradient: float, step: float) -> None:
        seconds = time.perf_counter() - began
        said = {"start": start, "iteration": iteration, "cost": cost, "gradient": gradient, "step": step,
                "seconds": seconds}
        _tell(f"start {start}, iteration {iteration}, cost {cost:.6g}", said, progress, callback)

    made = _make(problem, folder, initial)
    try:
        with made.open(_core.Control) as (core, _):
            raw = core.plan(threads, told if progress or callback is not None else None)
    finally:
        if progress:
            print(file=sys.stderr)
    found = Plan(raw)
    if not found.holds and on_failure == "raise":
        raise _core.TangibleError(f"{made.name}: {found.status}: {found.message}")
    warn(found.warnings)
    return found


def mpc(
    problem: ProblemLike,
    plant: SceneLike | None = None,
    *,
    folder: str | os.PathLike[str] = ".",
    initial: Initial | None = None,
    budget: float | None = None,
    threads: int = 0,
    callback: Callback | None = None,
    progress: bool = False,
) -> MpcResult:
    """Controls a plant with a new plan in each step, as `tangible-control --mpc` does.

    Args:
        problem: As of `plan`, with its key `mpc`.
        plant: The scene that is controlled, with the moving bodies and `dt` of the problem's; a
            `Scene`, its file or a dict. None: the problem's own.
        folder, initial, threads: As of `plan`.
        budget: Time of each plan, s, so that the result depends on the machine; None: the
            problem's number of iterations, with the same bits on any machine.
        callback: Called after each step with `step`, `steps`, `cost` (so far) and `seconds`; what
            it raises ends the run.
        progress: Whether a line on stderr says how far it is.

    Raises:
        TangibleError: A mistake in the problem or the plant; a run in which all plans failed.
        ValueError, TypeError: An argument that cannot be used.

    Warns:
        TangibleWarning: Of what `MpcResult.warnings` lists.
    """
    threads = _check(threads, "raise", callback, progress)
    if budget is not None:
        budget = number(budget, "budget", above=0.0, what="a time > 0 in s")
    began = time.perf_counter()

    def told(step: int, steps: int, cost: float) -> None:
        said = {"step": step, "steps": steps, "cost": cost, "seconds": time.perf_counter() - began}
        _tell(f"step {step + 1} of {steps}, cost {cost:.6g}", said, progress, callback)

    own = None if plant is None else Scene.of(plant, "plant")
    made = _make(problem, folder, initial)
    try:
        with made.open(_core.Control) as (core, _):
            raw = core.mpc(
                None if own is None else own.core,
                "" if own is None else own.name,
                0.0 if budget is None else budget,
                threads,
                told if progress or callback is not None else None,
            )
    finally:
        if progress:
            print(file=sys.stderr)
    found = MpcResult(raw)
    warn(found.warnings)
    return found
