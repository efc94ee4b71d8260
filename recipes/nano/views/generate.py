"""Generating views of many rooms into a folder; an interrupted run is resumed.

Trajectories show few of a home's things, from few sides, for most of their frames are of walking.
A tower that is to name things needs thousands of views of each. So the things of a room are put
about at random.
"""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from infthor_eval.errors import InfthorError, SimulatorError
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.generation.compact.pictures import palette_of
from infthor_eval.generation.simulator_jobs import (
    SimulatorWorker,
    collect_outcomes,
    freeze_existing_objects,
)
from infthor_eval.storage.files import file_name, is_written
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.segmentation import Segmentation
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject, Vector, teleport_call
from infthor_eval.workers import WorkerSettings, run_jobs
from recipes.nano.views.labelled_views import (
    ThingInView,
    read_views,
    views_of,
    write_views,
)

_LEAST_PIXELS = 8  # of an object that is labelled
# Bundled sets have pictures of few colours, and so have half of the arrangements.
_FEW_COLORS_SHARE = 0.5
_N_COLORS = (64, 128)
_TRIES = 4  # poses for each view; where the agent would stand in something, it is refused
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


class ViewJob(NamedTuple):
    """The views of a room.

    Attributes:
        scene: name of the room.
        seed: seed of all random choices.
        arrangements: how often its things are put about.
        per_arrangement: views of each arrangement.
        side: pixels along each side of a view.
        grid: cells along each side, for which labels are.
    """

    scene: str
    seed: int
    arrangements: int
    per_arrangement: int
    side: int
    grid: int


@dataclass
class ViewSet:
    """Views of many rooms.

    Attributes:
        paths: a file of each room; see `labelled_views.py`.
        views: number of views.
        refused: number of actions that the simulator refused while things were put about.
        failures: rooms without views, one line each.
    """

    paths: list[Path] = field(default_factory=list)
    views: int = 0
    refused: int = 0
    failures: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _RoomOutcome:
    path: Path | None = None
    views: int = 0
    refused: int = 0
    is_resumed: bool = False
    failure: str = ""


def generate_views(
    jobs: Sequence[ViewJob],
    launch: Launch,
    out: Path,
    worker_settings: WorkerSettings,
    advance: Callable[[bool], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
) -> ViewSet:
    """Generate the views that `out` lacks, a file for each room.

    Args:
        jobs: the rooms, with the same settings in each run.
        launch: simulator that each worker starts.
        out: folder of the files; created if it does not exist.
        worker_settings: number and place of the workers.
        advance: called after each room, with True if it is of an earlier run.
        notify: called with messages about the workers.
    """
    out.mkdir(parents=True, exist_ok=True)
    start = partial(SimulatorWorker, partial(Simulator, launch), partial(_views_of_room, out=out))
    outcomes = run_jobs(start, jobs, worker_settings, notify)
    result = ViewSet()

    def failed(_: int, error: InfthorError) -> _RoomOutcome:
        return _RoomOutcome(failure=str(error))

    for outcome in collect_outcomes(outcomes, failed, advance):
        if outcome.path is None:
            result.failures.append(outcome.failure)
            continue
        result.paths.append(outcome.path)
        result.views += outcome.views
        result.refused += outcome.refused
    return result


def _views_of_room(job: ViewJob, simulator: Simulator, out: Path) -> _RoomOutcome:
    path = out / f"{file_name(job.scene)}.npz"
    try:
        if is_written(path):
            return _RoomOutcome(path, len(read_views(path).frames), is_resumed=True)
        with freeze_existing_objects():
            frames, things, n_refused = _look_about(job, simulator)
        if not things:
            raise SimulatorError(f"{job.scene}: no view shows anything; give another scene")
    except InfthorError as error:
        return _RoomOutcome(failure=str(error))
    # Outside of `try`: if this file has no room, the views of other rooms would be wasted.
    write_views(path, views_of(frames, things))
    return _RoomOutcome(path, len(frames), n_refused)


def _look_about(
    job: ViewJob, simulator: Simulator
) -> tuple[list[NDArray[np.uint8]], list[ThingInView], int]:
    """Return views of a room, what they show, and the number of refused actions."""
    rng = random.Random(f"{job.scene}/{job.seed}")
    frames: list[NDArray[np.uint8]] = []
    things: list[ThingInView] = []
    n_refused = 0
    simulator.reset(job.scene)
    empty = simulator.mark()
    for _ in range(job.arrangements):
        simulator.rewind(empty, exactly=True)
        n_refused += _arrange(simulator, rng)
        views = _views(job.per_arrangement, simulator, rng)
        for number, view in enumerate(views):
            things += _things(view, len(frames) + number, job.grid)
        pictures = [Image.fromarray(view.frame) for view in views if view.frame is not None]
        if pictures and rng.random() < _FEW_COLORS_SHARE:
            pictures = _in_few_colors(pictures, rng.choice(_N_COLORS))
        frames += (_resized(picture, job.side) for picture in pictures)
    return frames, things, n_refused


def _views(n: int, simulator: Simulator, rng: random.Random) -> list[SimulatorView]:
    reply = simulator.query("GetReachablePositions", renderImage=False)
    positions = [(position["x"], position["z"]) for position in reply.result or ()]
    views: list[SimulatorView] = []
    for _ in range(_TRIES * n if positions else 0):
        pose = choose_pose(simulator.view, positions, rng)
        view = simulator.query(**teleport_call(pose, force=False))
        if view.success:
            views.append(view)
        if len(views) == n:
            break
    return views


def _things(view: SimulatorView, number: int, grid: int) -> list[ThingInView]:
    assert view.segmentation is not None
    things = []
    for key, pixels in cell_pixels(view.segmentation, grid).items():
        if key not in view.objects or pixels.sum() < _LEAST_PIXELS:
            continue
        thing = view.objects[key]
        parents = thing.parent_receptacles
        things.append(
            ThingInView(
                number,
                thing.object_type,
                object_type_of(parents[0]) if parents else None,
                thing.pickupable is True,
                thing.is_picked_up,
                thing.is_open is True,
                pixels,
            )
        )
    return things


def cell_pixels(shown: Segmentation, grid: int) -> dict[str, NDArray[np.int64]]:
    """Return how many pixels of each cell of a frame show an object, by its id.

    Args:
        shown: which object each pixel shows.
        grid: cells along each side of the frame; numbers of pixels are [grid, grid], the top row
            first.
    """
    rows, columns = (np.arange(extent) * grid // extent for extent in shown.codes.shape)
    codes, index = np.unique(shown.codes, return_inverse=True)
    places = index.reshape(shown.codes.shape) * grid**2 + rows[:, None] * grid + columns
    pixels = np.bincount(places.ravel(), minlength=len(codes) * grid**2)
    by_code = dict(zip(codes.tolist(), pixels.reshape(-1, grid, grid), strict=True))
    return {shown.names[code]: cells for code, cells in by_code.items() if code in shown.names}


def _in_few_colors(pictures: Sequence[Image.Image], n_colors: int) -> list[Image.Image]:
    palette = palette_of(pictures, n_colors)
    return [
        picture.quantize(palette=palette, dither=Image.Dither.NONE).convert("RGB")
        for picture in pictures
    ]


def _resized(picture: Image.Image, side: int) -> NDArray[np.uint8]:
    """Resize a picture as the image processor does."""
    return np.asarray(picture.resize((side, side), Image.Resampling.BICUBIC))


def _arrange(simulator: Simulator, rng: random.Random) -> int:
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
