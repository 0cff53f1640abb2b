"""Fits from Python are those of the program."""

from __future__ import annotations

import json
import os
import subprocess
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
    assert len(result.plot("cost").lines) == 1


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
    plain = {**data, "approach": "plain"}
    with pytest.raises(tangible.TangibleError, match="not_converged"):
        tangible.fit(plain, folder=FIT.parent, max_iterations=1)
    ended = tangible.fit(plain, folder=FIT.parent, max_iterations=1, on_failure="return")
    assert ended.status == "not_converged"
    with pytest.raises(ValueError, match="parameters: expected 1 values"):
        good([1.0, 2.0])


def test_recordings_share_what_they_have_in_common(tmp_path: Path) -> None:
    """Two falls with a drag in common, each from a height and at a speed of its own."""
    scene = {
        "name": "fall",
        "bodies": [{"name": "ball", "mass": 1, "inertia": 0.1, "position": [0, 0],
                    "quadratic_drag": 0.2}],
        "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"},
    }
    recordings = []
    for k, (y, vy) in enumerate([(1.0, 2.0), (3.0, -4.0)]):
        run = tangible.simulate(
            scene, parameters={"bodies/ball/position/y": y, "bodies/ball/velocity/y": vy})
        rows = [f"{t:.17g},ball,{q:.17g}" for t, q in zip(run.times, run["ball/y"])]
        (tmp_path / f"{k}.csv").write_text("\n".join(["time,body,y", *rows]))
        recordings.append(
            {"name": f"fall {k}", "observations": [{"file": f"{k}.csv", "sigma": 0.001}],
             "initial": {"y": y + 0.1, "vy": 0.0}, "weight": k + 1.0})
    (tmp_path / "fall.json").write_text(json.dumps(scene))
    problem = {
        "scene": "fall.json",
        "recordings": recordings,
        "parameters": [
            {"name": "drag", "path": "bodies/ball/quadratic_drag", "initial": 0.05},
            {"name": "y", "path": "bodies/ball/position/y", "per": "recording"},
            {"name": "vy", "path": "bodies/ball/velocity/y", "per": "recording"},
        ],
    }
    result = tangible.fit(problem, folder=tmp_path)
    assert result["drag"] == pytest.approx(0.2, rel=1e-9)
    assert result["vy of fall 1"] == pytest.approx(-4.0, rel=1e-9)
    assert "fall 1" in result.report()
    residuals = tangible.Residuals(problem, folder=tmp_path)
    at = residuals.initial
    assert residuals.names == ["drag", "y of fall 0", "vy of fall 0", "y of fall 1", "vy of fall 1"]
    jacobian = residuals.jacobian(at)
    for k in range(len(at)):
        step = np.zeros(len(at))
        step[k] = 1e-6
        difference = (residuals(at + step) - residuals(at - step)) / 2e-6
        assert np.abs(difference - jacobian[:, k]).max() < 1e-5 * np.abs(jacobian[:, k]).max()
    # The second one weighs twice as much.
    assert np.abs(jacobian[101:, 3]).max() == pytest.approx(2**0.5 * np.abs(jacobian[:101, 1]).max())


def test_the_next_experiment_is_designed(tmp_path: Path) -> None:
    scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.05, "duration": 1.0})
    scene.add_body("ball", mass=2.0, inertia=1.0, position=[0, 0], velocity=[2, 3])
    run = tangible.simulate(scene)
    data = {"time": run.times, "y": run["ball/y"] + 0.01 * np.random.default_rng(0).normal(size=21)}
    design = {"candidates": [{}, {"duration": 2.0}, {"values": {"bodies/ball/velocity/y": 9.0}}],
              "wanted": {"gravity/y": 0.005}}
    found = tangible.fit(scene, data, ["gravity/y"], sigma=0.01, design=design).design
    # y = v t + g t^2 / 2 is observed: the information is the sum of (t^2 / 2 / sigma)^2.
    information = [sum((0.5 * (0.05 * k) ** 2 / 0.01) ** 2 for k in range(n)) for n in (21, 21, 41, 21)]
    widths = [2 * 1.959963984540054 / np.sqrt(information[0] + (one if k else 0.0)) for k, one in enumerate(information)]
    assert found["widths"]["gravity/y"] == pytest.approx(widths[0])
    assert [one["widths"]["gravity/y"] for one in found["candidates"]] == pytest.approx(widths[1:])
    assert found["d_optimal"] == found["a_optimal"] == found["narrowest"]["gravity/y"] == 1
    needed = ((2 * 1.959963984540054 / 0.005) ** 2 - information[0]) / np.array(information[1:])
    assert [one["takes"]["gravity/y"] for one in found["candidates"]] == np.ceil(needed).tolist()
    # The program's file, result, terminal and report.
    (tmp_path / "design.json").write_text(json.dumps(design), encoding="utf-8")
    scene.save(tmp_path / "scene.json")
    rows = ["time,body,y"] + [f"{t:.17g},ball,{y:.17g}" for t, y in zip(data["time"], data["y"])]
    (tmp_path / "seen.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    fit = {"scene": "scene.json", "parameters": ["gravity/y"], "observations": [{"file": "seen.csv", "sigma": {"y": 0.01}}]}
    (tmp_path / "fit.json").write_text(json.dumps(fit), encoding="utf-8")
    from_file = tangible.fit(tmp_path / "fit.json", design=tmp_path / "design.json")
    assert from_file.design == found and "The next experiment" in from_file.report()
    program = Path(os.environ.get("TANGIBLE_PROGRAMS", "nowhere")) / "tangible-fit"
    if program.exists():
        ran = subprocess.run([program, tmp_path / "fit.json", f"--design={tmp_path / 'design.json'}",
                              f"--out={tmp_path / 'r.json'}"], capture_output=True, text=True, check=True)
        assert json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))["design"] == found
        assert "D-optimal: candidate 1, A-optimal: candidate 1" in ran.stdout
    for wrong, said in [
        ({"candidates": []}, "^design: /candidates: expected at least one candidate, got none$"),
        ({"candidates": [{"duration": -1}]}, "^design: /candidates/0/duration: expected a number > 0, got -1$"),
        ({"candidates": [{"values": {"bodies/cube/mass": 1}}]}, "^design: /candidates/0: .*bodies/cube/mass"),
        ({"candidates": [{"values": {"gravity/y": 1}}]}, "^design: /candidates/0: gravity/y: expected a number that is not"),
        ({"candidates": [{"camera": "c"}]}, "^design: /candidates/0/camera: expected a camera of the fit, which has none"),
        ({"candidates": [{}], "wanted": {"mass": 1}}, "^design: /wanted/mass: expected the name of a parameter"),
        ({"candidates": [{"colour": 1}]}, "^design: /candidates/0/colour: unknown key"),
    ]:
        with pytest.raises(tangible.TangibleError, match=said):
            tangible.fit(scene, data, ["gravity/y"], sigma=0.01, design=wrong)


@pytest.mark.filterwarnings("ignore::tangible.TangibleWarning")
def test_what_is_missing_is_named() -> None:
    scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.05, "duration": 2.0})
    scene.add_body("ball", mass=2.0, inertia=1.0, position=[0, 0], velocity=[2, 3])
    run = tangible.simulate(scene)
    noise = 0.01 * np.random.default_rng(1).normal(size=(2, 41))
    # Along x the pixels are five percent narrower than the model has them.
    data = {"time": run.times, "x": 1.05 * run["ball/x"] + noise[0], "y": run["ball/y"] + noise[1]}
    result = tangible.fit(scene, data, ["gravity/y", "bodies/ball/velocity/y"], sigma=0.01, missing=True)
    first = result.missing[0]
    names = [first["candidate"], *first["equivalent"]]
    assert first["confirmed"] and first["refitted"] and "sensors/x/gain" in names
    assert first["cost_share"] > 0.5 and first["held_out_gain"] > 0.5
    assert "What would explain the residuals" in result.report()
    without = tangible.fit(scene, data, ["gravity/y", "bodies/ball/velocity/y"], sigma=0.01)
    assert without.missing == [] and without.estimates == result.estimates


def test_draws_from_the_posterior() -> None:
    scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.1, "duration": 1.0})
    scene.add_body("ball", mass=2.0, inertia=1.0, position=[0, 0], velocity=[0, 3])
    run = tangible.simulate(scene)
    data = {"time": run.times, "y": run["ball/y"] + 0.01 * np.random.default_rng(4).normal(size=11)}
    names = ["gravity/y", "bodies/ball/velocity/y"]
    # A start elsewhere, so that the draws are not of the start.
    options = {"sigma": 0.01, "initial": {"gravity/y": -9.0}, "posterior_seed": 5}
    found = tangible.fit(scene, data, names, posterior=600, **options)
    plain = tangible.fit(scene, data, names, sigma=0.01)
    assert set(found.draws) == {"draw", "chain", "cost", *names}
    # Predictions are linear in both, so that the posterior is the Gaussian of the covariance.
    drawn = np.array([found.draws[name] for name in names])
    assert drawn.shape == (2, 600) and set(found.draws["chain"]) == {0, 1, 2, 3}
    deviations = np.sqrt(np.diag(plain.covariance))
    assert np.all(np.abs(drawn.mean(1) - list(plain.estimates.values())) < 0.25 * deviations)
    np.testing.assert_allclose(np.cov(drawn), plain.covariance, rtol=0.25)
    for name, statistics, mean in zip(names, found.posterior["parameters"], drawn.mean(1)):
        assert statistics["name"] == name and statistics["r_hat"] < 1.02
        low, high = found.intervals[name] or (None, None)
        assert low is not None and high is not None and low < mean < high
    assert "posterior" in found.report()
    # The same draws again, others with another seed; and domains are draws.
    again = tangible.fit(scene, data, names, posterior=600, **options)
    np.testing.assert_array_equal(again.draws["gravity/y"], found.draws["gravity/y"])
    other = tangible.fit(scene, data, names, posterior=600, **{**options, "posterior_seed": 6})
    assert np.any(other.draws["gravity/y"] != found.draws["gravity/y"])
    domains = found.domains(700, seed=1)
    assert domains["gravity/y"].shape == (700,)
    assert set(domains["gravity/y"]) == set(found.draws["gravity/y"])
    assert plain.draws == {} and plain.posterior == {}
    for wrong, said in [
        ({"posterior": 0}, "^posterior: expected a whole number from 1 to 1000000, got 0$"),
        ({"posterior": True}, "^posterior: expected a whole number"),
        ({"posterior": 10, "posterior_chains": 65}, "^posterior_chains: .* from 1 to 64, got 65$"),
        ({"posterior": 10, "posterior_temperatures": 0}, "^posterior_temperatures: .* from 1 to 32, got 0$"),
        ({"posterior": 10, "posterior_target": 1.0}, "^posterior_target: expected a number from 0.01"),
    ]:
        with pytest.raises((ValueError, TypeError), match=said):
            tangible.fit(scene, data, names, sigma=0.01, **wrong)
