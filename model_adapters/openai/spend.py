"""What requests take: tokens, money, and the caps on both."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Condition

from infthor_eval.errors import ModelError

__all__ = ["Caps", "Charge", "Prices", "Spend"]

_MILLION = 1_000_000


@dataclass(frozen=True)
class Prices:
    """US dollars of a million tokens.

    Attributes:
        read: of a request.
        cached: of a request, found in the server's cache.
        written: of a reply.
    """

    read: float
    cached: float
    written: float

    def cost(self, n_read: int, n_cached: int, n_written: int) -> float:
        """US dollars of one reply; the cached tokens are among those that are read."""
        dearly = n_read - n_cached
        return (dearly * self.read + n_cached * self.cached + n_written * self.written) / _MILLION


@dataclass(frozen=True)
class Caps:
    """What may be taken at most; None sets no limit.

    Attributes:
        tokens: of requests and replies.
        cost: in US dollars.
    """

    tokens: int | None = None
    cost: float | None = None


@dataclass
class Charge:
    """What one request took, filled in as soon as it is known.

    Attributes:
        tokens: of request and reply; None where the server does not tell.
        cost: in US dollars.
        sent: whether a reply came, which may have been charged for.
    """

    tokens: int | None = None
    cost: float = 0.0
    sent: bool = False


class Spend:
    """What was taken so far, for several threads.

    A request is refused once a cap is reached, before it is sent. What requests in flight will take is estimated by
    the dearest so far, and a request that could only be paid without them waits for their end: so a cap is passed by
    one request at most, not by one per thread, as long as none is dearer than all before. A reply that does not tell
    what it took counts as the dearest so far; where none has told yet, no cap can be kept.

    Args:
        name: of the model, for messages.
        caps: the caps.
    """

    def __init__(self, name: str, caps: Caps) -> None:
        self._name = name
        self._caps = caps
        self._changed = Condition()
        self._tokens = self._in_flight = self._most_tokens = 0
        self._cost = self._most_cost = 0.0
        self._untold = False

    @contextmanager
    def request(self) -> Iterator[Charge]:
        """One request, from before it is sent; what is filled into the charge counts in any case.

        Raises:
            ModelError: a cap is reached, or cannot be kept; nothing may be sent.
        """
        charge = Charge()
        self._admit()
        try:
            yield charge
        finally:
            self._settle(charge)

    def _admit(self) -> None:
        with self._changed:
            while self._in_flight and self._short_with_those_in_flight():
                self._changed.wait()
            reason = self._reason()
            if reason is not None:
                raise ModelError(reason)
            self._in_flight += 1

    def _settle(self, charge: Charge) -> None:
        with self._changed:
            self._in_flight -= 1
            if charge.tokens is not None:
                self._most_tokens = max(self._most_tokens, charge.tokens)
                self._most_cost = max(self._most_cost, charge.cost)
                self._tokens += charge.tokens
                self._cost += charge.cost
            elif charge.sent:
                self._untold = self._untold or not self._most_tokens
                self._tokens += self._most_tokens
                self._cost += self._most_cost
            self._changed.notify_all()

    def _short_with_those_in_flight(self) -> bool:
        """Whether those in flight may take what is left; of the first nothing is known, so it goes alone."""
        if self._caps == Caps():
            return False
        tokens = self._tokens + self._in_flight * self._most_tokens
        cost = self._cost + self._in_flight * self._most_cost
        return not self._most_tokens or _reached(tokens, self._caps.tokens) or _reached(cost, self._caps.cost)

    def _reason(self) -> str | None:
        """Why nothing more may be sent; None where it may."""
        if self._untold and self._caps != Caps():
            return (
                f"not asked: {self._name} does not tell what its replies take, so no cap can be kept; "
                "leave out max_tokens_total and max_cost"
            )
        mend = "raise it and run the same command again, which goes on where it was"
        if _reached(self._tokens, self._caps.tokens):
            return f"not asked: {self._tokens} tokens reach max_tokens_total={self._caps.tokens}; {mend}"
        if _reached(self._cost, self._caps.cost):
            return f"not asked: {self._cost:.4f} US dollars reach max_cost={self._caps.cost:g}; {mend}"
        return None


def _reached(taken: float, cap: float | None) -> bool:
    return cap is not None and taken >= cap
