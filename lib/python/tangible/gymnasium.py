"""Scenes as environments of gymnasium, and four of them to begin with.

    env = tangible.gymnasium.cart_pole()
    observation, info = env.reset(seed=0)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

gymnasium is imported with this module, not with `tangible`. Many rows at once, without its interface,
are `tangible.Simulation(batch=N)`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import TangibleError
from ._plain import function, number, said, whole
from ._rollout import floats
from ._scene import Scene, SceneLike
from ._simulation import Simulation

__all__ = ["SceneEnv", "breakout", "cart_pole", "hopper", "pushed_block"]

Floats = NDArray[np.float64]
Reward = Callable[[Floats, Floats, Floats], float]


class SceneEnv(gymnasium.Env):  # type: ignore[misc]
    """An environment whose world is a scene.

    Observations are states in double precision, as `Simulation` orders them, or what `observe` makes
    of one. A step that fails ends the episode, with the reason in `info["failure"]`.

    Args:
        scene: A `Scene`, a scene file, or a dict of its JSON.
        controls: C paths of forces, torques or efforts that an action sets.
        low, high: Of the controls, N or N m; actions outside are clipped.
        reward: (state before, action, state after) -> number.
        terminated: state -> whether the episode has reached an end of its own; absent: never.
        observe: state -> observation, of one shape; absent: the state.
        duration: s, after which an episode is truncated; absent: the scene's.
        steps: Of the scene for each action.
        noise, domains: As of `Simulation`; drawn by `reset`.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        scene: SceneLike,
        controls: Sequence[str],
        *,
        low: ArrayLike,
        high: ArrayLike,
        reward: Reward,
        terminated: Callable[[Floats], bool] | None = None,
        observe: Callable[[Floats], ArrayLike] | None = None,
        duration: float | None = None,
        steps: int = 1,
        noise: Mapping[str, float] | None = None,
        domains: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        steps = whole(steps, "steps", 1)
        if duration is not None:
            duration = number(duration, "duration", above=0.0, what="a time > 0 in s")
        if not callable(reward):
            raise TypeError(f"reward: expected a function, got {said(reward)}")
        function(terminated, "terminated")
        function(observe, "observe")
        read = Scene.of(scene)
        self.simulation = Simulation(read, controls, noise=noise, domains=domains)
        self._reward = reward
        self._terminated = terminated or (lambda state: False)
        self._observe = observe or (lambda state: state)
        self._steps = steps
        if duration is None:
            duration = float(json.loads(read.to_json())["simulation"]["duration"])
        self._limit = round(duration / (steps * self.simulation.dt))
        self._count = 0
        count = len(controls)
        self._low = np.broadcast_to(floats(low, "low"), (count,))
        self._high = np.broadcast_to(floats(high, "high"), (count,))
        shape = np.shape(self._observe(np.zeros(len(self.simulation.outputs))))
        self.action_space = gymnasium.spaces.Box(
            self._low.astype(np.float32), self._high.astype(np.float32), dtype=np.float32
        )
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, shape=shape, dtype=np.float64)

    def _look(self, state: Floats) -> Floats:
        return np.asarray(self._observe(state), dtype=np.float64)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Starts an episode; `options` may have the `state` and `parameters` of `Simulation.reset`."""
        super().reset(seed=seed)
        given = dict(options or {})
        self._count = 0
        state = self.simulation.reset(
            given.get("state"), seed, parameters=given.get("parameters")
        )
        return self._look(state), {"state": state}

    def _advance(self, action: Floats) -> Floats:
        return self.simulation.step(action, steps=self._steps)

    def step(self, action: ArrayLike) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """(observation, reward, terminated, truncated, info with the `state`)."""
        clipped = np.clip(np.asarray(action, dtype=np.float64), self._low, self._high)
        before = self.simulation.state
        if np.isnan(before).any():
            raise ValueError("step: expected a reset before it")
        if np.isnan(clipped).any():
            raise ValueError("action: expected numbers, got NaN")
        info: dict[str, Any] = {}
        try:
            state = self._advance(clipped)
        except TangibleError as error:
            # The last good state is the end; its reward is that of standing still.
            info["failure"] = str(error)
            state = before
        self._count += 1
        info["state"] = state
        ended = "failure" in info or bool(self._terminated(state))
        reward = float(self._reward(before, clipped, state))
        return self._look(state), reward, ended, self._count >= self._limit, info


def cart_pole(**keys: Any) -> SceneEnv:
    """A pole on a cart that a force of at most 10 N moves along a rail; 1 for each step upright.

    Observations are x, vx, angle, omega. `keys` replace those of `SceneEnv`.
    """
    scene = Scene(name="cart_pole", simulation={"stepping": "event", "dt": 0.02, "duration": 10.0})
    scene.add_body("cart", mass=1.0, inertia=1.0, position=[0, 0])
    scene.add_body("pole", shape={"box": {"size": [0.05, 1.0]}}, mass=0.1, position=[0, 0.5])
    scene.add_joint("rail", type="prismatic", bodies=["cart", "world"], anchor=[0, 0], axis=[1, 0])
    scene.add_joint("pin", type="revolute", bodies=["pole", "cart"], anchor=[0, 0])
    x, vx, angle, omega = 0, 3, 8, 11
    settings: dict[str, Any] = {
        "low": -10.0,
        "high": 10.0,
        "reward": lambda before, action, state: 1.0,
        "terminated": lambda state: abs(state[x]) > 2.4 or abs(state[angle]) > 0.21,
        "observe": lambda state: state[[x, vx, angle, omega]],
        "noise": {"joints/rail/displacement": 0.03, "joints/rail/rate": 0.03,
                  "joints/pin/angle": 0.03, "joints/pin/rate": 0.03},
    }
    return SceneEnv(scene, ["joints/rail/effort"], **{**settings, **keys})


def pushed_block(**keys: Any) -> SceneEnv:
    """A block on the ground, with friction, that a force of at most 10 N is to push to x = 1 m.

    The reward is minus the squared distance, and a little for the force. `keys` replace those of
    `SceneEnv`.
    """
    scene = Scene(name="pushed_block", simulation={"stepping": "event", "dt": 0.02, "duration": 3.0})
    scene.add_body(
        "block", shape={"box": {"size": [0.3, 0.2]}}, mass=1.0, position=[0, 0.1], friction=0.4
    )
    scene.add_body(
        "ground", static=True, friction=0.4, shape={"half_plane": {"normal": [0, 1], "offset": 0}}
    )
    scene.add_force("push", body="block", force=[0, 0])
    settings: dict[str, Any] = {
        "low": -10.0,
        "high": 10.0,
        "reward": lambda before, action, state: -((state[0] - 1.0) ** 2) - 1e-3 * action[0] ** 2,
        "noise": {"block/vx": 0.1},
    }
    return SceneEnv(scene, ["forces/push/force/x"], **{**settings, **keys})


def hopper(**keys: Any) -> SceneEnv:
    """A torso on a springy leg: a hip torque and a force along the leg make it hop towards +x.

    The reward is the torso's way per second, and a little for staying up. `keys` replace those of
    `SceneEnv`.
    """
    scene = Scene(name="hopper", simulation={"stepping": "fixed", "dt": 0.005, "duration": 10.0})
    scene.add_body("torso", shape={"box": {"size": [0.4, 0.2]}}, mass=5.0, position=[0, 0.76])
    scene.add_body("leg", mass=1.0, inertia=0.02, position=[0, 0.46])
    scene.add_body("foot", shape={"circle": {"radius": 0.06}}, mass=0.5, position=[0, 0.06], friction=0.9)
    scene.add_body(
        "ground", static=True, friction=0.9, shape={"half_plane": {"normal": [0, 1], "offset": 0}}
    )
    scene.add_joint("hip", type="revolute", bodies=["leg", "torso"], anchor=[0, 0.66], damping=0.5)
    scene.add_joint(
        "knee", type="prismatic", bodies=["foot", "leg"], anchor=[0, 0.06], axis=[0, 1],
        stiffness=1500.0, damping=10.0, limits=[-0.1, 0.25],
    )
    dt = 0.02
    settings: dict[str, Any] = {
        "low": [-20.0, -150.0],
        "high": [20.0, 150.0],
        "steps": 4,
        "reward": lambda before, action, state: (state[0] - before[0]) / dt + 0.5,
        "terminated": lambda state: state[1] < 0.4 or abs(state[2]) > 1.0,
        "noise": {"torso/vx": 0.05, "leg/vx": 0.05, "foot/vx": 0.05},
    }
    return SceneEnv(scene, ["joints/hip/effort", "joints/knee/effort"], **{**settings, **keys})


class _Breakout(SceneEnv):
    """A brick that the ball has touched is gone from the next step on."""

    def __init__(self, scene: Scene, controls: Sequence[str], **settings: Any) -> None:
        super().__init__(scene, controls, **settings)
        self._whole = self.simulation
        self._left = [body for body in scene.bodies if body.startswith("brick")]
        self._hits = 0

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        self.simulation = self._whole
        self._left = [body for body in self._whole.scene.bodies if body.startswith("brick")]
        return super().reset(seed=seed, options=options)

    def _advance(self, action: Floats) -> Floats:
        self._hits = 0
        state = self.simulation.state
        for _ in range(self._steps):
            state = self.simulation.step(action)
            hit = {body for pair in self.simulation.touches[0] for body in pair} & set(self._left)
            if hit:
                self._hits += len(hit)
                self._remove(hit, state)
            if not self._left:
                break
        return state

    def _remove(self, hit: set[str], state: Floats) -> None:
        self._left = [body for body in self._left if body not in hit]
        data = self.simulation.scene.to_dict()
        data["bodies"] = [body for body in data["bodies"] if body["name"] not in hit]
        # What was drawn for the episode stays.
        values = {
            path: value
            for path, value in zip(self.simulation.parameters, self.simulation.row_parameters[0])
            if not hit & set(path.replace(":", "/").split("/"))
        }
        self.simulation = Simulation(data, self.simulation.controls, parameters=list(values))
        self.simulation.reset(state, parameters=np.array(list(values.values())))

    def step(self, action: ArrayLike) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        observation, reward, ended, truncated, info = super().step(action)
        info["bricks"] = len(self._left)
        hits = 0 if "failure" in info else self._hits
        return observation, reward + hits, ended or not self._left, truncated, info


def breakout(**keys: Any) -> SceneEnv:
    """A paddle on a rail that keeps a ball in play; 1 for each of twelve bricks that it hits.

    `info["bricks"]` is how many are left. `keys` replace those of `SceneEnv`.
    """
    bounces = {"restitution": 1.0, "friction": 0.0}
    scene = Scene(
        name="breakout", gravity=[0, 0], simulation={"stepping": "event", "dt": 0.02, "duration": 30.0}
    )
    scene.add_body(
        "paddle", shape={"box": {"size": [0.5, 0.06]}}, mass=1.0, position=[1.5, 0.1], **bounces
    )
    scene.add_body(
        "ball", shape={"circle": {"radius": 0.05}}, mass=0.01, position=[1.5, 0.5],
        velocity=[0.6, 1.5], **bounces,
    )
    scene.add_joint(
        "rail", type="prismatic", bodies=["paddle", "world"], anchor=[1.5, 0.1], axis=[1, 0],
        damping=5.0, limits=[-1.2, 1.2],
    )
    for name, normal, offset in (("left", [1, 0], 0.0), ("right", [-1, 0], -3.0), ("top", [0, -1], -3.0)):
        shape = {"half_plane": {"normal": normal, "offset": offset}}
        scene.add_body(name, static=True, shape=shape, **bounces)
    for k in range(12):
        scene.add_body(
            f"brick{k}", static=True, shape={"box": {"size": [0.4, 0.15]}},
            position=[0.5 + 0.4 * (k % 6), 2.3 + 0.2 * (k // 6)], **bounces,
        )
    settings: dict[str, Any] = {
        "low": -20.0,
        "high": 20.0,
        "reward": lambda before, action, state: 0.0,
        "terminated": lambda state: state[7] < 0.0,
        "noise": {"ball/vx": 0.2},
    }
    return _Breakout(scene, ["joints/rail/effort"], **{**settings, **keys})
