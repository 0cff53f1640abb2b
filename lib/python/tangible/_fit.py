"""Fits: parameters identified from observed positions."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._certificate import Certificate
from ._rollout import floats
from ._warning import warn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
FitLike = Union[Mapping[str, Any], str, "os.PathLike[str]"]


def _text(
    problem: FitLike, folder: str | os.PathLike[str], initial: Mapping[str, float] | None
) -> tuple[str, str]:
    """The text of a fit file and its name, which places what it names."""
    if isinstance(problem, Mapping):
        data: dict[str, Any] = json.loads(json.dumps(problem))
        name = str(Path(folder) / "fit")
    else:
        name = os.fspath(problem)
        try:
            text = Path(name).read_text(encoding="utf-8-sig")
        except OSError as error:
            raise _core.TangibleError(f"{name}: cannot be read: {error.strerror}") from None
        if not initial:
            return text, name
        data = json.loads(text)
    for key, value in (initial or {}).items():
        for k, parameter in enumerate(data.get("parameters", [])):
            entry = {"name": parameter, "path": parameter} if isinstance(parameter, str) else parameter
            if entry.get("name", entry.get("path")) == key:
                data["parameters"][k] = {**entry, "initial": float(value)}
                break
        else:
            raise _core.TangibleError(f"initial: no parameter of the fit is named {key}")
    return json.dumps(data), name


class Residuals:
    """The residuals of a fit and their Jacobian, for least-squares methods of others.

        scipy.optimize.least_squares(r, r.initial, jac=r.jacobian, bounds=r.bounds)

    Residuals are in multiples of their standard deviation. Calls from several threads take turns.

    Args:
        problem: A fit file, or a dict of its JSON (README of `estimation`).
        folder: Where files that a dict names are looked for.
        initial: Initial values that replace the file's: {name: value}.

    Attributes:
        names: Of the P parameters.
        initial: Initial values, shape (P,).
        bounds: Two arrays of shape (P,), the lowest and highest values.
    """

    def __init__(
        self,
        problem: FitLike,
        *,
        folder: str | os.PathLike[str] = ".",
        initial: Mapping[str, float] | None = None,
    ) -> None:
        self._core = _core.Fit(*_text(problem, folder, initial))
        ranges = self._core.ranges()
        self.names = self._core.names
        self.initial: Floats = np.array(ranges[:, 0])
        self.bounds: tuple[Floats, Floats] = (np.array(ranges[:, 1]), np.array(ranges[:, 2]))

    def __call__(self, parameters: ArrayLike) -> Floats:
        """The residuals, shape (R,)."""
        return self._core.evaluate(floats(parameters, "parameters"), False)[0]

    def jacobian(self, parameters: ArrayLike) -> Floats:
        """Their derivatives with respect to the parameters, shape (R, P)."""
        found = self._core.evaluate(floats(parameters, "parameters"), True)[1]
        assert found is not None
        return found


class FitResult:
    """What a fit has found.

    Attributes:
        status: "converged", "not_converged", "failed" or "no_effect".
        message: Why.
        estimates: {name: estimate}.
        certificate: Of the derivatives at the estimate; None where there is no estimate.
        data: The whole result as `tangible-fit --out` writes it.
    """

    def __init__(self, data: dict[str, Any], page: str) -> None:
        self.data = data
        self._page = page
        self.status: str = data["status"]
        self.message: str = data["message"]
        found = data.get("certificate")
        self.certificate: Certificate | None = None if found is None else Certificate(found)
        self.estimates: dict[str, float] = {
            p["name"]: p["estimate"] for p in data["parameters"] if p["estimate"] is not None
        }

    def __getitem__(self, name: str) -> float:
        """The estimate of a parameter."""
        return self.estimates[name]

    @property
    def names(self) -> list[str]:
        """Of the parameters."""
        return [p["name"] for p in self.data["parameters"]]

    def interval(self, name: str, *, robust: bool = True) -> tuple[float, float] | None:
        """The 95 % interval; None where there is none (a bound, no information).

        The robust one comes from the residuals as they are; the other one trusts the stated sigma.
        """
        for parameter in self.data["parameters"]:
            if parameter["name"] == name:
                found = parameter["confidence_95_robust" if robust else "confidence_95"]
                return None if found is None else (float(found[0]), float(found[1]))
        raise KeyError(f"{name}: expected one of {', '.join(self.names)}")

    @property
    def warnings(self) -> list[str]:
        """What `tangible-fit` warns of, such as intervals that mean little."""
        lines = [str(line) for line in self.data.get("warnings") or []]
        if self.certificate is not None and self.certificate.verdict_of_map != "trustworthy":
            lines.append(f"not trustworthy at the estimate: {self.certificate}")
        return lines

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
            Path(file).write_text(self._page, encoding="utf-8")
        return self._page

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Plots the cost by iteration with matplotlib; returns the axes."""
        import matplotlib.pyplot as plt

        axes: Axes = ax if ax is not None else plt.subplots()[1]
        axes.semilogy([iteration["cost"] for iteration in self.data["iterations"]], marker="o")
        axes.set_xlabel("iteration")
        axes.set_ylabel("cost")
        return axes

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value:.6g}" for name, value in self.estimates.items())
        return f"FitResult({self.status}, {values})"


def fit(
    problem: FitLike,
    *,
    folder: str | os.PathLike[str] = ".",
    initial: Mapping[str, float] | None = None,
    max_iterations: int = 50,
    on_failure: str = "raise",
) -> FitResult:
    """Identifies parameters from observations, as `tangible-fit` does.

    Args:
        problem: A fit file, or a dict of its JSON (README of `estimation`).
        folder: Where files that a dict names are looked for.
        initial: Initial values that replace the file's: {name: value}.
        max_iterations: Of each start.
        on_failure: "raise", or "return" a result that has not converged.

    Raises:
        TangibleError: A mistake in the problem; a fit that has not converged.

    Warns:
        TangibleWarning: Of what `FitResult.warnings` lists.
    """
    if on_failure not in ("raise", "return"):
        raise ValueError(f"on_failure: expected raise or return, got {on_failure}")
    if max_iterations < 1:
        raise ValueError(f"max_iterations: expected a number >= 1, got {max_iterations}")
    text, page = _core.Fit(*_text(problem, folder, initial)).run(max_iterations)
    result = FitResult(json.loads(text), page)
    if result.status != "converged" and on_failure == "raise":
        raise _core.TangibleError(f"{result.status}: {result.message}")
    warn(result.warnings)
    return result
