"""Environments keep gymnasium's interface; a small stand-in serves where it is not installed."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import types
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from conftest import ball

HAS_GYMNASIUM = importlib.util.find_spec("gymnasium") is not None
NAMES = ["cart_pole", "pushed_block", "hopper", "breakout"]


class Box:
    """What the adapter uses of gymnasium.spaces.Box."""

    def __init__(self, low: Any, high: Any, shape: Any = None, dtype: Any = np.float32) -> None:
        self.shape = np.shape(low) if shape is None else tuple(shape)
        self.dtype = np.dtype(dtype)
        self.low = np.broadcast_to(np.asarray(low, dtype=dtype), self.shape)
        self.high = np.broadcast_to(np.asarray(high, dtype=dtype), self.shape)
        self.generator = np.random.default_rng(0)

    def contains(self, value: Any) -> bool:
        return (isinstance(value, np.ndarray) and value.shape == self.shape and value.dtype == self.dtype
                and bool((value >= self.low).all() and (value <= self.high).all()))

    def sample(self) -> Any:
        return self.generator.uniform(self.low, self.high).astype(self.dtype)


class Env:
    """What the adapter uses of gymnasium.Env."""

    np_random: Any = None

    def reset(self, *, seed: int | None = None, options: Any = None) -> None:
        if seed is not None or self.np_random is None:
            self.np_random = np.random.default_rng(seed)


@pytest.fixture
def adapter(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    if not HAS_GYMNASIUM:
        stand_in = types.ModuleType("gymnasium")
        stand_in.Env = Env  # type: ignore[attr-defined]
        stand_in.spaces = types.SimpleNamespace(Box=Box)  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "gymnasium", stand_in)
    module = importlib.import_module("tangible.gymnasium")
    yield module
    sys.modules.pop("tangible.gymnasium", None)


@pytest.mark.parametrize("name", NAMES)
def test_the_interface(adapter: Any, name: str) -> None:
    env = getattr(adapter, name)()
    first, info = env.reset(seed=7)
    assert env.observation_space.contains(first) and isinstance(info, dict)
    actions = [env.action_space.sample() for _ in range(20)]
    assert all(env.action_space.contains(action) for action in actions)

    def episode() -> list[Any]:
        found = [env.reset(seed=7)[0]]
        for action in actions:
            observation, reward, terminated, truncated, about = env.step(action)
            assert env.observation_space.contains(observation) and type(reward) is float
            assert type(terminated) is bool and type(truncated) is bool and isinstance(about, dict)
            found.append(observation)
            if terminated or truncated:
                break
        return found

    # The same seed gives the same episode; none goes on from the last.
    one, two = episode(), episode()
    assert len(one) > 5 and all(np.array_equal(a, b) for a, b in zip(one, two))
    other = [env.reset(seed=8)[0], env.reset()[0]]
    assert not np.array_equal(one[0], other[0]) and not np.array_equal(other[0], other[1])


@pytest.mark.skipif(not HAS_GYMNASIUM, reason="gymnasium is not installed")
@pytest.mark.parametrize("name", NAMES)
def test_the_checker_of_gymnasium(adapter: Any, name: str) -> None:
    checker = importlib.import_module("gymnasium.utils.env_checker")
    checker.check_env(getattr(adapter, name)(), skip_render_check=True)


def test_a_cart_pole_is_balanced_by_feedback_alone(adapter: Any) -> None:
    env = adapter.cart_pole()

    def length(gains: list[float]) -> int:
        observation, _ = env.reset(seed=3)
        for step in range(1, 501):
            observation, reward, terminated, truncated, _ = env.step([float(np.dot(gains, observation))])
            assert reward == 1.0
            if terminated or truncated:
                return step
        return 500

    assert length([0.0, 0.0, 0.0, 0.0]) < 150
    # Where the pole leans to the left (angle > 0), the cart follows to the left.
    assert length([1.0, 2.0, -40.0, -10.0]) == 500


def test_a_block_sticks_until_it_is_pushed(adapter: Any) -> None:
    env = adapter.pushed_block(noise=None)
    env.reset(seed=0)
    still = [env.step([3.0])[0][0] for _ in range(10)]
    assert still == pytest.approx([0.0] * 10, abs=1e-9)
    moved = [env.step([100.0])[0][0] for _ in range(25)]  # clipped to 10 N
    assert moved[-1] == pytest.approx(0.5 * (10.0 - 0.4 * 9.81) * 0.5**2, rel=1e-6)
    for _ in range(116):
        _, _, terminated, truncated, _ = env.step([0.0])
    assert truncated and not terminated


def test_a_hopper_stands_and_is_pushed_up(adapter: Any) -> None:
    env = adapter.hopper(noise=None)
    env.reset(seed=0)
    rest = [env.step([0.0, 0.0])[0][1] for _ in range(15)]
    # The spring gives way by about 6 kg g / 1500 N/m = 4 cm.
    assert 0.64 < min(rest) and max(rest) < 0.77
    env.reset(seed=0)
    pushed = [env.step([0.0, -150.0])[0][1] for _ in range(15)]  # the foot down, the torso up
    assert max(pushed) > max(rest) + 0.03


def test_bricks_that_are_hit_are_gone(adapter: Any) -> None:
    env = adapter.breakout(noise=None)
    env.reset(seed=0)
    total, left = 0.0, 12
    for _ in range(400):
        # The paddle follows the ball.
        state = env.simulation.state
        _, reward, terminated, truncated, info = env.step([40.0 * (state[6] - state[0]) - 4.0 * state[3]])
        total += reward
        assert info["bricks"] == left - reward
        left = info["bricks"]
        if terminated or truncated:
            break
    assert total >= 3 and left == 12 - total
    speed = np.hypot(*env.simulation.state[9:11])
    assert 0.5 < speed < 10
    env.reset(seed=0)
    assert env.step([0.0])[4]["bricks"] == 12


def test_breakout_keeps_what_was_drawn_and_counts_every_touch(adapter: Any) -> None:
    mass = "bodies/paddle/mass"
    hits = {}
    for steps in (1, 5):
        env = adapter.breakout(noise=None, steps=steps, domains={mass: [5.0]})
        env.reset(seed=0)
        reward = 0.0
        for _ in range(150 // steps):
            reward += env.step([0.0])[1]
            if env.simulation.parameters:
                assert env.simulation.row_parameters[0].tolist() == [5.0]
        assert env.simulation.parameters == [mass]
        hits[steps] = reward
    assert hits[1] == hits[5] > 0


def test_a_scene_of_ones_own(adapter: Any) -> None:
    env = adapter.SceneEnv(
        ball(duration=0.1), ["forces/push/force/x"], low=-1, high=1,
        reward=lambda before, action, state: state[0], terminated=lambda state: state[1] < 1.0,
        domains={"bodies/ball/mass": [1.0, 2.0]})
    observation, _ = env.reset(seed=1, options={"state": {"ball/y": 1.02}})
    assert observation[1] == 1.02
    steps = 0
    while True:
        _, _, terminated, truncated, _ = env.step([0.0])
        steps += 1
        if terminated or truncated:
            break
    # It falls 2 cm in 0.064 s.
    assert steps == 7 and terminated and not truncated


def test_wrong_arguments_are_said(adapter: Any) -> None:
    push = ["forces/push/force/x"]
    good: dict[str, Any] = {"low": -1, "high": 1, "reward": lambda *_: 0.0}
    for keys, said in [
        ({"steps": 1.5}, "^steps: expected a whole number >= 1, got 1.5$"),
        ({"duration": "1"}, "^duration: expected a time > 0 in s, got '1'$"),
        ({"reward": 3}, "^reward: expected a function, got 3$"),
        ({"observe": 3}, "^observe: expected a function or None, got 3$"),
        ({"low": "a"}, "^low: expected real numbers"),
    ]:
        with pytest.raises(TypeError, match=said):
            adapter.SceneEnv(ball(), push, **{**good, **keys})
