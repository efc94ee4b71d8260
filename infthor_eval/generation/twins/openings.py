"""The kind in which one of two containers is opened once more."""

import random
from collections.abc import Iterator
from typing import ClassVar

from infthor_eval.formats.trajectory import ApiAction
from infthor_eval.generation.twins.episode import ASKED_OPEN, Episode
from infthor_eval.generation.twins.insertions import Insertion, in_reach, moments
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.view import ThorObject


class CountOpen:
    """A container is opened once more than another one of another type."""

    name: ClassVar[str] = "count-open"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Insertion]:
        """See `EditKind`: where both are seen closed, in reach, between two actions of a task."""
        for index in moments(episode, rng):
            by_type: dict[str, ThorObject] = {}
            for obj in _closed_in_reach(episode, index):
                by_type.setdefault(canonical_type(obj.object_type), obj)
            if len(by_type) > 1:
                one, other = (by_type[name] for name in rng.sample(sorted(by_type), 2))
                yield Insertion(
                    index=index,
                    actions=(_open_and_close(one), _open_and_close(other)),
                    keys=frozenset({one.object_id, other.object_id}),
                    types=frozenset({one.object_type, other.object_type}),
                )


def _open_and_close(obj: ThorObject) -> list[ApiAction]:
    return [ApiAction(name, obj.object_id) for name in ("OpenObject", "CloseObject")]


def _closed_in_reach(episode: Episode, frame: int) -> list[ThorObject]:
    states = episode.history.states(frame)
    return [
        obj
        for obj in in_reach(episode, frame)
        if states[obj.object_id].is_open is False
        and not states[obj.object_id].is_on  # a microwave that is on stays closed
        and obj.object_type in ASKED_OPEN
    ]
