"""Facts of clue frames that are no evidence, but may tell the answer, and the scenes of a set.

A set must not give an answer away by when its clues were, whether something was in the hand, or how
much was in view. The audit's strongest guesser knows these facts; no score depends on them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import Step, read_steps
from infthor_eval.formats.trajectory import read_trajectory
from infthor_eval.grouping import grouped

_LAST_PIXEL = 299
_LARGE = 90  # pixels from which on an object counts as in view, as for questions


@dataclass(frozen=True)
class ClueFacts:
    """Facts of the first or the last clue frame of a question, or of all of them.

    Attributes:
        progress: place of the frame in the trajectory, from 0 to 1.
        hand_full: True if something is in the hand.
        n_in_view: number of objects in view.
        n_at_edge: number of them that touch the edge of the frame.
    """

    progress: float
    hand_full: bool
    n_in_view: int
    n_at_edge: int


def read_clue_facts(data: NiehSet) -> dict[str, tuple[ClueFacts, ...]]:
    """Return the facts of each question's clue frames, in their order, by id of the question.

    Questions on trajectories whose log does not say what frames show are left out.
    """
    facts: dict[str, tuple[ClueFacts, ...]] = {}
    by_trajectory = grouped((question.traj_id, question) for question in data.questions)
    for traj_id, questions in by_trajectory.items():
        steps = _read_log(data, traj_id)
        of_frame = {step.img_idx: _facts_of(step, len(steps)) for step in steps}
        for question in questions:
            if of_frame.keys() >= set(question.clues):
                facts[question.id] = tuple(of_frame[clue] for clue in sorted(question.clues))
    return facts


def read_scenes(data: NiehSet) -> Mapping[str, str]:
    """Return the scene of each trajectory whose file is in the set, by the trajectory's id."""
    scenes = {}
    for traj_id in {question.traj_id for question in data.questions}:
        path = data.outline_file(traj_id)
        if path is not None:
            scenes[traj_id] = read_trajectory(path).scene.floor_plan
    return scenes


def _read_log(data: NiehSet, traj_id: str) -> list[Step]:
    if not data.has_frames:
        return []
    try:
        steps = read_steps(data.folder(traj_id))
    except DataError:  # the audit needs no log; without one there are no facts
        return []
    return [step for step in steps if step.seen is not None]


def _facts_of(step: Step, n_frames: int) -> ClueFacts:
    boxes = [shown.box for shown in (step.seen or {}).values() if shown.pixels >= _LARGE]
    at_edge = [box for box in boxes if 0 in box or _LAST_PIXEL in box]
    return ClueFacts(
        progress=step.img_idx / max(1, n_frames - 1),
        hand_full=bool(step.object_log.inven_obj),
        n_in_view=len(boxes),
        n_at_edge=len(at_edge),
    )
