"""Episodes replayed for the page: a journal has every action and no frame."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from PIL import Image

from infthor_eval.errors import InfthorError
from infthor_eval.report.presenter import EpisodeSelection, OpenReplay, Replay
from infthor_eval.report.runs import choose_evenly
from infthor_eval.report.web.progress import PageProgress
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

Record = UnitRecord[Any]
# Pixels of a map's side: drawn larger than it is shown, since small letters are easier to read when
# they are reduced.
_DRAWN = 560
_SHOWN = 300
_WORK = "episodes replayed"


class EpisodePictures(NamedTuple):
    """Pictures of a replayed episode.

    Attributes:
        frames: numbers of the thumbnails before the first step and after each.
        map: number of the map at the end.
        note: how the replay differs from the recorded episode; empty if it does not.
    """

    frames: Sequence[int | None] = ()
    map: int | None = None
    note: str = ""


class EpisodeReplays:
    """Replays some episodes of each run of a page."""

    def __init__(
        self,
        runs: Sequence[Run],
        most: int,
        folders: tuple[Path | None, Path | None],
        thumbnails: ThumbnailStore,
        progress: PageProgress,
    ) -> None:
        """Choose the episodes.

        Args:
            runs: runs of the page.
            most: number of episodes of each run to replay.
            folders: those of the trajectories and of recorded floor plans, see `Recording.open`.
            thumbnails: collects the pictures.
            progress: observes the replays.
        """
        self._chosen = {
            run.folder: _choose(run, most) for run in runs if run.presenter.replay is not None
        }
        self._data, self._scenes = folders
        self._thumbnails = thumbnails
        self._progress = progress
        n_episodes = sum(map(len, self._chosen.values()))
        if n_episodes:
            progress.begin(_WORK, n_episodes)

    def replay(self, run: Run) -> tuple[Mapping[UnitKey, EpisodePictures], list[str]]:
        """Replay chosen episodes; return their pictures, and why a trajectory was not replayed."""
        pictures: dict[UnitKey, EpisodePictures] = {}
        notes: list[str] = []
        replay = run.presenter.replay
        if replay is None:
            return pictures, notes
        # By trajectory, so that each scene is loaded once.
        chosen = sorted(
            self._chosen[run.folder], key=lambda record: (record.task, record.cluster, record.key)
        )
        for (task, trajectory), group in groupby(
            chosen, key=lambda record: (record.task, record.cluster)
        ):
            records = list(group)
            try:
                recording = replay.select(run, EpisodeSelection(task, trajectory))
                with recording.open(self._data or run.data, self._scenes) as session:
                    while records:
                        pictures[records[0].key] = self._draw(replay, session, run, records[0])
                        del records[0]
                        self._count(run, trajectory)
            except InfthorError as error:
                notes.append(f"{run.label}, {trajectory}: no frames are shown: {error}")
                for _ in records:
                    self._count(run, trajectory)
        return pictures, notes

    def _count(self, run: Run, trajectory: str) -> None:
        self._progress.advance(_WORK, f"{run.label}, {trajectory}")

    def _draw(
        self, replay: Replay, session: OpenReplay, run: Run, record: Record
    ) -> EpisodePictures:
        frames = list(session.frames([record]))
        seen = [frame.observation for frame in frames if frame.observation is not None]
        if not seen:
            return EpisodePictures()
        name = f"{run.folder}/{record.key.task}/{record.key}"
        numbers = [
            self._thumbnails.add(f"{name}/{number}", partial(Image.fromarray, observation.frame))
            for number, observation in enumerate(seen)
        ]
        at_end = self._thumbnails.add(
            f"{name}/map", lambda: replay.draw_map(seen[-1], _DRAWN), _SHOWN
        )
        return EpisodePictures(
            numbers, at_end, next((frame.note for frame in frames if frame.note), "")
        )


def _choose(run: Run, most: int) -> list[Record]:
    """Two thirds of the room for episodes that went wrong, the rest for successes."""
    acted = [record for record in run.records if run.presenter.steps(record)]
    wrong = [record for record in acted if run.main_score(record) < 1]
    right = [record for record in acted if run.main_score(record) >= 1]
    first = choose_evenly(wrong, max(most - len(right), (2 * most + 2) // 3))
    return first + choose_evenly(right, most - len(first))
