"""The kind in which an object is put into one of two receptacles."""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from infthor_eval.generation.questions.history import ObjectMove
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.rewriting import in_world, put_elsewhere
from infthor_eval.household.affordances import goes_into
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject

__all__ = ["PutTarget"]


@dataclass(frozen=True)
class _OtherTarget:
    """An object's last put goes into another receptacle.

    Attributes:
        move: the move that ends with the put.
        other: the other receptacle.
    """

    move: ObjectMove
    other: ThorObject

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`: the first world is the episode's."""
        trajectory = in_world(episode.trajectory, episode.trajectory.scene)
        target = episode.start.objects[self.move.target]
        second = put_elsewhere(trajectory, self.move.after - 1, self.other)
        types = {self.move.object_type, target.object_type, self.other.object_type}
        return Worlds(
            pair=(trajectory, second),
            changed=frozenset({self.move.item, *episode.inside(self.move.item, self.move.after)}),
            types=frozenset(types),
        )


class PutTarget:
    """Where an object was put last: another receptacle, in reach, that need not be opened."""

    name: ClassVar[str] = "put-target"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[_OtherTarget]:
        """See `EditKind`."""
        moves = [move for move in episode.history.moves if _is_last(episode, move)]
        rng.shuffle(moves)
        for move in moves:
            others = _receptacles_in_reach(episode, move)
            if others:
                yield _OtherTarget(move, rng.choice(others))


def _is_last(episode: Episode, move: ObjectMove) -> bool:
    """Return True if the object stays where the move leaves it, in or on a fixture."""
    target = episode.start.objects.get(move.target)
    events = episode.history.events
    later = [event for event in events if event.frame > move.after and event.target == move.item]
    return target is not None and not target.pickupable and not later


def _receptacles_in_reach(episode: Episode, move: ObjectMove) -> list[ThorObject]:
    frame = move.after - 1
    history = episode.history
    target = episode.start.objects[move.target]
    shown = history.objects_in_frame(frame)
    return [
        obj
        for key, obj in sorted(episode.start.objects.items())
        if key in shown
        and shown[key].visible
        and obj.receptacle
        and not obj.openable
        and not obj.pickupable
        and canonical_type(obj.object_type) != canonical_type(target.object_type)
        and goes_into(move.object_type, obj.object_type)
        and history.shows(frame, key)
    ]
