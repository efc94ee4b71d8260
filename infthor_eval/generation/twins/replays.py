"""Replays of an episode and of worlds made of it, which do nothing again that one of them did.

Each world is replayed once, each picture drawn once, and a world begins where it differs from the
episode.
"""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.shared_frames import store_picture, write_frame_names
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import ApiAction, Trajectory, encode_trajectory
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.replay import Beginning, replay
from infthor_eval.generation.simulator_jobs import JobProgress
from infthor_eval.generation.twins.comparison import Difference, World
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.rewriting import without_traces
from infthor_eval.storage.digests import digest, digest_of_file
from infthor_eval.storage.files import write_atomically
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.thor.drawn_pictures import DrawnPictures
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator, SimulatorMark
from infthor_eval.thor.view import SimulatorView

WORLD = "twin"  # what a world is called while it is replayed
MOST_MARKS = 128  # of an episode; a simulator stores the state at each
_MARKED = 50  # actions from one mark to the next
_COPIED = ("metadata.json", "traj.txt", "state_summary.json")
_HINT = "give a trajectory that replays here"


@dataclass(frozen=True)
class Replayed:
    """A replayed world and the folder of its files."""

    world: World
    folder: Path

    def write(self, out: Path, world: Trajectory, pictures: Sequence[Path]) -> None:
        """Write the world into a set, by its trajectory there and the files of its pictures."""
        name = world.traj_id
        final = out / "metadata" / name
        if final.exists():
            shutil.rmtree(final)  # of a run that was interrupted before its draft was whole
        with write_atomically(final) as folder:
            folder.mkdir()
            for file in _COPIED:
                shutil.copyfile(self.folder / file, folder / file)
            (folder / "traj_data.json").write_bytes(encode_trajectory(world))
            content = (picture.read_bytes() for picture in pictures)
            write_frame_names(folder, [store_picture(out, one, name) for one in content])


class Replays:
    """Replays an episode and worlds of it, whatever edits they are of.

    Args:
        simulator: a simulator; only the embedded one tells what pictures show, and stores states.
        stack: holds what is written.
    """

    def __init__(self, simulator: Simulator, stack: ExitStack) -> None:
        self.simulator = simulator
        self._stack = stack
        self._replayed: dict[str, Replayed | str] = {}
        self._drawn: DrawnPictures | None = None
        self._common: _Common | None = None
        if simulator.label == "embedded":
            self._drawn = DrawnPictures(simulator, stack.enter_context(ScratchFolder()))

    def read(self, trajectory: Trajectory) -> Episode:
        """Restore and replay the episode; the ids in its actions become the simulator's.

        Raises:
            DataError: it cannot be restored, or an action is refused.
        """
        restored = restore(self.simulator, trajectory.scene)
        if restored.dropped or restored.refused:
            reason = [*restored.dropped, *restored.refused][0]
            raise DataError(f"its start cannot be restored ({reason}); {_HINT}")
        start = self.simulator.view
        grounding = Grounding(start)
        for api in _api_actions(trajectory):
            for name in ("object_id", "receptacle_id"):
                _ground(api, name, grounding, start)
        marks: dict[int, SimulatorMark] = {}

        def mark(progress: JobProgress) -> None:
            if self._drawn is not None and progress.n_done % _MARKED == 0:
                marks[progress.n_done] = self.simulator.mark()

        folder = self._new_folder()
        report = replay(trajectory, self.simulator, folder, "", 1, mark, drawn=self._drawn)
        if report.refusals:
            first = report.refusals[0]
            raise DataError(f"step {first.step}: {first.action}: {first.error}; {_HINT}")
        history = TrajectoryHistory(trajectory.traj_id, read_steps(folder))
        episode = Episode(trajectory, start, history)
        self._common = _Common(episode, without_traces(trajectory, WORLD), folder / "img", marks)
        return episode

    def replayed(self, world: Trajectory) -> Replayed:
        """Return the replay of a world of the episode.

        Raises:
            Difference: it cannot be restored, or an action is refused.
        """
        key = digest(msgspec.json.encode(world))
        if key not in self._replayed:
            self._replayed[key] = self._replay(world)
        result = self._replayed[key]
        if isinstance(result, str):
            raise Difference(result)
        return result

    def _replay(self, world: Trajectory) -> Replayed | str:
        folder = self._new_folder()
        beginning = None if self._common is None else self._common.with_world(world, self.simulator)
        report = replay(
            world, self.simulator, folder, "", needs_all=True, drawn=self._drawn,
            beginning=beginning,
        )  # fmt: skip
        if report.restore:
            return "its start cannot be restored"
        if report.refusals:
            return f"{report.refusals[0].action.partition(' ')[0]} is refused"
        steps = read_steps(folder)
        files = [folder / "img" / step.img_filename for step in steps]
        return Replayed(World(steps, [digest_of_file(file) for file in files], files), folder)

    def _new_folder(self) -> Path:
        folder = self._stack.enter_context(ScratchFolder()) / WORLD
        folder.mkdir()
        return folder


@dataclass(frozen=True)
class _Common:
    """What worlds may have in common with their episode.

    Attributes:
        episode: the episode.
        own: its trajectory as a world.
        images: folder of its frames.
        marks: states after some of its actions, by their number.
    """

    episode: Episode
    own: Trajectory
    images: Path
    marks: dict[int, SimulatorMark]

    def with_world(self, world: Trajectory, simulator: Simulator) -> Beginning | None:
        """Return the beginning of a world, if a state in it is stored."""
        if world.scene != self.own.scene:
            return None
        actions, own = world.plan.low_actions, self.own.plan.low_actions
        pairs = enumerate(zip(actions, own, strict=False))
        shorter = min(len(actions), len(own))
        n_common = next((at for at, (one, other) in pairs if one != other), shorter)
        n_done = n_common - n_common % _MARKED
        if n_done not in self.marks or not simulator.stores(self.marks[n_done]):
            return None
        steps = self.episode.history.steps[: n_common + 1]
        return Beginning(self.episode.start, steps, self.images, self.marks[n_done], n_done)


def _api_actions(trajectory: Trajectory) -> Iterator[ApiAction]:
    for low in trajectory.plan.low_actions:
        yield low.api_action


def _ground(api: ApiAction, name: str, grounding: Grounding, start: SimulatorView) -> None:
    """Replace a recorded id of an object that is there at the start by the simulator's."""
    recorded = getattr(api, name)
    if recorded is None or recorded.count("|") > 3:  # a part or a slice keeps its whole's id
        return
    key = grounding.ground(recorded, start)
    if key is not None:
        setattr(api, name, key)
