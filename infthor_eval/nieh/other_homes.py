"""Other homes, whose frames are shown instead of a question's own: drawn for the frame ablation."""

import random
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.scene_types import scene_type


class _Home(NamedTuple):
    """A trajectory's home: what it was made of (`Question.cluster`), and its kind of room.

    The room is None where the set does not tell it.
    """

    cluster: str
    room: str | None


def count_homes(data: NiehSet) -> int:
    """Return the number of different homes of a set's questions; both worlds of twins are one."""
    return len({question.cluster for question in data.questions})


def draw_other_home(data: NiehSet, question: Question, seed: int) -> str:
    """Return another trajectory of the same kind of room, the same one in both worlds of twins.

    It is drawn for the trajectory, or the base of twins, so that its questions share what is shown.
    It is one of any other kind if the set has no further home of that kind (`without_alike`), or
    does not tell the kind.
    """
    homes = _homes(data)
    others = [name for name, home in homes.items() if home.cluster != question.cluster]
    alike = _alike(homes, question.traj_id)
    return random.Random(f"{seed}/{question.cluster}").choice(alike or others)


def without_alike(data: NiehSet, questions: Sequence[Question]) -> tuple[str, ...]:
    """Return the trajectories of questions that are the only ones of their kind of room, sorted."""
    homes = _homes(data)
    asked = sorted({question.traj_id for question in questions})
    return tuple(name for name in asked if homes[name].room and not _alike(homes, name))


def _alike(homes: Mapping[str, _Home], traj_id: str) -> list[str]:
    """Return the trajectories of other homes of the same kind, sorted; none if it is not known."""
    own = homes[traj_id]
    return [
        name
        for name, home in homes.items()
        if own.room is not None and home.room == own.room and home.cluster != own.cluster
    ]


@lru_cache(maxsize=8)
def _homes(data: NiehSet) -> Mapping[str, _Home]:
    """Return the homes of a set's questions by trajectory, sorted."""
    clusters = {question.traj_id: question.cluster for question in data.questions}
    return {name: _Home(clusters[name], _room(data, name)) for name in sorted(clusters)}


def _room(data: NiehSet, traj_id: str) -> str | None:
    outline = data.outline(traj_id)
    floor_plan = outline and outline.floor_plan
    return scene_type(floor_plan) if floor_plan else None
