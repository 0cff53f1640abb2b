"""Rollouts as a differentiable function of jax arrays: a custom rule over callbacks to the engine.

    function = tangible.jax.rollout(tangible.Rollout(scene, parameters))
    jax.grad(lambda p: function(p)[0])(p)
    jax.jit(jax.vmap(function))(many)

Inside everything is computed in double precision on the CPU; results have the dtype of the first
argument, so that `jax.config.update("jax_enable_x64", True)` keeps all digits. Derivatives are first
ones and reverse ones. jax is imported with this module, not with `tangible`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ._rollout import Rollout, Smoothing, check_kinks, check_rollout

__all__ = ["rollout"]

# One call for all rows of a vmap, by the word of this version of jax.
_BATCHED: dict[str, Any] = (
    {"vmap_method": "broadcast_all"}
    if "vmap_method" in inspect.signature(jax.pure_callback).parameters
    else {"vectorized": True}
)


def _double(values: Any) -> np.ndarray[Any, Any]:
    return np.asarray(values, dtype=np.float64)


def rollout(
    function: Rollout, *, kinks: str = "element", smoothing: Smoothing | None = None
) -> Callable[..., Any]:
    """The rollout as a function of (parameters, initial_state, controls), of jax arrays.

    What is left out, or None, is the scene's own. Arguments may have one leading axis, a batch, or
    get it by `jax.vmap`, which makes one call to the engine.

    Args:
        function: What is rolled out; its arguments and shapes are those of `Rollout.__call__`.
        kinks, smoothing: As of `Rollout.vjp`.
    """
    check_rollout(function)
    check_kinks(kinks, smoothing)
    sizes = (
        function.default_parameters.shape,
        function.default_initial_state.shape,
        function.default_controls.shape,
    )
    records = () if function._single else (len(function.times),)
    result = (*records, len(function.outputs))

    def is_batched(inputs: tuple[Any, ...]) -> tuple[int, ...]:
        """The leading axis of a call, () where there is none."""
        for value, size in zip(inputs, sizes):
            if value is not None and value.ndim > len(size):
                return (int(value.shape[0]),)
        return ()

    def spread(inputs: tuple[Any, ...], rows: tuple[int, ...]) -> tuple[Any, ...]:
        """Arguments with the batch's axis: how vmap adds its axis to arguments is its own affair."""
        return tuple(
            None if value is None else jnp.broadcast_to(value, (*rows, *size))
            for value, size in zip(inputs, sizes)
        )

    def flat(arrays: tuple[Any, ...], own: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], list[Any]]:
        """The axes before the arrays' own, and the arrays with these as one; vmap may add axes to
        some and not to others."""
        leads = [np.shape(v)[: np.ndim(v) - len(s)] for v, s in zip(arrays, own) if v is not None]
        lead = max(leads, key=len)
        return lead, [
            None if v is None else np.broadcast_to(_double(v), (*lead, *s)).reshape(-1, *s)
            for v, s in zip(arrays, own)
        ]

    def on_host(*inputs: Any) -> Any:
        lead, given = flat(inputs, sizes)
        return np.asarray(function(*given).reshape(*lead, *result), dtype=dtype_of(inputs))

    def pull_on_host(bar: Any, *inputs: Any) -> Any:
        lead, (bars, *given) = flat((bar, *inputs), (result, *sizes))
        _, pull = function.vjp(*given, kinks=kinks, smoothing=smoothing)
        return tuple(
            np.asarray(part.reshape(*lead, *size), dtype=value.dtype)
            for part, value, size in zip(pull(bars), inputs, sizes)
            if value is not None
        )

    def dtype_of(inputs: tuple[Any, ...]) -> Any:
        return next(value.dtype for value in inputs if value is not None)

    def on_device(*inputs: Any) -> Any:
        rows = is_batched(inputs)
        shape = jax.ShapeDtypeStruct((*rows, *result), dtype_of(inputs))
        return jax.pure_callback(on_host, shape, *inputs, **_BATCHED)

    evaluate: Any = jax.custom_vjp(on_device)

    def forward(*inputs: Any) -> Any:
        return evaluate(*inputs), inputs

    def backward(inputs: tuple[Any, ...], bar: Any) -> Any:
        shapes = tuple(jax.ShapeDtypeStruct(v.shape, v.dtype) for v in inputs if v is not None)
        found = iter(jax.pure_callback(pull_on_host, shapes, bar, *inputs, **_BATCHED))
        return tuple(None if value is None else next(found) for value in inputs)

    evaluate.defvjp(forward, backward)

    def call(parameters: Any = None, initial_state: Any = None, controls: Any = None) -> Any:
        given = tuple(
            None if value is None else jnp.asarray(value)
            for value in (parameters, initial_state, controls)
        )
        for name, value, size in zip(("parameters", "initial_state", "controls"), given, sizes):
            if value is None:
                continue
            if not jnp.issubdtype(value.dtype, jnp.floating):
                raise TypeError(f"{name}: expected floating-point numbers, got {value.dtype}")
            if value.ndim not in (len(size), len(size) + 1) or value.shape[value.ndim - len(size) :] != size:
                raise ValueError(f"{name}: expected shape {size}, or one more axis, got {value.shape}")
        if all(value is None for value in given):
            given = (jnp.asarray(function._defaults[0][0]), None, None)
        rows = is_batched(given)
        return evaluate(*(spread(given, rows) if rows else given))

    return call
