"""Muon: steps of matrices whose singular values are about equal, whatever the gradient's are.

torch's own computes them in bfloat16, which takes longer than the rest of a step on processors
without instructions for it. This one computes in the matrices' own precision, and is otherwise
equal.
"""

from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch import Tensor
from torch.nn import Parameter

# A polynomial that brings singular values between 0 and 1 near 1 in a few rounds (Jordan et al.,
# 2024, https://kellerjordan.github.io/posts/muon).
_COEFFICIENTS = (3.4445, -4.7750, 2.0315)
_N_ROUNDS = 5
_SMALLEST = 1e-7  # norm of a gradient
_ADAM_RMS = 0.2  # of the elements of AdamW's steps, so that its learning rates can be used


class Muon(torch.optim.Optimizer):
    """Momentum, made orthogonal, with decoupled weight decay; for matrices alone.

    Args:
        parameters: matrices.
        lr: learning rate; steps are as large as AdamW's of this rate.
        weight_decay: share of a matrix that is taken off in a step, times `lr`.
        momentum: share of the earlier gradients that remains, with Nesterov's look ahead.
    """

    def __init__(
        self,
        parameters: Iterable[Parameter],
        lr: float,
        weight_decay: float = 0.0,
        momentum: float = 0.95,
    ) -> None:
        defaults = {"lr": lr, "weight_decay": weight_decay, "momentum": momentum}
        super().__init__(parameters, defaults)
        for group in self.param_groups:
            for parameter in group["params"]:
                if parameter.ndim != 2:
                    raise ValueError(f"a parameter has {parameter.ndim} dimensions; use matrices")

    @torch.no_grad()
    def step(self, closure: Callable[[], Any] | None = None) -> None:  # type: ignore[override]
        """Change the matrices by their gradients; those without one stay."""
        if closure is not None:
            raise ValueError("closures are not supported; compute the loss before the step")
        for group in self.param_groups:
            for parameter in group["params"]:
                if parameter.grad is not None:
                    self._change(parameter, group)

    def _change(self, parameter: Parameter, group: dict[str, Any]) -> None:
        state = self.state[parameter]
        if not state:
            state["momentum"] = torch.zeros_like(parameter)
        assert parameter.grad is not None
        momentum = state["momentum"].lerp_(parameter.grad, 1 - group["momentum"])
        ahead = parameter.grad.lerp(momentum, group["momentum"])
        scale = _ADAM_RMS * max(parameter.shape) ** 0.5
        parameter.mul_(1 - group["lr"] * group["weight_decay"])
        parameter.add_(_orthogonal(ahead), alpha=-group["lr"] * scale)


def _orthogonal(matrix: Tensor) -> Tensor:
    """Return a matrix with the same singular vectors, and singular values between 0.5 and 1.5."""
    linear, cubic, quintic = _COEFFICIENTS
    is_tall = matrix.shape[0] > matrix.shape[1]
    result = matrix.T if is_tall else matrix
    result = result / result.norm().clamp(min=_SMALLEST)
    for _ in range(_N_ROUNDS):
        gram = result @ result.T
        result = torch.addmm(
            result, torch.addmm(gram, gram, gram, beta=cubic, alpha=quintic), result, beta=linear
        )
    return result.T if is_tall else result
