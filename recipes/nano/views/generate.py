"""Generating views of many rooms into a folder; an interrupted run is resumed."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

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
from infthor_eval.thor.view import SimulatorView, teleport_call
from infthor_eval.workers import WorkerSettings, run_jobs
from recipes.nano.views.arranging import arrange, choose_pose
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
        n_refused += arrange(simulator, rng)
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
