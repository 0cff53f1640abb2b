"""Fits from Python are those of the program."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import tangible

FIT = Path(__file__).resolve().parents[2] / "data" / "fits" / "chain.json"


def test_the_chain_has_its_mass(tmp_path: Path) -> None:
    result = tangible.fit(FIT, initial={"chain mass": 20.0})
    assert result.status == "converged"
    assert result["chain mass"] == pytest.approx(6.999896254, abs=1e-8)
    low, high = result.interval("chain mass") or (0.0, 0.0)
    assert low < result["chain mass"] < high and high - low < 0.01
    assert result.covariance.shape == (1, 1) and result.correlations[0, 0] == 1.0
    page = result.report(tmp_path / "report.html")
    assert "chain mass" in page and (tmp_path / "report.html").read_text() == page
    pytest.importorskip("matplotlib")
    assert len(result.plot().lines) == 1


def test_scipy_finds_the_same() -> None:
    optimize = pytest.importorskip("scipy.optimize")
    residuals = tangible.Residuals(FIT)
    assert residuals.names == ["chain mass"]
    found = optimize.least_squares(
        residuals, residuals.initial, jac=residuals.jacobian, bounds=residuals.bounds, xtol=1e-14
    )
    assert found.x[0] == pytest.approx(6.999896254, rel=1e-6)
    step = 1e-5
    difference = (residuals([7.0 + step]) - residuals([7.0 - step])) / (2 * step)
    derivative = residuals.jacobian([7.0])[:, 0]
    assert np.abs(difference - derivative).max() < 1e-5 * np.abs(derivative).max()


def test_mistakes_are_one_line(tmp_path: Path) -> None:
    data = json.loads(FIT.read_text())
    with pytest.raises(tangible.TangibleError, match="chain.json"):
        tangible.fit({**data, "scene": "nowhere/chain.json"}, folder=tmp_path)
    good = tangible.Residuals(data, folder=FIT.parent)
    assert good.names == ["chain mass"]
    with pytest.raises(tangible.TangibleError, match="/parameters/0"):
        tangible.fit({**data, "parameters": ["bodies/nobody/mass"]}, folder=FIT.parent)
    with pytest.raises(tangible.TangibleError, match="no parameter of the fit is named mass"):
        tangible.fit(FIT, initial={"mass": 1.0})
    with pytest.raises(tangible.TangibleError, match="not_converged"):
        tangible.fit(FIT, max_iterations=1)
    assert tangible.fit(FIT, max_iterations=1, on_failure="return").status == "not_converged"
    with pytest.raises(ValueError, match="parameters: expected 1 values"):
        good([1.0, 2.0])
