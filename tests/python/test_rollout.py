"""Rollouts as functions, and their derivatives."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

METHODS = ["adjoint", "tangent", "jet", "jet_implicit", "finite_difference"]
PARAMETERS = ["bodies/ball/mass", "bodies/*/friction", "bodies/ball/position/y"]
CONTROLS = ["forces/push/force/x", "forces/push/torque"]


def driven(**kwargs: Any) -> tuple[tangible.Rollout, dict[str, Any]]:
    rollout = tangible.Rollout(ball(), PARAMETERS, CONTROLS, **kwargs)
    random = np.random.default_rng(5)
    return rollout, {
        "parameters": rollout.default_parameters * 1.01,
        "initial_state": rollout.default_initial_state + 0.01 * random.normal(size=6),
        "controls": 0.3 * random.normal(size=(60, 2)),
    }


def test_the_gradient_of_a_bounce_is_that_of_the_physics(scene: dict[str, Any]) -> None:
    rollout = tangible.Rollout(scene, ["bodies/ball/position/y"])
    u = math.sqrt(2.0 * 9.81)
    # y = e u t - g t^2 / 2 with t = T - u / g after the drop from h = 1 m: dy/dh by hand.
    t = 0.6 - u / 9.81
    expected = (9.81 / u) * (0.8 * t) + (0.8 * u - 9.81 * t) * (-1.0 / u)
    for method in METHODS:
        found = rollout.jacobian(method=method)
        assert found.method == method
        assert found.parameters[1, 0] == pytest.approx(expected, abs=1e-6)
        assert found.certificate["verdict"] == "trustworthy"


def test_a_puck_slides_to_rest_on_a_table_seen_from_above() -> None:
    puck = {
        "name": "puck",
        "shape": {"circle": {"radius": 0.04}},
        "mass": 0.2,
        "position": [0, 0],
        "velocity": [1.2, 0],
        "support": {"friction": 0.2},
    }
    settings = {"stepping": "event", "dt": 0.01, "duration": 1.0}
    scene = {"gravity": [0, 0], "bodies": [puck], "simulation": settings}
    rollout = tangible.Rollout(scene, ["bodies/puck/support/friction", "bodies/puck/velocity/x"])
    slows = 0.2 * 9.81
    way = 1.2**2 / (2.0 * slows)
    for method in METHODS:
        found = rollout.jacobian(method=method)
        assert found.states[:3] == pytest.approx([way, 0.0, 0.0], abs=1e-9)
        assert found.parameters[0] == pytest.approx([-way / 0.2, 1.2 / slows], abs=1e-6)
        assert found.certificate["verdict"] == "trustworthy"


def test_a_wheel_rolls_to_rest() -> None:
    wheel = {
        "name": "wheel",
        "shape": {"circle": {"radius": 0.1}},
        "mass": 2.0,
        "position": [0, 0.1],
        "velocity": [0.5, 0],
        "angular_velocity": -5.0,
        "friction": 0.5,
        "rolling_friction": 0.002,
    }
    floor = {
        "name": "floor",
        "static": True,
        "shape": {"half_plane": {"normal": [0, 1]}},
        "friction": 0.5,
        "rolling_friction": 0.002,
    }
    settings = {"stepping": "event", "dt": 0.02, "duration": 5.0}
    rollout = tangible.Rollout(
        {"bodies": [wheel, floor], "simulation": settings}, ["bodies/*/rolling_friction"]
    )
    # Half of m r^2 is the inertia, so that (3/2) m r a = rho m g.
    slows = 0.002 * 9.81 / (1.5 * 0.1)
    way = 0.5**2 / (2.0 * slows)
    for method in METHODS:
        found = rollout.jacobian(method=method)
        assert found.states[0] == pytest.approx(way, abs=1e-9)
        assert found.states[3:] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
        assert found.parameters[0, 0] == pytest.approx(-way / 0.002, rel=1e-6)


def test_a_certificate_says_how_far_its_derivative_holds() -> None:
    rollout = tangible.Rollout(ball(), ["bodies/ball/position/y", "bodies/ball/mass"])
    assert rollout.certificate().radius == {} and rollout.certificate().growth is None
    found = rollout.certificate(radius=True)
    assert set(found.radius) == {"bodies/ball/position/y", "bodies/ball/mass"}
    # A body that falls alone moves alike with any mass.
    assert found.radius["bodies/ball/mass"] == {"down": None, "up": None}
    down = found.radius["bodies/ball/position/y"]["down"]
    assert down is not None and down > 0.0
    assert "contact of" in found["radius"]["bodies/ball/position/y"]["down_where"]
    assert found.growth is not None and found.growth >= 1.0


def test_derivatives_of_the_discrete_map_say_so() -> None:
    by_steps = tangible.Rollout(ball("fixed"), ["bodies/ball/position/y"])
    p = by_steps.default_parameters
    for method in METHODS:
        found = by_steps.jacobian(method=method).certificate
        assert isinstance(found, tangible.Certificate) and isinstance(found, dict)
        assert found["verdict"] == found.verdict == "of the discrete map: trustworthy"
        assert found["discrete_map"] is True and found.discrete_map
        assert not found and not found.trustworthy
        assert found.verdict_of_map == "trustworthy"
        assert '"stepping": "event"' in found.advice and "contact of ball and floor" in found.advice
    falls = by_steps.certificate(p + 9.0)
    assert falls and falls.trustworthy and not falls.discrete_map and falls.advice == ""
    rows = by_steps.certificates(np.array([p, p + 9.0]))
    assert [bool(row) for row in rows] == [False, True]
    # `kinks` acts on the verdict of the map: an impact is no kink.
    _, pull = by_steps.vjp(p, kinks="raise")
    _, plain = by_steps.vjp(p)
    _, smoothed = by_steps.vjp(p, kinks="smoothed")
    bar = np.ones(6)
    assert np.array_equal(pull(bar)[0], plain(bar)[0])
    assert np.array_equal(smoothed(bar)[0], plain(bar)[0])
    by_events = tangible.Rollout(ball(), ["bodies/ball/position/y"]).certificate()
    assert by_events and by_events.trustworthy and not by_events["discrete_map"]
    run = tangible.simulate(ball("fixed"), certify=True)
    assert run.certificate is not None and run.certificate.discrete_map and not run.certificate


@pytest.mark.parametrize("records", [None, [0, 20, 60]])
def test_products_agree_with_the_jacobian(records: list[int] | None) -> None:
    rollout, at = driven(records=records)
    jacobian = rollout.jacobian(**at)
    states = rollout(**at)
    random = np.random.default_rng(1)
    directions = [random.normal(size=np.shape(at[k])) for k in ("parameters", "initial_state", "controls")]
    same, along = rollout.jvp(tuple(at.values()), tuple(directions))
    expected = (
        jacobian.parameters @ directions[0]
        + jacobian.initial_state @ directions[1]
        + np.einsum("...kc,kc->...", jacobian.controls, directions[2])
    )
    assert np.array_equal(same, states) and np.array_equal(jacobian.states, states)
    assert np.allclose(along, expected, rtol=1e-10, atol=1e-12)
    bar = random.normal(size=states.shape)
    _, pull = rollout.vjp(**at)
    for _ in range(2):  # a tape may be used again
        back = pull(bar)
        assert np.sum(bar * along) == pytest.approx(sum(np.sum(b * d) for b, d in zip(back, directions)))
    with pytest.raises(ValueError, match="cotangent: expected shape"):
        pull(bar[..., :2])


@pytest.mark.parametrize("method", METHODS)
def test_methods_agree(method: str) -> None:
    rollout, at = driven()
    reference = rollout.jacobian(**at, method="tangent")
    other = rollout.jacobian(**at, method=method)
    for name in ("parameters", "initial_state", "controls"):
        a, b = getattr(reference, name), getattr(other, name)
        assert np.abs(a).max() > 1e-3
        assert np.allclose(a, b, rtol=2e-6, atol=2e-6 * np.abs(a).max()), name


def test_batches_are_their_rows_on_any_number_of_threads() -> None:
    rollout, at = driven(threads=1)
    many, _ = driven(threads=3)
    random = np.random.default_rng(7)
    p = at["parameters"] * (1.0 + 0.1 * random.uniform(-1, 1, size=(9, 3)))
    finals = many(p, at["initial_state"], at["controls"])
    assert finals.shape == (9, 6)
    assert np.array_equal(finals, rollout(p, at["initial_state"], at["controls"]))
    for row in range(9):
        assert np.array_equal(finals[row], rollout(p[row], at["initial_state"], at["controls"]))
    states, pull = many.vjp(p, None, np.zeros((9, 60, 2)))
    bars = random.normal(size=states.shape)
    by_p, by_x, by_u = pull(bars)
    assert by_p.shape == (9, 3) and by_x.shape == (9, 6) and by_u.shape == (9, 60, 2)
    _, one = rollout.vjp(p[4], None, np.zeros((60, 2)))
    assert np.array_equal(one(bars[4])[2], by_u[4])
    assert len(many.certificates(p)) == 9


def test_calls_nest_and_chain() -> None:
    rollout = tangible.Rollout(ball(), ["bodies/ball/mass"])
    middle, pull_first = rollout.vjp(None, rollout.default_initial_state)
    end, pull_second = rollout.vjp(None, middle)
    alone = rollout.vjp(None, middle)[1](np.ones(6))[1]
    through = pull_first(pull_second(np.ones(6))[1])[1]
    assert np.array_equal(pull_second(np.ones(6))[1], alone)
    jacobians = [rollout.jacobian(None, x).initial_state for x in (rollout.default_initial_state, middle)]
    assert np.allclose(through, np.ones(6) @ jacobians[1] @ jacobians[0], rtol=1e-9, atol=1e-10)
    assert not np.array_equal(end, middle)


def test_failures_raise_or_are_nan() -> None:
    rollout = tangible.Rollout(ball(), ["bodies/ball/mass"])
    with pytest.raises(tangible.TangibleError, match="bodies/ball/mass: expected a number > 0"):
        rollout([-1.0])
    with pytest.raises(tangible.TangibleError, match="row 1: bodies/ball/mass"):
        rollout([[1.0], [-1.0]])
    states = rollout([[1.0], [-1.0]], on_failure="nan")
    assert np.isfinite(states[0]).all() and np.isnan(states[1]).all()
    _, pull = rollout.vjp([[1.0], [-1.0]], on_failure="nan")
    assert np.isnan(pull(np.ones((2, 6)))[0][1]).all()
    for wrong, message in [
        ({"parameters": [1.0, 2.0]}, "parameters: expected shape"),
        ({"initial_state": [0.0]}, "initial_state: expected shape"),
        ({"controls": np.zeros((3, 1))}, "controls: expected shape"),
        ({"parameters": np.ones((2, 1)), "initial_state": np.ones((3, 6))}, "leading axes"),
    ]:
        with pytest.raises(ValueError, match=message):
            rollout(**wrong)
    with pytest.raises(tangible.TangibleError, match="matches no number"):
        tangible.Rollout(ball(), ["bodies/bal/mass"])
    with pytest.raises(tangible.TangibleError, match="control bodies/ball/mass: expected forces"):
        tangible.Rollout(ball(), controls=["bodies/ball/mass"])
    with pytest.raises(ValueError, match="method: expected auto"):
        rollout.jacobian(method="adjiont")


def test_several_threads_may_call_one_rollout() -> None:
    rollout, at = driven(threads=1)
    expected = rollout(**at)
    wrong: list[int] = []

    def work(k: int) -> None:
        for _ in range(20):
            if not np.array_equal(rollout(**at), expected):
                wrong.append(k)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_ctrl_c_ends_a_long_run() -> None:
    import os
    import signal
    import time

    long = tangible.Rollout(ball(duration=1e5))
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        long()
    assert time.monotonic() - start < 5.0


def test_a_rollout_keeps_its_scene() -> None:
    scene = tangible.Scene(ball())
    rollout = tangible.Rollout(scene, PARAMETERS)
    text, states = repr(rollout), rollout()
    scene.add_body("late", shape={"circle": {"radius": 1}}, mass=1, position=[9, 9])
    assert repr(rollout) == text and np.array_equal(rollout(), states)
    assert "bodies/late/mass" not in rollout.scene.parameters()
    assert "bodies/late/mass" in tangible.Rollout(scene, PARAMETERS).scene.parameters()


@pytest.mark.parametrize("wrong", [
    np.array([True, False, True]), [True, False, True], np.ones(3, dtype=complex), [1.0, None, 1.0],
    ["1", "2", "3"], np.array([1, 2, 3], dtype="datetime64[s]"), [b"1", b"2", b"3"],
])
def test_what_are_no_real_numbers_is_refused(wrong: Any) -> None:
    rollout, at = driven()
    one_state = [*wrong, *wrong]
    with pytest.raises(TypeError, match="^parameters: expected real numbers, got"):
        rollout(wrong)
    with pytest.raises(TypeError, match="^initial_state: expected real numbers, got"):
        rollout.vjp(initial_state=one_state)
    with pytest.raises(TypeError, match="^controls: expected real numbers, got"):
        rollout.jacobian(controls=[[x, x] for x in wrong])
    with pytest.raises(TypeError, match="^tangent of parameters: expected real numbers, got"):
        rollout.jvp((None, None, None), (wrong, None, None))
    with pytest.raises(TypeError, match="^cotangent: expected real numbers, got"):
        rollout.vjp()[1](one_state)


def test_arrays_of_any_layout_give_the_same_bits() -> None:
    rollout, at = driven()
    random = np.random.default_rng(3)
    p = at["parameters"] * (1.0 + 0.01 * random.normal(size=(4, 3)))
    u = 0.3 * random.normal(size=(4, 60, 2))
    bars = random.normal(size=(4, 6))
    states, pull = rollout.vjp(p, None, u)
    expected = [states, *pull(bars)]

    def strided(a: Any) -> Any:
        wide = np.full((*a.shape[:-1], 2 * a.shape[-1]), np.nan)
        wide[..., ::2] = a
        return wide[..., ::2]

    def frozen(a: Any) -> Any:
        copy = a.copy()
        copy.flags.writeable = False
        return copy

    layouts = [np.asfortranarray, strided, frozen, lambda a: a[::-1].copy()[::-1],
               lambda a: a.astype(">f8"), lambda a: a.tolist(), lambda a: a.astype(np.longdouble)]
    for layout in layouts:
        states, pull = rollout.vjp(layout(p), None, layout(u))
        assert all(np.array_equal(a, b) for a, b in zip([states, *pull(layout(bars))], expected))
    # What is given may be changed afterwards: a tape has copies.
    q = p.copy()
    _, pull = rollout.vjp(q, None, u)
    q[:] = np.nan
    assert all(np.array_equal(a, b) for a, b in zip(pull(bars), expected[1:]))
    # Whole numbers are exact, and results are never whole numbers.
    whole = rollout(np.array([2, 1, 3]))
    assert whole.dtype == np.float64 and np.array_equal(whole, rollout([2.0, 1.0, 3.0]))
    single = rollout(np.array([1.1, 0.3, 1.2], dtype=np.float32))
    assert np.array_equal(single, rollout([float(np.float32(x)) for x in (1.1, 0.3, 1.2)]))
