"""The rule for jax, where it is installed: `.ci/setup` installs what Debian has, which has no jax."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tangible

from conftest import ball

jax = pytest.importorskip("jax", reason="jax is not installed")
jax.config.update("jax_enable_x64", True)
jnp: Any = jax.numpy

from tangible.jax import rollout  # noqa: E402

PATHS = ["bodies/ball/mass", "bodies/ball/velocity/x"]
PUSH = ["forces/push/force/x"]


def made(**keys: Any) -> tangible.Rollout:
    return tangible.Rollout(ball(), PATHS, PUSH, **keys)


def test_values_and_derivatives_are_those_of_the_rollout() -> None:
    function = made()
    p, x, u = (jnp.asarray(v) for v in (
        function.default_parameters, function.default_initial_state, function.default_controls + 0.1))
    f = rollout(function)
    assert np.array_equal(f(p, x, u), function(p, x, u))
    assert np.array_equal(jax.jit(f)(p), function(p))
    found = jax.jacrev(f, argnums=(0, 1, 2))(p, x, u)
    exact = function.jacobian(p, x, u, method="adjoint")
    for mine, theirs in zip(found, (exact.parameters, exact.initial_state, exact.controls)):
        np.testing.assert_allclose(mine, theirs, rtol=1e-12, atol=1e-13)
    assert np.abs(exact.controls).max() > 0
    assert np.array_equal(f(), function())


def test_batches_are_one_call() -> None:
    function = made(records=[10, 60])
    f = rollout(function)
    many = jnp.asarray(function.default_parameters) + 0.01 * jnp.arange(10.0).reshape(5, 2)
    calls = []
    run = function._core.run

    class Counted:
        def __getattr__(self, name: str) -> Any:
            return getattr(core, name)

        def run(self, *arguments: Any) -> Any:
            calls.append(arguments[0].shape)
            return run(*arguments)

    core, function._core = function._core, Counted()  # type: ignore[assignment]
    expected = function(many)
    calls.clear()
    assert np.array_equal(jax.vmap(f)(many), expected) and calls == [(5, 2)]
    assert np.array_equal(f(many), expected)
    u = jnp.asarray(function.default_controls) + 0.2
    # Controls of all rows beside parameters of each.
    assert np.array_equal(jax.jit(jax.vmap(lambda p: f(p, None, u)))(many), function(many, None, u))
    function._core = core

    def loss(p: Any, u: Any) -> Any:
        return jnp.sum(jax.vmap(lambda one: f(one, None, u))(p)[:, 1, 0] ** 2)

    by_p, by_u = jax.jit(jax.grad(loss, argnums=(0, 1)))(many, u)
    states, pull = function.vjp(many, None, np.asarray(u))
    bars = np.zeros_like(states)
    bars[:, 1, 0] = 2 * states[:, 1, 0]
    exact = pull(bars)
    np.testing.assert_allclose(by_p, exact[0], rtol=1e-12)
    np.testing.assert_allclose(by_u, exact[2].sum(axis=0), rtol=1e-12)


def test_other_precision_and_mistakes() -> None:
    function = made()
    f = rollout(function)
    p = jnp.asarray(function.default_parameters, dtype=jnp.float32)
    assert f(p).dtype == jnp.float32 and jax.grad(lambda q: f(q)[0])(p).dtype == jnp.float32
    with pytest.raises(TypeError, match="parameters: expected floating-point numbers"):
        f(jnp.array([1, 2]))
    with pytest.raises(ValueError, match="parameters: expected shape"):
        f(jnp.ones(3))
    with pytest.raises(ValueError, match="kinks: expected"):
        rollout(function, kinks="none")
    with pytest.raises(Exception, match="expected a number > 0"):
        f(jnp.array([-1.0, 0.0])).block_until_ready()
