"""Rollouts as pure functions, with their derivatives."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from numbers import Real
from typing import Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, _executor
from ._certificate import Certificate
from ._plain import choice, flag, integers, masked, named, number, paths, said, seed_of, whole
from ._scene import Scene, SceneLike

Floats = NDArray[np.float64]
# Numbers as an array, or by their names: {name: value}.
Numbers = Union[ArrayLike, Mapping[str, ArrayLike]]
# As the programs' --threads.
MOST_THREADS = 256
_METHODS = ("auto", "adjoint", "tangent", "jet", "jet_implicit", "finite_difference")
_KINKS = ("element", "raise", "smoothed")


@dataclass(frozen=True)
class Jacobian:
    """The derivatives of a rollout's states with respect to its inputs.

    Attributes:
        states: The states themselves, shape (S,), or (R, S) with `records`.
        parameters: d states / d parameters, shape (..., S, P).
        initial_state: d states / d initial state, shape (..., S, S).
        controls: d states / d controls, shape (..., S, steps, C).
        method: The method that was used.
        certificate: How far the derivatives can be trusted: true where fully; see `Certificate`.
    """

    states: Floats
    parameters: Floats
    initial_state: Floats
    controls: Floats
    method: str
    certificate: Certificate = field(repr=False)


@dataclass(frozen=True)
class Smoothing:
    """The Gaussian over which the smoothed surrogate of a derivative averages.

    The surrogate is the mean of the exact Jacobians at `samples` inputs around the given one, drawn
    in pairs of opposite sign (randomised smoothing, arXiv 2109.05143, its first-order estimate). Of
    a motion that is continuous it is the derivative of the motion's mean; jumps do not count in it.

    Attributes:
        deviation: Standard deviation of each number, as a share of max(|value|, 1).
        samples: Even, at least 2; each costs a rollout and its adjoint.
        seed: Of the samples.
        everywhere: Whether all rows are smoothed and not those at kinks and jumps alone: a box that
            sticks has a derivative then where it slides for some of the samples.
    """

    deviation: float = 1e-3
    samples: int = 32
    seed: int = 0
    everywhere: bool = False

    def __post_init__(self) -> None:
        number(self.deviation, "deviation", above=0.0, what="a number > 0")
        if whole(self.samples, "samples", 2, what="an even number >= 2") % 2 != 0:
            raise ValueError(f"samples: expected an even number >= 2, got {self.samples}")
        seed_of(self.seed)
        flag(self.everywhere, "everywhere")

    def draw(self, values: Floats, generator: np.random.Generator) -> Floats:
        """Samples around each row: shape (rows * samples, ...)."""
        rows, *shape = values.shape
        half = generator.standard_normal((rows, self.samples // 2, *shape))
        steps = self.deviation * np.maximum(np.abs(values), 1.0)[:, None]
        around = values[:, None] + steps * np.concatenate([half, -half], axis=1)
        return np.ascontiguousarray(around.reshape(rows * self.samples, *shape))


def check_kinks(kinks: str, smoothing: Smoothing | None) -> None:
    """Refuses what `Rollout.vjp` does not take."""
    choice(kinks, "kinks", *_KINKS)
    if smoothing is not None and not isinstance(smoothing, Smoothing):
        raise TypeError(f"smoothing: expected a Smoothing or None, got {said(smoothing)}")


def floats(values: ArrayLike, name: str) -> Floats:
    """The numbers as an array of the engine's. What is no real number is refused: numpy would turn
    True into 1, None into NaN, drop the imaginary part of complex numbers, and the mask of arrays."""
    if masked(values) is not None:
        raise ValueError(f"{name}: expected numbers, got an array that masks some")
    array = np.asarray(values)
    if array.dtype.kind == "O" and all(isinstance(x, Real) for x in array.flat):
        pass  # fractions, whole numbers of more than 64 bits
    elif array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected real numbers, got an array of {array.dtype}")
    return np.ascontiguousarray(array, dtype=np.float64)


def finite(
    values: Floats | None, name: str, names: Sequence[str], batched: bool, own: Floats | None = None
) -> None:
    """Refuses NaN and infinite numbers, in the words of a row that the engine refuses.

    Args:
        values: Shape (rows, ..., len(names)); None: there are none.
        name: Of the argument, with a blank behind it where it is said.
        names: Of the last axis.
        batched: Whether the caller knows of rows.
        own: The scene's own values; where they are NaN (those of a path differ), NaN leaves them.
    """
    if values is None or np.isfinite(values).all():
        return
    bad = ~np.isfinite(values)
    if own is not None:
        bad &= ~(np.isnan(values) & np.isnan(own))
    if not bad.any():
        return
    at = np.argwhere(bad)[0]
    found = values[tuple(at)]
    got = "NaN" if np.isnan(found) else "Infinity" if found > 0 else "-Infinity"
    row = f"row {at[0]}: " if batched else ""
    step = f" in step {at[1]}" if values.ndim == 3 else ""
    raise _core.TangibleError(f"{row}{name}{names[at[-1]]}: expected a finite number, got {got}{step}")


def _by_name(
    values: Mapping[str, ArrayLike], name: str, names: Sequence[str], base: Floats
) -> Floats:
    """`base`, whose last axis has these names, with other values of some of them."""
    columns: dict[int, Floats] = {}
    for key, value in values.items():
        if key not in names:
            raise ValueError(f"{name}: expected one of {', '.join(names) or 'none'}, got {key!r}")
        columns[list(names).index(key)] = floats(value, f"{name} {key}").reshape(np.shape(value))
    axes = base.ndim - 1
    for k, column in columns.items():
        if column.ndim > axes + 1:
            raise ValueError(
                f"{name} {names[k]}: expected at most {axes + 1} axes, got {column.ndim}"
            )
    # A value with one axis more is a batch.
    sizes = {column.shape[0] for column in columns.values() if column.ndim > axes}
    if len(sizes) > 1:
        raise ValueError(f"{name}: expected leading axes of one length, got {sorted(sizes)}")
    shape = (*sizes, *base.shape)
    array = np.array(np.broadcast_to(base, shape))
    for k, column in columns.items():
        try:
            array[..., k] = column
        except ValueError:
            raise ValueError(
                f"{name} {names[k]}: expected shape {shape[:-1]}, got {column.shape}"
            ) from None
    return array


def _array(
    values: Numbers, name: str, names: Sequence[str], base: Floats
) -> Floats:
    """An array of the shape of `base`, or with one more, leading axis."""
    if isinstance(values, Mapping):
        return _by_name(values, name, names, base)
    columns = named(values)
    if columns is not None:
        return _by_name(columns, name, names, base)
    array = floats(values, name)
    if array.ndim not in (base.ndim, base.ndim + 1):
        raise ValueError(
            f"{name}: expected {base.ndim} axes, or one more for a batch, got {array.ndim}"
        )
    if array.shape[array.ndim - base.ndim :] != base.shape:
        batch = ("N",) if array.ndim > base.ndim else ()
        expected = ", ".join(str(n) for n in (*batch, *base.shape))
        comma = "," if len(batch) + base.ndim == 1 else ""
        raise ValueError(f"{name}: expected shape ({expected}{comma}), got {array.shape}")
    return array


class Rollout:
    """A scene's motion as a pure function of parameters, initial state and controls.

    The state of a rollout is x, y, angle, vx, vy, omega of each moving body, in the order of
    `outputs`: S numbers. Every argument may have one more, leading axis: a batch, which runs on all
    cores; arguments without it are the same in all rows. Nothing is kept between calls.

    Args:
        scene: A `Scene`, a scene file, or a dict of its JSON.
        parameters: P paths of parameters, such as "bodies/ball/mass" or "bodies/*/friction".
        controls: C paths of forces, torques or efforts, or of servos' targets, that have a value of
            their own in each step: "forces/push/force/x", "joints/motor/effort",
            "joints/motor/effort/target".
        records: Steps whose states are returned (0: the start); absent: the state at the end, and
            results have no axis for it.
        threads: Of batches, up to 256; 0: one a core. Results have the same bits for any number.

    The rows of a batch may be done by the processes of an `executor` of `concurrent.futures`, on this
    machine or, as those of `mpi4py.futures` and of a dask client, on others, with the same bits. Each
    worker uses one thread then, or `threads` of them where that is not 0.
    """

    def __init__(
        self,
        scene: SceneLike,
        parameters: Sequence[str] = (),
        controls: Sequence[str] = (),
        *,
        records: Iterable[int] | None = None,
        threads: int = 0,
    ) -> None:
        read = Scene.of(scene)
        core = read.core
        self.scene = read._copy()  # of which later changes of the scene are no part
        self.threads = whole(threads, "threads", 0, MOST_THREADS)
        self._single = records is None
        steps = [] if records is None else integers(records, "records")
        if records is not None and not steps:
            raise ValueError("records: expected at least one step, got none; absent: the end")
        self._core = _core.Rollout(
            core, paths(parameters, "parameters"), paths(controls, "controls"), steps
        )
        self._defaults = self._core.defaults()
        self._start: _core.Rollout | None = None

    @property
    def parameters(self) -> list[str]:
        """Paths of the parameters."""
        return self._core.parameters

    @property
    def controls(self) -> list[str]:
        """Paths of the controls."""
        return self._core.controls

    @property
    def outputs(self) -> list[str]:
        """Names of the numbers of a state: "ball/x", "ball/y", "ball/angle", "ball/vx", ..."""
        return self._core.outputs

    @property
    def num_steps(self) -> int:
        """Steps of the run: the length of a control."""
        return self._core.num_steps

    @property
    def times(self) -> Floats:
        """Times of the recorded states, s."""
        return np.array(self._core.times)

    @property
    def default_parameters(self) -> Floats:
        """The scene's own values, shape (P,); of a path whose numbers differ the first one's. Given
        as an argument, a value sets all of them."""
        return self._first(self._defaults[0][0], self.parameters)

    @property
    def default_initial_state(self) -> Floats:
        """The scene's own, shape (S,)."""
        return np.array(self._defaults[1][0])

    @property
    def default_controls(self) -> Floats:
        """The scene's own values in each step, shape (steps, C); of a path as `default_parameters`."""
        return self._first(self._defaults[2][0], self.controls)

    def _first(self, own: Floats, names: Sequence[str]) -> Floats:
        """Where `own` is NaN, as the numbers of a path differ, the first of them."""
        values = np.array(own)
        for k, name in enumerate(names):
            if np.isnan(values[..., k]).any():
                values[..., k] = self.scene[name]
        return values

    def _inputs(
        self,
        parameters: Numbers | None,
        initial_state: Numbers | None,
        controls: Numbers | None,
    ) -> tuple[Floats, Floats | None, Floats, bool]:
        """Arrays with a leading axis, and whether there was one."""
        own_p, own_x, own_u = (values[0] for values in self._defaults)
        p, x, u = own_p, None, own_u
        if parameters is not None:
            p = _array(parameters, "parameters", self.parameters, own_p)
        if initial_state is not None:
            x = _array(initial_state, "initial_state", self.outputs, own_x)
        if controls is not None:
            u = _array(controls, "controls", self.controls, own_u)
        left = self._left(initial_state)
        batched = p.ndim == 2 or u.ndim == 3 or (x is not None and x.ndim == 2)
        sizes = {a.shape[0] for a, axes in ((p, 1), (x, 1), (u, 2)) if a is not None and a.ndim > axes}
        if len(sizes) > 1:
            raise ValueError(f"batch: expected leading axes of one length, got {sorted(sizes)}")
        rows = sizes.pop() if sizes else 1

        def spread(array: Floats, axes: int) -> Floats:
            if array.ndim > axes:
                return array
            if rows == 1:  # without the 6 us that broadcast_to takes
                return np.ascontiguousarray(array[None])
            return np.ascontiguousarray(np.broadcast_to(array, (rows, *array.shape)))

        p, x, u = spread(p, 1), None if x is None else spread(x, 1), spread(u, 2)
        if x is not None and left and parameters is not None:
            begun, statuses, _ = self._begin().run(p, None, u, self.threads)
            x = np.array(x)
            for row, status in enumerate(statuses):
                if status == "done":  # what is refused is refused again, in the words of its run
                    x[row, left] = begun[row, 0, left]
        return p, x, u, batched

    def _left(self, initial_state: Numbers | None) -> list[int]:
        """Which numbers of the state a dict leaves as the parameters make them."""
        names = initial_state if isinstance(initial_state, Mapping) else named(initial_state)
        if names is None or not self.parameters:
            return []
        return [k for k, name in enumerate(self.outputs) if name not in names]

    def _begin(self) -> _core.Rollout:
        """The states at the start as a function of the same inputs."""
        if self._start is None:
            self._start = _core.Rollout(self.scene.core, self.parameters, self.controls, [0])
        return self._start

    def _from_start(
        self, initial_state: Numbers | None, p: Floats, u: Floats
    ) -> Callable[[Floats, Floats], None]:
        """What adds to the derivatives by parameters (rows, P) those by the numbers of the initial
        state (rows, S) that a dict leaves as the parameters make them."""
        left = self._left(initial_state)
        if not left:
            return lambda by_parameters, by_state: None
        start = _core.Recorded(self._begin(), p, None, u, self.threads)

        def add(by_parameters: Floats, by_state: Floats) -> None:
            bars = np.zeros((len(by_state), 1, by_state.shape[1]))
            bars[:, 0, left] = by_state[:, left]
            by_parameters += start.adjoint(bars)[0]

        return add

    def _finite(self, p: Floats, x: Floats | None, u: Floats, batched: bool, on_failure: str) -> None:
        """Refuses what the engine's messages would name in their own words, unless rows may fail."""
        choice(on_failure, "on_failure", "raise", "nan")
        if on_failure != "raise":
            return
        # Names are made where they are said: the engine makes a list of them at each look.
        if not all(values is None or np.isfinite(values).all() for values in (p, x, u)):
            finite(p, "", self.parameters, batched, self._defaults[0][0])
            finite(x, "initial_state ", self.outputs, batched)
            finite(u, "controls ", self.controls, batched, self._defaults[2][0])

    def _shape(self, states: Floats, batched: bool) -> Floats:
        shaped: Floats = states[:, 0] if self._single else states
        return shaped if batched else np.asarray(shaped[0])

    @staticmethod
    def _check(statuses: list[str], messages: list[str], batched: bool, on_failure: str) -> None:
        for row, (status, message) in enumerate(zip(statuses, messages)):
            if status != "done" and on_failure == "raise":
                raise _core.TangibleError(f"row {row}: {message}" if batched else message)

    def __call__(
        self,
        parameters: Numbers | None = None,
        initial_state: Numbers | None = None,
        controls: Numbers | None = None,
        *,
        on_failure: str = "raise",
        executor: Executor | None = None,
    ) -> Floats:
        """The states, shape (S,); (R, S) with `records`; (N, ...) of a batch.

        Args:
            parameters: Shape (P,), SI units; absent: the scene's. This and the others may be dicts,
                {path or name of an output: value}, of which what is left out is the scene's.
            initial_state: Shape (S,); absent: the scene's, as its parameters make it.
            controls: Shape (steps, C), N or N m; absent: the scene's values in all steps.
            on_failure: "raise", or "nan" in states that were not reached.
            executor: Whose workers do the rows of a batch; absent: threads of this process.

        Raises:
            TangibleError: A value that is not allowed, or a run that ended early.
        """
        _executor.check(executor)
        p, x, u, batched = self._inputs(parameters, initial_state, controls)
        self._finite(p, x, u, batched, on_failure)
        states, statuses, messages = _executor.of_rows(
            executor, "run", self._core, (p, x, u), self.threads
        )
        self._check(statuses, messages, batched, on_failure)
        return self._shape(states, batched)

    def jvp(
        self,
        primals: tuple[Numbers | None, Numbers | None, Numbers | None],
        tangents: tuple[Numbers | None, Numbers | None, Numbers | None],
        *,
        on_failure: str = "raise",
        executor: Executor | None = None,
    ) -> tuple[Floats, Floats]:
        """States and their derivative along a direction of (parameters, initial state, controls).

        None stands for the scene's value among `primals`, and for 0 among `tangents`; `on_failure`
        and `executor` are those of a call.
        """
        _executor.check(executor)
        for name, given in (("primals", primals), ("tangents", tangents)):
            if not isinstance(given, (tuple, list)) or len(given) != 3:
                raise TypeError(f"{name}: expected (parameters, initial state, controls), got {said(given)}")
        p, x, u, batched = self._inputs(*primals)
        self._finite(p, x, u, batched, on_failure)
        rows = p.shape[0]

        def direction(k: int, name: str, names: Sequence[str]) -> Floats:
            value, zeros = tangents[k], np.zeros(self._defaults[k].shape[1:])
            array = zeros if value is None else _array(value, f"tangent of {name}", names, zeros)
            return np.ascontiguousarray(np.broadcast_to(array, (rows, *zeros.shape)))

        along_p = direction(0, "parameters", self.parameters)
        along_x = direction(1, "initial_state", self.outputs)
        along_u = direction(2, "controls", self.controls)
        left = self._left(primals[1])
        if left:
            start = self._begin().tangent(
                p, None, u, along_p, np.zeros_like(along_x), np.zeros_like(along_u), self.threads
            )
            along_x = np.array(along_x)
            along_x[:, left] += start[3][:, 0, left]
        arrays = (p, x, u, along_p, along_x, along_u)
        states, statuses, messages, along = _executor.of_rows(
            executor, "tangent", self._core, arrays, self.threads
        )
        self._check(statuses, messages, batched, on_failure)
        return self._shape(states, batched), self._shape(along, batched)

    def vjp(
        self,
        parameters: Numbers | None = None,
        initial_state: Numbers | None = None,
        controls: Numbers | None = None,
        *,
        on_failure: str = "raise",
        kinks: str = "element",
        smoothing: Smoothing | None = None,
    ) -> tuple[Floats, Callable[[ArrayLike], tuple[Floats, Floats, Floats]]]:
        """States, and the function that takes derivatives of a loss back from them.

        The function maps d loss / d states (their shape) to the derivatives with respect to
        parameters, initial state and controls. It holds the tapes of this call alone and may be
        called often, also from several threads, whose calls take turns. Rows that failed have NaN
        derivatives.

        Args:
            parameters, initial_state, controls, on_failure: As in a call.
            kinks: What stands for derivatives at a kink or jump, of the motion or of the discrete
                map (`Certificate.verdict_of_map`): "element" is one element of the generalised
                Jacobian (`certificates` says where); "raise" an error; "smoothed" the mean of the
                Jacobians around (`Smoothing`), in those rows alone, or in all with
                `Smoothing(everywhere=True)`. The states are those of the rollout in each case.
            smoothing: Of "smoothed"; absent: its defaults.

        Raises:
            TangibleError: As a call; or with "raise" the verdict of the first row that is not
                trustworthy as one of the map; or no sample of "smoothed" could be run.
        """
        check_kinks(kinks, smoothing)
        p, x, u, batched = self._inputs(parameters, initial_state, controls)
        self._finite(p, x, u, batched, on_failure)
        smoothing = smoothing or Smoothing()
        if kinks == "smoothed" and smoothing.everywhere:
            add = self._from_start(initial_state, p, u)
            return self._vjp_of_mean(p, x, u, batched, on_failure, smoothing, add)
        recorded = _core.Recorded(self._core, p, x, u, self.threads)
        states, statuses, messages = recorded.outputs
        self._check(statuses, messages, batched, on_failure)
        result = self._shape(states, batched)
        smoothed = [] if kinks == "element" else self._rows_at_kinks(p, x, u, statuses)
        if kinks == "raise" and smoothed:
            row, verdict = smoothed[0]
            raise _core.TangibleError(f"{f'row {row}: ' if batched else ''}derivative: {verdict}")
        rows = [row for row, _ in smoothed]
        average = self._average(p, x, u, rows, smoothing) if rows else None
        add = self._from_start(initial_state, p, u)

        def pull(cotangent: ArrayLike) -> tuple[Floats, Floats, Floats]:
            bars = floats(cotangent, "cotangent")
            if bars.shape != result.shape:
                raise ValueError(f"cotangent: expected shape {result.shape}, got {bars.shape}")
            rows_of_bars = bars.reshape(states.shape)
            by_parameters, by_state, by_controls = recorded.adjoint(rows_of_bars)
            if average is not None:
                found = average(rows_of_bars[rows])
                for into, mean in zip((by_parameters, by_state, by_controls), found):
                    into[rows] = mean
            add(by_parameters, by_state)
            if batched:
                return by_parameters, by_state, by_controls
            return by_parameters[0], by_state[0], by_controls[0]

        return result, pull

    def _vjp_of_mean(
        self, p: Floats, x: Floats | None, u: Floats, batched: bool, on_failure: str,
        smoothing: Smoothing, add: Callable[[Floats, Floats], None],
    ) -> tuple[Floats, Callable[[ArrayLike], tuple[Floats, Floats, Floats]]]:
        """`vjp` with all rows smoothed: their own derivatives are not needed."""
        states, statuses, messages = self._core.run(p, x, u, self.threads)
        self._check(statuses, messages, batched, on_failure)
        result = self._shape(states, batched)
        done = [row for row, status in enumerate(statuses) if status == "done"]
        average = self._average(p, x, u, done, smoothing) if done else None
        shapes = (p.shape, (len(p), self._core.num_states), u.shape)

        def pull(cotangent: ArrayLike) -> tuple[Floats, Floats, Floats]:
            bars = floats(cotangent, "cotangent")
            if bars.shape != result.shape:
                raise ValueError(f"cotangent: expected shape {result.shape}, got {bars.shape}")
            found = [np.full(shape, np.nan) for shape in shapes]
            if average is not None:
                for into, mean in zip(found, average(bars.reshape(states.shape)[done])):
                    into[done] = mean
            add(found[0], found[1])
            by_parameters, by_state, by_controls = (
                found if batched else [values[0] for values in found]
            )
            return by_parameters, by_state, by_controls

        return result, pull

    def _rows_at_kinks(
        self, p: Floats, x: Floats | None, u: Floats, statuses: list[str]
    ) -> list[tuple[int, str]]:
        """Rows that ended well and whose derivatives are at a kink or jump, with their verdicts.

        That they are those of the discrete map alone is none: no other derivative is nearby.
        """
        texts = self._core.certify(p, x, u, self.threads)
        certificates = [Certificate.of_json(text) for text in texts]
        return [
            (row, certificate.verdict)
            for row, (status, certificate) in enumerate(zip(statuses, certificates))
            if status == "done" and certificate.verdict_of_map != "trustworthy"
        ]

    def _average(
        self, p: Floats, x: Floats | None, u: Floats, rows: list[int], smoothing: Smoothing
    ) -> Callable[[Floats], list[Floats]]:
        """The mean pull of samples around `rows`; samples that cannot be run do not count."""
        generator = np.random.default_rng(smoothing.seed)
        samples = _core.Recorded(
            self._core,
            smoothing.draw(p[rows], generator),
            None if x is None else smoothing.draw(x[rows], generator),
            smoothing.draw(u[rows], generator),
            self.threads,
        )
        _, statuses, messages = samples.outputs
        done = np.array([status == "done" for status in statuses])
        done = done.reshape(len(rows), smoothing.samples)
        for index, row in enumerate(rows):
            if not done[index].any():
                message = messages[index * smoothing.samples]
                raise _core.TangibleError(f"row {row}: no sample around it could be run: {message}")

        def pull(bars: Floats) -> list[Floats]:
            found = samples.adjoint(np.repeat(bars, smoothing.samples, axis=0))
            return [
                np.stack([
                    part[done[index]].mean(axis=0)
                    for index, part in enumerate(values.reshape(*done.shape, *values.shape[1:]))
                ])
                for values in found
            ]

        return pull

    def jacobian(
        self,
        parameters: Numbers | None = None,
        initial_state: Numbers | None = None,
        controls: Numbers | None = None,
        *,
        method: str = "auto",
    ) -> Jacobian:
        """All derivatives, with their certificate.

        Args:
            parameters, initial_state, controls: As in a call, without a batch's axis.
            method: "auto", "adjoint", "tangent", "jet", "jet_implicit" or "finite_difference".
        """
        p, x, u, batched = self._inputs(parameters, initial_state, controls)
        if batched:
            raise ValueError("jacobian: expected arguments without a batch's axis")
        choice(method, "method", *_METHODS)
        self._finite(p, x, u, False, "raise")
        states, status, message, used, all_columns = self._core.jacobian(p, x, u, method)
        self._check([status], [message], False, "raise")
        matrix = all_columns[0] if self._single else all_columns
        num_p, num_s = p.shape[1], self._core.num_states
        left = self._left(initial_state)
        if left:
            _, status, message, _, start = self._begin().jacobian(p, None, u, method)
            self._check([status], [message], False, "raise")
            by_left = matrix[..., [num_p + k for k in left]]
            matrix[..., :num_p] += by_left @ start[0][left, :num_p]
        by_controls = matrix[..., num_p + num_s :]
        return Jacobian(
            states[0] if self._single else states,
            matrix[..., :num_p],
            matrix[..., num_p : num_p + num_s],
            by_controls.reshape(*matrix.shape[:-1], *u.shape[1:]),
            used,
            self.certificate(p[0], None if x is None else x[0], u[0]),
        )

    def certificate(
        self,
        parameters: Numbers | None = None,
        initial_state: Numbers | None = None,
        controls: Numbers | None = None,
        *,
        radius: bool = False,
    ) -> Certificate:
        """How far the derivatives at these inputs can be trusted.

        `verdict` is "trustworthy", or names a kink, a jump or a side; of a run by fixed steps in
        which a contact was made or broken or a slip turned back it begins with "of the discrete
        map: ". The initial state counts as an input only where it is given. Of a batch, see
        `certificates`.

        With `radius` it has how far each parameter may be changed, to first order, until another
        discrete choice is made (two more runs a parameter), and the growth of the flow.
        """
        p, x, u, batched = self._inputs(parameters, initial_state, controls)
        if batched:
            raise ValueError("certificate: expected arguments without a batch's axis")
        flag(radius, "radius")
        self._finite(p, x, u, False, "raise")
        certificate = Certificate.of_json(self._core.certify(p, x, u, self.threads)[0])
        if radius:
            more = json.loads(self._core.radii(p, x, u))
            certificate.update({key: more[key] for key in ("radius", "growth") if key in more})
        return certificate

    def certificates(
        self,
        parameters: Numbers | None = None,
        initial_state: Numbers | None = None,
        controls: Numbers | None = None,
        *,
        executor: Executor | None = None,
    ) -> list[Certificate]:
        """The certificate of each row of a batch; `executor` as of a call."""
        _executor.check(executor)
        p, x, u, _ = self._inputs(parameters, initial_state, controls)
        texts = _executor.of_rows(executor, "certify", self._core, (p, x, u), self.threads)
        return [Certificate.of_json(text) for text in texts]

    def __repr__(self) -> str:
        return (
            f"Rollout({self.scene!r}, parameters={self.parameters}, controls={self.controls}, "
            f"steps={self.num_steps})"
        )


def one_value(function: Rollout, names: Sequence[str], what: str) -> None:
    """Refuses parameters whose path matches numbers that differ: one value would make them equal."""
    own = function._defaults[0][0]
    for name in names:
        if np.isnan(own[function.parameters.index(name)]):
            raise ValueError(
                f"{what}: {name}: expected numbers that are equal, as one value sets all of them; "
                "name them one by one"
            )


def check_rollout(function: object) -> None:
    """Refuses what is no rollout."""
    if not isinstance(function, Rollout):
        raise TypeError(f"function: expected a tangible.Rollout, got {type(function).__name__}")
