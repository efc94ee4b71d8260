"""Running the episodes of one trajectory in a simulator, and recording them."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.episodes.retries import with_retries
from infthor_eval.errors import InfthorError, NotAskedError, SceneError
from infthor_eval.runs import (
    NOTHING,
    Session,
    StoredRequest,
    Tokens,
    Unit,
    UnitRecord,
    Usage,
    keep_request,
)
from infthor_eval.thor.simulator import Simulator

P = TypeVar("P")
E = TypeVar("E")


@dataclass(frozen=True)
class EpisodeResult(Generic[P]):
    """The result of an episode.

    Attributes:
        tokens: tokens of its requests; None if there were none, which is not recorded.
        faults: faults of the model that were retried.
    """

    payload: P
    tokens: Tokens | None = None
    faults: tuple[str, ...] = ()


class EpisodeRunner(Generic[E, P]):
    """A trajectory's environment, in which one episode is run after the other.

    Attributes:
        begun: payload of the present episode once it has begun, without steps; recorded if the
            subject fails.
        usage: usage of all requests for the present episode, with those of tries that were retried.
        request: the request before the first step of the present episode; None if there is none.
    """

    begun: P | None
    usage: Usage
    request: StoredRequest | None

    def __init__(self, simulator: Simulator, build: Callable[[], E]) -> None:
        """Take a trajectory's simulator, and what builds its environment and restores the scene."""
        self._simulator = simulator
        self._build = build
        self._environment: E | None = None

    @property
    def environment(self) -> E:
        """The environment, built for the first episode and after the simulator failed for good."""
        if self._environment is None:
            self._environment = self._build()
        return self._environment

    def record(
        self,
        unit: Unit[P],
        fingerprint: str,
        run: Callable[[], EpisodeResult[P]],
        session: Session[P],
    ) -> UnitRecord[P]:
        """Run an episode, again if the simulator fails for good, and record it or its error."""
        self.begun = None
        self.usage = NOTHING
        self.request = None
        start = time.perf_counter()
        try:
            result, faults = with_retries(self._simulator, run, self._drop_environment)
        except (InfeasibleError, SceneError) as error:
            keep_request(self.request, session)  # that of a later episode may continue it
            return unit.record_exclusion(str(error), fingerprint)
        except InfthorError as error:
            begun = unit if self.begun is None else replace(unit, payload=self.begun)
            return begun.record_failure(
                session.describe_failure(unit, error),
                fingerprint,
                asked=not isinstance(error, NotAskedError),
                usage=self.usage,
                request=keep_request(self.request, session),
            )
        return unit.record(
            fingerprint,
            result.payload,
            faults=(*faults, *result.faults),
            seconds=round(time.perf_counter() - start, 4),
            usage=self.usage,
            request=keep_request(self.request, session),
            **({} if result.tokens is None else {"tokens": result.tokens}),
        )

    def _drop_environment(self) -> None:
        self._environment = None
