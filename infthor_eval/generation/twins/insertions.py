"""More actions at one moment of an episode, other ones in each of two worlds.

Both worlds are edits of the episode, so neither is the original. The agent stands still, so that
all later poses are those of the episode.
"""

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from infthor_eval.formats.trajectory import ApiAction
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.rewriting import with_inserted
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject


@dataclass(frozen=True)
class Insertion:
    """Actions that are inserted at one moment, as many in each world.

    Attributes:
        index: index of the action before which they are.
        actions: the actions of each world.
        keys: ids of the objects that may differ; what is in or on them may, too.
        types: object types that the changed fact is about.
    """

    index: int
    actions: tuple[Sequence[ApiAction], Sequence[ApiAction]]
    keys: frozenset[str]
    types: frozenset[str]

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`."""
        first, second = (
            with_inserted(episode.trajectory, self.index, actions) for actions in self.actions
        )
        inside = (key for holder in self.keys for key in episode.inside(holder, self.index))
        return Worlds(
            pair=(first, second),
            changed=self.keys.union(inside),
            types=self.types,
            inserted=range(self.index, self.index + len(self.actions[0])),
        )


def moments(episode: Episode, rng: random.Random) -> list[int]:
    """Return the indices of the actions before which others can be, in random order.

    An index is that of the frame before the action, too. Between two tasks there is none: what is
    inserted belongs to a task.
    """
    ends = {end for part in episode.trajectory.sub_trajs for end in part.low_pddl_idx}
    indices = [index for index in range(1, len(episode.history) - 1) if index not in ends]
    rng.shuffle(indices)
    return indices


def in_reach(episode: Episode, frame: int) -> Iterable[ThorObject]:
    """Yield the objects that a frame shows large enough and the agent can reach, by id."""
    history = episode.history
    for key, shown in sorted(history.objects_in_frame(frame).items()):
        if shown.visible and key in episode.start.objects and history.shows(frame, key):
            yield episode.start.objects[key]
