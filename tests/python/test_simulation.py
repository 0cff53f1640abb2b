"""A step at a time has the bits of a long run, one row or many."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
import tangible

from conftest import ball

PUSH = "forces/push/force/x"
DATA = Path(__file__).resolve().parents[2] / "data"


@pytest.mark.parametrize("stepping", ["fixed", "event"])
def test_the_bits_of_a_long_run(stepping: str) -> None:
    scene = ball(stepping, dt=0.007)
    rollout = tangible.Rollout(scene, ["bodies/ball/mass"], [PUSH], records=range(87))
    controls = np.random.default_rng(0).normal(size=(86, 1))
    states = rollout([1.5], {"ball/x": 0.2}, controls)
    simulation = tangible.Simulation(scene, [PUSH], parameters=["bodies/ball/mass"])
    for _ in range(2):  # a reset begins anew
        found = [simulation.reset({"ball/x": 0.2}, parameters=[1.5])]
        found += [simulation.step(u) for u in controls]
        # The run's last step is shorter: 0.6 s are no multiple of 7 ms.
        assert np.array_equal(found[:-1], states[:-1])
        assert simulation.steps == 86 and simulation.time == pytest.approx(86 * 0.007)
    simulation.reset(parameters={"bodies/ball/mass": 1.5}, state={"ball/x": 0.2})
    assert np.array_equal(simulation.step({PUSH: 0.0}, steps=10), [
        simulation.reset({"ball/x": 0.2}, parameters=[1.5]), *[simulation.step() for _ in range(10)]][-1])
    assert simulation.outputs == rollout.outputs and simulation.controls == [PUSH]


def test_a_simulation_keeps_its_scene() -> None:
    scene = tangible.Scene(ball())
    simulation = tangible.Simulation(scene)
    scene.add_body("late", shape={"circle": {"radius": 1}}, mass=1, position=[9, 9])
    assert "bodies/late/mass" not in simulation.scene.parameters()


@pytest.mark.parametrize("file", ["scenes/chain.json", "event_scenes/chain.json", "scenes/bouncing_ball.json"])
def test_scenes_of_the_repository(file: str) -> None:
    rollout = tangible.Rollout(DATA / file, records=range(0, 101, 10))
    simulation = tangible.Simulation(DATA / file)
    simulation.reset()
    for state in rollout()[1:]:
        assert np.array_equal(simulation.step(steps=10), state)


def test_it_goes_on_beyond_the_duration() -> None:
    simulation = tangible.Simulation(ball("event", duration=0.1))
    simulation.reset()
    assert np.array_equal(simulation.step(steps=60), tangible.Rollout(ball("event"))())


def test_a_batch_has_the_bits_of_single_ones() -> None:
    actions = np.random.default_rng(1).normal(size=(20, 5, 1))
    starts = np.tile(tangible.Rollout(ball()).default_initial_state, (5, 1))
    starts[:, 1] += np.arange(5) * 0.1
    single = tangible.Simulation(ball(), [PUSH])
    for threads in (1, 2):
        many = tangible.Simulation(ball(), [PUSH], batch=5, threads=threads)
        assert np.isnan(many.state).all() and many.state.shape == (5, 6)
        many.reset(starts)
        for action in actions:
            states = many.step(action)
        for row in range(5):
            single.reset(starts[row])
            for action in actions:
                state = single.step(action[row])
            assert np.array_equal(states[row], state)
        # Some rows begin anew, the others go on.
        many.reset(rows=[1, 3])
        assert many.steps.tolist() == [20, 0, 20, 0, 20]
        assert np.array_equal(many.state[0], states[0])
        assert many.state[1, 1] == 1.1
        # One action for all.
        assert many.step([0.5]).shape == (5, 6)


def test_seeds_noise_and_domains() -> None:
    masses = np.array([1.0, 2.0, 3.0])
    simulation = tangible.Simulation(
        ball(), [PUSH], batch=200, noise={"ball/vx": 0.1, "bodies/ball/restitution": 0.01},
        domains={"bodies/ball/mass": masses, "bodies/ball/position/y": masses})
    first = simulation.reset(seed=4).copy()
    assert set(first[:, 1]) == {1.0, 2.0, 3.0} and np.std(first[:, 3]) == pytest.approx(0.1, rel=0.2)
    assert first[:, 3].mean() == pytest.approx(0.5, abs=0.03) and (first[:, 4] == 0).all()
    other = simulation.reset().copy()
    assert not np.array_equal(other, first)
    assert np.array_equal(simulation.reset(seed=4), first)
    # A domain's values go together: a push moves those that begin lower faster.
    speeds = simulation.step([10.0])[:, 3] - first[:, 3]
    assert speeds == pytest.approx(0.1 / first[:, 1])


def test_touches_are_the_contacts_of_the_step() -> None:
    simulation = tangible.Simulation(ball("event"))
    simulation.reset()
    assert simulation.touches == [{}]
    simulation.step(steps=45)
    assert simulation.touches == [{}]
    simulation.step()
    (pair, impulse), = simulation.touches[0].items()
    assert pair == ("ball", "floor") and impulse == pytest.approx(1.2 * 1.8 * np.sqrt(2 * 9.81))


def test_mistakes_are_said() -> None:
    simulation = tangible.Simulation(ball(), [PUSH])
    with pytest.raises(tangible.TangibleError, match="expected a reset before a step"):
        simulation.step()
    simulation.reset()
    for wrong, said in [([1.0, 2.0], r"action: expected shape \(1,\)"), ({"x": 1.0}, "expected one of forces/push"),
                        ([np.nan], "action forces/push/force/x: expected a finite number, got NaN"), ([[1.0]], r"action: expected shape \(1,\)")]:
        with pytest.raises(ValueError, match=said):
            simulation.step(wrong)
    with pytest.raises(ValueError, match="state: expected finite numbers"):
        simulation.reset({"ball/x": np.inf})
    with pytest.raises(tangible.TangibleError, match="noise|matches no number"):
        tangible.Simulation(ball(), noise={"ball/z": 1.0})
    with pytest.raises(ValueError, match=r"domains: expected arrays of one shape \(D,\)"):
        tangible.Simulation(ball(), domains={"bodies/ball/mass": [1.0], "bodies/ball/friction": [0.1, 0.2]})
    many = tangible.Simulation(ball(), parameters=["bodies/ball/mass"], batch=2, on_failure="nan")
    states = many.reset(parameters=[[1.0], [-1.0]])
    assert np.isfinite(states[0]).all() and np.isnan(states[1]).all()
    assert np.isnan(many.step()[1]).all() and np.isfinite(many.reset()).all()


def test_a_step_is_cheap() -> None:
    simulation = tangible.Simulation(ball("fixed"), [PUSH])
    simulation.reset()

    def seconds() -> float:
        start = time.process_time()
        for _ in range(500):
            simulation.step([0.1])
        return (time.process_time() - start) / 500

    assert min(seconds() for _ in range(5)) < 60e-6


def two_bodies() -> tangible.Scene:
    """Two bodies that fall from different heights, each with a force of its own."""
    scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.1, "duration": 1.0})
    for name, y, force in (("a", 0.0, 3.0), ("b", 1.0, 1.0)):
        scene.add_body(name, mass=1, inertia=1, position=[0, y])
        scene.add_force(f"f{name}", body=name, force=[force, 0])
    return scene


def test_what_is_left_out_stays_as_it_is_where_the_numbers_of_a_path_differ() -> None:
    heights, forces = "bodies/*/position/y", "forces/f*/force/x"
    fallen = -0.5 * 9.81
    simulation = tangible.Simulation(two_bodies(), [forces], parameters=[heights, "bodies/a/velocity/x"])
    assert simulation.reset()[[1, 7]].tolist() == [0.0, 1.0]
    assert simulation.step(steps=10)[[0, 1, 6, 7]] == pytest.approx([1.5, fallen, 0.5, 1.0 + fallen])
    assert simulation.reset(parameters={heights: 2.0})[[1, 7]].tolist() == [2.0, 2.0]
    assert simulation.step([2.0], steps=10)[[0, 6]] == pytest.approx([1.0, 1.0])
    assert simulation.reset(parameters={"bodies/a/velocity/x": 1.0})[[1, 7]].tolist() == [0.0, 1.0]
    assert simulation.step(steps=10)[[0, 6]] == pytest.approx([2.5, 0.5])
    rollout = tangible.Rollout(two_bodies(), [heights, "bodies/a/velocity/x"], [forces])
    assert rollout.default_parameters.tolist() == [0.0, 0.0]
    for given in (None, {"bodies/a/velocity/x": 0.0}):
        assert rollout(given)[[1, 7]] == pytest.approx([fallen, 1.0 + fallen])
    # The value of one of them is set like any other.
    assert rollout([0.0, 0.0])[[1, 7]] == pytest.approx([fallen, fallen])
    assert rollout([[0.0, 0.0], [1e-9, 0.0]])[:, 7] == pytest.approx([fallen, fallen])
    assert rollout([5.0, 0.0])[[1, 7]] == pytest.approx([5.0 + fallen] * 2)
    assert rollout()[[0, 6]] == pytest.approx([1.5, 0.5])  # the last call has left nothing
    with pytest.raises(tangible.TangibleError, match="velocity/x: expected a finite number, got NaN"):
        rollout([0.0, np.nan])


def test_rows_by_a_mask() -> None:
    simulation = tangible.Simulation(ball(), batch=3)
    simulation.reset()
    simulation.step(steps=5)
    simulation.reset(rows=np.array([True, False, True]))
    assert simulation.steps.tolist() == [0, 5, 0]
    simulation.reset(rows=[1])
    assert simulation.steps.tolist() == [0, 0, 0]
    with pytest.raises(ValueError, match="a mask of 3 truth values, got 2"):
        simulation.reset(rows=[True, False])
    with pytest.raises(TypeError, match="rows: expected whole numbers, got True"):
        simulation.reset(rows=[True, 1, 2])
    # Two threads would reset one row at once.
    with pytest.raises(ValueError, match=r"rows: expected each row once, got \[0, 0\]"):
        simulation.reset(rows=[0, 0])
    with pytest.raises(ValueError, match="steps: expected at most 2147483647, got 1000000000000"):
        simulation.step(steps=10**12)


def test_an_action_that_is_no_number_fails_its_row() -> None:
    simulation = tangible.Simulation(ball(), [PUSH], batch=2, on_failure="nan")
    simulation.reset()
    states = simulation.step([[np.nan], [1.0]])
    assert np.isnan(states[0]).all() and np.isfinite(states[1]).all()
    assert np.isnan(simulation.step([[1.0], [1.0]])[0]).all()
    simulation.reset(rows=[0])
    assert np.isfinite(simulation.step([[1.0], [1.0]])).all()


def test_a_process_that_is_forked_off_goes_on() -> None:
    simulation = tangible.Simulation(ball(), batch=4, threads=2)
    simulation.reset()
    simulation.step(steps=2)
    child = os.fork()
    if child == 0:
        simulation.step(steps=2)
        os._exit(7 if simulation.steps.tolist() == [4] * 4 else 8)
    end = time.monotonic() + 20.0
    done, status = 0, 0
    while not done and time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        time.sleep(0.01)
    if not done:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    assert done and os.WEXITSTATUS(status) == 7


def two_masses(second: float) -> tangible.Scene:
    scene = tangible.Scene(gravity=[0, 0], simulation={"dt": 0.02, "duration": 0})
    for name, mass, x in (("a", 2.0, 0.0), ("b", second, 5.0)):
        scene.add_body(name, mass=mass, inertia=1, position=[x, 0])
        scene.add_force(f"on_{name}", body=name, force=[mass * mass, 0])
    return scene


def test_parameters_make_what_a_dict_of_the_state_leaves() -> None:
    velocity = "bodies/a/velocity/x"
    scene = two_masses(3.0)
    drawn = tangible.Simulation(scene, domains={velocity: [0.1, 0.2, 0.3]}, batch=8)
    states = drawn.reset({"a/y": 1.0}, seed=0)
    assert (states[:, 1] == 1.0).all()
    assert len(set(states[:, 3])) > 1
    assert (states[:, 3] == drawn.row_parameters[:, 0]).all()
    noisy = tangible.Simulation(scene, noise={velocity: 0.5})
    assert noisy.reset({"a/y": 1.0}, seed=0)[3] == noisy.row_parameters[0, 0] != 0.0


def test_noise_of_numbers_that_differ_is_refused() -> None:
    with pytest.raises(ValueError, match="name them one by one"):
        tangible.Simulation(two_masses(3.0), noise={"bodies/*/mass": 0.1})
    equal = tangible.Simulation(two_masses(2.0), noise={"bodies/*/mass": 0.1})
    equal.reset(seed=0)
    assert equal.row_parameters[0, 0] != 2.0


def test_without_an_action_each_force_is_the_scenes_own_also_without_steps() -> None:
    simulation = tangible.Simulation(two_masses(3.0), ["forces/*/force/x"])
    simulation.reset()
    assert simulation.step(steps=10)[3::6] == pytest.approx([0.4, 0.6])


def test_a_refused_action_leaves_the_rows_as_they_are() -> None:
    simulation = tangible.Simulation(two_masses(3.0), ["forces/on_a/force/x"], batch=3)
    simulation.reset()
    with pytest.raises(tangible.TangibleError, match="row 1: action forces/on_a/force/x: .* got NaN"):
        simulation.step([[1.0], [float("nan")], [1.0]])
    assert simulation.step([[1.0], [1.0], [1.0]])[:, 3] == pytest.approx([0.01] * 3)
    assert (simulation.steps == 1).all()
