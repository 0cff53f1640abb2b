"""Rollouts as a differentiable function of torch tensors; the adjoint is the backward pass.

Tensors keep their dtype and device outside; inside everything is computed in double precision on the
CPU. Derivatives are first ones; a second one raises `NotImplementedError` where it is asked for, and
is never left out. torch is imported with this module, not with `tangible`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import torch

from ._rollout import Rollout as _Rollout
from ._rollout import Smoothing
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
        for value, entry, needed in zip(found, of.inputs, of.needs_input_grad[4:]):
            if entry is None or not needed:
                gradients.append(None)
                continue
            shape, dtype, device = entry
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


class _Function(torch.autograd.Function):
    @staticmethod
    def forward(  # type: ignore[override]
        ctx: Any,
        function: _Rollout,
        kinks: str,
        smoothing: Smoothing | None,
        like: torch.Tensor,
        *inputs: torch.Tensor | None,
    ) -> torch.Tensor:
        arrays = [_numpy(tensor) for tensor in inputs]
        # Without a derivative to take, a kink is none of the caller's business.
        of_kinks = kinks if any(ctx.needs_input_grad) else "element"
        states, ctx.pull = function.vjp(*arrays, kinks=of_kinks, smoothing=smoothing)
        ctx.inputs = [None if t is None else (t.shape, t.dtype, t.device) for t in inputs]
        ctx.batched = states.ndim > (1 if function._single else 2)
        ctx.save_for_backward(*inputs)
        return torch.as_tensor(states).to(device=like.device, dtype=like.dtype)

    @staticmethod
    def backward(ctx: Any, bar: torch.Tensor) -> Any:  # type: ignore[override]
        # Inputs that have changed since do not matter to the tape, but to a second derivative.
        inputs = ctx.saved_tensors if torch.is_grad_enabled() else ()
        return (None, None, None, None, *_Gradients.apply(ctx, bar, *inputs))


def rollout(
    function: _Rollout,
    parameters: torch.Tensor | None = None,
    initial_state: torch.Tensor | None = None,
    controls: torch.Tensor | None = None,
    *,
    kinks: str = "element",
    smoothing: Smoothing | None = None,
) -> torch.Tensor:
    """States of a `tangible.Rollout` of tensors, with gradients for all that are given.

    Args:
        function: What is rolled out; its arguments and shapes are those of `Rollout.__call__`.
        parameters, initial_state, controls: Tensors, with or without a batch's axis; the result has
            the dtype and device of the first that is given.
        kinks, smoothing: As of `Rollout.vjp`: where two-sided derivatives do not exist, "element"
            takes one element of the generalised Jacobian (`function.certificates` says where),
            "raise" an error, "smoothed" the mean of the Jacobians around.
    """
    named = {"parameters": parameters, "initial_state": initial_state, "controls": controls}
    given = {name: tensor for name, tensor in named.items() if tensor is not None}
    for name, tensor in given.items():
        if not isinstance(tensor, torch.Tensor):
            raise TypeError(f"{name}: expected a tensor, got {type(tensor).__name__}")
        if not tensor.is_floating_point():
            # States, and gradients, of its dtype would be cut to whole numbers.
            raise TypeError(f"{name}: expected a tensor of floating-point numbers, got {tensor.dtype}")
    like = next(iter(given.values()), torch.empty(0, dtype=torch.float64))
    result: torch.Tensor = _Function.apply(
        function, kinks, smoothing, like, parameters, initial_state, controls
    )
    return result


class RolloutLayer(torch.nn.Module):
    """A rollout whose scene's parameters are learned, and stay physical.

    Each parameter is kept as a torch parameter q: p = initial exp(q) where it must be positive (a
    mass, a radius), p = low + (high - low) sigmoid(q) where bounds are given, and p = initial + q
    otherwise.

    Args:
        scene: As of `tangible.Rollout`.
        parameters: Paths that are learned; they start at the scene's values.
        controls, records: As of `tangible.Rollout`.
        positive: Paths that stay above 0; absent: masses, inertias, radii and sizes.
        bounds: {path: (low, high)}; the scene's value lies between.
        kinks, smoothing: As of `rollout`.
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
    ) -> None:
        super().__init__()
        self.function = _Rollout(scene, parameters, controls, records=records)
        self.kinks = kinks
        self.smoothing = smoothing
        start = torch.as_tensor(self.function.default_parameters)
        ends = ("/mass", "/inertia", "/radius", "/size/x", "/size/y", "/length")
        kept = [p for p in parameters if p.endswith(ends)] if positive is None else list(positive)
        limits = dict(bounds or {})
        for name in [*kept, *limits]:
            if name not in parameters:
                raise ValueError(f"{name}: expected one of {', '.join(parameters)}")
        self._positive = torch.tensor([p in kept and p not in limits for p in parameters])
        self._bounded = torch.tensor([p in limits for p in parameters])
        low = torch.tensor([limits.get(p, (0.0, 1.0))[0] for p in parameters], dtype=torch.float64)
        high = torch.tensor([limits.get(p, (0.0, 1.0))[1] for p in parameters], dtype=torch.float64)
        if bool((self._positive & (start <= 0.0)).any()):
            raise ValueError("positive: expected a scene whose values are > 0")
        if bool((self._bounded & ((start <= low) | (start >= high))).any()):
            raise ValueError("bounds: expected the scene's values between them")
        self.register_buffer("start", start)
        self.register_buffer("low", low)
        self.register_buffer("high", high)
        share = torch.where(self._bounded, (start - low) / (high - low), torch.full_like(start, 0.5))
        self.q = torch.nn.Parameter(torch.where(self._bounded, torch.logit(share), 0.0 * start))

    def extra_repr(self) -> str:
        """What `print` shows of the layer."""
        values = self.values().tolist()
        return ", ".join(
            f"{path}={value:.6g}" for path, value in zip(self.function.parameters, values)
        )

    def values(self) -> torch.Tensor:
        """The parameters p, shape (P,), in SI units."""
        positive = self.start * torch.exp(torch.where(self._positive, self.q, 0.0 * self.q))
        bounded = self.low + (self.high - self.low) * torch.sigmoid(self.q)
        free = self.start + self.q
        return torch.where(self._positive, positive, torch.where(self._bounded, bounded, free))

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
        )
