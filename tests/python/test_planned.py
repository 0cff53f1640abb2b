"""What was planned is run, shown and written."""

from __future__ import annotations

import math
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

PUSH = "forces/push/force/x"


@pytest.mark.parametrize("stepping", ["fixed", "event"])
def test_a_plan_has_the_bits_of_its_rollout(stepping: str) -> None:
    scene = ball(stepping)
    rollout = tangible.Rollout(scene, ["bodies/ball/mass"], [PUSH, "forces/push/torque"], records=range(61))
    controls = np.random.default_rng(0).normal(size=(60, 2))
    start = rollout.default_initial_state
    start[:2] += [0.1, -0.2]
    states = rollout([1.5], start, controls)
    run = tangible.simulate(
        scene, {"bodies/ball/mass": 1.5}, initial_state=start,
        controls={PUSH: controls[:, 0], "forces/push/torque": controls[:, 1]}, certify=True)
    assert np.array_equal(np.concatenate([run.poses, run.twists], axis=2)[:, 0], states)
    by_name = tangible.simulate(scene, initial_state={"ball/x": 0.1}, controls={PUSH: 2.0})
    assert by_name["ball/x"][0] == 0.1
    assert by_name.final["ball/x"] == rollout([1.2], {"ball/x": 0.1}, {PUSH: 2.0})[-1, 0]
    assert run.certificate is not None
    assert run.certificate["margin_min"] == rollout.certificate([1.5], start, controls)["margin_min"]


def test_a_run_goes_on_from_another_one() -> None:
    half = tangible.simulate(ball(duration=0.3))
    rest = tangible.simulate(ball(duration=0.3), initial_state=half)
    assert rest.final["ball/y"] == pytest.approx(tangible.simulate(ball()).final["ball/y"], abs=1e-12)
    assert "0.3" not in half.html() or rest.html() != half.html()


def test_mistakes_of_plans_are_said() -> None:
    for wrong, said in [
        ({"controls": {"forces/f/force/x": np.ones(60)}}, "forces/f"),
        ({"controls": {PUSH: np.ones(3)}}, r"expected shape \(60,\), got \(3,\)"),
        ({"controls": {PUSH: np.ones((2, 60))}}, "expected one run, got a batch of 2"),
        ({"controls": {"bodies/ball/mass": 1.0}}, "expected forces/NAME/force/x"),
        ({"controls": {PUSH: 1.0}, "parameters": {PUSH: 2.0}}, "in parameters or in controls, got both"),
        ({"initial_state": [1.0, 2.0]}, r"initial_state: expected shape \(6,\), got \(2,\)"),
        ({"initial_state": {"x": 1.0}}, "expected one of ball/x"),
        ({"initial_state": {"ball/x": np.nan}}, "initial_state ball/x: expected a finite number, got NaN"),
    ]:
        with pytest.raises(ValueError, match=said):
            tangible.simulate(ball(), **wrong)


def pendulum(kind: str = "event") -> tangible.Scene:
    """A uniform rod that hangs from a pin and swings, and a block on a rail that a spring pulls."""
    scene = tangible.Scene(simulation={"stepping": kind, "dt": 0.002, "duration": 1.0})
    scene.add_body("rod", shape={"box": {"size": [0.1, 1.0]}}, mass=2.0, position=[0, -0.5])
    scene.add_body("block", mass=1.5, inertia=1.0, position=[3, 0])
    scene.add_body("hung", mass=0.5, inertia=1.0, position=[6, 0])
    scene.add_joint("pin", type="revolute", bodies=["rod", "world"], anchor=[0, 0], angle=0.7)
    scene.add_joint("rail", type="prismatic", bodies=["block", "world"], anchor=[3, 0], axis=[1, 0], rate=0.4)
    scene.add_joint("weld", type="weld", bodies=["hung", "world"], anchor=[5, 0])
    return scene


def test_joints_have_coordinates_and_forces() -> None:
    run = tangible.simulate(pendulum())
    assert run.joints.names == ["pin", "rail", "weld"] and run.joints.units == ["rad", "m", ""]
    assert run["pin/coordinate"] == pytest.approx(run["rod/angle"]) and run["pin/coordinate"][0] == 0.7
    assert run["pin/rate"] == pytest.approx(run["rod/omega"])
    assert run["rail/coordinate"] == pytest.approx(0.4 * run.times)
    assert run["rail/rate"] == pytest.approx(0.4) and np.isnan(run.joints.coordinates[:, 2]).all()
    # The pin holds the rod: m a = F + m g, by the mean over a step the change of its momentum.
    momentum = 2.0 * run.twists[:, run.bodies.index("rod"), :2]
    force = np.diff(momentum, axis=0) / 0.002 + [0, 2.0 * 9.81]
    assert run.joints.forces[:, 0, :2] == pytest.approx(force, abs=1e-6 * 20)
    assert run.joints.forces[:, 0, 2] == pytest.approx(0.0, abs=1e-9)
    assert run.joints.forces[:, 1] == pytest.approx(np.tile([0, 1.5 * 9.81, 0], (500, 1)), abs=1e-6)
    # The weld carries the weight 1 m to the right of its anchor.
    assert run.joints.forces[:, 2] == pytest.approx(np.tile([0, 0.5 * 9.81, 0.5 * 9.81], (500, 1)), abs=1e-6)
    assert run.joints.time[-1] == 1.0 and len(run.joints.time) == 500
    with pytest.raises(KeyError, match="JOINT/coordinate"):
        run["weld/coordinate"]


def test_contacts_have_forces() -> None:
    scene = tangible.Scene(ball("fixed", duration=0.105))
    scene.add_force("down", body="ball", force=[0, -3.0])
    run = tangible.simulate(scene.with_parameters(
        {"bodies/ball/position/y": 0.1, "bodies/*/restitution": 0.0, "bodies/ball/velocity/x": 0.0}))
    assert run.contacts.normal_force == pytest.approx(1.2 * 9.81 + 3.0)
    assert run.contacts.length[-1] == pytest.approx(0.005) and run.contacts.length[0] == pytest.approx(0.01)


def test_tables(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    run = tangible.simulate(pendulum(), every=100)
    wide = run.to_dataframe()
    assert list(wide.columns) == run.names and wide.index.name == "time"
    assert np.array_equal(wide["pin/coordinate"], run["pin/coordinate"])
    long = run.to_dataframe(long=True)
    assert list(long.columns) == ["time", "body", "x", "y", "angle", "vx", "vy", "omega"]
    assert len(long) == 3 * len(run.times)
    assert np.array_equal(long[long.body == "block"].vx, run["block/vx"])
    run.to_csv(tmp_path / "run.csv")
    read = pandas.read_csv(tmp_path / "run.csv", float_precision="round_trip")
    assert read.equals(long)


def test_a_file_is_that_of_the_program(tmp_path: Path) -> None:
    import os

    programs = Path(os.environ.get("TANGIBLE_PROGRAMS", "nowhere"))
    if not (programs / "tangible-simulate").exists():
        pytest.skip("tangible-simulate is not built")
    tangible.Scene(ball()).save(tmp_path / "ball.json")
    subprocess.run(
        [programs / "tangible-simulate", tmp_path / "ball.json", f"--out={tmp_path / 'program.csv'}"], check=True)
    tangible.simulate(tmp_path / "ball.json").to_csv(tmp_path / "python.csv")
    assert (tmp_path / "python.csv").read_bytes() == (tmp_path / "program.csv").read_bytes()


def test_a_file_is_written_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = tangible.simulate(ball())
    kept, link = tmp_path / "kept.csv", tmp_path / "link.csv"
    kept.write_text("old")
    link.symlink_to(kept)
    run.to_csv(link)
    assert link.is_symlink() and kept.read_text().startswith("time,")

    def fail(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    kept.write_text("old")
    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match=r"No space left on device: '.*kept\.csv'"):
        run.to_csv(kept)
    assert kept.read_text() == "old" and sorted(p.name for p in tmp_path.iterdir()) == ["kept.csv", "link.csv"]


def test_plots_have_units_and_merge_their_spans() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    run = tangible.simulate(pendulum())
    assert run.plot("rod/x", "rail/coordinate").get_ylabel() == "m"
    mixed = run.plot("rod/angle", "pin/rate", "rod/x")
    assert mixed.get_ylabel() == "rad, rad/s, m"
    assert [text.get_text() for text in mixed.get_legend().get_texts()][1] == "pin/rate (rad/s)"
    bounce = tangible.simulate(ball("fixed"))
    assert len(bounce._borne()) == 1 and bounce._borne()[0][1] == pytest.approx(0.01)
    sliding: dict[str, Any] = ball("fixed", duration=0.1)
    sliding["bodies"][0]["position"] = [0, 0.1]
    assert tangible.simulate(sliding)._borne() == [(0.0, pytest.approx(0.1))]
    assert tangible.simulate(ball(duration=0.2))._borne() == []


def test_ten_thousand_steps_are_plotted_at_once(tmp_path: Path) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    sliding: dict[str, Any] = ball("fixed", duration=20.0, dt=0.002)
    sliding["bodies"][0]["position"] = [0, 0.1]
    run = tangible.simulate(sliding)
    assert len(run.times) == 10001
    tangible.simulate(ball()).plot()

    def seconds() -> float:
        start = time.perf_counter()
        run.plot().figure.savefig(tmp_path / "plot.png")
        return time.perf_counter() - start

    assert min(seconds() for _ in range(3)) < 0.5


def test_a_display_runs_nothing_again(monkeypatch: pytest.MonkeyPatch) -> None:
    run = tangible.simulate(ball(), controls={PUSH: np.linspace(0, 5, 60)}, every=2)
    from tangible import _core

    monkeypatch.setattr(_core, "simulate", None)
    page = run.html()
    assert page == run.html() and page.startswith("<!DOCTYPE html>")
    assert math.isclose(run.times[1], 0.02)
