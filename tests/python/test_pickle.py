"""Objects go to other processes and files, and are the same there."""

from __future__ import annotations

import copy
import io
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

FIT = Path(__file__).resolve().parents[2] / "data" / "fits" / "chain.json"
PARAMETERS = ["bodies/ball/velocity/x", "bodies/*/friction"]


def through_pickle(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


WAYS: list[Callable[[Any], Any]] = [through_pickle, copy.deepcopy, copy.copy]


@pytest.mark.parametrize("way", WAYS)
def test_a_scene_is_another_one(way: Callable[[Any], Any], scene: dict[str, Any]) -> None:
    for kept in (
        tangible.Scene(scene),
        tangible.Scene(FIT.parents[1] / "scenes" / "bouncing_ball.json"),
        tangible.Scene(scene).with_parameters({"bodies/ball/mass": 3.0}),
    ):
        text = kept.to_json()
        other = way(kept)
        assert other.to_json() == text and other.to_dict() == kept.to_dict()
        other.add_body("late", mass=1, inertia=1, position=[9, 9])
        assert kept.to_json() == text and "late" in other.to_json()
    wrong = way(tangible.Scene(bodies=[{"name": "a"}]))
    with pytest.raises(tangible.TangibleError, match="mass: missing"):
        wrong.to_json()


@pytest.mark.parametrize("way", WAYS)
def test_signals_go_along(way: Callable[[Any], Any], scene: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "push.csv").write_text("time,x,y\n0,1,0.1\n0.3,2,0\n")
    scene["forces"][0]["force"] = {"file": "push.csv", "interpolation": "linear"}
    built = tangible.Scene(scene, folder=tmp_path)
    run = tangible.simulate(built)
    others = way(built), way(run), way(tangible.Rollout(built, PARAMETERS))
    if way is through_pickle:
        (tmp_path / "push.csv").unlink()
    assert np.array_equal(tangible.simulate(others[0]).poses, run.poses)
    assert others[1].html() == run.html()
    assert others[2]()[0] == run.final["ball/x"]


@pytest.mark.parametrize("way", WAYS)
def test_rollouts_and_runs_have_the_same_bits(way: Callable[[Any], Any], scene: dict[str, Any]) -> None:
    records = range(0, 61, 20)
    rollout = tangible.Rollout(scene, PARAMETERS, ["forces/push/force/x"], records=records, threads=1)
    other = way(rollout)
    assert repr(other) == repr(rollout) and other.threads == 1
    controls = np.random.default_rng(0).normal(size=(60, 1))
    assert np.array_equal(other([1, 0.2], None, controls), rollout([1, 0.2], None, controls))
    found, again = rollout.jacobian([1, 0.2]), way(other).jacobian([1, 0.2])
    assert np.array_equal(found.controls, again.controls) and again.certificate == found.certificate
    assert way(found).certificate == found.certificate
    run = tangible.simulate(scene, certify=True)
    same = way(run)
    assert np.array_equal(same.poses, run.poses) and same.events.kind == run.events.kind
    assert same.certificate == run.certificate and same.html() == run.html()
    assert way(tangible.Smoothing(seed=3)) == tangible.Smoothing(seed=3)


@pytest.mark.parametrize("way", WAYS)
def test_fits_and_residuals(way: Callable[[Any], Any]) -> None:
    residuals = tangible.Residuals(FIT)
    other = way(residuals)
    assert other.names == residuals.names
    assert np.array_equal(other([6.0]), residuals([6.0]))
    result = tangible.fit(FIT)
    same = way(result)
    assert same.estimates == result.estimates and same.report() == result.report()
    assert str(way(tangible.TangibleError("wrong"))) == "wrong"


@pytest.mark.parametrize("way", WAYS)
def test_simulations_before_their_first_step(way: Callable[[Any], Any], scene: dict[str, Any]) -> None:
    def made() -> tangible.Simulation:
        return tangible.Simulation(
            scene, ["forces/push/force/x"], batch=3, noise={"ball/x": 0.1, "bodies/ball/restitution": 0.01},
            domains={"bodies/ball/mass": [1.0, 2.0]}, on_failure="nan", threads=1)

    fresh = way(made())
    assert np.isnan(fresh.state).all() and repr(fresh) == repr(made())
    assert np.array_equal(fresh.reset(seed=3), made().reset(seed=3))
    simulation = made()
    simulation.reset(seed=3, rows=[0, 2])
    other = way(simulation)
    assert np.array_equal(other.state, simulation.state, equal_nan=True) and np.isnan(other.state[1]).all()
    for one in (simulation, other):
        one.step([0.5], steps=50)
    assert np.array_equal(other.state, simulation.state, equal_nan=True) and not np.isnan(other.state[[0, 2]]).any()
    # They are two: one that is reset leaves the other.
    other.reset(seed=3)
    assert simulation.steps.tolist() != other.steps.tolist()
    with pytest.raises(TypeError, match="^Simulation: expected one before its first step, .* pickle its `scene` and"):
        way(simulation)


def test_a_layer_can_be_saved(scene: dict[str, Any], tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    from tangible.torch import RolloutLayer

    layer = RolloutLayer(scene, ["bodies/ball/mass", "bodies/ball/velocity/x"])
    with torch.no_grad():
        layer.q += 0.1
    assert "bodies/ball/velocity/x=0.6" in repr(layer)
    memory = io.BytesIO()
    torch.save(layer, memory)
    memory.seek(0)
    for other in (torch.load(memory), copy.deepcopy(layer)):
        assert torch.equal(other(), layer())
        other().sum().backward()
        assert other.q.grad is not None and layer.q.grad is None


def test_another_process_reads_it(scene: dict[str, Any], tmp_path: Path) -> None:
    rollout = tangible.Rollout(scene, PARAMETERS)
    (tmp_path / "rollout.pickle").write_bytes(pickle.dumps(rollout))
    code = "import pickle, sys; print(repr(pickle.load(open(sys.argv[1], 'rb'))()[0]))"
    said = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "rollout.pickle"],
        capture_output=True, text=True, check=True, env=dict(os.environ),
    )
    assert said.stdout.strip() == repr(rollout()[0])
