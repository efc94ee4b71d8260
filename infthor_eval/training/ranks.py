"""Division of a training run among processes, and the sum of their gradients."""

from collections.abc import Iterable
from dataclasses import dataclass

import torch
import torch.distributed as dist
from torch.nn import Parameter

from infthor_eval.errors import UsageError


@dataclass(frozen=True)
class Ranks:
    """A process's position in a grid of data groups and context ranks.

    Attributes:
        rank: rank among all processes.
        data_rank: number of its data group, which determines its sequences.
        n_data: number of data groups.
        context_rank: number of its part of each sequence.
        n_context: number of parts of each sequence.
        context_group: processes with the same sequences, or None if sequences are not split.
    """

    rank: int = 0
    data_rank: int = 0
    n_data: int = 1
    context_rank: int = 0
    n_context: int = 1
    context_group: dist.ProcessGroup | None = None

    @property
    def n_ranks(self) -> int:
        """Number of processes."""
        return self.n_data * self.n_context


def assign_ranks(n_context: int = 1) -> Ranks:
    """Return this process's position; neighbouring ranks, with the fastest links, share sequences.

    All processes of the default process group have to call this. Without a group, the process is
    alone.

    Args:
        n_context: number of parts of each sequence.
    """
    world = dist.get_world_size() if dist.is_initialized() else 1
    if n_context < 1 or world % n_context:
        raise UsageError(
            f"{world} processes cannot share sequences by {n_context}; give a divisor of {world}"
        )
    if world == 1:
        return Ranks()
    rank = dist.get_rank()
    data_rank, context_rank = divmod(rank, n_context)
    # Creating a group is collective: every process has to create every group.
    firsts = range(0, world, n_context) if n_context > 1 else ()
    groups = [dist.new_group(list(range(first, first + n_context))) for first in firsts]
    group = groups[data_rank] if groups else None
    return Ranks(rank, data_rank, world // n_context, context_rank, n_context, group)


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
