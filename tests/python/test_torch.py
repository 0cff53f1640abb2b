"""The torch layer."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
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
        rollout(function, p, kinks="soft")


def test_an_impact_of_fixed_steps_is_no_kink() -> None:
    function = tangible.Rollout(ball("fixed"), ["bodies/ball/position/y"])
    assert function.certificate()["verdict"].startswith("of the discrete map: ")
    gradients = []
    for kinks in ("element", "raise", "smoothed"):
        p = torch.tensor(function.default_parameters, requires_grad=True)
        rollout(function, p, kinks=kinks)[1].backward()
        assert p.grad is not None
        gradients.append(p.grad)
    assert torch.equal(gradients[0], gradients[1]) and torch.equal(gradients[0], gradients[2])


def test_the_smoothed_surrogate_is_used_at_kinks_alone() -> None:
    # A box that is pushed with F moves by max(0, F - mu m g) (steps of h: h^2 n (n + 1) / 2m).
    scene = tangible.Scene(simulation={"dt": 0.01, "duration": 0.5})
    scene.add_body("floor", static=True, friction=0.5, shape={"half_plane": {"normal": [0, 1], "offset": 0}})
    scene.add_body("box", shape={"box": {"size": [1, 0.5]}}, mass=1.0, position=[0, 0.25], friction=0.5)
    scene.add_force("push", body="box", force=[0.5 * 9.81, 0])
    function = tangible.Rollout(scene, ["forces/push/force/x"])
    slope = 0.01**2 * 50 * 51 / 2
    slides = function.default_parameters + 1.0
    both = torch.tensor(np.array([function.default_parameters, slides]), requires_grad=True)
    states = rollout(function, both, kinks="smoothed")
    assert np.array_equal(states.detach().numpy(), function(both.detach().numpy()))
    states[:, 0].sum().backward()
    assert both.grad is not None
    # Half of the samples slide: their mean; and where the box slides anyway the exact derivative.
    assert both.grad[0, 0].item() == pytest.approx(0.5 * slope, rel=1e-6)
    _, pull = function.vjp(slides)
    assert both.grad[1, 0].item() == pull([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])[0][0]
    assert both.grad[1, 0].item() == pytest.approx(slope, rel=1e-9)
    for samples, deviation in ((3, 1e-3), (0, 1e-3), (2, 0.0), (2, float("nan"))):
        with pytest.raises(ValueError, match="expected"):
            tangible.Smoothing(deviation, samples)


def test_samples_that_cannot_be_run_do_not_count() -> None:
    resting = ball()
    resting["bodies"][0].update(position=[0, 0.1], velocity=[0, 0], mass=1e-4)
    function = tangible.Rollout(resting, ["bodies/ball/mass", "bodies/ball/position/y"])
    mass = function.default_parameters
    assert function.certificate()["verdict"] != "trustworthy"
    # A deviation of 1e-3 makes about half of the masses negative.
    _, pull = function.vjp(mass, kinks="smoothed")
    found = pull(np.ones(6))
    assert all(np.isfinite(part).all() for part in found)
    first = [part.copy() for part in found]
    again = function.vjp(mass, kinks="smoothed", smoothing=tangible.Smoothing(seed=0))[1](np.ones(6))
    other = function.vjp(mass, kinks="smoothed", smoothing=tangible.Smoothing(seed=1))[1](np.ones(6))
    assert all(np.array_equal(a, b) for a, b in zip(first, again))
    assert any(not np.array_equal(a, b) for a, b in zip(first, other))


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


@pytest.mark.parametrize("rows", [None, 3])
@pytest.mark.parametrize("which", [(0,), (1,), (2,), (0, 1, 2)])
def test_a_second_derivative_raises_where_it_is_asked_for(which: tuple[int, ...], rows: int | None) -> None:
    function = tangible.Rollout(ball(), PATHS, ["forces/push/force/x"])
    given = inputs(function, rows)
    asked = [given[k] for k in which]
    arguments = [g if k in which else g.detach() for k, g in enumerate(given)]
    # The cotangent is a constant, or depends on the states.
    for loss in (lambda s: s[..., 0].sum(), lambda s: (s**2).sum()):
        states = rollout(function, *arguments)
        first = torch.autograd.grad(loss(states), asked, retain_graph=True)
        again = torch.autograd.grad(loss(states), asked, create_graph=True)
        assert all(torch.equal(a, b) for a, b in zip(first, again))
        penalty = sum((g**2).sum() for g in again)
        with pytest.raises(NotImplementedError, match="rollout: expected first derivatives"):
            (asked[0].sum() + penalty).backward()
    with pytest.raises(NotImplementedError, match="second one"):
        torch.autograd.functional.hessian(
            lambda x: rollout(function, *[x if k == which[0] else a for k, a in enumerate(arguments)])
            .sum(), asked[0].detach())
    assert all(g.grad is None for g in given)


def test_what_needs_no_second_derivative_does_not_raise() -> None:
    """A graph may be made, and another variable's derivative be taken through the gradient."""
    function = tangible.Rollout(ball(), PATHS)
    p = torch.tensor(function.default_parameters, requires_grad=True)
    factor = torch.tensor(2.0, dtype=torch.float64, requires_grad=True)
    gradient = torch.autograd.grad(rollout(function, p).sum(), p, create_graph=True)[0]
    product = (factor * gradient).sum()
    found = torch.autograd.grad(product, factor, retain_graph=True)[0]
    assert found.item() == pytest.approx(gradient.sum().item())
    with pytest.raises(NotImplementedError):
        torch.autograd.grad(product, p)
    # Constants of a penalty: the gradient is cut off from the graph.
    (rollout(function, p).sum() * gradient.detach().sum()).backward()
    assert p.grad is not None and p.grad.abs().max() > 0.0


def test_inputs_may_change_between_forward_and_backward() -> None:
    """The tape holds the values of the forward pass, as it always has; only a graph of the backward
    pass, which would need the inputs, is refused by torch."""
    scene = tangible.Scene(ball())
    function = tangible.Rollout(scene, PATHS)
    p = torch.tensor(function.default_parameters, requires_grad=True)
    states = rollout(function, p)
    expected = torch.autograd.grad(states.sum(), p, retain_graph=True)[0]
    with torch.no_grad():
        p *= 1.1
    scene.add_body("late", shape={"circle": {"radius": 0.1}}, mass=1.0, position=[5, 5])
    assert torch.equal(torch.autograd.grad(states.sum(), p, retain_graph=True)[0], expected)
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        torch.autograd.grad(states.sum(), p, create_graph=True)


@pytest.mark.parametrize("dtype", ["int8", "int32", "int64", "uint8", "bool", "complex64", "complex128"])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_tensors_without_fractions_are_refused(dtype: str, which: int) -> None:
    function = tangible.Rollout(ball(), PATHS, ["forces/push/force/x"])
    given = [g.detach() for g in inputs(function, None)]
    given[which] = torch.ones(given[which].shape, dtype=getattr(torch, dtype))
    name = ("parameters", "initial_state", "controls")[which]
    message = f"^{name}: expected a tensor of floating-point numbers, got torch.{dtype}$"
    with pytest.raises(TypeError, match=message):
        rollout(function, *given)
    alone = [given[which] if k == which else None for k in range(3)]
    with pytest.raises(TypeError, match=message):
        rollout(function, *alone)
    with pytest.raises(TypeError, match=f"^{name}: expected a tensor, got ndarray$"):
        rollout(function, *[None if a is None else a.numpy() for a in alone])


@pytest.mark.parametrize("dtype", ["float16", "bfloat16", "float32", "float64"])
def test_states_have_the_dtype_of_the_first_that_is_given(dtype: str) -> None:
    function = tangible.Rollout(ball(), PATHS)
    p = torch.tensor(function.default_parameters, dtype=getattr(torch, dtype), requires_grad=True)
    x = torch.tensor(function.default_initial_state, requires_grad=True)
    states = rollout(function, p, x)
    # Computed in double precision, and rounded at the end.
    exact = torch.tensor(function(p.detach().to(torch.float64).numpy(), x.detach().numpy()))
    assert states.dtype == p.dtype and torch.equal(states, exact.to(p.dtype))
    states.sum().backward()
    assert p.grad is not None and p.grad.dtype == p.dtype
    assert x.grad is not None and x.grad.dtype == torch.float64


def test_threads_share_a_layer() -> None:
    layer = RolloutLayer(ball(), PATHS)
    # Whatever the threads add up, it is the same number of the same gradients.
    layer().sum().backward()
    expected = layer.q.grad.clone()
    graph = layer().sum()

    def work(k: int) -> list[Any]:
        own = torch.autograd.grad(layer().sum(), layer.q)[0]
        shared = torch.autograd.grad(graph, layer.q, retain_graph=True)[0]
        return [own, shared]

    with ThreadPoolExecutor(6) as pool:
        for found in pool.map(work, range(60)):
            assert all(torch.equal(g, expected) for g in found)


def sticking() -> tangible.Rollout:
    """A box at rest whose friction holds it against 4 N where it is above 4 / 9.81."""
    scene = tangible.Scene(simulation={"stepping": "event", "dt": 0.1, "duration": 1.0})
    scene.add_body("box", shape={"box": {"size": [0.2, 0.2]}}, mass=1, position=[0, 0.1])
    scene.add_body("floor", static=True, shape={"half_plane": {"normal": [0, 1], "offset": 0}})
    scene.add_pair("box", "floor", friction=0.6)
    scene.add_force("push", body="box", force=[4.0, 0])
    return tangible.Rollout(scene, ["pairs/box:floor/friction"])


def test_a_box_that_sticks_has_a_derivative_where_it_is_smoothed_everywhere() -> None:
    function = sticking()
    everywhere = tangible.Smoothing(deviation=0.1, samples=32, everywhere=True)
    p = torch.tensor([0.6], dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.Adam([p], lr=0.05)
    for _ in range(60):
        loss = (rollout(function, p, kinks="smoothed", smoothing=everywhere)[0] - 0.5) ** 2
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    # x = (4 - mu 9.81) / 2 = 0.5.
    assert p.item() == pytest.approx(3.0 / 9.81, abs=4e-3)
    # It is the mean of the samples' own derivatives, and the states are those of the rollout.
    states, pull = function.vjp([0.42], kinks="smoothed", smoothing=everywhere)
    assert np.array_equal(states, function([0.42]))
    drawn = everywhere.draw(np.array([[0.42]]), np.random.default_rng(0))
    own = [function.jacobian(sample).parameters[0, 0] for sample in drawn]
    assert pull([1.0, 0, 0, 0, 0, 0])[0][0] == pytest.approx(np.mean(own), rel=1e-9)
    assert -4.9 < np.mean(own) < -0.5
    # Without the request a row that can be trusted keeps its own derivative.
    assert function.vjp([0.6], kinks="smoothed")[1](np.ones(6))[0][0] == 0.0
    batch = function.vjp([[0.42], [0.3]], kinks="smoothed", smoothing=everywhere)
    assert -4.905 < batch[1](np.eye(6)[[0, 0]])[0][1] < -3.0  # of which few samples stick
    assert batch[0].shape == (2, 6)


def test_a_layer_keeps_to_the_ranges_of_its_scene() -> None:
    scene = ball()
    scene["bodies"][0].update(linear_damping=0.0, friction=0.3)
    paths = ["bodies/ball/friction", "bodies/ball/restitution", "bodies/ball/linear_damping",
             "bodies/ball/mass", "bodies/ball/velocity/x"]
    layer = RolloutLayer(scene, paths)
    start = tangible.Scene(scene)
    assert layer.values().tolist() == pytest.approx([start[path] for path in paths])
    assert [start.range(path) for path in paths] == [
        (0, np.inf), (0, 1), (0, np.inf), (0, np.inf), (-np.inf, np.inf)]
    for direction in (1.0, -1.0):
        with torch.no_grad():
            layer.q += direction * 20.0
        values = layer.values()
        assert (values >= 0)[:4].all() and values[1] <= 1
        layer().sum().backward()
        assert torch.isfinite(layer.q.grad).all()
        with torch.no_grad():
            layer.q -= direction * 20.0
    # At the end of its range a value can still leave it: the derivative is that inside.
    with torch.no_grad():
        layer.q[2] = -0.5
    layer.q.grad = None
    layer.values()[2].backward()
    assert layer.values()[2] == 0 and layer.q.grad[2] == 1
    box = tangible.Scene(simulation={"stepping": "event", "dt": 0.02, "duration": 0.5})
    box.add_body("box", shape={"box": {"size": [0.2, 0.2]}}, mass=1, position=[0, 0.1], velocity=[2, 0], friction=0.3)
    box.add_body("floor", static=True, friction=0.0, shape={"half_plane": {"normal": [0, 1], "offset": 0}})
    slides = RolloutLayer(box, ["bodies/box/friction"])
    optimizer = torch.optim.SGD(slides.parameters(), lr=5.0)
    for _ in range(20):
        loss = (slides()[0] - 1.0) ** 2  # which no friction reaches
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    assert 0 <= slides.values()[0] < 0.15


def test_rows_that_fail_leave_the_others_their_gradients() -> None:
    function = tangible.Rollout(ball(), PATHS[:1])
    p = torch.tensor([[1.0], [-1.0], [2.0]], dtype=torch.float64, requires_grad=True)
    with pytest.raises(tangible.TangibleError, match="row 1"):
        rollout(function, p)
    states = rollout(function, p, on_failure="nan")
    assert torch.isnan(states[1]).all() and torch.isfinite(states[[0, 2]]).all()
    torch.nanmean(states).backward()
    assert p.grad is not None and p.grad[1] == 0 and torch.isfinite(p.grad).all()
    # A value of all rows is not spoilt by one of them.
    shared = torch.tensor([1.0], dtype=torch.float64, requires_grad=True)
    starts = torch.as_tensor(np.tile(function.default_initial_state, (2, 1)))
    starts[1, 1] = np.inf
    states = rollout(function, shared, starts, on_failure="nan")
    states[0].sum().backward()
    assert shared.grad is not None and torch.isfinite(shared.grad).all()


def test_nothing_is_recorded_without_a_derivative_to_take(monkeypatch: pytest.MonkeyPatch) -> None:
    function = tangible.Rollout(ball(), PATHS[:1])
    p = torch.tensor([[1.0], [2.0]], dtype=torch.float64, requires_grad=True)
    with_tape = rollout(function, p)
    from tangible import _core

    monkeypatch.setattr(_core, "Recorded", None)
    with torch.no_grad():
        found = rollout(function, p, kinks="raise")
    assert torch.equal(found, with_tape) and not found.requires_grad
    assert torch.equal(rollout(function, p.detach()), with_tape.detach())
    assert rollout(function, p.detach().float()).dtype == torch.float32
    with pytest.raises(TypeError):
        rollout(function, p)


def test_wrong_arguments_are_said() -> None:
    names = ["bodies/ball/mass"]
    for keys, said in [
        ({"positive": 3}, "^positive: expected a list of paths, got 3$"),
        ({"bounds": [1]}, r"^bounds: expected a dict \{path: \(low, high\)\}, got list$"),
        ({"bounds": {names[0]: 1}}, rf"^bounds: {names[0]}: expected \(low, high\), got 1$"),
        ({"smoothing": 3}, "^smoothing: expected a Smoothing or None, got 3$"),
    ]:
        with pytest.raises(TypeError, match=said):
            RolloutLayer(ball(), names, **keys)
    with pytest.raises(ValueError, match="^on_failure: expected raise or nan, got x$"):
        RolloutLayer(ball(), names, on_failure="x")
    with pytest.raises(TypeError, match="^function: expected a tangible.Rollout, got int$"):
        rollout(3)  # type: ignore[arg-type]


def masses(first: float, second: float) -> tangible.Scene:
    scene = tangible.Scene(gravity=[0, 0], simulation={"dt": 0.02, "duration": 0.4})
    for name, mass in (("a", first), ("b", second)):
        scene.add_body(name, mass=mass, inertia=1, position=[5 * (name == "b"), 0])
        scene.add_force(f"on_{name}", body=name, force=[1, 0])
    return scene


def test_a_layer_does_not_make_masses_equal() -> None:
    with pytest.raises(ValueError, match="name them one by one"):
        RolloutLayer(masses(2, 3), ["bodies/*/mass"])
    assert RolloutLayer(masses(2, 2), ["bodies/*/mass"]).values().tolist() == [2.0]


def test_a_tangent_of_forward_mode_is_refused() -> None:
    from torch.autograd import forward_ad

    function = tangible.Rollout(masses(2, 3), ["bodies/a/mass"])
    for needed in (False, True):
        mass = torch.tensor([2.0], dtype=torch.float64, requires_grad=needed)
        with forward_ad.dual_level(), pytest.raises(NotImplementedError):
            rollout(function, forward_ad.make_dual(mass, torch.ones_like(mass)))


def test_the_saved_state_of_a_layer_has_its_formulas() -> None:
    path = ["bodies/ball/friction"]
    first = RolloutLayer(ball(), path)
    with torch.no_grad():
        first.q += 0.5
    smooth = ball()
    smooth["bodies"][0]["friction"] = 0.0
    second = RolloutLayer(smooth, path)
    second.load_state_dict(first.state_dict())
    assert second.values().tolist() == first.values().tolist()
