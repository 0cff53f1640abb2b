"""Fits: parameters identified from observed positions."""

from __future__ import annotations

import csv
import html
import io
import json
import math
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Any, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, _executor
from ._certificate import Certificate
from ._plain import choice, file_name, flag, function, number, plain, seed_of, text, whole, write_whole
from ._plain import paths as names
from ._problem import Problem, make, of_data, text_of
from ._rollout import finite, floats
from ._scene import Scene
from ._warning import warn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
FitLike = Union[Mapping[str, Any], str, "os.PathLike[str]"]
# A table: a dict of arrays, or a DataFrame of pandas, which is never imported here.
Table = Any
Parameters = Union[Sequence[Any], Mapping[str, Any]]


def _problem(
    problem: FitLike | Scene,
    data: Table | None,
    parameters: Parameters | None,
    sigma: float | Mapping[str, float] | None,
    points: Mapping[str, Any] | None,
    recordings: Sequence[Any] | Mapping[str, Any] | None,
    folder: str | os.PathLike[str],
    initial: Mapping[str, float] | None,
    keys: Mapping[str, Any],
) -> Problem:
    if data is not None or recordings is not None:
        whole_problem, labels = of_data(problem, data, parameters, sigma, points, recordings, keys)
        return make(whole_problem, folder, initial, labels)
    if isinstance(problem, Scene):
        raise TypeError("data: expected a dict of arrays or a DataFrame with a scene, got None")
    given = {"parameters": parameters, "sigma": sigma, "points": points, **keys}
    for name, value in given.items():
        if value is not None:
            raise TypeError(f"{name}: expected in the fit file, or beside data")
    return make(problem, folder, initial)


class Residuals:
    """The residuals of a fit and their Jacobian, for least-squares methods of others.

        scipy.optimize.least_squares(r, r.initial, jac=r.jacobian, bounds=r.bounds)

    Residuals are in multiples of their standard deviation. Calls from several threads take turns.
    Pickled, they keep what was in memory; files are read again.

    Args:
        problem, data, parameters, sigma, points, recordings, folder, keys: As of `fit`.
        initial: Initial values that replace the file's: {name: value}.

    Attributes:
        names: Of the P parameters.
        initial: Initial values, shape (P,).
        bounds: Two arrays of shape (P,), the lowest and highest values.
    """

    def __init__(
        self,
        problem: FitLike | Scene,
        data: Table | None = None,
        parameters: Parameters | None = None,
        *,
        sigma: float | Mapping[str, float] | None = None,
        points: Mapping[str, Any] | None = None,
        recordings: Sequence[Any] | Mapping[str, Any] | None = None,
        folder: str | os.PathLike[str] = ".",
        initial: Mapping[str, float] | None = None,
        **keys: Any,
    ) -> None:
        self._open(
            _problem(problem, data, parameters, sigma, points, recordings, folder, initial, keys)
        )

    def _open(self, problem: Problem) -> None:
        self._problem = problem
        with problem.read() as core:
            self._core = core
        ranges = self._core.ranges()
        self.names = self._core.names
        self.initial: Floats = np.array(ranges[:, 0])
        self.bounds: tuple[Floats, Floats] = (np.array(ranges[:, 1]), np.array(ranges[:, 2]))

    def __getstate__(self) -> Problem:
        return self._problem

    def __setstate__(self, problem: Problem) -> None:
        self._open(problem)

    def _numbers(self, parameters: ArrayLike) -> Floats:
        array = floats(parameters, "parameters")
        if array.shape == (len(self.names),):
            finite(array[None], "", self.names, False)
        return array

    def __call__(self, parameters: ArrayLike) -> Floats:
        """The residuals, shape (R,)."""
        return self._core.evaluate(self._numbers(parameters), False)[0]

    def jacobian(self, parameters: ArrayLike) -> Floats:
        """Their derivatives with respect to the parameters, shape (R, P)."""
        found = self._core.evaluate(self._numbers(parameters), True)[1]
        assert found is not None
        return found


def _arrays(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Lists of numbers as arrays, with nan for null."""
    return {
        key: np.array([np.nan if x is None else x for x in value]) if isinstance(value, list) else value
        for key, value in columns.items()
    }


# Rounding of linear functions of parameters, as a share of their largest term.
_ROUNDING = 1e-12
# So many draws for each one that is asked for, at most.
_DRAWS = 1000
_OF_SCENES = ("bodies/", "joints/", "springs/", "forces/", "pairs/", "gravity/")


class _Domains:
    """Values of a scene's numbers as functions of a fit's parameters p: scale p + offset of the
    parameter that sets a number. Where others add to numbers, each is its value at the estimate p_0
    and scale (p - p_0) of all that set it or add to it."""

    def __init__(
        self, scene: Scene, names: Sequence[str], estimates: Mapping[str, float],
        parameters: Sequence[Any], ranges: Mapping[str, tuple[float, float]],
    ) -> None:
        self.scene = scene
        self.estimates = np.array([estimates[name] for name in names])
        limits = [ranges.get(name, (-math.inf, math.inf)) for name in names]
        self.low, self.high = (np.array([limit[side] for limit in limits]) for side in (0, 1))
        sets: list[tuple[int, dict[str, Any]]] = []
        for entry in parameters:
            given = {"path": entry} if isinstance(entry, str) else entry
            name = given.get("name", given.get("path"))
            if name in names:
                listed = given.get("sets", [{"path": given.get("path")}])
                sets += [(names.index(name), one) for one in listed]
        lengths = [one["path"] for _, one in sets if one["path"].startswith("links/")]
        if lengths:
            raise ValueError(
                f"domains: expected parameters that are numbers of the scene, got {', '.join(lengths)}, which "
                "moves several; write what it moves as `sets` with \"add\": true in its place"
            )
        sets = [(k, one) for k, one in sets if one["path"].startswith(_OF_SCENES)]
        self.adds = any(one.get("add") for _, one in sets)
        # (parameter, scale, offset) of each path, or of each number where some add.
        self.terms: dict[str, list[tuple[int, float, float]]] = {}
        for k, one in sets:
            for path in self._numbers(one["path"]):
                term = k, float(one.get("scale", 1.0)), float(one.get("offset", 0.0))
                self.terms.setdefault(path, []).append(term)

    def _numbers(self, path: str) -> list[str]:
        if not self.adds:
            return [path]
        form = re.compile(re.escape(path).replace(r"\*", "[^/]*"))
        return [known for known in self.scene.parameters() if form.fullmatch(known)]

    def values(self, drawn: Floats) -> tuple[dict[str, Floats], NDArray[np.bool_]]:
        """The numbers, within their ranges, and of which rows all were, to rounding."""
        found: dict[str, Floats] = {}
        inside = ((drawn >= self.low) & (drawn <= self.high)).all(axis=1)
        for path, terms in self.terms.items():
            begin = self.scene[path] if self.adds else 0.0
            column = np.full(len(drawn), begin)
            size = abs(begin)
            for k, scale, offset in terms:
                column += scale * (drawn[:, k] - self.estimates[k]) if self.adds else scale * drawn[:, k] + offset
                size = max(size, abs(scale * self.estimates[k]), abs(offset))
            found[path] = np.clip(column, *self.scene.range(path))
            inside &= np.abs(found[path] - column) <= _ROUNDING * size
        return found, inside

    def gaussian(self, covariance: Floats, count: int, random: np.random.Generator) -> Floats:
        """Draws of the parameters, shape (count, P), within all ranges."""
        known = np.isfinite(np.diag(covariance))
        if not known.any():
            return np.tile(self.estimates, (count, 1))
        kept: list[Floats] = []
        for _ in range(_DRAWS):
            drawn = np.tile(self.estimates, (count, 1))
            drawn[:, known] = random.multivariate_normal(
                self.estimates[known], covariance[np.ix_(known, known)], size=count, method="eigh"
            )
            kept.append(drawn[self.values(drawn)[1]])
            if sum(map(len, kept)) >= count:
                return np.concatenate(kept)[:count]
        raise ValueError(
            f"domains: expected a Gaussian of estimates and covariance within the ranges, got {sum(map(len, kept))} "
            f"of {count * _DRAWS} draws inside; draws of the posterior, fit(posterior=N), keep to them"
        )


class FitResult:
    """What a fit has found.

    Attributes:
        status: "converged", "not_converged", "failed" or "no_effect".
        message: Why.
        estimates: {name: estimate}.
        certificate: Of the derivatives at the estimate; None where there is no estimate.
        scenes: {name of the recording: fitted scene}; "" names the only one. Empty where there is no
            estimate, as `predictions` is.
        predictions: A column each of the table of all observations beside their predictions: `time`
            (s), `target`, `coordinate`, `used` ("fit", "prediction", or of recordings with the
            role `predict` "state" and "unused"), `sigma`, `observed`, `predicted`, `residual`
            (predicted - observed), `residual_in_sigma`, and more.
            `pandas.DataFrame(result.predictions)` is a table.
        draws: Draws from the posterior, if `posterior` asked for them: arrays of `draw`, `chain`,
            `cost` and of each parameter by its name; else empty.
        data: The whole result as `tangible-fit --out` writes it.
    """

    def __init__(
        self,
        data: dict[str, Any],
        page: str,
        predictions: str = "",
        scenes: Iterable[_core.Scene] = (),
        parameters: Sequence[Any] = (),
        draws: str = "",
        ranges: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.data = data
        self._page = page
        self._parameters = list(parameters)
        self._ranges = dict(ranges or {})
        self.status: str = data["status"]
        self.message: str = data["message"]
        found = data.get("certificate")
        self.certificate: Certificate | None = None if found is None else Certificate(found)
        self.estimates: dict[str, float] = {
            p["name"]: p["estimate"] for p in data["parameters"] if p["estimate"] is not None
        }
        self.predictions = _read_predictions(predictions)
        self.draws = _read_draws(draws)
        names = list(dict.fromkeys(self.predictions.get("recording", np.array([""])).tolist()))
        self.scenes = {name: Scene._of_core(core) for name, core in zip(names, scenes)}

    @property
    def scene(self) -> Scene:
        """The fitted scene; of several recordings that of the first."""
        if not self.scenes:
            raise ValueError(f"scene: expected a fit with an estimate, got one that is {self.status}")
        return next(iter(self.scenes.values()))

    @property
    def residuals(self) -> Floats:
        """Of the observations that were fitted, predicted - observed in multiples of sigma."""
        used = self.predictions.get("used", np.array([])) == "fit"
        return np.asarray(self.predictions["residual_in_sigma"][used]) if used.any() else np.zeros(0)

    @property
    def standard_deviations(self) -> dict[str, float]:
        """{name: standard deviation}, from the stated sigma; NaN where it is not determined."""
        found = {p["name"]: p.get("standard_deviation") for p in self.data["parameters"]}
        return {name: math.nan if value is None else float(value) for name, value in found.items()}

    def domains(self, count: int, seed: int = 0) -> dict[str, Floats]:
        """Scenes that the observations leave possible, for `Simulation(domains=...)`.

        From the draws of the posterior, if `posterior` asked for them, each at most once more often
        than another; else from the Gaussian of estimates and covariance, drawn anew where a parameter
        leaves its range or a number of the scene its own (`Scene.range`): {path of the scene: shape
        (count,), SI units}. A parameter without a standard deviation, such as one at its bound, has its
        estimate in each row. Parameters of single recordings are left out, which have their estimates
        of the first, and those of instruments and points, which no scene has.

        Args:
            count: Number of scenes, at least 1.
            seed: Of the draws, a whole number >= 0.

        Raises:
            ValueError: A fit without an estimate; one of a length of `links`; a Gaussian of which
                less than a thousandth is within the ranges; a number that is not allowed.
            TypeError: What is no whole number.
        """
        count, random = whole(count, "count", 1), np.random.default_rng(seed_of(seed))
        if not self.scenes:
            raise ValueError(f"domains: expected a fit with an estimate, got one that is {self.status}")
        drawer = _Domains(self.scene, self.names, self.estimates, self._parameters, self._ranges)
        if self.draws:
            table = np.column_stack([self.draws[name] for name in self.names])
            rows = [random.permutation(len(table)) for _ in range(-(-count // len(table)))]
            return drawer.values(table[np.concatenate(rows)[:count]])[0]
        return drawer.values(drawer.gaussian(self.covariance, count, random))[0]

    def __getitem__(self, name: str) -> float:
        """The estimate of a parameter."""
        if text(name, "name", "the name of a parameter") not in self.estimates:
            raise KeyError(f"{name}: expected one of {', '.join(self.estimates) or 'none'}")
        return self.estimates[name]

    @property
    def names(self) -> list[str]:
        """Of the parameters."""
        return [p["name"] for p in self.data["parameters"]]

    def interval(self, name: str, *, robust: bool = True) -> tuple[float, float] | None:
        """The 95 % interval; None where there is none (a bound, no information).

        The robust one comes from the residuals as they are; the other one trusts the stated sigma.
        """
        robust = flag(robust, "robust")
        for parameter in self.data["parameters"]:
            if parameter["name"] == text(name, "name", "the name of a parameter"):
                found = parameter["confidence_95_robust" if robust else "confidence_95"]
                return None if found is None else (float(found[0]), float(found[1]))
        raise KeyError(f"{name}: expected one of {', '.join(self.names)}")

    @property
    def intervals(self) -> dict[str, tuple[float | None, float | None] | None]:
        """{name: 95 % interval}, of each parameter the one that the programs print first; an end that
        is None is not determined, an interval that is None neither."""
        found: dict[str, tuple[float | None, float | None] | None] = {}
        for parameter in self.data["parameters"]:
            ends = parameter.get("interval_95")
            found[parameter["name"]] = None if ends is None else (ends[0], ends[1])
        return found

    @property
    def warnings(self) -> list[str]:
        """What `tangible-fit` warns of, such as intervals that mean little."""
        lines = [str(line) for line in self.data.get("warnings") or []]
        found = self.certificate
        # Where the fit has certified its own estimate, the verdict stands among its lines.
        if found is not None and found.verdict_of_map != "trustworthy" and not any(
            found.verdict in line for line in lines
        ):
            lines.append(f"not trustworthy at the estimate: {found}")
        return lines

    @property
    def design(self) -> dict[str, Any]:
        """What the candidates for the next experiment are worth: `widths` now, of each of
        `candidates` its `widths`, `gain`, `takes`, ..., and which is `d_optimal`, `a_optimal`,
        `narrowest` of each parameter; empty unless candidates were given."""
        return dict(self.data.get("design") or {})

    @property
    def posterior(self) -> dict[str, Any]:
        """What the draws of `posterior` say: of each of `parameters` its `mean`,
        `standard_deviation`, `median`, `interval_95`, `r_hat`, `ess_bulk` and `ess_tail`, and
        `transitions`, `divergences`, `saturated`, `acceptance`, ...; empty without them."""
        return dict(self.data.get("posterior") or {})

    @property
    def missing(self) -> list[dict[str, Any]]:
        """What would explain the residuals, the best first: of each `candidate` its `kind`, the
        `cost_share` to first order, whether it was `refitted`, with the `refitted_cost_share`, the
        `held_out_gain` and whether these make it `confirmed`, which candidates are `equivalent`,
        and its `parameters`; empty unless `missing` was asked for."""
        return list(self.data.get("missing") or [])

    @property
    def process_noise(self) -> list[dict[str, Any]]:
        """Of each random force that `process_noise` asks for its `intensity` (in `unit`),
        `interval_95` where it is `estimated`, and `forces`: of each recording arrays of `time`,
        `force`, `standard_deviation`, `coordinate` and `rate`."""
        return [
            {**one, "forces": [_arrays(course) for course in one["forces"]]}
            for one in self.data.get("process_noise") or []
        ]

    @property
    def smoothed_states(self) -> list[dict[str, Any]]:
        """With `process_noise`, of each recording `time`, `states` and `standard_deviations`, which
        are arrays by name ("ball/x")."""
        return [
            {**_arrays(one), **{key: _arrays(one[key]) for key in ("states", "standard_deviations")}}
            for one in self.data.get("smoothed_states") or []
        ]

    @property
    def covariance(self) -> Floats:
        """Shape (P, P), from the stated sigma; NaN where it is not determined."""
        rows = self.data["covariance"]
        return np.array([[np.nan if x is None else x for x in row] for row in rows], dtype=np.float64)

    @property
    def correlations(self) -> Floats:
        """Shape (P, P)."""
        covariance = self.covariance
        deviations = np.sqrt(np.diag(covariance))
        return np.asarray(covariance / np.outer(deviations, deviations))

    def report(self, file: str | os.PathLike[str] | None = None) -> str:
        """The report as a page; written to a file if one is named."""
        if file is not None:
            write_whole(file, self._page)
        return self._page

    def _repr_html_(self) -> str:
        """What a notebook shows: the report in a frame of its own."""
        if not self._page:
            return f"<pre>{html.escape(repr(self))}</pre>"
        return (
            f'<iframe srcdoc="{html.escape(self._page)}" width="100%" height="640" '
            'style="border:0"></iframe>'
        )

    def plot(self, what: str = "data", *, ax: Axes | None = None) -> Axes:
        """Plots with matplotlib; returns the axes.

        Args:
            what: "data": observations and their predictions over time; "residuals": in multiples of
                sigma over time; "cost": by iteration.
        """
        import matplotlib.pyplot as plt

        choice(what, "what", "data", "residuals", "cost")
        axes: Axes = ax if ax is not None else plt.subplots()[1]
        if what == "cost":
            axes.semilogy([iteration["cost"] for iteration in self.data["iterations"]], marker="o")
            axes.set_xlabel("iteration")
            axes.set_ylabel("cost")
            return axes
        table, units = self.predictions, []
        for k, (label, coordinate, rows) in enumerate(self._series()):
            time, color = table["time"][rows], f"C{k % 10}"
            units.append(_UNITS.get(coordinate, ""))
            if what == "data":
                axes.plot(time, table["observed"][rows], ".", color=color, ms=4, label=label)
                axes.plot(time, table["predicted"][rows], "-", color=color, lw=1)
            else:
                axes.plot(time, table["residual_in_sigma"][rows], ".", color=color, ms=4, label=label)
        if what == "residuals":
            axes.axhspan(-2.0, 2.0, color="0.9", zorder=0)
        axes.set_xlabel("time (s)")
        axes.set_ylabel("residual (sigma)" if what == "residuals" else ", ".join(dict.fromkeys(units)))
        if units:
            axes.legend(loc="upper right")
        return axes

    def _series(self) -> list[tuple[str, str, NDArray[np.intp]]]:
        """(label, coordinate, rows by time) of each coordinate that was measured."""
        rows: dict[tuple[str, ...], list[int]] = {}
        keys = [self.predictions[k] for k in ("recording", "target", "coordinate") if k in self.predictions]
        for i, key in enumerate(zip(*keys)):
            rows.setdefault(tuple(str(part) for part in key), []).append(i)
        return [("/".join(part for part in key if part), key[-1], np.array(found)) for key, found in rows.items()]

    def __repr__(self) -> str:
        deviations = self.standard_deviations
        values = ", ".join(
            f"{name}={value:.6g}" + (f"±{deviations[name]:.2g}" if deviations[name] >= 0.0 else "")
            for name, value in self.estimates.items()
        )
        return f"FitResult({self.status}, {values})"


_UNITS = {
    **{"x": "m", "y": "m", "distance": "m", "angle": "rad", "vx": "m/s", "vy": "m/s", "omega": "rad/s"},
    **{"ax": "m/s²", "ay": "m/s²", "alpha": "rad/s²", "time": "s"},
    **{"fx": "N", "fy": "N", "normal": "N", "tangent": "N", "torque": "N m"},
}


def _read_predictions(text: str) -> dict[str, NDArray[Any]]:
    """The columns of the programs' table; an empty number is NaN."""
    if not text:
        return {}
    header, *rows = csv.reader(io.StringIO(text))
    numbers = ("time", "sigma", "observed", "predicted", "residual", "residual_in_sigma")
    columns: dict[str, NDArray[Any]] = {}
    for name, cells in zip(header, zip(*rows)):
        if name in numbers:
            columns[name] = np.array([float(cell) if cell else math.nan for cell in cells])
        else:
            columns[name] = np.array(cells)
    return columns


def _read_draws(text: str) -> dict[str, Floats]:
    """The columns of the programs' table of draws."""
    if not text:
        return {}
    header, *rows = csv.reader(io.StringIO(text))
    return {name: np.array([float(cell) for cell in cells]) for name, cells in zip(header, zip(*rows))}


# Draws, chains, warm-up, target, seed and temperatures, as the core takes them.
Sampling = Tuple[int, int, int, float, int, int]


def _sampling(
    draws: int | None, chains: int, warm_up: int, target: float, seed: int, temperatures: int
) -> Sampling | None:
    """The options of draws from the posterior, as the core takes them."""
    if draws is None:
        return None
    for name, value, low, high in (
        ("posterior", draws, 1, 1_000_000), ("posterior_chains", chains, 1, 64),
        ("posterior_warm_up", warm_up, 0, 1_000_000), ("posterior_seed", seed, 0, 2**31 - 1),
        ("posterior_temperatures", temperatures, 1, 32),
    ):
        whole(value, name, low, high, what=f"a whole number from {low} to {high}")
    if not 0.01 <= number(target, "posterior_target", what="a number from 0.01 to 0.999") <= 0.999:
        raise ValueError(f"posterior_target: expected a number from 0.01 to 0.999, got {target}")
    return int(draws), int(chains), int(warm_up), float(target), int(seed), int(temperatures)


def _start(problem: Problem, number: int, max_iterations: int, predict_from: float) -> str:
    """A start of a fit, in a worker's process."""
    with problem.read() as core:
        return core.start(number, max_iterations, predict_from, 1)


def _profile(
    problem: Problem, name: str, max_iterations: int, predict_from: float, starts: list[str]
) -> str:
    """A profile of a fit with these starts, in a worker's process."""
    with problem.read() as core:
        return core.profile(name, max_iterations, predict_from, 1, starts)


def _chain(
    problem: Problem, number: int, max_iterations: int, predict_from: float, starts: list[str],
    sampling: Sampling,
) -> str:
    """A chain of draws around the estimate of a fit with these starts, in a worker's process."""
    with problem.read() as core:
        return core.chain(number, max_iterations, predict_from, 1, starts, sampling)


def _parts(
    executor: Executor | None, problem: Problem, max_iterations: int, predict_from: float,
    profiles: list[str], sampling: Sampling | None,
) -> tuple[list[str], list[str], list[str]]:
    """Starts, profiles and chains that the executor's workers have made: what a fit takes over."""
    if executor is None:
        return [], [], []
    with problem.read() as core:
        count, known = core.num_starts, core.names
    for name in profiles:
        if name not in known:
            raise _core.TangibleError(f"profile: expected names of parameters, got {name}")
    starts: list[str] = []
    # The one start of a fit is worth sending where profiles or chains begin from it.
    if count > 1 or profiles or sampling is not None:
        calls = [(problem, number, max_iterations, predict_from) for number in range(count)]
        starts = _executor.in_order(executor, _start, calls)
    around = [(problem, name, max_iterations, predict_from, starts) for name in profiles]
    made = _executor.in_order(executor, _profile, around)
    if sampling is None:
        return starts, made, []
    chains = [
        (problem, number, max_iterations, predict_from, starts, sampling) for number in range(sampling[1])
    ]
    return starts, made, _executor.in_order(executor, _chain, chains)


def _progress(said: dict[str, Any]) -> None:
    """One line on stderr that is written over at each iteration."""
    print(
        f"\rstart {said['start']}, iteration {said['iteration']}, cost {said['cost']:.6g}, "
        f"{said['seconds']:.1f} s\033[K", end="", file=sys.stderr, flush=True,
    )


def fit(
    problem: FitLike | Scene,
    data: Table | None = None,
    parameters: Parameters | None = None,
    *,
    sigma: float | Mapping[str, float] | None = None,
    points: Mapping[str, Any] | None = None,
    recordings: Sequence[Any] | Mapping[str, Any] | None = None,
    folder: str | os.PathLike[str] = ".",
    initial: Mapping[str, float] | None = None,
    max_iterations: int = 50,
    predict_from: float | None = None,
    profile: Sequence[str] = (),
    design: FitLike | None = None,
    missing: bool = False,
    posterior: int | None = None,
    posterior_chains: int = 4,
    posterior_warm_up: int = 200,
    posterior_target: float = 0.8,
    posterior_seed: int = 0,
    posterior_temperatures: int = 1,
    discretisation_check: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
    callback: Callable[[dict[str, Any]], object] | None = None,
    progress: bool = False,
    on_failure: str = "raise",
    executor: Executor | None = None,
    **keys: Any,
) -> FitResult:
    """Identifies parameters from observations, as `tangible-fit` does.

        tangible.fit(scene, {"time": t, "ball/x": x}, ["bodies/ball/mass"], sigma=0.001)
        tangible.fit("chain_fit.json")

    Args:
        problem: With `data` or `recordings` a scene: a `Scene`, its file, or a dict of its JSON. Else
            a fit file, or a dict of its JSON (README of `estimation`), in which a scene may stand as
            a `Scene` or dict, and an observation's table as its `data`, in the place of files.
        data: What was measured: a dict of arrays of one length, or a DataFrame of pandas. Columns
            are `time` (s; a DataFrame's index may be it) and either `body` or `point` beside `x`,
            `y` (m), `angle` (rad), ..., or wide ones like "ball/x". A table of the one moving body
            needs no names. NaN, None, pandas' NA and what a masked array masks is what was not
            measured. Time differences (timedelta) are times.
        parameters: What is to be found: paths, or dicts as in a fit file, or {path or name: initial
            value or such a dict}.
        sigma: Standard deviation of what was measured: a number, or {"x": m, "angle": rad, ...}.
        points: {name: {"body": name, "at": [x, y]}}: points of bodies that `data` may name.
        recordings: In the place of `data` tables of several runs, as a list or {name: table}; an
            item may be {"data": table, "initial": {...}, "weight": w, ...} too.
        folder: Where files that a dict names are looked for.
        initial: Initial values that replace the file's: {name: value}.
        max_iterations: Of each start.
        predict_from: s: observations after it are not fitted but predicted; their errors stand in
            the report and in `predictions`.
        profile: Names of parameters whose profiles are computed: the fit with the parameter held, at
            values around; their intervals count where the cost is no parabola.
        design: Candidates for the next experiment, as `tangible-fit --design` reads them: a file, or
            {"candidates": [{"values": {path: number}, "duration": s, "camera": name}, ...],
            "wanted": {parameter: width}}; what each would narrow stands in `FitResult.design`.
        missing: Whether it is asked what would explain the residuals, with real fits of the best
            candidates: `FitResult.missing`.
        posterior: So many draws from the posterior density of the parameters, by Hamiltonian Monte
            Carlo (`tangible-fit --posterior`): `FitResult.draws` and `posterior`; the intervals are
            theirs, and `domains` takes them.
        posterior_chains, posterior_warm_up, posterior_target, posterior_seed: Of the draws: chains,
            each from a start of its own; transitions of each before its draws; mean acceptance, nearer
            to 1 with shorter steps; the seed.
        posterior_temperatures: Of each chain, 1, 2, 4, ...: more pass between several modes, and take
            as much more time.
        discretisation_check: Whether it is fitted with half the step too, which shows its bias.
        checkpoint: A file that keeps the fit's evaluations: where the fit is interrupted, the same
            call goes on from it, with the same bits.
        callback: Called after each iteration with `start`, `iteration`, `cost`, `gradient_norm`,
            `parameters` and `seconds`; what it raises ends the fit.
        progress: Whether a line on stderr says how far it is.
        on_failure: "raise", or "return" a result that has not converged.
        executor: One of `concurrent.futures` whose workers, on this machine or others, make the
            starts (`starts` of the fit), the profiles that are asked for and the chains of
            `posterior`, one thread each; the bits are those without. Not with `checkpoint`.
        **keys: With `data`, further keys of a fit file: `loss`, `starts`, `seed`, `sensors`, ...

    Raises:
        TangibleError: A mistake in the problem; a fit that has not converged.
        TypeError, ValueError: An argument that is missing, or a table that cannot be read.

    Warns:
        TangibleWarning: Of what `FitResult.warnings` lists.
    """
    choice(on_failure, "on_failure", "raise", "return")
    max_iterations = whole(max_iterations, "max_iterations", 1)
    end = math.inf if predict_from is None else number(predict_from, "predict_from", what="a time in s")
    function(callback, "callback")
    progress = flag(progress, "progress")
    missing, discretisation_check = flag(missing, "missing"), flag(discretisation_check, "discretisation_check")
    kept = "" if checkpoint is None else file_name(checkpoint, "checkpoint")
    _executor.check(executor)
    if executor is not None and checkpoint is not None:
        raise ValueError("checkpoint: not with executor, whose workers keep none")

    def told(said: dict[str, Any]) -> None:
        if progress:
            _progress(said)
        if callback is not None:
            callback(said)

    sampling = _sampling(
        posterior, posterior_chains, posterior_warm_up, posterior_target, posterior_seed,
        posterior_temperatures,
    )
    made = _problem(problem, data, parameters, sigma, points, recordings, folder, initial, keys)
    profiles = names(profile, "profile")
    candidates = ("", "")
    if isinstance(design, Mapping):
        candidates = (json.dumps(plain(design, "design")), "design")
    elif design is not None:
        file = file_name(design, "design", "a file of candidates or a dict of its JSON")
        candidates = (text_of(file), file)
    try:
        starts_done, profiles_done, chains_done = _parts(
            executor, made, max_iterations, end, profiles, sampling
        )
        with made.open(_core.Fit) as (core, named):
            found, page, predictions, scenes, draws = core.run(
                max_iterations,
                end,
                discretisation_check,
                kept,
                told if progress or callback is not None else None,
                profiles,
                starts_done,
                profiles_done,
                *candidates,
                missing,
                sampling,
                chains_done,
            )
            found, page, predictions = named(found), named(page), named(predictions)
            ranges = {name: (low, high) for name, (_, low, high) in zip(core.names, core.ranges().tolist())}
    finally:
        if progress:
            print(file=sys.stderr)
    listed = json.loads(made.text).get("parameters", [])
    result = FitResult(json.loads(found), page, predictions, scenes, listed, draws, ranges)
    if result.status != "converged" and on_failure == "raise":
        raise _core.TangibleError(f"{result.status}: {result.message}")
    warn(result.warnings)
    return result
