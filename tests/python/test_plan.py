"""Plans and runs over a receding horizon are those of tangible-control."""

from __future__ import annotations

import copy
import json
import os
import pickle
import subprocess
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from test_interrupts import interrupted

CONTROL = Path(__file__).resolve().parents[2] / "data" / "control"
EFFORT = "joints/rail/effort"


def pole(length: float = 1.0, duration: float = 1.0) -> dict[str, Any]:
    """A cart with a pole of this length that leans."""
    return {
        "name": "pole",
        "bodies": [
            {"name": "cart", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0]},
            {"name": "pole", "shape": {"box": {"size": [0.05, length]}}, "mass": 0.2, "position": [0, length / 2]},
        ],
        "joints": [
            {"name": "rail", "type": "prismatic", "bodies": ["cart", "world"], "anchor": [0, 0], "axis": [1, 0]},
            {"name": "pin", "type": "revolute", "bodies": ["pole", "cart"], "anchor": [0, 0], "angle": 0.4},
        ],
        "no_contact": [["cart", "pole"]],
        "simulation": {"dt": 0.02, "duration": duration, "stepping": "event"},
    }


def balance(**keys: Any) -> dict[str, Any]:
    """The pole is to stand, and the cart to be where it was."""
    return {
        "scene": tangible.Scene(pole()),
        "controls": [{"path": EFFORT, "low": -20, "high": np.float64(20)}],
        "cost": [
            {"control": EFFORT, "weight": 0.01},
            {"state": "pole/angle", "weight": 10},
            {"state": "cart/x", "weight": 1},
            {"state": "pole/angle", "weight": 100, "at": "end"},
            {"state": "pole/omega", "weight": 10, "at": "end"},
        ],
        "mpc": {"duration": 0.4, "horizon": 0.8},
        **keys,
    }


def program(folder: Path, problem: Path, *flags: str) -> dict[str, Any]:
    """What tangible-control writes, but for its times; with plan.csv, motion.csv and page.html beside."""
    file = Path(os.environ.get("TANGIBLE_PROGRAMS", "nowhere")) / "tangible-control"
    if not file.exists():
        pytest.skip("tangible-control is not built")
    outputs = [f"--{flag}={folder / name}" for flag, name in (
        ("plan", "plan.csv"), ("trajectory", "motion.csv"), ("view", "page.html"))]
    text = subprocess.run([file, problem, *outputs, *flags], check=True, capture_output=True, text=True).stdout
    return without_times(json.loads(text))


def without_times(result: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in result.items() if not key.startswith("cpu_seconds")}


def file_of(folder: Path, problem: dict[str, Any]) -> Path:
    problem["scene"].save(folder / "model.json")
    (folder / "problem.json").write_text(
        json.dumps({**problem, "scene": "model.json"}, default=float), encoding="utf-8")
    return folder / "problem.json"


@pytest.fixture(scope="module")
def swing() -> tangible.Plan:
    return tangible.plan(CONTROL / "pendulum_swing_up.json")


def test_a_plan_is_that_of_the_program(swing: tangible.Plan, tmp_path: Path) -> None:
    assert without_times(swing.data) == program(tmp_path, CONTROL / "pendulum_swing_up.json")
    swing.save(tmp_path / "own.csv")
    swing.to_csv(tmp_path / "own_motion.csv")
    swing.show(tmp_path / "own.html")
    for own, other in (("own.csv", "plan.csv"), ("own_motion.csv", "motion.csv"), ("own.html", "page.html")):
        assert (tmp_path / own).read_bytes() == (tmp_path / other).read_bytes(), own
    assert swing.html() in pickle.loads(pickle.dumps(swing)).html()
    assert copy.deepcopy(swing).cost == swing.cost


def test_a_plan_says_what_it_is(swing: tangible.Plan) -> None:
    steps = len(swing.times) - 1
    assert swing.status == "converged" and swing.planned_status == "converged" and swing.holds
    assert list(swing.controls) == swing.paths == ["joints/motor/effort"]
    assert swing.controls["joints/motor/effort"].shape == (steps,)
    assert swing.states.shape == (steps + 1, len(swing.names))
    assert swing["rod/angle"][-1] == swing.final_state["rod/angle"] == pytest.approx(np.pi, abs=0.05)
    assert swing.certificate and "trustworthy" in str(swing.certificate)
    assert swing.motion.cost == pytest.approx(swing.cost, rel=1e-4)
    assert swing.cost < swing.motion.cost_of_nothing
    assert swing.iterations[-1]["cost"] < swing.iterations[0]["cost"]
    assert repr(swing).startswith("Plan(converged, cost=0.1")
    with pytest.raises(KeyError, match="expected one of joints/motor/effort, rod/x"):
        swing["rod/z"]


def test_a_plan_is_simulated_with_the_bits_of_its_replay(swing: tangible.Plan) -> None:
    motion = swing.motion
    run = tangible.simulate(motion.scene, controls=motion.controls, every=motion.every)
    states = np.concatenate([run.poses, run.twists], axis=2).reshape(len(run.times), -1)
    assert np.array_equal(states, motion.states)
    assert np.array_equal(swing.simulate()["rod/angle"], run["rod/angle"])
    assert run.final == motion.final_state
    # The plan itself is made of single steps: the same to rounding.
    planned = tangible.simulate(swing.scene, controls=swing.controls)
    assert planned["rod/angle"] == pytest.approx(swing["rod/angle"], abs=1e-9)
    assert planned.times == pytest.approx(swing.times, abs=1e-12)


def test_a_plan_is_drawn(swing: tangible.Plan) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert swing.plot().get_ylabel() == "N m"
    assert swing.plot("rod/angle", "rod/omega").get_ylabel() == "rad, rad/s"
    assert len(swing.plot("cost").get_lines()[0].get_ydata()) == len(swing.iterations)
    assert swing._repr_html_().startswith("<iframe") and "Controls" in swing.html()
    with pytest.raises(RuntimeError, match="expected a file"):
        swing.show()


def test_a_dict_is_a_problem(tmp_path: Path) -> None:
    problem = balance(starts={"count": 3, "seed": 1}, max_iterations=100)
    plans = [tangible.plan(problem, threads=threads) for threads in (1, 2)]
    assert plans[0].holds and without_times(plans[0].data) == without_times(plans[1].data)
    assert without_times(plans[0].data) == program(tmp_path, file_of(tmp_path, problem))
    assert tangible.plan({**problem, "scene": pole()}).cost == plans[0].cost
    named = tangible.plan({**problem, "scene": "model.json"}, folder=tmp_path)
    assert named.cost == plans[0].cost


def test_a_plan_goes_on_from_another_one(swing: tangible.Plan, tmp_path: Path) -> None:
    swing.save(tmp_path / "swing.csv")
    problem = CONTROL / "pendulum_swing_up.json"
    values = {path: list(column) for path, column in swing.controls.items()}
    for initial in (swing, values, {"file": str(tmp_path / "swing.csv")}):
        again = tangible.plan(problem, initial=initial)
        assert len(again.iterations) == 0 and again.cost == swing.cost
    whole = json.loads(problem.read_text(encoding="utf-8"))
    assert tangible.plan({**whole, "initial": swing}, folder=CONTROL).cost == swing.cost
    with pytest.raises(ValueError, match="initial: expected controls of joints/motor/effort, got a"):
        tangible.plan(problem, initial={"a": [1.0]})
    with pytest.raises(tangible.TangibleError, match="^initial: expected a row for each of the horizon's"):
        tangible.plan(problem, initial={"joints/motor/effort": [0.0, 1.0]})


def test_a_plan_that_does_not_hold_is_said() -> None:
    # A ball that no control touches.
    scene = tangible.Scene(pole())
    scene.add_body("ball", shape={"circle": {"radius": 0.1}}, mass=1, position=[5, 5])
    problem = balance(scene=scene, cost=[{"state": "ball/x", "weight": 1, "at": "end"}])
    with pytest.raises(tangible.TangibleError, match="^plan: no_effect_on_target: the controls have no effect"):
        tangible.plan(problem)
    kept = tangible.plan(problem, on_failure="return")
    assert kept.status == "no_effect_on_target" and not kept.holds and "ball/x" in kept.message
    assert repr(kept).startswith("Plan(no_effect_on_target")


@pytest.mark.parametrize(("change", "said"), [
    ({"controls": []}, "^plan: /controls: expected at least one control, got none$"),
    ({"controls": [{"path": "joints/x/effort"}]}, "^plan: /controls/0/path: parameter joints/x/effort"),
    ({"cost": [{"state": "a/x"}]}, "^plan: /cost/0/state: expected a number of the state"),
    ({"horizon": -1}, "^plan: /horizon: expected a number > 0, got -1$"),
    ({"horizon": float("nan")}, "^plan: /horizon: expected a finite number, got NaN$"),
    ({"colour": 1}, "^plan: /colour: unknown key"),
    ({"scene": {"bodies": [{"name": "a"}]}}, "^scene: /bodies/0/mass: missing"),
    ({"initial": {EFFORT: [30.0] * 50}}, "^initial: line 2: joints/rail/effort: expected a number from low to high, got 30"),
])
def test_mistakes_are_one_line(change: dict[str, Any], said: str) -> None:
    with pytest.raises(tangible.TangibleError, match=said) as caught:
        tangible.plan(balance(**change))
    assert "\n" not in str(caught.value)


def test_mistakes_of_arguments() -> None:
    with pytest.raises(tangible.TangibleError, match="^nowhere.json: cannot be read"):
        tangible.plan("nowhere.json")
    with pytest.raises(ValueError, match="threads: expected a whole number from 0 to 256, got -1"):
        tangible.plan(balance(), threads=-1)
    with pytest.raises(ValueError, match="on_failure: expected raise or return"):
        tangible.plan(balance(), on_failure="x")
    with pytest.raises(ValueError, match="budget: expected a time > 0"):
        tangible.mpc(balance(), budget=0.0)
    without = balance()
    del without["mpc"]
    with pytest.raises(tangible.TangibleError, match="^plan: /mpc: missing"):
        tangible.mpc(without)
    other = tangible.Scene(pole(), simulation={"dt": 0.01})
    with pytest.raises(tangible.TangibleError, match="^pole: /simulation/dt: expected the problem's, 0.02"):
        tangible.mpc(balance(), other)


def test_callbacks(capfd: pytest.CaptureFixture[str]) -> None:
    said: list[dict[str, Any]] = []
    made = tangible.plan(balance(), callback=said.append, progress=True)
    assert [one["iteration"] for one in said] == list(range(len(made.iterations)))
    assert [one["cost"] for one in said] == [one["cost"] for one in made.iterations]
    assert "start 0, iteration 0, cost" in capfd.readouterr().err

    def end(_: dict[str, Any]) -> None:
        raise RuntimeError("enough")

    for keys in ({}, {"starts": 4}):
        with pytest.raises(RuntimeError, match="enough"):
            tangible.plan(balance(**keys), callback=end, threads=2)
    steps: list[dict[str, Any]] = []
    run = tangible.mpc(balance(), callback=steps.append)
    assert [one["step"] for one in steps] == list(range(20)) and steps[0]["steps"] == 20
    assert steps[-1]["cost"] <= run.cost
    with pytest.raises(RuntimeError, match="enough"):
        tangible.mpc(balance(), callback=end)


def test_a_longer_plant_is_controlled(tmp_path: Path) -> None:
    longer = tangible.Scene(pole(1.2))
    problem = balance(mpc={"duration": 2, "horizon": 0.8})
    run = tangible.mpc(problem, longer)
    longer.save(tmp_path / "longer.json")
    found = program(tmp_path, file_of(tmp_path, problem), "--mpc", f"--plant={tmp_path / 'longer.json'}")
    assert without_times(run.data) == found
    assert run.status == "done" and run.plans == run.states_projected == 100 and run.plans_failed == 0
    assert run.joint_error_max == pytest.approx(0.1, abs=1e-6)
    assert abs(run["pole/angle"][-1]) < 0.1 < abs(run["pole/angle"][0])
    assert run.html() == (tmp_path / "page.html").read_text(encoding="utf-8")
    again = tangible.simulate(run.scene, controls=run.controls)
    assert again["pole/angle"] == pytest.approx(run["pole/angle"], abs=1e-6)
    assert repr(run).startswith("MpcResult(done, cost=")
    assert pickle.loads(pickle.dumps(run)).cost == run.cost
    pytest.importorskip("matplotlib")
    assert run.plot("pole/angle", EFFORT).get_ylabel() == "rad, N"


def test_plans_are_interrupted_and_release_the_lock() -> None:
    long = balance(starts={"count": 1000}, max_iterations=100000, gradient_tolerance=1e-30)
    for threads in (1, 2):
        interrupted(lambda: tangible.plan(long, threads=threads))
    interrupted(lambda: tangible.mpc(balance(mpc={"duration": 1000, "horizon": 0.8})))
    results: list[float] = []
    workers = [threading.Thread(target=lambda: results.append(tangible.plan(balance()).cost)) for _ in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(results) == 3 and len(set(results)) == 1


def test_plans_without_an_effect_on_the_target_are_said() -> None:
    cart = {
        "gravity": [0, 0],
        "bodies": [{"name": "c", "mass": 2, "inertia": 1, "position": [0, 0]}],
        "forces": [{"name": "f", "body": "c", "force": [0, 0]}],
        "simulation": {"dt": 0.1, "duration": 1, "stepping": "event"},
    }

    def run(coordinate: str, horizon: float) -> tangible.MpcResult:
        return tangible.mpc(
            {
                "scene": tangible.Scene(cart),
                "controls": [{"path": "forces/f/force/x", "low": -20, "high": 20}],
                "cost": [
                    {"state": f"c/{coordinate}", "target": 1, "weight": 100},
                    {"control": "forces/f/force/x", "weight": 0.01},
                ],
                "horizon": 0.1,
                "mpc": {"duration": 1, "horizon": horizon},
            }
        )

    # The cost of one step counts its first state alone; a force along x does not lift.
    assert run("x", 0.1).status == "no_effect_on_target"
    lifted = run("y", 0.5)
    assert lifted.status == "no_effect_on_target"
    assert "no effect on" in lifted.data["message"]
    assert run("x", 0.2).status == "done"


def test_a_plan_goes_on_from_a_file_that_another_saved(tmp_path: Path) -> None:
    problem = balance()
    del problem["mpc"]
    first = tangible.plan(problem)
    first.save(tmp_path / "plan.csv")
    for initial in (str(tmp_path / "plan.csv"), tmp_path / "plan.csv"):
        assert tangible.plan(problem, initial=initial).cost == pytest.approx(first.cost, rel=1e-9)
