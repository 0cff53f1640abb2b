"""Simulations and what they give."""

from __future__ import annotations

import html
import importlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._certificate import Certificate
from ._scene import Scene, SceneLike
from ._warning import warn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
COMPONENTS = ("x", "y", "angle", "vx", "vy", "omega")


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
    """

    time: Floats
    bodies: list[tuple[str, str]]
    gap: Floats
    normal_impulse: Floats
    tangential_impulse: Floats
    mode: list[str]


@dataclass(frozen=True)
class Events:
    """Events that event stepping located: `time` (s), the two bodies, the kind ("touch", ...)."""

    time: Floats
    bodies: list[tuple[str, str]]
    kind: list[str]


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
        contacts, events: See `Contacts`, `Events`.
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
        self._ran = scene.core
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
        )
        events = raw["events"]
        self.events = Events(events["time"], pairs(events), events["kind"])
        self.summary: dict[str, Any] = json.loads(raw["summary"])
        self.warnings: list[str] = raw["warnings"]
        self.certificate: Certificate | None = (
            Certificate.of_json(raw["certificate"]) if raw["certificate"] else None
        )

    def __getitem__(self, name: str) -> Floats:
        """A coordinate over time, shape (T,): "ball/x", "ball/angle", "ball/vy", ..."""
        body, _, component = name.rpartition("/")
        if body not in self.bodies or component not in COMPONENTS:
            raise KeyError(
                f"{name}: expected BODY/COMPONENT with a body of {', '.join(self.bodies)} "
                f"and a component of {', '.join(COMPONENTS)}"
            )
        i, k = self.bodies.index(body), COMPONENTS.index(component)
        return self.poses[:, i, k] if k < 3 else self.twists[:, i, k - 3]

    @property
    def final(self) -> dict[str, float]:
        """The last state: {"ball/x": ..., ...}."""
        return {
            f"{body}/{component}": float(self[f"{body}/{component}"][-1])
            for body in self.bodies
            for component in COMPONENTS
        }

    def html(self) -> str:
        """The animated view as one self-contained page."""
        page: str = _core.simulate(self._ran, 1, False, True)["html"]
        return page

    def show(self, file: str | os.PathLike[str] | None = None) -> None:
        """Plays the animated view in a notebook, or writes it to a file for a browser.

        Without a file and outside a notebook it raises `RuntimeError`.
        """
        if file is not None:
            Path(file).write_text(self.html(), encoding="utf-8")
            return
        try:
            ipython = importlib.import_module("IPython")
        except ImportError:
            ipython = None
        if ipython is None or ipython.get_ipython() is None:
            raise RuntimeError("show() plays in a notebook; expected a file outside of one, got none")
        ipython.display.display(self)

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
        for name in names or [f"{body}/{k}" for body in self.bodies for k in ("x", "y")]:
            axes.plot(self.times, self[name], label=name)
        step = float(self.summary["steps"] and self.times[-1] / self.summary["steps"])
        borne = np.unique(self.contacts.time[self.contacts.normal_impulse > 0.0])
        for time in borne:
            axes.axvspan(time - step, time, color="0.85", lw=0, zorder=0)
        axes.set_xlabel("time (s)")
        axes.legend()
        return axes

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
        axes.set_ylabel("margin")
        axes.set_title(str(self.certificate["verdict"]))
        return axes

    def __repr__(self) -> str:
        return (
            f"Trajectory({self.status}, {len(self.times)} times to {self.times[-1]:g} s, "
            f"bodies={self.bodies})"
        )


def simulate(
    scene: SceneLike,
    parameters: Mapping[str, float] | None = None,
    *,
    every: int = 1,
    certify: bool = False,
    on_failure: str = "raise",
) -> Trajectory:
    """Runs a scene.

    Args:
        scene: A `Scene`, a scene file, or a dict of its JSON.
        parameters: Values that replace the scene's: {"bodies/ball/mass": 2.0}, SI units.
        every: Record one state in so many steps; the first and the last are always recorded.
        certify: Whether the certificate of the run's derivatives is computed too.
        on_failure: "raise", or "return" the trajectory up to a step that failed.

    Raises:
        TangibleError: A mistake in the scene or a value that is not allowed; a run that ended early.

    Warns:
        TangibleWarning: Of what `Trajectory.warnings` lists.
    """
    if on_failure not in ("raise", "return"):
        raise ValueError(f"on_failure: expected raise or return, got {on_failure}")
    read = Scene.of(scene)
    if parameters:
        read = read.with_parameters(parameters)
    trajectory = Trajectory(read, _core.simulate(read.core, every, certify, False))
    if trajectory.status != "done" and on_failure == "raise":
        raise _core.TangibleError(trajectory.message)
    warn(trajectory.warnings)
    return trajectory
