"""Usage: number, tokens and cost of requests."""

import math
from collections.abc import Iterable

import msgspec

from infthor_eval.quantities import Amount, Count
from model_adapters import Reply

_DIGITS = 9  # of dollars; further digits depend on the order of the sum


class Usage(msgspec.Struct, frozen=True, omit_defaults=True):
    """Usage of some requests together; a count that the model does not report is left out.

    Attributes:
        requests: number of answered requests.
        context: tokens of the requests, frames included.
        cached: those of them that were not encoded again.
        reply: tokens of the replies.
        cost: cost in US dollars by the prices given for the run; None without prices.
    """

    requests: Count = 0
    context: Count = 0
    cached: Count = 0
    reply: Count = 0
    cost: Amount | None = None

    @classmethod
    def of(cls, replies: Iterable[Reply]) -> "Usage":
        """Return the usage of replies."""
        return cls.total(
            cls(
                1,
                reply.n_context_tokens or 0,
                reply.n_cached_tokens or 0,
                reply.n_reply_tokens or 0,
                reply.cost,
            )
            for reply in replies
        )

    @classmethod
    def total(cls, usages: Iterable["Usage"]) -> "Usage":
        """Return the sum of several usages."""
        summands = list(usages)
        costs = [usage.cost for usage in summands if usage.cost is not None]
        return cls(
            requests=sum(usage.requests for usage in summands),
            context=sum(usage.context for usage in summands),
            cached=sum(usage.cached for usage in summands),
            reply=sum(usage.reply for usage in summands),
            cost=round(math.fsum(costs), _DIGITS) if costs else None,
        )

    @property
    def hit_rate(self) -> float | None:
        """Share of the context's tokens not encoded again, 0 to 1; None if none were counted."""
        return self.cached / self.context if self.context else None

    @property
    def description(self) -> str:
        """The usage in words."""
        cost = "" if self.cost is None else f", {self.cost:.4f} US dollars"
        requests = f"{self.requests:,} request{'s' if self.requests != 1 else ''}"
        if self.requests and self.hit_rate is None:
            return f"{requests}, their tokens not counted{cost}"
        share = "" if self.hit_rate is None else f", {100 * self.hit_rate:.1f} %"
        return (
            f"{requests}, {self.context:,} tokens read ({self.cached:,} of them cached{share}), "
            f"{self.reply:,} written{cost}"
        )


NOTHING = Usage()
