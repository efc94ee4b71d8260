"""Summation of gradients over processes."""

from collections.abc import Iterable

import torch
import torch.distributed as dist
from torch.nn import Parameter

__all__ = ["sum_gradients"]


def sum_gradients(parameters: Iterable[Parameter], group: dist.ProcessGroup | None = None) -> None:
    """Replace every rank's gradients by the sum over all ranks.

    A parameter without a gradient on any rank stays without one, as in a single process: the
    optimizer then skips it, including its weight decay.

    Args:
        parameters: the parameters, in the same order on every rank.
        group: the ranks; all of them where None.
    """
    trained = [parameter for parameter in parameters if parameter.requires_grad]
    if not trained:
        return
    has_gradient = [parameter.grad is not None for parameter in trained]
    anywhere = torch.tensor(has_gradient, dtype=torch.int32, device=trained[0].device)
    dist.all_reduce(anywhere, dist.ReduceOp.MAX, group=group)
    for parameter, is_present in zip(trained, anywhere.tolist(), strict=True):
        if is_present:
            if parameter.grad is None:
                parameter.grad = torch.zeros_like(parameter)
            dist.all_reduce(parameter.grad, group=group)
