"""What the requests of a run took: how many, their tokens, and their cost."""

import math
from collections.abc import Iterable

import msgspec

from model_adapters import Reply

__all__ = ["NOTHING", "Usage"]

_DIGITS = 9  # of dollars: what is beyond is rounding


class Usage(msgspec.Struct, frozen=True, omit_defaults=True):
    """What some requests took, all together; a count that the model does not tell is left out.

    Attributes:
        requests: that were answered.
        context: their tokens, frames included.
        cached: how many of these were not encoded again.
        reply: tokens of the replies.
        cost: in US dollars, by the prices given when they were asked; None where none were.
    """

    requests: int = 0
    context: int = 0
    cached: int = 0
    reply: int = 0
    cost: float | None = None

    @classmethod
    def of(cls, replies: Iterable[Reply]) -> "Usage":
        """What these replies took."""
        return cls.total(
            cls(1, reply.n_context_tokens or 0, reply.n_cached_tokens or 0, reply.n_reply_tokens or 0, reply.cost)
            for reply in replies
        )

    @classmethod
    def total(cls, usages: Iterable["Usage"]) -> "Usage":
        """All of them together."""
        kept = list(usages)
        costs = [usage.cost for usage in kept if usage.cost is not None]
        return cls(
            requests=sum(usage.requests for usage in kept),
            context=sum(usage.context for usage in kept),
            cached=sum(usage.cached for usage in kept),
            reply=sum(usage.reply for usage in kept),
            cost=round(math.fsum(costs), _DIGITS) if costs else None,
        )

    @property
    def description(self) -> str:
        """In words."""
        cost = "" if self.cost is None else f", {self.cost:.4f} US dollars"
        return (
            f"{self.requests:,} requests, {self.context:,} tokens read ({self.cached:,} of them cached), "
            f"{self.reply:,} written{cost}"
        )


NOTHING = Usage()
