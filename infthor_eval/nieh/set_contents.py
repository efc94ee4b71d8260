"""What an NIEH set has, and what of it can be asked, counted over the whole set."""

from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.question_forms import type_of
from infthor_eval.formats.step_log import layout_of
from infthor_eval.nieh.samples import find_samples
from infthor_eval.runs import Catalog

# Contexts whose frames are chosen by a model; which questions they can be asked with is that of
# whole trajectories.
_BY_MODEL = frozenset({"clip_retrieval", "memory"})
# Tokens of a frame of 300x300 in Qwen2.5-VL, for contexts that are measured in tokens.
_QWEN_FRAME = 121


@dataclass
class SetContents:
    """What a set has.

    Attributes:
        questions: numbers of questions by type, by question file; rows that are no question are not
            among them.
        malformed: numbers of such rows by reason.
        left_out: numbers of questions that cannot be asked whatever is shown, by reason.
        n_trajectories: number of trajectories that the questions name.
        n_unasked: number of folders of trajectories without a question.
        frames: number of frames of each trajectory that can be read.
        layouts: numbers of trajectories by the layout of their step log.
        image_folders: numbers of trajectories by the name of their folder of frames.
        image_sizes: numbers of trajectories by width and height of their first frame, pixels.
        conversions: numbers of frames by what is done to their pictures, in words.
        unreadable: reasons of the trajectories that cannot be read.
    """

    questions: dict[str, Counter[str]] = field(default_factory=dict)
    malformed: Counter[str] = field(default_factory=Counter)
    left_out: Counter[str] = field(default_factory=Counter)
    n_trajectories: int = 0
    n_unasked: int = 0
    frames: list[int] = field(default_factory=list)
    layouts: Counter[str] = field(default_factory=Counter)
    image_folders: Counter[str] = field(default_factory=Counter)
    image_sizes: Counter[tuple[int, int]] = field(default_factory=Counter)
    conversions: Counter[str] = field(default_factory=Counter)
    unreadable: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class AskedTask:
    """What of a set a task can ask.

    Attributes:
        name: of the task.
        n_asked: number of samples.
        skipped: numbers of samples that cannot be asked, by reason.
    """

    name: str
    n_asked: int
    skipped: Counter[str]


def read_contents(data: NiehSet) -> SetContents:
    """Read a set whole; what cannot be read is counted by reason."""
    contents = SetContents()
    for name, rows in data.files.items():
        questions = [row for row in rows if isinstance(row, Question)]
        contents.questions[name] = Counter(
            row.question_type or type_of(row.text) for row in questions
        )
    contents.malformed.update(row.reason for row in data.malformed)
    contents.left_out.update(data.reasons() - contents.malformed)
    named = {
        row.traj_id for rows in data.files.values() for row in rows if isinstance(row, Question)
    }
    contents.n_trajectories = len(named)
    if data.has_frames:
        folders = [path.name for path in data.folder("").iterdir() if path.is_dir()]
        contents.n_unasked = len(set(folders) - named)
        for traj_id in sorted(named):
            _read_trajectory(data, traj_id, contents)
    return contents


def _read_trajectory(data: NiehSet, traj_id: str, contents: SetContents) -> None:
    try:
        frames = data.frames(traj_id)
        layout = layout_of(data.folder(traj_id))
    except DataError as error:
        contents.unreadable.append(str(error))
        return
    contents.frames.append(len(frames))
    contents.layouts[layout.value] += 1
    if frames:
        contents.image_folders[frames[0].path.parent.name] += 1
        with suppress(DataError):  # tasks say what they cannot ask for it
            contents.image_sizes[frames[0].size] += 1
    for frame in frames:
        with suppress(DataError):
            contents.conversions[frame.conversions] += 1


def read_asked_tasks(root: Path, trajectories: Path | None = None) -> Iterator[AskedTask]:
    """Yield for each task of NIEH that the package has what of a set it can ask.

    Contexts that are measured in tokens count a frame as Qwen2.5-VL does. Tasks whose context a
    model chooses, and those of the bundled set, are left out.
    """
    for name, task in sorted(Catalog.find_packaged().tasks.items()):
        settings: dict[str, Any] = task.settings.get("dataset_kwargs") or {}
        context = settings.get("context")
        if (
            not name.startswith("nieh")
            or "bundled" in settings
            or context is None
            or context in _BY_MODEL
        ):
            continue
        more = {} if trajectories is None else {"trajectories": str(trajectories)}
        samples = find_samples(
            {"data": str(root), "tokens_per_frame": _QWEN_FRAME, "seed": 0, **settings, **more}
        )
        yield AskedTask(
            name, len(samples.samples), Counter(skipped.reason for skipped in samples.skipped)
        )
