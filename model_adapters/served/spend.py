"""Tokens and cost of requests, caps on both, and rate limits."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Condition, Lock

from infthor_eval.errors import NotAskedError
from model_adapters.served.completion import TokenUsage
from model_adapters.served.options import ServedOptions

_MILLION = 1_000_000


@dataclass(frozen=True)
class Prices:
    """US dollars per million tokens.

    Attributes:
        prompt: tokens of requests.
        cached: tokens of requests that were in the server's cache.
        reply: tokens of replies.
        stored: tokens of requests that were put into the server's cache; as `prompt` where None.
    """

    prompt: float
    cached: float
    reply: float
    stored: float | None = None

    @classmethod
    def of(cls, options: ServedOptions) -> "Prices | None":
        """Return the prices that a user gave, or None."""
        prompt = options.price_per_m_input
        reply = options.price_per_m_output
        if prompt is None or reply is None:
            return None
        cached = options.price_per_m_cached
        cached = prompt if cached is None else cached
        return cls(prompt, cached, reply, options.price_per_m_cache_write)

    def cost(self, usage: TokenUsage) -> float:
        """Return the US dollars of one reply."""
        n_cached = usage.n_cached or 0
        n_new = usage.prompt_tokens - n_cached - usage.n_stored
        stored = self.prompt if self.stored is None else self.stored
        return (
            n_new * self.prompt
            + n_cached * self.cached
            + usage.n_stored * stored
            + usage.completion_tokens * self.reply
        ) / _MILLION


@dataclass(frozen=True)
class Caps:
    """Caps on a run's tokens, of requests and replies, and cost in US dollars; None for no cap."""

    tokens: int | None = None
    cost: float | None = None


@dataclass
class Charge:
    """Tokens and cost of one request, filled in when they are known.

    Attributes:
        tokens: tokens of request and reply, or None if the server does not report them.
        cost: cost in US dollars.
        sent: true if a reply arrived, which may have been charged for.
    """

    tokens: int | None = None
    cost: float = 0.0
    sent: bool = False


class Spend:
    """Tokens and cost so far, for several threads.

    Once a cap is reached, requests are refused before they are sent. Requests in flight count with
    the largest tokens and cost so far, and a new request waits for them if they may use up the
    rest. So a cap is exceeded by at most one request, not by one per thread, as long as no request
    costs more than all before. A reply without usage counts as the largest so far; before the first
    usage is reported, caps cannot be enforced.
    """

    def __init__(self, name: str, caps: Caps) -> None:
        self._name = name
        self._caps = caps
        self._changed = Condition()
        self._tokens = self._in_flight = self._most_tokens = 0
        self._cost = self._most_cost = 0.0
        self._has_unknown_usage = False

    @contextmanager
    def request(self) -> Iterator[Charge]:
        """Account for one request; what the charge is filled with counts even if it fails later."""
        charge = Charge()
        self._admit()
        try:
            yield charge
        finally:
            self._settle(charge)

    def room(self) -> int | None:
        """Return how many requests may be sent together, if each takes as much as the largest so
        far; None without caps. The first one is unpredictable, so it goes alone.
        """
        with self._changed:
            self._check_caps()
            if self._caps == Caps():
                return None
            rooms = [1.0] if not self._most_tokens else []
            if self._caps.tokens is not None and self._most_tokens:
                rooms.append((self._caps.tokens - self._tokens) / self._most_tokens)
            if self._caps.cost is not None and self._most_cost:
                rooms.append((self._caps.cost - self._cost) / self._most_cost)
            return max(1, math.floor(min(rooms))) if rooms else None

    def add(self, charge: Charge) -> None:
        """Count a request that was sent without `request`, in a batch."""
        with self._changed:
            self._in_flight += 1
        self._settle(charge)

    def _admit(self) -> None:
        with self._changed:
            while self._in_flight and self._may_reach_cap_in_flight():
                self._changed.wait()
            self._check_caps()
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
                self._has_unknown_usage = self._has_unknown_usage or not self._most_tokens
                self._tokens += self._most_tokens
                self._cost += self._most_cost
            self._changed.notify_all()

    def _may_reach_cap_in_flight(self) -> bool:
        """Return whether requests in flight may use up the rest; the first one is unpredictable, so
        it runs alone."""
        if self._caps == Caps():
            return False
        tokens = self._tokens + self._in_flight * self._most_tokens
        cost = self._cost + self._in_flight * self._most_cost
        return (
            not self._most_tokens
            or _is_reached(tokens, self._caps.tokens)
            or _is_reached(cost, self._caps.cost)
        )

    def _check_caps(self) -> None:
        """Raise `NotAskedError` if no more requests may be sent."""
        if self._has_unknown_usage and self._caps != Caps():
            raise NotAskedError(
                f"not asked: {self._name} does not report the usage of its replies, so caps cannot "
                "be enforced; leave out max_tokens_total and max_cost"
            )
        hint = "raise it and run the same command again, which resumes"
        if _is_reached(self._tokens, self._caps.tokens):
            raise NotAskedError(
                f"not asked: {self._tokens} tokens reach max_tokens_total={self._caps.tokens}; "
                f"{hint}"
            )
        if _is_reached(self._cost, self._caps.cost):
            raise NotAskedError(
                f"not asked: {self._cost:.4f} US dollars reach max_cost={self._caps.cost:g}; {hint}"
            )


def _is_reached(used: float, cap: float | None) -> bool:
    return cap is not None and used >= cap


class RateLimiter:
    """Grants a number of units per minute, evenly: after each grant, the next one waits until its
    time has passed.

    Servers count in their own windows, often shorter than a minute, so unused units are not saved
    up for a burst. Several threads may use it at once. A rate of None sets no limit.
    """

    def __init__(self, per_minute: float | None) -> None:
        self._seconds_per_unit = 0.0 if per_minute is None else 60.0 / per_minute
        self._free_at = 0.0  # on the clock of time.monotonic
        self._lock = Lock()

    def wait(self, amount: float = 1.0) -> None:
        """Wait for some units and take them."""
        with self._lock:
            now = time.monotonic()
            begin = max(now, self._free_at)
            self._free_at = begin + amount * self._seconds_per_unit
        if begin > now:
            time.sleep(begin - now)

    def take(self, amount: float) -> None:
        """Take units that were used already, without waiting; a negative amount returns them."""
        with self._lock:
            self._free_at = max(time.monotonic(), self._free_at) + amount * self._seconds_per_unit
