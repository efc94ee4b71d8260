"""Which part of the work each process of a training run does."""

from dataclasses import dataclass

import torch.distributed as dist

from infthor_eval.errors import UsageError

__all__ = ["Ranks", "assign_ranks"]


@dataclass(frozen=True)
class Ranks:
    """A process's place in a grid of data groups times context.

    Attributes:
        rank: of all processes.
        data_rank: which of the sequences are its.
        n_data: in how many ways sequences are shared out.
        context_rank: which part of each of these sequences is its.
        n_context: in how many parts a sequence is cut.
        context_group: the processes that share its sequences; None where it has them alone.
    """

    rank: int = 0
    data_rank: int = 0
    n_data: int = 1
    context_rank: int = 0
    n_context: int = 1
    context_group: dist.ProcessGroup | None = None

    @property
    def n_ranks(self) -> int:
        """All processes."""
        return self.n_data * self.n_context


def assign_ranks(n_context: int = 1) -> Ranks:
    """This process's place; neighbouring ranks, which the fastest links join, share sequences.

    All processes of the default process group have to call it. Without one the process is alone.

    Args:
        n_context: in how many parts each sequence is cut.

    Raises:
        UsageError: the processes do not divide into groups of this size.
    """
    world = dist.get_world_size() if dist.is_initialized() else 1
    if n_context < 1 or world % n_context:
        raise UsageError(f"{world} processes cannot share sequences by {n_context}; give a divisor of {world}")
    if world == 1:
        return Ranks()
    rank = dist.get_rank()
    data_rank, context_rank = divmod(rank, n_context)
    group = None
    if n_context > 1:
        # Every process makes every group, or none of them comes about.
        firsts = range(0, world, n_context)
        groups = [dist.new_group(list(range(first, first + n_context))) for first in firsts]
        group = groups[data_rank]
    return Ranks(rank, data_rank, world // n_context, context_rank, n_context, group)
