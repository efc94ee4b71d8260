"""Records of episodes, as far as plans and arms have them alike, and why one has no result."""

from typing import Any, TypeVar

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.quantities import Count, Number

# Two of the ways in which an episode ends.
DONE = "done"
NOT_ATTEMPTED = "not attempted"


class EpisodeRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One episode, and what the subject did in it.

    Attributes:
        index: place in the trajectory.
        reward: reward of all steps.
        max_reward: highest possible reward; None if it is not known.
        ended: how it ended; "not attempted" if an earlier one ended the trajectory, and empty if
            the subject failed or the episode is excluded.
    """

    index: Count
    kind: str
    steps: tuple[Any, ...] = ()
    reward: Number = 0.0
    max_reward: Number | None = None
    ended: str = ""

    @property
    def attempted(self) -> bool:
        """Whether the subject acted in it up to its end."""
        return self.ended not in ("", NOT_ATTEMPTED)

    @property
    def done(self) -> bool:
        """Whether it is a success."""
        return self.ended == DONE


P = TypeVar("P", bound=EpisodeRecord)


class InfeasibleError(DataError):
    """Nobody can succeed in an episode in this simulator, so it is excluded for every subject."""
