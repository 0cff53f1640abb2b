"""Rollouts as a differentiable function of torch tensors; the adjoint is the backward pass.

Tensors keep their dtype and device outside; inside everything is computed in double precision on the
CPU. Derivatives are first ones; a second one raises `NotImplementedError` where it is asked for, and
is never left out. torch is imported with this module, not with `tangible`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np
import torch
import torch.autograd.forward_ad as forward_ad

from ._plain import choice, mapping, paths, said
from ._rollout import Rollout as _Rollout
from ._rollout import Smoothing, check_kinks, check_rollout, one_value
from ._scene import SceneLike

__all__ = ["RolloutLayer", "rollout"]


def _numpy(tensor: torch.Tensor | None) -> np.ndarray[Any, Any] | None:
    return None if tensor is None else tensor.detach().to("cpu", torch.float64).numpy()


class _Gradients(torch.autograd.Function):
    """The backward pass, as a node that has the inputs as its own: a second derivative, which goes
    back through it, is refused. Without the node torch would take the gradients for constants
    wherever the cotangent is one."""

    @staticmethod
    def forward(  # type: ignore[override]
        ctx: Any, of: Any, bar: torch.Tensor, *inputs: torch.Tensor | None
    ) -> tuple[torch.Tensor | None, ...]:
        found = of.pull(_numpy(bar))
        gradients: list[torch.Tensor | None] = []
        for value, entry, needed in zip(found, of.inputs, of.needs_input_grad[_OWN:]):
            if entry is None or not needed:
                gradients.append(None)
                continue
            shape, dtype, device = entry
            # A row that failed has no derivative; it must not spoil the sum over the others.
            if of.failed.any():
                value[of.failed] = 0.0
            # An argument without the batch's axis is one for all rows: their derivatives add up.
            if of.batched and value.ndim > len(shape):
                value = value.sum(axis=0)
            gradients.append(torch.as_tensor(value).to(device=device, dtype=dtype))
        return tuple(gradients)

    @staticmethod
    def backward(ctx: Any, *bars: torch.Tensor) -> Any:
        raise NotImplementedError(
            "rollout: expected first derivatives, got a second one, which the engine does not have; "
            "differences of gradients give it"
        )


_OWN = 5  # arguments of _Function before the inputs


class _Function(torch.autograd.Function):
    @staticmethod
    def forward(  # type: ignore[override]
        ctx: Any,
        function: _Rollout,
        kinks: str,
        smoothing: Smoothing | None,
        on_failure: str,
        like: torch.Tensor,
        *inputs: torch.Tensor | None,
    ) -> torch.Tensor:
        arrays = [_numpy(tensor) for tensor in inputs]
        states, ctx.pull = function.vjp(
            *arrays, kinks=kinks, smoothing=smoothing, on_failure=on_failure
        )
        ctx.inputs = [None if t is None else (t.shape, t.dtype, t.device) for t in inputs]
        ctx.batched = states.ndim > (1 if function._single else 2)
        # Records that a run has not reached are NaN; the last one tells whether it has failed.
        axes = tuple(range(1 if ctx.batched else 0, states.ndim))
        ctx.failed = np.isnan(states).any(axis=axes)
        ctx.save_for_backward(*inputs)
        return torch.as_tensor(states).to(device=like.device, dtype=like.dtype)

    @staticmethod
    def backward(ctx: Any, bar: torch.Tensor) -> Any:  # type: ignore[override]
        # Inputs that have changed since do not matter to the tape, but to a second derivative.
        inputs = ctx.saved_tensors if torch.is_grad_enabled() else ()
        return (*[None] * _OWN, *_Gradients.apply(ctx, bar, *inputs))


def rollout(
    function: _Rollout,
    parameters: torch.Tensor | None = None,
    initial_state: torch.Tensor | None = None,
    controls: torch.Tensor | None = None,
    *,
    kinks: str = "element",
    smoothing: Smoothing | None = None,
    on_failure: str = "raise",
) -> torch.Tensor:
    """States of a `tangible.Rollout` of tensors, with gradients for all that are given.

    Args:
        function: What is rolled out; its arguments and shapes are those of `Rollout.__call__`.
        parameters, initial_state, controls: Tensors, with or without a batch's axis; the result has
            the dtype and device of the first that is given.
        kinks, smoothing: As of `Rollout.vjp`: where two-sided derivatives do not exist, "element"
            takes one element of the generalised Jacobian (`function.certificates` says where),
            "raise" an error, "smoothed" the mean of the Jacobians around.
        on_failure: "raise", or "nan" in states that were not reached: rows that failed have the
            derivative 0, so that a loss of the others (`torch.nanmean`, or a mask) can be minimised.
    """
    check_rollout(function)
    named = {"parameters": parameters, "initial_state": initial_state, "controls": controls}
    given = {name: tensor for name, tensor in named.items() if tensor is not None}
    for name, tensor in given.items():
        if not isinstance(tensor, torch.Tensor):
            raise TypeError(f"{name}: expected a tensor, got {type(tensor).__name__}")
        if not tensor.is_floating_point():
            # States, and gradients, of its dtype would be cut to whole numbers.
            raise TypeError(f"{name}: expected a tensor of floating-point numbers, got {tensor.dtype}")
        if forward_ad.unpack_dual(tensor).tangent is not None:
            raise NotImplementedError(
                f"{name}: expected a tensor without a tangent of forward mode; Rollout.jvp takes one"
            )
    like = next(iter(given.values()), torch.empty(0, dtype=torch.float64))
    if not torch.is_grad_enabled() or not any(tensor.requires_grad for tensor in given.values()):
        # Without a derivative to take no tape is needed, and a kink is none of the caller's business.
        check_kinks(kinks, smoothing)
        arrays = [_numpy(tensor) for tensor in (parameters, initial_state, controls)]
        states = function(*arrays, on_failure=on_failure)
        return torch.as_tensor(states).to(device=like.device, dtype=like.dtype)
    result: torch.Tensor = _Function.apply(
        function, kinks, smoothing, on_failure, like, parameters, initial_state, controls
    )
    return result


class RolloutLayer(torch.nn.Module):
    """A rollout whose scene's parameters are learned, and stay in the ranges of the scene.

    Each parameter is kept as a torch parameter q, which begins at 0 or in the middle: p = initial
    exp(q) where it must be positive (a mass, a stiffness) or may not be negative (a friction),
    p = low + (high - low) sigmoid(q) between two bounds (a restitution), and p = initial + q
    otherwise. Where the scene's value is itself the end of a range (a friction of 0), p = initial + q
    is cut off at the range, with the derivative that it has inside, so that it can leave the end.

    Args:
        scene: As of `tangible.Rollout`.
        parameters: Paths that are learned; they start at the scene's values.
        controls, records: As of `tangible.Rollout`.
        positive: Further paths that stay above 0.
        bounds: {path: (low, high)}, in the place of the scene's range; its value lies between.
        kinks, smoothing, on_failure: As of `rollout`.
    """

    start: torch.Tensor
    low: torch.Tensor
    high: torch.Tensor

    def __init__(
        self,
        scene: SceneLike,
        parameters: Sequence[str],
        controls: Sequence[str] = (),
        *,
        records: Iterable[int] | None = None,
        positive: Sequence[str] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        kinks: str = "element",
        smoothing: Smoothing | None = None,
        on_failure: str = "raise",
    ) -> None:
        super().__init__()
        parameters = paths(parameters, "parameters")
        self.function = _Rollout(scene, parameters, controls, records=records)
        self.kinks = kinks
        self.smoothing = smoothing
        self.on_failure = on_failure
        if positive is not None:
            positive = paths(positive, "positive")
        if bounds is not None:
            mapping(bounds, "bounds", "a dict {path: (low, high)}")
        choice(on_failure, "on_failure", "raise", "nan")
        check_kinks(kinks, smoothing)
        one_value(self.function, parameters, "parameters")
        start = torch.as_tensor(self.function.default_parameters)
        limits = dict(bounds or {})
        for name in [*(positive or []), *limits]:
            if name not in parameters:
                raise ValueError(f"{name}: expected one of {', '.join(parameters)}")
        ranges = [self._range(path, limits, positive or []) for path in parameters]
        low = torch.tensor([r[0] for r in ranges], dtype=torch.float64)
        high = torch.tensor([r[1] for r in ranges], dtype=torch.float64)
        given = torch.tensor([p in limits for p in parameters], dtype=torch.bool)
        kept = torch.tensor([p in (positive or []) for p in parameters], dtype=torch.bool)
        if bool((kept & (start <= 0.0)).any()):
            raise ValueError("positive: expected a scene whose values are > 0")
        if bool((given & ((start <= low) | (start >= high))).any()):
            raise ValueError("bounds: expected the scene's values between them")
        self.register_buffer("start", start)
        self.register_buffer("low", low)
        self.register_buffer("high", high)
        share = torch.where(self._bounded(), (start - low) / (high - low), torch.full_like(start, 0.5))
        self.q = torch.nn.Parameter(torch.where(self._bounded(), torch.logit(share), 0.0 * start))

    # Which formula of `values` holds follows from what is saved with a layer's state.

    def _inside(self) -> torch.Tensor:
        return (self.start > self.low) & (self.start < self.high)

    def _bounded(self) -> torch.Tensor:
        return self._inside() & torch.isfinite(self.low) & torch.isfinite(self.high)

    def _positive(self) -> torch.Tensor:
        return self._inside() & (self.low == 0.0) & torch.isinf(self.high)

    def _range(
        self, path: str, limits: Mapping[str, tuple[float, float]], positive: Sequence[str]
    ) -> tuple[float, float]:
        if path in limits:
            pair = limits[path]
            if not isinstance(pair, (tuple, list)) or len(pair) != 2:
                raise TypeError(f"bounds: {path}: expected (low, high), got {said(pair)}")
            return self._bound(pair[0], path), self._bound(pair[1], path)
        low, high = self.function.scene.range(path)
        return (max(low, 0.0) if path in positive else low), high

    @staticmethod
    def _bound(value: object, path: str) -> float:
        if isinstance(value, bool) or not isinstance(value, Real) or value != value:
            raise TypeError(f"bounds: {path}: expected (low, high), got {said(value)} in it")
        return float(value)

    def extra_repr(self) -> str:
        """What `print` shows of the layer."""
        values = self.values().tolist()
        return ", ".join(
            f"{path}={value:.6g}" for path, value in zip(self.function.parameters, values)
        )

    def values(self) -> torch.Tensor:
        """The parameters p, shape (P,), in SI units."""
        is_positive, is_bounded = self._positive(), self._bounded()
        positive = self.start * torch.exp(torch.where(is_positive, self.q, 0.0 * self.q))
        low = torch.where(is_bounded, self.low, torch.zeros_like(self.low))
        high = torch.where(is_bounded, self.high, torch.ones_like(self.high))
        bounded = low + (high - low) * torch.sigmoid(self.q)
        free = self.start + self.q
        # The value is cut off at the range, the derivative is not.
        free = free + (torch.minimum(torch.maximum(free, self.low), self.high) - free).detach()
        return torch.where(is_positive, positive, torch.where(is_bounded, bounded, free))

    def forward(
        self,
        initial_state: torch.Tensor | None = None,
        controls: torch.Tensor | None = None,
    ) -> torch.Tensor:
        """States, as `rollout` gives them."""
        return rollout(
            self.function,
            self.values(),
            initial_state,
            controls,
            kinks=self.kinks,
            smoothing=self.smoothing,
            on_failure=self.on_failure,
        )
