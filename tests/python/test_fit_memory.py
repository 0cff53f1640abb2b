"""Fits from memory are those of files."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

PARAMETERS = ["bodies/ball/velocity/x", "bodies/ball/restitution"]
TRUE = {"bodies/ball/velocity/x": 0.5, "bodies/ball/restitution": 0.8}
GUESS = {"bodies/ball/velocity/x": 0.3, "bodies/ball/restitution": 0.7}
SIGMA = 1e-3


def scene() -> dict[str, Any]:
    data = ball("event")
    data["bodies"][1]["restitution"] = data["bodies"][0]["restitution"]
    data["pairs"] = [{"bodies": ["ball", "floor"], "friction": 0.0}]
    return data


def seen(seed: int = 0, **truth: float) -> dict[str, np.ndarray[Any, Any]]:
    run = tangible.simulate(scene(), {**TRUE, **truth}, every=3)
    noise = np.random.default_rng(seed).normal(size=(2, len(run.times))) * SIGMA
    return {"time": run.times, "ball/x": run["ball/x"] + noise[0], "ball/y": run["ball/y"] + noise[1]}


def from_files(folder: Path) -> tangible.FitResult:
    table = seen()
    rows = [f"{t:.17g},ball,{x:.17g},{y:.17g}" for t, x, y in zip(*table.values())]
    (folder / "seen.csv").write_text("\n".join(["time,body,x,y", *rows]))
    (folder / "scene.json").write_text(json.dumps(scene()))
    return tangible.fit(
        {"scene": "scene.json", "observations": [{"file": "seen.csv", "sigma": SIGMA}],
         "parameters": [{"path": path, "initial": GUESS[path]} for path in PARAMETERS]}, folder=folder)


@pytest.mark.parametrize("form", ["wide", "long", "nameless", "dataframe", "long dataframe", "entries"])
def test_tables_of_every_form_give_the_same_bits(form: str, tmp_path: Path) -> None:
    expected = from_files(tmp_path)
    assert expected["bodies/ball/restitution"] == pytest.approx(0.8, abs=0.01)
    table: Any = seen()
    long = {"time": table["time"], "body": ["ball"] * len(table["time"]), "x": table["ball/x"], "y": table["ball/y"]}
    if form == "long":
        table = long
    if form == "nameless":
        table = {"time": list(table["time"]), "x": table["ball/x"], "y": table["ball/y"].tolist()}
    if "dataframe" in form:
        pandas = pytest.importorskip("pandas")
        table = pandas.DataFrame(long) if "long" in form else pandas.DataFrame(table).set_index("time")
    problem: Any = tangible.Scene(scene()) if form != "wide" else scene()
    if form == "entries":
        found = tangible.fit({
            "scene": problem, "parameters": [{"path": path, "initial": GUESS[path]} for path in PARAMETERS],
            "observations": [{"time": long["time"], "body": "ball", "x": long["x"], "y": long["y"], "sigma": SIGMA}]})
    else:
        found = tangible.fit(problem, table, GUESS, sigma=SIGMA)
    assert found.estimates == expected.estimates
    assert np.array_equal(found.covariance, expected.covariance)


def test_what_was_not_measured_is_nan() -> None:
    table = seen()
    table["ball/y"][::2] = np.nan
    table["ball/x"][4] = table["ball/y"][4] = np.nan
    found = tangible.fit(scene(), table, GUESS, sigma={"x": SIGMA, "y": 2 * SIGMA})
    assert len(found.residuals) == 20 + 10
    kinds = found.predictions["coordinate"]
    assert set(found.predictions["sigma"][kinds == "y"]) == {2 * SIGMA}


def test_a_result_has_all_that_was_found(tmp_path: Path) -> None:
    found = tangible.fit(tangible.Scene(scene()), seen(), GUESS, sigma=SIGMA)
    path = "bodies/ball/restitution"
    assert found.scene[path] == pytest.approx(found[path]) and isinstance(found.scene, tangible.Scene)
    run = tangible.simulate(found.scene, every=3)
    table = found.predictions
    xs = table["coordinate"] == "x"
    assert table["predicted"][xs] == pytest.approx(run["ball/x"], abs=1e-9)
    assert table["residual"] == pytest.approx(table["predicted"] - table["observed"], abs=1e-12)
    assert found.residuals == pytest.approx((table["predicted"] - table["observed"]) / SIGMA, abs=1e-9)
    assert found.standard_deviations[path] == pytest.approx(np.sqrt(found.covariance[1, 1]))
    assert f"{path}={found[path]:.6g}±{found.standard_deviations[path]:.2g}" in repr(found)
    assert found._repr_html_().startswith("<iframe srcdoc=") and found.warnings == []
    other = pickle.loads(pickle.dumps(found))
    assert repr(other) == repr(found) and other.scene.to_json() == found.scene.to_json()
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    data = found.plot()
    assert len(data.lines) == 4 and data.get_ylabel() == "m"
    assert np.array_equal(data.lines[0].get_ydata(), table["observed"][xs])
    residuals = found.plot("residuals")
    assert len(residuals.lines) == 2 and residuals.get_ylabel() == "residual (sigma)"


def test_recordings_from_memory() -> None:
    tables = {"slow": seen(1), "fast": seen(2, **{"bodies/ball/velocity/x": 1.5})}
    parameters = [
        {"path": "bodies/ball/restitution", "initial": 0.7},
        {"name": "vx", "path": "bodies/ball/velocity/x", "initial": 1.0, "per": "recording"},
    ]
    found = tangible.fit(scene(), None, parameters, sigma=SIGMA, recordings=tables)
    assert found["vx of slow"] == pytest.approx(0.5, abs=0.01)
    assert found["vx of fast"] == pytest.approx(1.5, abs=0.01)
    assert list(found.scenes) == ["slow", "fast"]
    assert found.scenes["fast"]["bodies/ball/velocity/x"] == pytest.approx(found["vx of fast"])
    begun = {"slow": tables["slow"], "fast": {"data": tables["fast"], "initial": {"vx": 1.4}}}
    residuals = tangible.Residuals(scene(), None, parameters, sigma=SIGMA, recordings=begun)
    assert residuals.initial.tolist() == [0.7, 1.0, 1.4]
    listed = tangible.fit(scene(), None, parameters, sigma=SIGMA, recordings=list(tables.values()))
    assert list(listed.scenes) == ["recording 0", "recording 1"]


def test_points_can_be_measured() -> None:
    run = tangible.simulate(scene(), TRUE)
    angle = run["ball/angle"]
    table = {"time": run.times, "dot/x": run["ball/x"] + 0.1 * np.cos(angle), "dot/y": run["ball/y"] + 0.1 * np.sin(angle)}
    found = tangible.fit(
        scene(), table, GUESS, sigma=SIGMA, points={"dot": {"body": "ball", "at": np.array([0.1, 0.0])}})
    assert found["bodies/ball/velocity/x"] == pytest.approx(0.5, abs=1e-6)
    assert set(found.predictions["target"]) == {"dot"}


def test_residuals_of_memory_are_pickled() -> None:
    residuals = tangible.Residuals(scene(), seen(), GUESS, sigma=SIGMA)
    assert residuals.initial.tolist() == list(GUESS.values())
    other = pickle.loads(pickle.dumps(residuals))
    assert np.array_equal(other([0.4, 0.75]), residuals([0.4, 0.75]))
    assert np.array_equal(other.jacobian([0.4, 0.75]), residuals.jacobian([0.4, 0.75]))


def test_later_observations_are_predicted() -> None:
    found = tangible.fit(scene(), seen(), {"bodies/ball/velocity/x": 0.3}, sigma=SIGMA, predict_from=0.3)
    used = found.predictions["used"]
    assert set(used) == {"fit", "prediction"} and (found.predictions["time"][used == "fit"] <= 0.3).all()
    assert len(found.residuals) == (used == "fit").sum()
    with pytest.raises(tangible.TangibleError, match="predict_from: expected observations after"):
        tangible.fit(scene(), seen(), GUESS, sigma=SIGMA, predict_from=2.0)


def test_profiles_give_intervals() -> None:
    path = "bodies/ball/restitution"
    found = tangible.fit(scene(), seen(), GUESS, sigma=SIGMA, profile=[path])
    entry, = (p for p in found.data["parameters"] if p["name"] == path)
    assert entry["interval_method"] == "profile"
    low, high = found.intervals[path] or (None, None)
    assert low is not None and high is not None and low < found[path] < high
    width = 2 * 1.96 * found.standard_deviations[path]
    assert high - low == pytest.approx(width, rel=0.5)
    with pytest.raises(tangible.TangibleError, match="profile: expected names of parameters, got x"):
        tangible.fit(scene(), seen(), GUESS, sigma=SIGMA, profile=["x"])
    with pytest.raises(TypeError, match="profile: expected a list"):
        tangible.fit(scene(), seen(), GUESS, sigma=SIGMA, profile=path)


def test_callbacks_checks_and_checkpoints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said: list[dict[str, Any]] = []
    file = tmp_path / "fit.checkpoint"
    found = tangible.fit(
        scene(), seen(), GUESS, sigma=SIGMA, callback=said.append, progress=True, checkpoint=file,
        discretisation_check=True)
    for start in {s["start"] for s in said}:
        iterations = [s["iteration"] for s in said if s["start"] == start]
        assert iterations == list(range(len(iterations))) and len(iterations) > 2
    assert said[0]["parameters"] == GUESS and said[-1]["cost"] < said[0]["cost"]
    assert "iteration 2" in capsys.readouterr().err
    assert any("discretisation" in key for key in found.data)
    again = tangible.fit(scene(), seen(), GUESS, sigma=SIGMA, checkpoint=file, discretisation_check=True)
    assert again.estimates == found.estimates

    class Enough(Exception):
        pass

    def end(_: dict[str, Any]) -> None:
        raise Enough

    with pytest.raises(Enough):
        tangible.fit(scene(), seen(), GUESS, sigma=SIGMA, callback=end)
    assert tangible.fit(scene(), seen(), GUESS, sigma=SIGMA).status == "converged"


def test_scenes_that_the_data_leave_possible() -> None:
    found = tangible.fit(scene(), seen(), [
        {"path": "bodies/ball/restitution", "initial": 0.7, "upper": 1.0},
        {"name": "speed", "initial": 3.0, "sets": [{"path": "bodies/ball/velocity/x", "scale": 0.1}]},
    ], sigma=SIGMA)
    drawn = found.domains(2000, seed=3)
    assert list(drawn) == ["bodies/ball/restitution", "bodies/ball/velocity/x"]
    assert drawn["bodies/ball/velocity/x"].mean() == pytest.approx(0.1 * found["speed"], rel=1e-2)
    assert drawn["bodies/ball/velocity/x"].std() == pytest.approx(0.1 * found.standard_deviations["speed"], rel=0.1)
    simulation = tangible.Simulation(found.scene, batch=50, domains=drawn)
    assert np.std(simulation.reset(seed=0)[:, 3]) == pytest.approx(0.1 * found.standard_deviations["speed"], rel=0.4)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"data": {"x": [1.0]}}, "expected a column time"),
        ({"data": {"time": [0.0, 0.1], "x": [1.0]}}, r"x: expected shape \(2,\), as time, got \(1,\)"),
        ({"data": {"time": [0.0], "x": ["a"]}}, "x: expected numbers"),
        ({"data": {"time": [0.0], "event": ["e"], "number": [1.5]}}, "number: expected 1, 2"),
        ({"data": {"time": [0.0], "body": ["ball"], "point": ["tip"], "x": [0.0]}},
         "expected one column body, point, joint, contact, got body, point"),
        ({"data": {"time": [0.0], "ball/x": [0.0], "y": [1.0]}}, "columns like ball/x, got y"),
        ({"data": {"time": [0.0], "bal/x": [0.0]}}, "^data: line 2: body: .*bal"),
        ({"data": {"time": [np.nan], "ball/x": [0.0]}}, "time: expected finite numbers"),
        ({"data": 3}, "expected a dict of arrays or a DataFrame, got int"),
        ({"data": None}, "expected a dict of arrays or a DataFrame with a scene"),
        ({"parameters": None}, "parameters: expected paths"),
        ({"parameters": "bodies/ball/mass"}, "parameters: expected a list of paths, got the text"),
        ({"parameters": ["bodies/ball/mas"]}, "/parameters/0"),
        ({"sigma": None}, "sigma: expected the standard deviation"),
        ({"recordings": [{}]}, "data: expected None beside recordings"),
        ({"keys": 1}, "/keys: unknown key"),
    ],
)
def test_mistakes_are_said(arguments: dict[str, Any], said: str) -> None:
    given: dict[str, Any] = {"data": seen(), "parameters": PARAMETERS, "sigma": SIGMA, **arguments}
    with pytest.raises((ValueError, TypeError), match=said):
        tangible.fit(tangible.Scene(scene()), **given)
    broken = tangible.Scene(scene())
    broken.add_body("a")
    with pytest.raises(tangible.TangibleError, match="^ball: /bodies/2/mass"):
        tangible.fit(broken, seen(), PARAMETERS, sigma=SIGMA)
    with pytest.raises(TypeError, match="sigma: expected in the fit file, or beside data"):
        tangible.fit({"scene": "x"}, sigma=1.0)


def test_pandas_is_never_imported() -> None:
    import subprocess
    import sys

    code = (
        "import sys, tangible, numpy as np\n"
        "s = tangible.Scene(simulation={'duration': 0.1})\n"
        "s.add_body('a', mass=1, inertia=1, position=[0, 0], velocity=[1, 0])\n"
        "t = np.linspace(0, 0.1, 5)\n"
        "r = tangible.fit(s, {'time': t, 'x': 2 * t}, ['bodies/a/velocity/x'], sigma=0.1)\n"
        "assert abs(r['bodies/a/velocity/x'] - 2) < 1e-6\n"
        "assert not {'pandas', 'matplotlib', 'torch'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("form", ["wide", "long"])
def test_forces_of_joints_and_contacts_are_data(form: str) -> None:
    """A block slides on the floor with mu m g; a mass hangs from a pin with its weight."""
    held: dict[str, Any] = {
        "bodies": [
            {"name": "block", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2.0, "position": [0, 0.1],
             "velocity": [3, 0]},
            {"name": "floor", "static": True, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
            {"name": "bob", "mass": 1.0, "inertia": 0.1, "position": [9, 5]}],
        "pairs": [{"bodies": ["block", "floor"], "friction": 0.3}],
        "joints": [{"name": "pin", "type": "weld", "bodies": ["bob", "world"], "anchor": [9, 5]}],
        "simulation": {"dt": 0.01, "duration": 0.2, "stepping": "event"}}
    times = np.linspace(0.02, 0.2, 10)
    contact = {"normal": np.full(10, 2.0 * 9.81), "tangent": np.full(10, -0.4 * 2.0 * 9.81)}
    joint = {"fy": np.full(10, 1.5 * 9.81)}
    tables: list[dict[str, Any]] = [
        {"time": times, **{f"block:floor/{key}": values for key, values in contact.items()}},
        {"time": times, "pin/fy": joint["fy"]}]
    if form == "long":
        tables = [{"time": times, "contact": ["block:floor"] * 10, **contact},
                  {"time": times, "joint": ["pin"] * 10, **joint}]
    found = tangible.fit({
        "scene": held, "parameters": ["pairs/block:floor/friction", "bodies/bob/mass"],
        "observations": [{"data": table, "sigma": 0.1} for table in tables]})
    assert found["pairs/block:floor/friction"] == pytest.approx(0.4, abs=1e-9)
    assert found["bodies/bob/mass"] == pytest.approx(1.5, abs=1e-9)
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert "N" in found.plot().get_ylabel()


def test_times_of_events_are_data() -> None:
    """Bounces of a ball at 0.8 of each speed, of which the drop's height is known."""
    first = float(np.sqrt(2.0 * 0.9 / 9.81))
    times = first + np.cumsum(np.concatenate([[0.0], 2.0 * first * 0.8 ** np.arange(1, 5)]))
    drop = {
        "bodies": [
            {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1.0, "position": [0, 1.0]},
            {"name": "floor", "static": True, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "pairs": [{"bodies": ["ball", "floor"], "friction": 0.0, "restitution": 0.7}],
        "simulation": {"dt": 0.01, "duration": 3.0, "stepping": "event"}}
    table = {"time": times, "event": ["bounce"] * 5, "number": np.arange(1, 6)}
    problem = {
        "scene": drop, "parameters": ["pairs/ball:floor/restitution"],
        "events": {"bounce": {"bodies": ["ball", "floor"], "kind": "touch"}},
        "observations": [{"data": table, "sigma": 1e-3}]}
    assert tangible.fit(problem)["pairs/ball:floor/restitution"] == pytest.approx(0.8, abs=1e-8)
    with pytest.raises(ValueError, match="number: expected 1, 2"):
        table["number"] = [1, None, 3, 4, 5]
        tangible.fit(problem)


def test_random_forces_are_found_over_time() -> None:
    """A mass that a force drives which the scene does not have."""
    times = np.linspace(0.0, 3.0, 76)
    # ẍ = 0.2 sin 3 t from rest, without a spring.
    seen = 0.2 * (times / 3.0 - np.sin(3.0 * times) / 9.0)
    scene = {
        "gravity": [0, 0],
        "bodies": [
            {"name": "m", "mass": 2, "position": [0, 0], "shape": {"circle": {"radius": 0.1}}}],
        "simulation": {"dt": 0.02, "duration": 3},
    }
    noise = [{"body": "m", "coordinate": "x", "intensity": 1.0}]
    result = tangible.fit(
        scene, {"time": times, "m/x": seen}, ["bodies/m/velocity/x"], sigma=1e-4, process_noise=noise
    )
    (force,) = result.process_noise
    (course,) = force["forces"]
    inside = (course["time"] > 0.3) & (course["time"] < 2.7)
    expected = 0.4 * np.sin(3.0 * course["time"])
    assert np.abs(course["force"] - expected)[inside].max() < 0.05
    (states,) = result.smoothed_states
    assert np.abs(np.interp(times, states["time"], states["states"]["m/x"]) - seen).max() < 1e-3
    assert (course["standard_deviation"] > 0).all()
    with pytest.raises(TypeError, match="process_noise"):
        tangible.fit("fit.json", process_noise=noise)


def pendulum(damping: float = 0.02, **simulation: Any) -> dict[str, Any]:
    return {
        "name": "pendulum", "bodies": [{"name": "bob", "mass": 1.0, "inertia": 0.01, "position": [0, -0.5]}],
        "joints": [{"name": "pin", "type": "revolute", "bodies": ["bob", "world"], "anchor": [0, 0], "angle": 0.6,
                    "damping": damping}],
        "simulation": {"dt": 0.01, "duration": 1.0, "stepping": "event", **simulation}}


DAMPING = "joints/pin/damping"


def swing(damping: float, sigma: float, seed: int) -> dict[str, Any]:
    run = tangible.simulate(pendulum(damping))
    noise = sigma * np.random.default_rng(seed).normal(size=len(run.times))
    return {"time": run.times, "angle": run["bob/angle"] + noise}


def test_domains_keep_to_the_ranges_of_the_scene() -> None:
    """A damping that is nearly 0 has a Gaussian that reaches below it."""
    found = tangible.fit(pendulum(), swing(0.003, 0.01, 0), [DAMPING, "joints/pin/angle"], sigma=0.01)
    assert 0 < found[DAMPING] < 2 * found.standard_deviations[DAMPING]
    drawn = found.domains(2000, seed=1)
    assert drawn[DAMPING].min() >= 0 and len(np.unique(drawn[DAMPING])) == 2000
    # Half of a Gaussian about a mean m: the draws are of the Gaussian above 0.
    from scipy.stats import truncnorm

    mean, deviation = found[DAMPING], found.standard_deviations[DAMPING]
    expected = truncnorm(-mean / deviation, np.inf, mean, deviation).mean()
    assert drawn[DAMPING].mean() == pytest.approx(expected, abs=4 * deviation / np.sqrt(2000))
    assert np.isfinite(tangible.Simulation(pendulum(), batch=50, domains=drawn).reset(seed=0)).all()
    # A range of its own, of a scaled parameter.
    scaled = [{"name": "d", "initial": 0.01, "upper": 0.05, "sets": [{"path": "joints/p*/damping", "scale": 0.1}]}]
    one = tangible.fit(pendulum(), swing(0.0045, 0.01, 1), scaled, sigma=0.01, on_failure="return").domains(500)
    assert list(one) == ["joints/p*/damping"] and one["joints/p*/damping"].max() <= 0.005
    assert one["joints/p*/damping"].min() >= 0


def test_domains_of_parameters_at_their_bounds_are_the_estimate() -> None:
    found = tangible.fit(pendulum(), swing(0.0, 0.01, 3), [DAMPING], sigma=0.01, on_failure="return")
    assert found[DAMPING] == 0.0
    assert found.domains(4)[DAMPING].tolist() == [0.0] * 4


def test_domains_of_parameters_that_add() -> None:
    table = swing(0.05, 0.001, 1)
    sets = [{"path": "joints/*/damping", "add": True}]
    found = tangible.fit(pendulum(0.03), table, [{"name": "extra", "initial": 0.01, "sets": sets}], sigma=0.001)
    assert found["extra"] == pytest.approx(0.02, abs=0.001)
    drawn = found.domains(1000, seed=2)
    assert list(drawn) == [DAMPING]
    assert drawn[DAMPING].mean() == pytest.approx(found.scene[DAMPING], abs=1e-4)
    assert drawn[DAMPING].std() == pytest.approx(found.standard_deviations["extra"], rel=0.1)
    # With one that sets the number.
    both = tangible.fit(pendulum(), table, [
        {"name": "twice", "initial": 0.02, "sets": [{"path": DAMPING, "scale": 2, "offset": 0.005}]},
        {"name": "extra", "initial": 0.01, "sets": sets, "prior": {"gaussian": {"mean": 0.02, "sigma": 1e-5}}},
    ], sigma=0.001)
    assert both.domains(1000)[DAMPING].mean() == pytest.approx(both.scene[DAMPING], abs=1e-4)
    assert both.scene[DAMPING] == pytest.approx(0.05, abs=0.001)


def test_domains_say_what_they_have_not() -> None:
    two = pendulum()
    two["bodies"].append({"name": "tip", "mass": 0.5, "inertia": 0.01, "position": [0, -1]})
    two["joints"].append({"name": "elbow", "type": "revolute", "bodies": ["tip", "bob"], "anchor": [0, -0.7]})
    run = tangible.simulate(two)
    found = tangible.fit(
        two, {"time": run.times, "bob/x": run["bob/x"], "tip/x": run["tip/x"]}, ["links/arm/length", DAMPING],
        sigma=0.001, links={"arm": {"from": "pin", "to": "elbow"}})
    with pytest.raises(ValueError, match="^domains: expected parameters that are numbers .*, got links/arm/length,"):
        found.domains(3)
    for wrong, said in [((0,), "count: expected a whole number >= 1, got 0"), ((3, -1), "seed: expected a whole")]:
        with pytest.raises(ValueError, match=said):
            found.domains(*wrong)
    bare = tangible.FitResult({"status": "failed", "message": "", "parameters": []}, "")
    with pytest.raises(ValueError, match="domains: expected a fit with an estimate, got one that is failed"):
        bare.domains(3)


def test_what_is_masked_was_not_measured() -> None:
    table = swing(0.05, 0.001, 1)
    spoiled = table["angle"].copy()
    spoiled[20:40] = 99.0
    blank = np.where(spoiled > 10, np.nan, spoiled)
    expected = tangible.fit(pendulum(), {**table, "angle": blank}, [DAMPING], sigma=0.001)
    masked = np.ma.masked_greater(spoiled, 10)
    for angle in (masked, masked.astype(object)):
        found = tangible.fit(pendulum(), {**table, "angle": angle}, [DAMPING], sigma=0.001)
        assert found.estimates == expected.estimates
    residuals = tangible.Residuals(pendulum(), {**table, "angle": masked}, [DAMPING], sigma=0.001)
    assert len(residuals([0.05])) == len(table["time"]) - 20
    whole = np.ma.masked_array(np.arange(101), np.arange(101) > 1)
    assert len(tangible.Residuals(pendulum(), {**table, "angle": whole}, [DAMPING], sigma=0.001)([0.05])) == 2
    with pytest.raises(ValueError, match="data: time: expected finite numbers, got NaN"):
        tangible.fit(pendulum(), {**table, "time": np.ma.masked_less(table["time"], 0.1)}, [DAMPING], sigma=0.001)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda x: x > 0, "bool"), (lambda x: x + 1j, "complex128"), (lambda x: list(x > 0), "bool"),
        (lambda x: [True, *x[1:]], "bool"), (lambda x: np.array([1j, *x[1:]], dtype=object), "complex"),
        (lambda x: [np.datetime64("2020-01-01")] * len(x), r"datetime64\[D\]"),
    ],
)
def test_what_is_no_real_number_is_refused(change: Any, said: str) -> None:
    table = swing(0.05, 0.001, 1)
    changed = change(table["angle"])
    if isinstance(changed, list) and isinstance(changed[0], bool):
        changed = np.array(changed, dtype=object)
    with pytest.raises(TypeError, match=f"^data: angle: expected real numbers, got {said}$"):
        tangible.fit(pendulum(), {**table, "angle": changed}, [DAMPING], sigma=0.001)
    with pytest.raises(ValueError, match="^data: angle: expected finite numbers, or NaN"):
        tangible.fit(pendulum(), {**table, "angle": table["angle"] / 0.0}, [DAMPING], sigma=0.001)


def without_seconds(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: without_seconds(item) for key, item in value.items() if "seconds" not in key}
    return [without_seconds(item) for item in value] if isinstance(value, list) else value


def test_equal_calls_have_equal_results() -> None:
    table = swing(0.05, 0.001, 1)
    one, other = (tangible.fit(pendulum(), table, [DAMPING], sigma=0.001) for _ in range(2))
    assert without_seconds(one.data) == without_seconds(other.data)
    assert one.data["residuals_by_series"][0]["file"] == "data"
    runs = {"slow": table, "fast": {"data": table, "weight": 2.0}}
    named = tangible.fit(pendulum(), None, [DAMPING], sigma=0.001, recordings=runs)
    assert [s["file"] for s in named.data["residuals_by_series"]] == ["recordings/slow", "recordings/fast"]
    listed = tangible.fit(pendulum(), None, [DAMPING], sigma=0.001, recordings=[table])
    assert listed.data["residuals_by_series"][0]["file"] == "recordings/0"
    whole = tangible.fit({"scene": pendulum(), "parameters": [DAMPING],
                          "observations": [{"data": {"body": "bob", **table}, "sigma": 0.001}]})
    assert whole.data["residuals_by_series"][0]["file"] == "observations/0"
    for found in (one, named, listed, whole):
        assert "tangible_" not in json.dumps(found.data) + found.report() + repr(found.predictions)
    with pytest.raises(tangible.TangibleError, match="^recordings/fast: line 2: body: .*bib"):
        tangible.fit(pendulum(), None, [DAMPING], sigma=0.001,
                     recordings={"slow": table, "fast": {"time": [0.0], "bib/x": [0.0]}})


def test_a_kink_is_warned_of_once() -> None:
    """A block that is pushed exactly at the limit of its friction."""
    block = {
        "bodies": [
            {"name": "block", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2.0, "position": [0, 0.1]},
            {"name": "floor", "static": True, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "pairs": [{"bodies": ["block", "floor"], "friction": 0.3}],
        "forces": [{"name": "push", "body": "block", "force": [0.3 * 2 * 9.81, 0]}],
        "simulation": {"dt": 0.01, "duration": 0.5, "stepping": "event"}}
    times = np.linspace(0, 0.5, 26)
    with pytest.warns(tangible.TangibleWarning) as caught:
        found = tangible.fit(block, {"time": times, "x": 0 * times}, ["bodies/block/position/x"], sigma=0.001)
    assert found.certificate is not None and found.certificate.kind == "near_kink"
    for lines in (found.warnings, [str(warning.message) for warning in caught]):
        assert sum("trustworthy" in line for line in lines) == 1


def test_tables_of_pandas() -> None:
    pandas = pytest.importorskip("pandas")
    table = swing(0.05, 0.001, 1)

    def estimate(data: Any) -> float:
        return tangible.fit(pendulum(), data, [DAMPING], sigma=0.001)[DAMPING]

    angle = np.where(np.arange(101) % 5 == 0, np.nan, table["angle"])
    expected = estimate({**table, "angle": angle})
    nullable = pandas.array([None if np.isnan(x) else x for x in angle], dtype="Float64")
    assert estimate(pandas.DataFrame({**table, "angle": nullable})) == expected
    assert estimate({**table, "angle": nullable}) == expected
    assert estimate({**table, "angle": pandas.Series(nullable).astype(object)}) == expected
    since = pandas.to_timedelta(table["time"], unit="s")
    full = estimate(table)
    for times in (since, since.to_numpy(), [x.to_pytimedelta() for x in since]):
        assert estimate({"time": times, "angle": table["angle"]}) == pytest.approx(full, abs=1e-12)
    indexed = pandas.DataFrame({"angle": table["angle"]}, index=pandas.Index(since, name="time"))
    assert estimate(indexed) == pytest.approx(full, abs=1e-12)
    with pytest.raises(ValueError, match=r'^data: expected a column time, got angle; .*rename_axis\("time"\)$'):
        estimate(pandas.DataFrame({"angle": table["angle"]}, index=table["time"]))
    with pytest.raises(TypeError, match="^data: time: expected s or time differences, got dates .*: subtract"):
        estimate({"time": pandas.Timestamp("2020-01-01") + since, "angle": table["angle"]})
    with pytest.raises(TypeError, match=r"^recordings: expected a list of tables .*, got one table: \[table\]$"):
        tangible.fit(pendulum(), None, [DAMPING], sigma=0.001, recordings=pandas.DataFrame(table))


def test_names_of_parameters_are_listed() -> None:
    found = tangible.fit(pendulum(), swing(0.05, 0.001, 1), [DAMPING], sigma=0.001)
    with pytest.raises(KeyError, match=f"nope: expected one of {DAMPING}"):
        found["nope"]
    assert tangible.TangibleError.__doc__ is not None and "expected" in tangible.TangibleError.__doc__
