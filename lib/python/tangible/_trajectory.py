"""Simulations and what they give."""

from __future__ import annotations

import html
import importlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._certificate import Certificate
from ._plain import choice, flag, mapping, text, whole, write_whole
from ._rollout import Numbers, Rollout, finite
from ._scene import Scene, SceneLike
from ._warning import warn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

Floats = NDArray[np.float64]
COMPONENTS = ("x", "y", "angle", "vx", "vy", "omega")
UNITS = dict(zip(COMPONENTS, ("m", "m", "rad", "m/s", "m/s", "rad/s")))


@dataclass(frozen=True)
class Contacts:
    """Contacts of all steps, a row each.

    Attributes:
        time: End of the step, s, shape (rows,).
        bodies: Names of the two bodies.
        gap: Signed distance at the step's start, m.
        normal_impulse: Along the normal, from the second body to the first, N s.
        tangential_impulse: Along the tangent (n_y, -n_x), N s.
        mode: "open", "closed", "sticking", "sliding_left" or "sliding_right".
        length: Of the step, s.
    """

    time: Floats
    bodies: list[tuple[str, str]]
    gap: Floats
    normal_impulse: Floats
    tangential_impulse: Floats
    mode: list[str]
    length: Floats

    @property
    def normal_force(self) -> Floats:
        """The mean over the step, with the impulses of impacts in it, N."""
        return np.asarray(self.normal_impulse / self.length)

    @property
    def tangential_force(self) -> Floats:
        """The mean over the step along the tangent, N."""
        return np.asarray(self.tangential_impulse / self.length)


@dataclass(frozen=True)
class Joints:
    """Joints over time: J of them.

    Attributes:
        names: In the order of the scene.
        units: Of their coordinates: "rad", "m", or "" of types that have none.
        coordinates: Angle or displacement of bodies[0] against bodies[1], 0 as drawn, shape (T, J);
            NaN where the type has none.
        rates: Of the coordinates, per second, shape (T, J).
        time: Ends of the steps, s, shape (steps,).
        forces: With which bodies[1] holds bodies[0]: the mean over each step of the force along x
            and y (N, world) and of the torque about the anchor (N m), shape (steps, J, 3). Limits,
            efforts, springs and friction of the joint are no part of it.
    """

    names: list[str]
    units: list[str]
    coordinates: Floats
    rates: Floats
    time: Floats
    forces: Floats


@dataclass(frozen=True)
class Events:
    """Events that event stepping located: `time` (s), the two bodies, the kind ("touch", ...)."""

    time: Floats
    bodies: list[tuple[str, str]]
    kind: list[str]


def display(page: Any, file: str | os.PathLike[str] | None) -> None:
    """Plays a page in a notebook, or writes it to a file: `show` of what has an `html()`."""
    if file is not None:
        write_whole(file, page.html())
        return
    try:
        ipython = importlib.import_module("IPython")
    except ImportError:
        ipython = None
    if ipython is None or ipython.get_ipython() is None:
        raise RuntimeError("show() plays in a notebook; expected a file outside of one, got none")
    ipython.display.display(page)


class Trajectory:
    """The motion of a scene's moving and kinematic bodies.

    Attributes:
        scene: A copy of the scene that was run, with its parameters set.
        status: "done", "unsolved" or "diverged".
        message: Empty, or why the run ended early.
        bodies: Names, in the order of the scene.
        times: s, shape (T,).
        poses: x (m), y (m), angle (rad), shape (T, bodies, 3).
        twists: vx, vy (m/s), omega (rad/s), shape (T, bodies, 3).
        energies: Kinetic and potential energy (of gravity and springs), J, shape (T, 2).
        contacts, events, joints: See `Contacts`, `Events`, `Joints`.
        summary: The figures of `tangible-simulate --summary`.
        certificate: How near the run is to kinks and jumps; None unless asked for.
        margins: Of each step the smallest relative distance to a change of contact modes, infinite
            where nothing is near, shape (steps,); empty unless the certificate is asked for.
        warnings: What the programs would warn of; `simulate` warns of it too.
    """

    def __init__(self, scene: Scene, raw: dict[str, Any]) -> None:
        names = scene.core.body_names + ["world"]

        def pairs(table: dict[str, Any]) -> list[tuple[str, str]]:
            return [(names[i], names[j]) for i, j in zip(table["first"], table["second"])]

        self.scene = scene._copy()
        self._view: _core.View = raw["view"]
        self.status: str = raw["status"]
        self.message: str = raw["message"]
        self.bodies = [names[i] for i in raw["bodies"]]
        self.times: Floats = raw["times"]
        self.poses: Floats = raw["poses"]
        self.twists: Floats = raw["twists"]
        self.energies: Floats = raw["energies"]
        self.margins: Floats = raw["margins"]
        contacts = raw["contacts"]
        self.contacts = Contacts(
            contacts["time"],
            pairs(contacts),
            contacts["gap"],
            contacts["normal_impulse"],
            contacts["tangential_impulse"],
            contacts["mode"],
            contacts["length"],
        )
        self.joints = Joints(
            raw["joints"],
            raw["units"],
            raw["coordinates"][:, :, 0],
            raw["coordinates"][:, :, 1],
            raw["step_ends"],
            raw["joint_forces"],
        )
        events = raw["events"]
        self.events = Events(events["time"], pairs(events), events["kind"])
        self.summary: dict[str, Any] = json.loads(raw["summary"])
        self.warnings: list[str] = raw["warnings"]
        self.certificate: Certificate | None = (
            Certificate.of_json(raw["certificate"]) if raw["certificate"] else None
        )

    def __getitem__(self, name: str) -> Floats:
        """A coordinate over time, shape (T,): "ball/x", "ball/angle", "ball/vy", and of joints
        "hinge/coordinate", "hinge/rate"."""
        owner, _, component = text(name, "name", "the name of a coordinate").rpartition("/")
        if owner in self.bodies and component in COMPONENTS:
            i, k = self.bodies.index(owner), COMPONENTS.index(component)
            return self.poses[:, i, k] if k < 3 else self.twists[:, i, k - 3]
        if owner in self.joints.names and component in ("coordinate", "rate"):
            i = self.joints.names.index(owner)
            if self.joints.units[i]:
                return (self.joints.coordinates if component == "coordinate" else self.joints.rates)[:, i]
        raise KeyError(
            f"{name}: expected BODY/COMPONENT with a body of {', '.join(self.bodies)} and a component "
            f"of {', '.join(COMPONENTS)}, or JOINT/coordinate, JOINT/rate with a joint of "
            f"{', '.join(self._turning()) or 'none'}"
        )

    def _turning(self) -> list[str]:
        """Joints that have a coordinate."""
        return [name for name, unit in zip(self.joints.names, self.joints.units) if unit]

    @property
    def names(self) -> list[str]:
        """Of all that `run[name]` gives: coordinates of bodies, then of joints."""
        return [f"{body}/{component}" for body in self.bodies for component in COMPONENTS] + [
            f"{joint}/{component}" for joint in self._turning() for component in ("coordinate", "rate")
        ]

    def unit(self, name: str) -> str:
        """The unit of a coordinate: "m", "rad", "m/s", "rad/s"."""
        owner, _, component = text(name, "name", "the name of a coordinate").rpartition("/")
        self[name]  # raises where there is none
        if component in UNITS:
            return UNITS[component]
        unit = self.joints.units[self.joints.names.index(owner)]
        return unit if component == "coordinate" else f"{unit}/s"

    def to_dataframe(self, *, long: bool = False) -> DataFrame:
        """The run as a table of pandas.

        Args:
            long: False: a column a coordinate, `names`, with the time (s) as index. True: the
                columns of a trajectory file, `time`, `body`, `x`, ..., a row a body and time.
        """
        import pandas as pd

        if not long:
            index = pd.Index(self.times, name="time")
            return pd.DataFrame({name: self[name] for name in self.names}, index=index)
        count = len(self.bodies)
        values = np.concatenate([self.poses, self.twists], axis=2).reshape(-1, 6)
        table = {"time": np.repeat(self.times, count), "body": list(self.bodies) * len(self.times)}
        return pd.DataFrame({**table, **dict(zip(COMPONENTS, values.T))})

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Writes a trajectory file, as `tangible-simulate --out` does: 17 digits, the same bits."""
        rows = ["time,body," + ",".join(COMPONENTS)]
        for time, poses, twists in zip(self.times, self.poses, self.twists):
            for body, numbers in zip(self.bodies, np.concatenate([poses, twists], axis=1)):
                rows.append(",".join([f"{time:.17g}", body, *(f"{x:.17g}" for x in numbers)]))
        write_whole(file, "\n".join(rows) + "\n")

    @property
    def final(self) -> dict[str, float]:
        """The last state: {"ball/x": ..., ...}."""
        return {
            f"{body}/{component}": float(self[f"{body}/{component}"][-1])
            for body in self.bodies
            for component in COMPONENTS
        }

    def html(self) -> str:
        """The animated view of the recorded times as one self-contained page."""
        return self._view.html()

    def show(self, file: str | os.PathLike[str] | None = None) -> None:
        """Plays the animated view in a notebook, or writes it to a file for a browser.

        Without a file and outside a notebook it raises `RuntimeError`.
        """
        display(self, file)

    def _repr_html_(self) -> str:
        """What a notebook shows: the animated view in a frame of its own."""
        return (
            f'<iframe srcdoc="{html.escape(self.html())}" width="100%" height="520" '
            'style="border:0"></iframe>'
        )

    def plot(self, *names: str, ax: Axes | None = None) -> Axes:
        """Plots coordinates over time with matplotlib, by default x and y of all bodies.

        Steps in which a contact bears an impulse are shaded. Returns the axes.
        """
        import matplotlib.pyplot as plt

        axes: Axes = ax if ax is not None else plt.subplots()[1]
        shown = list(names) or [f"{body}/{k}" for body in self.bodies for k in ("x", "y")]
        units = list(dict.fromkeys(self.unit(name) for name in shown if self[name] is not None))
        for name in shown:
            label = name if len(units) == 1 else f"{name} ({self.unit(name)})"
            axes.plot(self.times, self[name], label=label)
        axes.broken_barh(
            self._borne(), (0.0, 1.0), transform=axes.get_xaxis_transform(), color="0.85", lw=0, zorder=0
        )
        axes.set_xlabel("time (s)")
        axes.set_ylabel(", ".join(units))
        axes.legend(loc="upper right")  # to look for the best place takes long for many points
        return axes

    def _borne(self) -> list[tuple[float, float]]:
        """(start, length) in s of the spans in which a contact bears an impulse."""
        bears = self.contacts.normal_impulse > 0.0
        ends, first = np.unique(self.contacts.time[bears], return_index=True)
        starts = ends - self.contacts.length[bears][first]
        # Steps one after another are one span, to rounding of their times.
        tolerance = 1e-9 * np.abs(ends).max(initial=1.0)
        begins = np.flatnonzero(np.diff(ends, prepend=-np.inf) > (ends - starts) + tolerance)
        lasts = np.append(begins[1:], len(ends)) - 1
        return [(float(starts[i]), float(ends[k] - starts[i])) for i, k in zip(begins, lasts)] if len(ends) else []

    def plot_energies(self, ax: Axes | None = None) -> Axes:
        """Plots kinetic and potential energy and their sum (J) over time. Returns the axes."""
        import matplotlib.pyplot as plt

        axes: Axes = ax if ax is not None else plt.subplots()[1]
        for values, label in zip(self.energies.T, ("kinetic", "potential")):
            axes.plot(self.times, values, label=label)
        axes.plot(self.times, self.energies.sum(axis=1), label="sum")
        axes.set_xlabel("time (s)")
        axes.set_ylabel("energy (J)")
        axes.legend()
        return axes

    def plot_contacts(self, ax: Axes | None = None) -> Axes:
        """Plots the normal impulse (N s) of each pair of bodies that touch, in each step.

        Returns the axes.
        """
        import matplotlib.pyplot as plt

        axes: Axes = ax if ax is not None else plt.subplots()[1]
        of_pair: dict[tuple[str, str], list[int]] = {}
        for row, pair in enumerate(self.contacts.bodies):
            of_pair.setdefault(pair, []).append(row)
        for (first, second), rows in of_pair.items():
            times, place = np.unique(self.contacts.time[rows], return_inverse=True)
            impulses = np.bincount(place, weights=self.contacts.normal_impulse[rows])
            axes.plot(times, impulses, ".", label=f"{first} on {second}")
        axes.set_xlabel("time (s)")
        axes.set_ylabel("normal impulse (N s)")
        if of_pair:
            axes.legend()
        return axes

    def plot_margins(self, ax: Axes | None = None) -> Axes:
        """Plots how near each step is to a kink of its derivatives, and below which margin the
        verdict says so (1e-6).

        Returns the axes.

        Raises:
            ValueError: The certificate was not asked for.
        """
        import matplotlib.pyplot as plt

        if self.certificate is None:
            raise ValueError("plot_margins: expected a run with its certificate (certify=True)")
        axes: Axes = ax if ax is not None else plt.subplots()[1]
        steps = (np.arange(len(self.margins)) + 1.0) * (self.times[-1] / max(len(self.margins), 1))
        near = np.isfinite(self.margins)
        # A margin of 0 has no logarithm: it is drawn at the bottom.
        axes.semilogy(steps[near], np.maximum(self.margins[near], 1e-16), ".")
        axes.axhline(1e-6, color="0.6", lw=1)
        axes.set_xlabel("time (s)")
        axes.set_ylabel("margin (relative)")
        axes.set_title(str(self.certificate["verdict"]))
        return axes

    def __repr__(self) -> str:
        return (
            f"Trajectory({self.status}, {len(self.times)} times to {self.times[-1]:g} s, "
            f"bodies={self.bodies})"
        )


State = Union[Numbers, Trajectory]


def _initial_state(rollout: Rollout, given: State) -> Floats:
    if not isinstance(given, Trajectory):
        return rollout._inputs(None, given, None)[1]  # type: ignore[return-value]
    final = given.final
    missing = [name for name in rollout.outputs if name not in final]
    if missing:
        raise ValueError(f"initial_state: expected a run with {missing[0]}, got {given!r}")
    return np.array([final[name] for name in rollout.outputs])


def simulate(
    scene: SceneLike,
    parameters: Mapping[str, float] | None = None,
    *,
    initial_state: State | None = None,
    controls: Mapping[str, ArrayLike] | None = None,
    every: int = 1,
    certify: bool = False,
    on_failure: str = "raise",
) -> Trajectory:
    """Runs a scene.

    Args:
        scene: A `Scene`, a scene file, or a dict of its JSON.
        parameters: Values that replace the scene's: {"bodies/ball/mass": 2.0}, SI units.
        initial_state: Of the moving bodies, as a `Rollout` orders it, shape (S,); a dict of what
            differs from the scene's, {"ball/x": 0.3}; or a run, from whose end this one goes on.
        controls: Forces, torques and efforts that have a value of their own in each step, N or N m:
            {"forces/push/force/x": shape (steps,)}, or one number for all steps. The motion has the
            bits of a `Rollout` with the same controls.
        every: Record one state in so many steps; the first and the last are always recorded.
        certify: Whether the certificate of the run's derivatives is computed too.
        on_failure: "raise", or "return" the trajectory up to a step that failed.

    Raises:
        TangibleError: A mistake in the scene or a value that is not allowed; a run that ended early.
        ValueError: A shape, or a name that the scene does not have.
        TypeError: An argument that cannot be used.

    Warns:
        TangibleWarning: Of what `Trajectory.warnings` lists.
    """
    choice(on_failure, "on_failure", "raise", "return")
    every, certify = whole(every, "every", 1), flag(certify, "certify")
    if controls is not None:
        mapping(controls, "controls", "a dict {path: a number, or one for each step}")
    read = Scene.of(scene)
    if parameters is not None:
        mapping(parameters, "parameters", "a dict {path: value}")
        for path in parameters:
            if path in (controls or {}):
                raise ValueError(
                    f"{path}: expected a value in parameters or in controls, got both"
                )
        read = read.with_parameters(parameters) if parameters else read
    state: Floats | None = None
    values: Floats | None = None
    paths = list(controls or {})
    if initial_state is not None or controls:
        rollout = Rollout(read, [], paths)
        rows = rollout._inputs(None, None, controls)[2]
        if rows.shape[0] != 1:
            raise ValueError(f"controls: expected one run, got a batch of {rows.shape[0]}")
        finite(rows, "controls ", paths, False)
        values = rows[0]
        if initial_state is not None:
            state = _initial_state(rollout, initial_state).reshape(-1)
            if state.shape != (len(rollout.outputs),):
                raise ValueError("initial_state: expected the state of one run, got a batch")
            finite(state[None], "initial_state ", rollout.outputs, False)
    trajectory = Trajectory(read, _core.simulate(read.core, every, certify, state, paths, values))
    if trajectory.status != "done" and on_failure == "raise":
        raise _core.TangibleError(trajectory.message)
    warn(trajectory.warnings)
    return trajectory
