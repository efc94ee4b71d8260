"""The kind in which one of two containers is opened once more."""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from infthor_eval.formats.trajectory import ApiAction
from infthor_eval.generation.twins.episode import ASKED_OPEN, Episode
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.rewriting import with_inserted
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject

__all__ = ["CountOpen"]


@dataclass(frozen=True)
class _OneMore:
    """At one moment one of two containers is opened and closed again.

    Attributes:
        index: index of the action before which that is.
        one: a container.
        other: another one, of another type.
    """

    index: int
    one: ThorObject
    other: ThorObject

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`."""
        first, second = (
            with_inserted(
                episode.trajectory,
                self.index,
                [ApiAction(name, obj.object_id) for name in ("OpenObject", "CloseObject")],
            )
            for obj in (self.one, self.other)
        )
        both = {self.one.object_id, self.other.object_id}
        inside = (key for holder in both for key in episode.inside(holder, self.index))
        return Worlds(
            pair=(first, second),
            changed=frozenset(both.union(inside)),
            types=frozenset({self.one.object_type, self.other.object_type}),
        )


class CountOpen:
    """A container is opened once more than another one of another type."""

    name: ClassVar[str] = "count-open"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[_OneMore]:
        """See `EditKind`: where both are seen closed, in reach, between two actions of a task."""
        ends = {end for part in episode.trajectory.sub_trajs for end in part.low_pddl_idx}
        indices = [index for index in range(1, len(episode.history) - 1) if index not in ends]
        rng.shuffle(indices)
        for index in indices:
            by_type: dict[str, ThorObject] = {}
            for obj in _closed_in_reach(episode, index):
                by_type.setdefault(canonical_type(obj.object_type), obj)
            if len(by_type) > 1:
                one, other = rng.sample(sorted(by_type), 2)
                yield _OneMore(index, by_type[one], by_type[other])


def _closed_in_reach(episode: Episode, frame: int) -> list[ThorObject]:
    history = episode.history
    states = history.states(frame)
    return [
        episode.start.objects[key]
        for key, shown in sorted(history.objects_in_frame(frame).items())
        if shown.visible
        and key in episode.start.objects
        and states[key].is_open is False
        and not states[key].is_on  # a microwave that is on stays closed
        and states[key].type in ASKED_OPEN
        and history.shows(frame, key)
    ]
