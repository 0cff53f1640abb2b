"""The torch layer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

torch = pytest.importorskip("torch")
from tangible.torch import RolloutLayer, rollout  # noqa: E402

PATHS = ["bodies/ball/mass", "bodies/ball/restitution", "bodies/ball/friction"]


def inputs(function: tangible.Rollout, rows: int | None) -> list[Any]:
    random = np.random.default_rng(2)
    lead = () if rows is None else (rows,)
    p = function.default_parameters * (1.0 + 0.02 * random.uniform(-1, 1, size=(*lead, 3)))
    x = function.default_initial_state + 0.01 * random.normal(size=(*lead, 6))
    u = 0.2 * random.normal(size=(*lead, function.num_steps, 1))
    return [torch.tensor(a, dtype=torch.float64, requires_grad=True) for a in (p, x, u)]


@pytest.mark.parametrize("rows", [None, 3])
@pytest.mark.parametrize("stepping", ["fixed", "event"])
def test_gradcheck_through_contact(stepping: str, rows: int | None) -> None:
    scene = ball(stepping, dt=0.02)
    scene["bodies"][0]["friction"] = 0.1
    function = tangible.Rollout(scene, PATHS, ["forces/push/force/x"])
    given = inputs(function, rows)
    for certificate in function.certificates(*[g.detach().numpy() for g in given]):
        assert certificate["events"] >= 1 or stepping == "fixed"
    assert torch.autograd.gradcheck(
        lambda *a: rollout(function, *a), given, eps=1e-6, atol=1e-5, rtol=1e-4
    )


def test_dtype_and_shared_arguments() -> None:
    function = tangible.Rollout(ball(), PATHS)
    p = torch.tensor(function.default_parameters, dtype=torch.float32, requires_grad=True)
    x = torch.tensor(np.tile(function.default_initial_state, (4, 1)), dtype=torch.float32, requires_grad=True)
    states = rollout(function, p, x)
    assert states.dtype == torch.float32 and states.shape == (4, 6)
    states[:, 0].sum().backward()
    assert p.grad is not None and p.grad.shape == (3,) and p.grad.dtype == torch.float32
    assert x.grad is not None and x.grad.shape == (4, 6)
    one = rollout(function, p.detach().requires_grad_(), x[0].detach())
    assert torch.allclose(one, states[0])


def test_kinks_raise_if_asked() -> None:
    resting = ball()
    resting["bodies"][0]["position"] = [0, 0.1]
    resting["bodies"][0]["velocity"] = [0, 0]
    function = tangible.Rollout(resting, ["bodies/ball/position/y"])
    p = torch.tensor(function.default_parameters, requires_grad=True)
    rollout(function, p)
    with pytest.raises(tangible.TangibleError, match="derivative: "):
        rollout(function, p, kinks="raise")
    with pytest.raises(ValueError, match="kinks"):
        rollout(function, p, kinks="smooth")


def test_a_layer_learns_and_its_parameters_stay_physical() -> None:
    fast = tangible.Scene(ball()).with_parameters({"bodies/ball/velocity/x": 15.0})
    target = torch.tensor(tangible.Rollout(fast, PATHS, records=[10, 30, 45, 60])())
    start = fast.with_parameters({PATHS[1]: 0.6, PATHS[2]: 0.1})
    layer = RolloutLayer(start, PATHS[1:], records=[10, 30, 45, 60], bounds={p: (0.0, 1.0) for p in PATHS[1:]})
    optimiser = torch.optim.LBFGS(layer.parameters(), lr=0.5, max_iter=60, line_search_fn="strong_wolfe")

    def closure() -> Any:
        optimiser.zero_grad()
        loss = ((layer() - target) ** 2).sum()
        loss.backward()
        return loss

    optimiser.step(closure)
    assert torch.allclose(layer.values(), torch.tensor([0.8, 0.3], dtype=torch.float64), atol=1e-4)
    heavy = RolloutLayer(ball(), PATHS[:1])
    with torch.no_grad():
        heavy.q -= 50.0
    assert 0.0 < float(heavy.values()) < 1e-20
