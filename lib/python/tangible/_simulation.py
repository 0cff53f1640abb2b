"""Simulations that go on a step at a time, one or many side by side."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._plain import choice, integers, mapping, number, paths, said, seed_of, whole
from ._rollout import MOST_THREADS, Numbers, Rollout, _array, finite, floats, one_value
from ._scene import Scene, SceneLike

Floats = NDArray[np.float64]


class Simulation:
    """A scene that goes on a step at a time, for as long as one likes.

        simulation = tangible.Simulation(scene, controls=["joints/motor/effort"])
        state = simulation.reset(seed=0)
        while state[1] > 0:
            state = simulation.step([policy(state)])

    Steps are those of a long run, bit for bit: `dt`, stepping and all else are the scene's, but its
    duration is no end. With `batch` there are N of them, which run on all cores; states, actions and
    parameters have a leading axis then.

    Args:
        scene: A `Scene`, a scene file, or a dict of its JSON.
        controls: C paths of forces, torques or efforts that an action sets.
        parameters: P paths of parameters that `reset` may set.
        batch: N; absent: one simulation, without the axis.
        noise: {name of an output, or path of a parameter: standard deviation}: Gaussian noise of the
            initial state, or of parameters, which `reset` draws anew. Bodies with joints are moved
            by "joints/pin/angle" or "joints/pin/rate", which keep the joints closed.
        domains: Values of parameters, {path: shape (D,)}: `reset` draws one of the D for each row,
            all its values together. Its paths are added to `parameters`.
        on_failure: "raise", or "nan" in states of rows that have failed, until they are reset.
        threads: Of batches, up to 256; 0: one a core. Results have the same bits for any number.

    It is pickled and copied as it is made or reset. After a step `pickle` and `copy` raise TypeError:
    what the engine keeps between steps (its time, and how the last contacts bore) is no part of the
    state; another one that is reset to the `state` goes on to rounding where nothing depends on time.

    Raises:
        TangibleError: A mistake in the scene or a path.
        ValueError, TypeError: An argument that cannot be used.
    """

    def __init__(
        self,
        scene: SceneLike,
        controls: Sequence[str] = (),
        *,
        parameters: Sequence[str] = (),
        batch: int | None = None,
        noise: Mapping[str, float] | None = None,
        domains: Mapping[str, ArrayLike] | None = None,
        on_failure: str = "raise",
        threads: int = 0,
    ) -> None:
        batch = None if batch is None else whole(batch, "batch", 1)
        choice(on_failure, "on_failure", "raise", "nan")
        noise, domains = {} if noise is None else noise, {} if domains is None else domains
        mapping(noise, "noise", "a dict {name: standard deviation}")
        mapping(domains, "domains", "a dict {path: values}")
        read = Scene.of(scene)
        self.scene = read._copy()
        self.batch = batch
        self.on_failure = on_failure
        outputs = Rollout(read).outputs
        moved = [name for name in paths(list(noise), "noise") if name not in outputs]
        names = list(dict.fromkeys([*paths(parameters, "parameters"), *paths(list(domains), "domains"), *moved]))
        # It checks the paths and knows the scene's own values.
        self._rollout = Rollout(read, names, controls)
        self._rows = 1 if batch is None else batch
        self._threads = whole(threads, "threads", 0, MOST_THREADS)
        self._core = self._make()
        self._set = np.tile(self._rollout._defaults[0][0], (self._rows, 1))  # parameters of each row
        own = self._rollout._defaults[2][0]
        if not len(own) and self.controls:
            dt = json.loads(read.core.to_json())["simulation"]["dt"]
            a_step = Rollout(Scene(read, simulation={"duration": dt}), names, controls)
            own = a_step._defaults[2][0]
        self._own = own[0] if self.controls else np.zeros(0)
        self._noise = np.zeros(len(outputs))
        self._spread_of_parameters = np.zeros(len(names))
        for name, deviation in noise.items():
            spread = number(deviation, f"noise {name}", 0.0, what="a standard deviation >= 0")
            if name in outputs:
                self._noise[outputs.index(name)] = spread
            else:
                self._spread_of_parameters[names.index(name)] = spread
                one_value(self._rollout, [name], "noise")
        self._dt = float(json.loads(read.core.to_json())["simulation"]["dt"])
        self._domains = self._read_domains(domains)
        self._generator = np.random.default_rng()

    def _make(self) -> _core.Simulation:
        return _core.Simulation(
            self.scene.core, self.parameters, self.controls, self._rows, self._threads if self._rows > 1 else 1
        )

    def __getstate__(self) -> dict[str, Any]:
        """What pickle keeps: the engine's rows are begun anew from their states."""
        if any(self._core.steps_done()):
            raise TypeError(
                "Simulation: expected one before its first step, as what the engine keeps between steps "
                "cannot be copied; pickle its `scene` and `state`, and reset another one to that"
            )
        kept = {key: value for key, value in self.__dict__.items() if key != "_core"}
        return {**kept, "_states": self._core.states()}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        states: Floats = kept.pop("_states")
        self.__dict__.update(kept)
        self._core = self._make()
        self._set = self._set.copy()  # which a shallow copy would share
        begun = np.flatnonzero(np.isfinite(states).all(axis=1))
        self._core.reset(begun.tolist(), self._set[begun], np.ascontiguousarray(states[begun]))

    def _read_domains(self, domains: Mapping[str, ArrayLike]) -> Floats | None:
        columns = {path: floats(values, f"domains {path}") for path, values in domains.items()}
        sizes = {column.shape for column in columns.values()}
        if len(sizes) > 1 or any(len(size) != 1 for size in sizes):
            raise ValueError(f"domains: expected arrays of one shape (D,), got {sorted(sizes)}")
        if not columns:
            return None
        for path, column in columns.items():
            if not (len(column) and np.isfinite(column).all()):
                raise ValueError(f"domains {path}: expected finite numbers, got {column}")
        table = np.tile(self._rollout._defaults[0][0], (*sizes.pop(), 1))
        for path, column in columns.items():
            table[:, self.parameters.index(path)] = column
        return table

    @property
    def outputs(self) -> list[str]:
        """Names of the S numbers of a state, as of a `Rollout`."""
        return self._rollout.outputs

    @property
    def controls(self) -> list[str]:
        """Paths of the C numbers of an action."""
        return self._rollout.controls

    @property
    def parameters(self) -> list[str]:
        """Paths of the P parameters."""
        return self._rollout.parameters

    @property
    def row_parameters(self) -> Floats:
        """The parameters of the last reset of each row, shape (N, P); NaN: the scene's own, where
        those of a path differ."""
        return self._set.copy()

    @property
    def state(self) -> Floats:
        """Shape (S,), or (N, S) of a batch; NaN before the first reset."""
        states = self._core.states()
        return states if self.batch is not None else np.asarray(states[0])

    @property
    def steps(self) -> NDArray[np.int64]:
        """Steps since the reset: one number, or shape (N,) of a batch."""
        steps = np.array(self._core.steps_done(), dtype=np.int64)
        return steps if self.batch is not None else np.asarray(steps[0])

    @property
    def time(self) -> Floats:
        """s since the reset: one number, or shape (N,) of a batch."""
        return np.asarray(self.steps * self.dt)

    @property
    def dt(self) -> float:
        """The length of a step, s."""
        return self._dt

    @property
    def touches(self) -> list[dict[tuple[str, str], float]]:
        """The contacts that carried an impulse in the last step: {(body, body): normal impulse in
        N s}; a dict for each row."""
        names = self.scene.core.body_names
        found: list[dict[tuple[str, str], float]] = []
        for row in self._core.touches():
            impulses: dict[tuple[str, str], float] = {}
            for first, second, impulse in row:
                pair = names[first], names[second]
                impulses[pair] = impulses.get(pair, 0.0) + impulse
            found.append(impulses)
        return found

    def _spread(self, values: Numbers, name: str, names: Sequence[str], base: Floats, rows: int) -> Floats:
        array = _array(values, name, names, base)
        if array.ndim > base.ndim and self.batch is None:
            raise ValueError(f"{name}: expected shape {base.shape}, got {array.shape}")
        if array.ndim > base.ndim and array.shape[0] != rows:
            raise ValueError(f"{name}: expected shape {(rows, *base.shape)}, got {array.shape}")
        return np.ascontiguousarray(np.broadcast_to(array, (rows, *base.shape)))

    def _chosen(self, rows: Iterable[int]) -> list[int]:
        found = list(rows) if isinstance(rows, Iterable) else rows
        if isinstance(found, list) and found and all(isinstance(row, (bool, np.bool_)) for row in found):
            if len(found) != self._rows:
                raise ValueError(f"rows: expected a mask of {self._rows} truth values, got {len(found)}")
            return [int(row) for row in np.flatnonzero(found)]
        return integers(found, "rows")

    def reset(
        self,
        state: Numbers | None = None,
        seed: int | None = None,
        *,
        parameters: Numbers | None = None,
        rows: Iterable[int] | None = None,
    ) -> Floats:
        """Starts anew; returns the state.

        Args:
            state: Shape (S,), or one for each row that is reset, or a dict of what differs from the
                scene's; `noise` is added to it. Absent: the scene's, as its parameters make it.
            seed: Of `noise` and `domains` from now on, a whole number >= 0; absent: they go on.
            parameters: Shape (P,), or one for each row, or a dict; absent: drawn from `domains`, or
                the scene's.
            rows: Which of a batch, by number or by a mask of N truth values; absent: all. The
                others keep their state.

        Raises:
            TangibleError: A value that is not allowed.
            ValueError, TypeError: An argument that cannot be used.
        """
        if seed is not None:
            self._generator = np.random.default_rng(seed_of(seed))
        chosen = list(range(self._rows)) if rows is None else self._chosen(rows)
        if any(not 0 <= row < self._rows for row in chosen):
            raise ValueError(f"rows: expected numbers from 0 to {self._rows - 1}, got {chosen}")
        if len(set(chosen)) < len(chosen):
            raise ValueError(f"rows: expected each row once, got {said(chosen)}")
        count = len(chosen)
        own = self._rollout._defaults[0][0]
        if parameters is not None:
            p = self._spread(parameters, "parameters", self.parameters, own, count)
        elif self._domains is not None:
            p = self._domains[self._generator.integers(len(self._domains), size=count)]
        else:
            p = np.tile(own, (count, 1))
        if self._spread_of_parameters.any():
            shape = (count, len(self.parameters))
            p = p + self._spread_of_parameters * self._generator.standard_normal(shape)
        if self.on_failure == "raise":
            finite(p, "", self.parameters, self.batch is not None, own)
        self._set[chosen] = p
        x: Floats | None = None
        if state is not None:
            base = self._rollout.default_initial_state
            x = self._spread(state, "state", self.outputs, base, count)
            left = self._rollout._left(state)
            if left and count > 0:
                # What a dict leaves is as the parameters make it.
                self._check(self._core.reset(chosen, np.ascontiguousarray(p), None), chosen)
                x = np.array(x)
                x[:, left] = self._core.states()[np.ix_(chosen, left)]
        self._check(self._core.reset(chosen, np.ascontiguousarray(p), x), chosen)
        if self._noise.any():
            # The state is known now, also where parameters make it.
            drawn = self._noise * self._generator.standard_normal((count, len(self._noise)))
            x = np.ascontiguousarray(self._core.states()[chosen] + drawn)
            self._check(self._core.reset(chosen, np.ascontiguousarray(p), x), chosen)
        return self.state

    def step(self, action: Numbers | None = None, *, steps: int = 1) -> Floats:
        """Goes on by a step; returns the state.

        Args:
            action: Shape (C,), N or N m, or one for each row, or a dict {path: value}; absent: the
                scene's own values.
            steps: So many, with the action held.

        Raises:
            TangibleError: A step that failed; a value that is not finite; no reset before.
            ValueError, TypeError: An argument that cannot be used.
        """
        steps = whole(steps, "steps", 1)
        own = self._own
        u = own if action is None else action
        values = self._spread(u, "action", self.controls, own, self._rows)
        if self.on_failure == "raise":
            # Before any row has gone on.
            finite(values, "action ", self.controls, self.batch is not None, own)
        self._check(self._core.step(values, steps), range(self._rows))
        return self.state

    def _check(self, messages: list[str], rows: Iterable[int]) -> None:
        if self.on_failure == "nan":
            return
        for row, message in zip(rows, messages):
            if message:
                raise _core.TangibleError(message if self.batch is None else f"row {row}: {message}")

    def __repr__(self) -> str:
        batch = "" if self.batch is None else f", batch={self.batch}"
        return f"Simulation({self.scene!r}, controls={self.controls}{batch})"
