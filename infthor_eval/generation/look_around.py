"""Looking around: in long walks the camera is level, so that frames show rooms and not floors.

The generator that the authors published in July 2026 has this as an option, and a script does it to
trajectories that exist. The camera is raised before a long stretch of moves and turns, and lowered
again after it, so that each interaction has the horizon that the planner chose. With an object in
the hand nothing is inserted: it moves with the camera, and can hit walls. Insertions are equal to
the published function's.

To add or change where the camera is raised: `level_walks` here; what the published function does is
in `tests/goldens/look_around.jsonl.gz`.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

from infthor_eval.formats.trajectory import ApiAction, LowAction
from infthor_eval.generation.trace import ExecutedAction, RolloutError, Trace
from infthor_eval.household.scout import HORIZON_STEP
from infthor_eval.thor.simulator import SimulatorMark

INSERTED = "look_around"  # the mark of an inserted action, its field `inserted`
MIN_RUN = 6  # actions of a stretch, at least

_Action = TypeVar("_Action")
_WALKING = frozenset({"MoveAhead", "RotateLeft", "RotateRight"})
_TILTS = {"LookUp": -HORIZON_STEP, "LookDown": HORIZON_STEP}  # degrees
_IN_HAND = {"PickupObject": True, "PutObject": False}
_MAX_LOOKS = 2  # the simulator's camera is at 60 degrees at most


class LevelWalk(NamedTuple):
    """A stretch of a list of actions that is walked with a level camera.

    Attributes:
        first: index of its first action, before which the camera is raised.
        end: index of the action after it, before which the camera is lowered.
        n_looks: number of LookUp actions, and of LookDown actions.
    """

    first: int
    end: int
    n_looks: int


def level_walks(
    names: Sequence[str], horizon: float = 30.0, min_run: int = MIN_RUN
) -> list[LevelWalk]:
    """Return the stretches to be walked with a level camera, in their order.

    Args:
        names: names of the low-level actions, as "MoveAhead".
        horizon: the camera's angle below level before the first action, degrees.
        min_run: number of actions that only walk or turn from which a stretch counts, at least 1.
            The first action of the list is not part of a stretch, as published.
    """
    walks = []
    holds = False
    for index, name in enumerate(names):
        if index and name in _WALKING:
            continue
        horizon += _TILTS.get(name, 0)
        holds = _IN_HAND.get(name, holds)
        walk = LevelWalk(index + 1, _end_of_stretch(names, index + 1), int(horizon // HORIZON_STEP))
        is_long = walk.end - walk.first >= min_run
        if is_long and walk.end < len(names) and 1 <= walk.n_looks <= _MAX_LOOKS and not holds:
            walks.append(walk)
    return walks


def _end_of_stretch(names: Sequence[str], first: int) -> int:
    return next(
        (index for index in range(first, len(names)) if names[index] not in _WALKING), len(names)
    )


def with_looks(
    actions: Sequence[_Action],
    walks: Sequence[LevelWalk],
    look: Callable[[str, LevelWalk], _Action],
) -> list[_Action]:
    """Return the actions with those of the camera among them.

    Args:
        actions: the actions in which the walks were found.
        walks: see `level_walks`.
        look: makes a new action of the name "LookUp" or "LookDown" for a walk.
    """
    result: list[_Action] = []
    done = 0
    for walk in walks:
        result += actions[done : walk.first]
        result += (look("LookUp", walk) for _ in range(walk.n_looks))
        result += actions[walk.first : walk.end]
        result += (look("LookDown", walk) for _ in range(walk.n_looks))
        done = walk.end
    return [*result, *actions[done:]]


def inserted_before(walks: Sequence[LevelWalk], index: int) -> int:
    """Return how many actions are inserted before the original action of this index."""
    return sum(walk.n_looks * ((index >= walk.first) + (index >= walk.end)) for walk in walks)


def look_around(trace: Trace, start: SimulatorMark) -> None:
    """Execute a rollout once more with the camera level in its long walks.

    Args:
        trace: a completed rollout; its actions are replaced.
        start: the state before its first action.

    Raises:
        RolloutError: an action is refused this time.
    """
    before = trace.actions
    names = [action.low.api_action.action for action in before]
    walks = level_walks(names, start.view.agent.horizon)
    if not walks:
        return

    def look(name: str, walk: LevelWalk) -> tuple[LowAction, dict[str, Any]]:
        owner = before[walk.first - 1 if name == "LookUp" else walk.end].low
        low = LowAction(ApiAction(name), owner.high_idx, inserted=INSERTED)
        return low, {"degrees": float(HORIZON_STEP)}

    trace.simulator.rewind(start, exactly=True)
    calls = with_looks([(action.low, action.arguments) for action in before], walks, look)
    trace.actions = [_execute(trace, low, arguments) for low, arguments in calls]


def _execute(trace: Trace, low: LowAction, arguments: dict[str, Any]) -> ExecutedAction:
    api = low.api_action
    after = trace.simulator.step(api.action, **arguments)
    if not after.success:
        raise RolloutError(f"{api.action}, looking around: {after.error}")
    return ExecutedAction(low, after, arguments)
