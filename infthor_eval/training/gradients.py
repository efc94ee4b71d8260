"""Gradients of one loss that several processes have computed parts of."""

from collections.abc import Iterable

import torch
import torch.distributed as dist
from torch.nn import Parameter

__all__ = ["sum_gradients"]


def sum_gradients(parameters: Iterable[Parameter], group: dist.ProcessGroup | None = None) -> None:
    """Give every rank the sum of all ranks' gradients.

    A parameter that no rank has a gradient of stays without one, as in one process: an optimizer leaves it alone then,
    weight decay included.

    Args:
        parameters: the same ones in the same order on every rank.
        group: the ranks; all of them where None.
    """
    trained = [parameter for parameter in parameters if parameter.requires_grad]
    if not trained:
        return
    present = [parameter.grad is not None for parameter in trained]
    anywhere = torch.tensor(present, dtype=torch.int32, device=trained[0].device)
    dist.all_reduce(anywhere, dist.ReduceOp.MAX, group=group)
    for parameter, wanted in zip(trained, anywhere.tolist(), strict=True):
        if wanted:
            if parameter.grad is None:
                parameter.grad = torch.zeros_like(parameter)
            dist.all_reduce(parameter.grad, group=group)
