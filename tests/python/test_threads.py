"""Objects that several threads use at once give the bits of one thread; a forked process uses them too."""

from __future__ import annotations

import json
import multiprocessing
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

PARAMETERS = ["bodies/ball/velocity/x", "bodies/ball/restitution"]


def at_once(call: Callable[[Any], Any], items: list[Any], times: int = 4) -> list[list[Any]]:
    """Results of `call` of each item, several times over, from six threads that start together."""
    with ThreadPoolExecutor(6) as pool:
        barrier = threading.Barrier(6)

        def worker(_: int) -> list[list[Any]]:
            barrier.wait()
            return [[call(item) for item in items] for _ in range(times)]

        return [found for many in pool.map(worker, range(6)) for found in many]


def same(a: Any, b: Any) -> bool:
    return all(np.array_equal(x, y) for x, y in zip(a, b))


@pytest.mark.parametrize("stepping", ["fixed", "event"])
@pytest.mark.parametrize("rows", [None, 20])
@pytest.mark.parametrize("kinks", ["element", "smoothed"])
def test_a_pull_is_the_same_from_many_threads(stepping: str, rows: int | None, kinks: str) -> None:
    scene = ball(stepping)
    if kinks == "smoothed":  # it rests: a kink
        scene["bodies"][0].update(position=[0, 0.1], velocity=[0, 0])
    rollout = tangible.Rollout(scene, PARAMETERS, ["forces/push/force/x"])
    p = rollout.default_parameters
    if rows is not None:
        p = p * (1.0 + 0.1 * np.random.default_rng(0).uniform(-1, 1, size=(rows, 2)))
    smoothing = tangible.Smoothing(samples=4)
    states, pull = rollout.vjp(p, kinks=kinks, smoothing=smoothing)
    bars = [np.broadcast_to(row, states.shape) for row in np.eye(6)]
    expected = [pull(bar) for bar in bars]
    assert any(np.abs(part).max() > 0.01 for found in expected for part in found)
    for found in at_once(pull, bars):
        assert all(same(a, b) for a, b in zip(found, expected))


def test_one_rollout_serves_many_threads() -> None:
    rollout = tangible.Rollout(ball(), PARAMETERS, ["forces/push/force/x"])
    p = rollout.default_parameters
    many = p + 0.01 * np.arange(10)[:, None]

    def everything(shift: float) -> list[Any]:
        jacobians = [
            rollout.jacobian(p + shift, method=method)
            for method in ("adjoint", "tangent", "jet", "jet_implicit", "finite_difference")
        ]
        return [
            rollout(p + shift),
            rollout(many + shift),
            *rollout.jvp((p + shift, None, None), (np.ones(2), None, None)),
            *rollout.vjp(many + shift)[1](np.ones((10, 6))),
            *(j.parameters for j in jacobians),
            *(j.controls for j in jacobians),
            np.array([json.dumps(c) for c in rollout.certificates(many + shift)]),
        ]

    shifts = [0.0, 0.02]
    expected = [everything(shift) for shift in shifts]
    for found in at_once(everything, shifts, 1):
        assert all(same(a, b) for a, b in zip(found, expected))


def test_one_scene_is_simulated_by_many_threads() -> None:
    scene = tangible.Scene(ball())
    expected = tangible.simulate(scene, certify=True)
    for (found,) in at_once(lambda _: tangible.simulate(scene, certify=True), [0]):
        assert np.array_equal(found.poses, expected.poses)
        assert found.certificate == expected.certificate
        assert found.html() == expected.html()


def test_residuals_take_turns() -> None:
    fit = Path(__file__).resolve().parents[2] / "data" / "fits" / "chain.json"
    residuals = tangible.Residuals(fit)
    masses = [[3.0], [6.9], [15.0]]

    def both(mass: list[float]) -> list[Any]:
        return [residuals(mass), residuals.jacobian(mass)]

    expected = [both(mass) for mass in masses]
    assert not np.array_equal(expected[0][0], expected[1][0])
    for found in at_once(both, masses, 1):
        assert all(same(a, b) for a, b in zip(found, expected))


def test_a_mistake_in_one_thread_leaves_the_others_alone() -> None:
    rollout = tangible.Rollout(ball(), PARAMETERS)
    states, pull = rollout.vjp()
    expected = pull(np.ones(6))

    def sometimes_wrong(k: int) -> Any:
        if k % 2 == 0:
            return pull(np.ones(6))
        with pytest.raises(ValueError, match="cotangent: expected shape"):
            pull(np.ones(5))
        with pytest.raises(tangible.TangibleError, match="row 1: .*restitution"):
            rollout([[0.5, 0.8], [0.5, -1.0]])
        return expected

    for found in at_once(sometimes_wrong, [0, 1, 2, 3]):
        assert all(same(one, expected) for one in found)


def in_the_child(rollout: tangible.Rollout, pull: Any, queue: Any) -> None:
    """What a forked process computes with objects that were used before."""
    many = np.tile(rollout.default_parameters, (4, 1))
    queue.put([rollout(many), pull(np.ones(6))[0], rollout.vjp(many)[1](np.ones((4, 6)))[0]])


def test_a_forked_process_goes_on() -> None:
    rollout = tangible.Rollout(ball(), PARAMETERS, threads=2)
    many = np.tile(rollout.default_parameters, (4, 1))
    _, pull = rollout.vjp()
    expected = [rollout(many), pull(np.ones(6))[0], rollout.vjp(many)[1](np.ones((4, 6)))[0]]
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=in_the_child, args=(rollout, pull, queue))
    child.start()
    found = queue.get(timeout=60)
    child.join(60)
    assert child.exitcode == 0 and same(found, expected)
