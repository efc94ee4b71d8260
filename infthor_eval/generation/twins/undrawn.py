"""Packing sets of twins as their worlds' trajectories, and drawing the frames from these.

The embedded simulator draws the same frames again. A digest of each world shows whether it did.
"""

import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import msgspec
import pyarrow as pa
from msgspec.structs import replace

from infthor_eval.errors import DataError, SimulatorError, wrap_errors
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource, read_trajectory
from infthor_eval.formats.twins import TwinPair, read_pairs, write_pairs
from infthor_eval.formats.undrawn import DIGESTS, SET_INFO, WORLDS
from infthor_eval.generation.simulator_jobs import (
    SimulatorWorker,
    collect_outcomes,
    freeze_existing_objects,
)
from infthor_eval.generation.twins.comparison import Difference
from infthor_eval.generation.twins.replays import WORLD, Replays
from infthor_eval.generation.twins.rewriting import first_subgoals, without_traces
from infthor_eval.grouping import grouped
from infthor_eval.storage.digests import digest
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings, run_jobs

_HINT = "install infthor-eval again"
_LEVEL = 19  # of zstd


def pack_worlds(source: Path, out: Path) -> None:
    """Write a set of twins without frames, each world up to the sub-goal of its last question.

    Args:
        source: the set, with frames; all its questions have moments.
        out: folder of the new set, which exists and is empty.
    """
    data = NiehSet(source)
    pairs, lines, digests = [], [], {}
    for pair in read_pairs(source):
        n_frames = 0
        for name in pair.traj_ids:
            world = _up_to_last_moment(data, name, pair)
            n_frames = len(world.plan.low_actions) + 1
            lines.append(msgspec.json.encode(world))
            digests[name] = _digest(data, name, n_frames)
        pairs.append(replace(pair, frames=pair.frames[:n_frames]))
    codec = pa.Codec("zstd", compression_level=_LEVEL)
    (out / WORLDS).write_bytes(codec.compress(b"\n".join(lines) + b"\n", asbytes=True))
    (out / DIGESTS).write_bytes(msgspec.json.format(msgspec.json.encode(digests), indent=1) + b"\n")
    write_pairs(out, pairs)
    copy_questions(source, out, data.files)


class Drawn(msgspec.Struct):
    """What became of the worlds of one scene.

    Attributes:
        differing: names of those that are drawn otherwise here than where the set was made.
        failure: why one cannot be carried out here; empty if all can.
        is_resumed: False, as no scene is skipped whole.
    """

    differing: list[str] = msgspec.field(default_factory=list)
    failure: str = ""
    is_resumed: bool = False


def draw_worlds(
    packed: Path,
    out: Path,
    worker_settings: WorkerSettings,
    advance: Callable[[bool], None] = lambda _: None,
) -> list[str]:
    """Write a packed set with its frames; worlds that are there already are not drawn again.

    Args:
        packed: the set without frames.
        out: folder of the new set, which exists.
        worker_settings: number of the workers that share the scenes.
        advance: called after each scene.

    Returns:
        The names of the worlds that are drawn otherwise here than where the set was made.

    Raises:
        DataError: a world cannot be carried out here.
    """
    (out / "metadata").mkdir(exist_ok=True)
    scenes = grouped((world.scene.floor_plan, world) for world in _worlds(packed))
    draw = partial(_draw, expected=expected_digests(packed), out=out)
    start = partial(SimulatorWorker, partial(Simulator, embedded_launch()), draw)
    drawn = collect_outcomes(
        run_jobs(start, list(scenes.values()), worker_settings, lambda _: None),
        lambda _, error: Drawn(failure=str(error)),
        advance,
    )
    for failure in (it.failure for it in drawn if it.failure):
        raise DataError(f"{packed / WORLDS}: {failure}; {_HINT}")
    write_pairs(out, read_pairs(packed))
    copy_questions(packed, out, NiehSet(packed).files)  # it says that all is there
    return [name for it in drawn for name in it.differing]


def _draw(
    worlds: Sequence[Trajectory], simulator: Simulator, expected: Mapping[str, str], out: Path
) -> Drawn:
    drawn = Drawn()
    with ExitStack() as stack, freeze_existing_objects():
        replays = Replays(simulator, stack)
        for world in worlds:
            name = world.traj_id
            if not (out / "metadata" / name).exists():
                try:
                    replayed = replays.replayed(without_traces(world, WORLD))
                except (Difference, SimulatorError) as error:
                    return Drawn(failure=f"{name}: {error}")
                replayed.write(out, world, replayed.world.files)
            if _digest(NiehSet(out, needs_questions=False), name) != expected[name]:
                drawn.differing.append(name)
    return drawn


def expected_digests(packed: Path) -> dict[str, str]:
    """Return the digest of each world's frames and log where the set was made, by its name."""
    digests: dict[str, str] = read_json(packed / DIGESTS, _HINT, dict[str, str])
    return digests


def _worlds(packed: Path) -> Iterator[Trajectory]:
    path = packed / WORLDS
    with (
        wrap_errors(f"{path}: cannot be unpacked", _HINT, catch=(OSError, ValueError)),
        pa.input_stream(str(path)) as file,
    ):
        lines = file.read().splitlines()
    for number, line in enumerate(lines, 1):
        yield TrajectorySource(path, number, line).read()


def _up_to_last_moment(data: NiehSet, name: str, pair: TwinPair) -> Trajectory:
    world = read_trajectory(data.folder(name) / "traj_data.json")
    last = max(question.moment or 0 for question in pair.questions)
    n_high = world.plan.low_actions[last - 1].high_idx + 1
    return without_traces(first_subgoals(world, n_high), name)


def _digest(data: NiehSet, name: str, n_frames: int | None = None) -> str:
    """Return a digest of a world's first frames and their entries in its log."""
    pictures = [frame.path.stem for frame in data.frames(name)[:n_frames]]
    steps = read_steps(data.folder(name))[:n_frames]
    return digest(msgspec.json.encode((steps, pictures)))


def copy_questions(source: Path, out: Path, files: Iterable[str]) -> None:
    """Copy the files of a set's questions, by their names; last what it says of itself."""
    for file in (*(f"{name}.csv" for name in files), SET_INFO):
        shutil.copyfile(source / file, out / file)
