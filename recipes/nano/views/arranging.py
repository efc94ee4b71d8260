"""Putting the things of a room about at random, and choosing where to look from.

Trajectories show few of a home's things, from few sides, for most of their frames are of walking.
A tower that is to name things needs thousands of views of each.
"""

import math
import random
from collections.abc import Sequence
from typing import Any

from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject, Vector

# State changes, what they need, and the share of the things that could be changed and are.
_CHANGES: tuple[tuple[str, str, float, dict[str, str]], ...] = (
    ("SliceObject", "sliceable", 0.3, {}),
    ("OpenObject", "openable", 0.3, {}),
    ("ToggleObjectOn", "toggleable", 0.3, {}),
    ("CookObject", "cookable", 0.2, {}),
    ("DirtyObject", "dirtyable", 0.2, {}),
    ("FillObjectWithLiquid", "can_fill_with_liquid", 0.2, {"fillLiquid": "water"}),
)
_HOLD_SHARE = 0.5  # of the arrangements, in which the agent holds something
_SEEDS = 2**31
_QUIET = {"renderImage": False, "renderInstanceSegmentation": False}

_AIMED_SHARE = 0.9  # of the poses look at an object
# weights of what these look at
_LOOSE, _OPENABLE, _ANY = 0.85, 0.1, 0.05
_NEAR_SHARE, _NEAR_M, _FAR_M = 0.8, 1.2, 2.5  # from so near, else from as far as
_SQUARE_SHARE = 0.8  # of the headings are square to the room, as in trajectories
_OFF_SQUARE = 25.0  # degrees to either side at which others pass the object
_HORIZONS = (-30.0, 0.0, 30.0, 60.0)
_HORIZON_WEIGHTS = (3, 37, 40, 20)  # of poses that look at nothing in particular
_LEVEL_SHARE = 0.8  # of the horizons are those nearest to the object
_EYES_M = 1.575  # height of the camera


def arrange(simulator: Simulator, rng: random.Random) -> int:
    """Put the loose things of the scene about, change the states of some, and let the agent hold
    one, or none.

    Returns:
        How many of the actions were refused; the others count all the same.
    """
    n_refused = 0

    def act(action: str, **arguments: Any) -> None:
        nonlocal n_refused
        n_refused += not simulator.step(action, **arguments, **_QUIET).success

    act("InitialRandomSpawn", randomSeed=rng.randrange(_SEEDS))
    for action, ability, share, arguments in _CHANGES:
        for thing in [*simulator.view.objects.values()]:
            if getattr(thing, ability) is True and rng.random() < share:
                act(action, objectId=thing.object_id, forceAction=True, **arguments)
    loose = _loose(simulator.view)
    if loose and rng.random() < _HOLD_SHARE:
        act("PickupObject", objectId=rng.choice(loose).object_id, forceAction=True)
    return n_refused


def choose_pose(
    view: SimulatorView, positions: Sequence[tuple[float, float]], rng: random.Random
) -> AgentPose:
    """Return a random pose, most of which look at something loose from near by.

    Args:
        view: the scene.
        positions: x and z of the positions that the agent can reach, metres; at least one.
        rng: source of all random choices.
    """
    pools = (
        (_loose(view), _LOOSE),
        ([thing for thing in view.objects.values() if thing.openable is True], _OPENABLE),
        ([*view.objects.values()], _ANY),
    )
    filled = [(pool, weight) for pool, weight in pools if pool]
    if not filled or rng.random() >= _AIMED_SHARE:
        heading = rng.choice((0.0, 90.0, 180.0, 270.0))
        (horizon,) = rng.choices(_HORIZONS, _HORIZON_WEIGHTS)
        return _pose(view, rng.choice(positions), heading, horizon)
    (pool,) = rng.choices([pool for pool, _ in filled], [weight for _, weight in filled])
    return _pose_at(view, rng.choice(pool).position, positions, rng)


def _loose(view: SimulatorView) -> list[ThorObject]:
    return [
        thing
        for thing in view.objects.values()
        if thing.pickupable is True and not thing.is_picked_up
    ]


def _pose_at(
    view: SimulatorView,
    target: Vector,
    positions: Sequence[tuple[float, float]],
    rng: random.Random,
) -> AgentPose:
    """Return a pose that looks about at a point."""
    limit = _NEAR_M if rng.random() < _NEAR_SHARE else _FAR_M

    def distance(position: tuple[float, float]) -> float:
        return math.hypot(target.x - position[0], target.z - position[1])

    near = [position for position in positions if distance(position) < limit]
    x, z = rng.choice(near or sorted(positions, key=distance)[:4])
    heading = math.degrees(math.atan2(target.x - x, target.z - z))
    if rng.random() < _SQUARE_SHARE:
        heading = round(heading / 90) * 90.0
    else:
        heading += rng.uniform(-_OFF_SQUARE, _OFF_SQUARE)
    below = math.degrees(math.atan2(_EYES_M - target.y, max(distance((x, z)), 0.1)))
    level = min(_HORIZONS, key=lambda horizon: abs(horizon - below))
    horizon = level if rng.random() < _LEVEL_SHARE else rng.choice(_HORIZONS[1:])
    return _pose(view, (x, z), heading % 360, horizon)


def _pose(
    view: SimulatorView, position: tuple[float, float], heading: float, horizon: float
) -> AgentPose:
    x, z = position
    return AgentPose(Vector(x, view.agent.position.y, z), heading, horizon, view.agent.standing)
