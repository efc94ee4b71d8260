"""An NIEH set: questions about long egocentric trajectories, and the frames they are asked on.

The folder form is that of the published data (hub dataset `PEARLS-Lab/infini-thor-nieh`): `qa_set*.csv` beside
`metadata/<traj_id>/` with `img/` (or `img_768/`), `metadata.json`, `expert_log.json` and, in some sets,
`<traj_id>_10fps.mp4`. Trajectories themselves lie in a folder beside the set, or in ours inside it.
"""

import hashlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeVar

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.action_log import read_action_log
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.outline import Outline, find_outline, read_outline, read_states
from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.set_info import simulator_of
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.video import frames_per_second

__all__ = ["NiehSet", "SkippedQuestion"]

T = TypeVar("T")
_LONGEST = 40  # characters of a name in a message
_HINT = "unpack the trajectory again"
_GIVE_A_SET = "give the folder of an NIEH set, or fetch the published one: fetch nieh"  # wherever it was to be given
_IMAGE_FOLDERS = ("img", "img_768")
_IMAGE_SUFFIXES = {".png", ".jpg", ".jpeg"}


@dataclass(frozen=True)
class SkippedQuestion:
    """A question that cannot be asked, and why.

    Attributes:
        question: the question.
        reason: why not.
        variant: of several ways of asking it, the one that is meant; empty where all are, or there is one.
    """

    question: Question
    reason: str
    variant: str = ""


class NiehSet:
    """Questions and frames of one folder. Trajectories are read when first asked for, and then kept.

    Attributes:
        root: the folder.
        trajectories: the folder of its trajectories (`<traj_id>.json` or `.txt`); None where they lie in the set.
        simulator: what rendered the frames ("embedded", "unity"); None where the set does not say.
    """

    def __init__(self, root: Path, trajectories: Path | None = None) -> None:
        """Read the questions of the set in `root`.

        Raises:
            DataError: there is no such set or folder, it is of another version, or a question file is not what the
                format says.
        """
        if not root.is_dir():
            raise DataError(f"{root}: no such folder; {_GIVE_A_SET}")
        self.root = root
        self._files = sorted(root.glob("qa_set*.csv"))
        if not self._files:
            raise DataError(f"{root}: no qa_set*.csv in it, which a set has beside metadata/; {_GIVE_A_SET}")
        if not (root / "metadata").is_dir():
            raise DataError(f"{root}: no metadata/ in it; unpack the set's metadata.tar there")
        if trajectories is not None and not trajectories.is_dir():
            raise DataError(f"{trajectories}: no such folder; give the trajectories' folder with --trajectories")
        self.trajectories = trajectories
        self.simulator = simulator_of(root)
        self._read = tuple(question for file in self._files for question in read_questions(file))
        self._frames: dict[str, dict[int, FrameRef] | DataError] = {}
        self._all_frames: dict[str, tuple[FrameRef, ...]] = {}  # shared by all questions on the whole trajectory
        self._videos: dict[str, tuple[FrameRef, ...] | DataError] = {}
        self._outlines: dict[str, Outline] = {}
        self._action_frames: dict[str, dict[int, tuple[int, ...]]] = {}

    @cached_property
    def rows(self) -> tuple[Question | SkippedQuestion, ...]:
        """Every question, in the order of the files; one that cannot be asked with the reason."""
        found: list[Question | SkippedQuestion] = []
        seen = set()
        for question in self._read:
            reason = "stands in the files twice" if question.id in seen else self._problem(question)
            seen.add(question.id)
            found.append(SkippedQuestion(question, reason) if reason else question)
        return tuple(found)

    @cached_property
    def skipped(self) -> tuple[SkippedQuestion, ...]:
        """Questions that cannot be asked, in the order of the files."""
        return tuple(row for row in self.rows if isinstance(row, SkippedQuestion))

    @cached_property
    def questions(self) -> tuple[Question, ...]:
        """The questions that can be asked, in the order of the files."""
        return tuple(row for row in self.rows if isinstance(row, Question))

    @cached_property
    def fingerprint(self) -> str:
        """Hash of the questions, the step logs, and the names and sizes of the frames (hex, 32 characters).

        The content of frames is not read here: each answered unit records the digests of the frames it used.
        """
        digest = hashlib.blake2b(digest_size=16)
        for file in self._files:
            digest.update(file.read_bytes())
        for traj_id in sorted({question.traj_id for question in self.questions}):
            digest.update((self.folder(traj_id) / "metadata.json").read_bytes())
            for index, frame in self._trajectory(traj_id).items():
                digest.update(f"{traj_id}/{index}:{frame.path.name}:{_size(frame.path)}\n".encode())
        return digest.hexdigest()

    def reasons(self) -> Counter[str]:
        """How many questions were skipped, by reason."""
        return Counter(item.reason for item in self.skipped)

    def folder(self, traj_id: str) -> Path:
        """Where the trajectory's frames and metadata lie."""
        return self.root / "metadata" / traj_id

    def frames(self, traj_id: str) -> tuple[FrameRef, ...]:
        """Every frame of a trajectory in time order.

        Raises:
            DataError: the trajectory is not in the set, or its frames do not fit its metadata.
        """
        if traj_id not in self._all_frames:
            self._all_frames[traj_id] = tuple(self._trajectory(traj_id).values())
        return self._all_frames[traj_id]

    def clue_frames(self, question: Question) -> tuple[FrameRef, ...]:
        """The frames that hold a question's evidence, in the order of its clues."""
        frames = self._trajectory(question.traj_id)
        return tuple(frames[index] for index in question.clues)

    def outline_file(self, traj_id: str) -> Path | None:
        """Where the trajectory itself lies; None where it is not there."""
        if self.trajectories is not None:
            return find_outline(self.trajectories, traj_id)
        path = self.folder(traj_id) / "traj_data.json"
        return path if path.is_file() else None

    def outline(self, traj_id: str) -> Outline | None:
        """What the trajectory's own file tells; None where it is not there.

        Raises:
            DataError: it is no trajectory.
        """
        path = self.outline_file(traj_id)
        if path is None:
            return None
        if traj_id not in self._outlines:
            self._outlines[traj_id] = read_outline(path)
        return self._outlines[traj_id]

    @property
    def missing_outline(self) -> str:
        """Why a trajectory's own file is not there."""
        place = "metadata/" if self.trajectories is None else f"{self.trajectories}"
        return f"the trajectory's JSON is not in {place}; name its folder with --trajectories"

    def action_frames(self, traj_id: str) -> dict[int, tuple[int, ...]]:
        """Positions, in time order, of the frames of each low-level action that has some.

        Raises:
            DataError: `expert_log.json` is missing, or names frames that the trajectory does not have.
        """
        if traj_id not in self._action_frames:
            places = {frame.path.stem: place for place, frame in enumerate(self.frames(traj_id))}
            self._action_frames[traj_id] = read_action_log(self.folder(traj_id) / "expert_log.json", places)
        return self._action_frames[traj_id]

    def states(self, traj_id: str) -> dict[int, str]:
        """The states of a trajectory in words, by low-level action: the trajectory's own, else those beside its frames.

        Raises:
            DataError: they are not what the format says.
        """
        outline = self.outline(traj_id)
        return (outline and outline.state_summary) or read_states(self.folder(traj_id) / "state_summary.json")

    def video(self, traj_id: str) -> Path | None:
        """The trajectory's video; None where it has none."""
        path = self.folder(traj_id) / f"{traj_id}_10fps.mp4"
        return path if path.is_file() else None

    def video_frames(self, traj_id: str) -> tuple[FrameRef, ...]:
        """One frame per second of the trajectory's video, which there must be; decoded when first asked for.

        Raises:
            DataError: the video cannot be decoded.
        """
        video = self.folder(traj_id) / f"{traj_id}_10fps.mp4"
        return _once(self._videos, traj_id, lambda: frames_per_second(video))

    def _problem(self, question: Question) -> str | None:
        """Why a question cannot be asked; None where it can."""
        if not question.answers:
            return "no gold answer"
        if not question.clues:
            return "no clue frame"
        try:
            frames = self._trajectory(question.traj_id)
        except DataError as error:
            return str(error)
        outside = [index for index in question.clues if index not in frames]
        if outside:
            return f"clue {outside[0]} is outside trajectory {question.traj_id} ({len(frames)} frames)"
        return next(filter(None, (frames[index].problem() for index in question.clues)), None)

    def _trajectory(self, traj_id: str) -> dict[int, FrameRef]:
        if Path(traj_id).name != traj_id or traj_id in {"", ".", ".."}:
            raise DataError(f"trajectory {traj_id!r} is not a plain folder name")
        return _once(self._frames, traj_id, lambda: _read_frames(self.folder(traj_id)))


def _once(known: dict[str, T | DataError], traj_id: str, read: Callable[[], T]) -> T:
    """What was read for a trajectory, or the error it ended in: the broken is not read again for every question."""
    if traj_id not in known:
        try:
            known[traj_id] = read()
        except DataError as error:
            known[traj_id] = error
    found = known[traj_id]
    if isinstance(found, DataError):
        raise found
    return found


def _read_frames(folder: Path) -> dict[int, FrameRef]:
    """Frames by their number (`img_idx`), in time order."""
    with wrap_errors(f"trajectory {folder.name[:_LONGEST]}: its folder cannot be read", _HINT):
        if not folder.is_dir():
            raise DataError(f"trajectory {folder.name} is not in metadata/")
    steps = sorted(read_steps(folder), key=lambda step: step.img_idx)
    home = _image_folder(folder)
    # By stem: published sets of other sizes (img_768) keep the names and change the suffix.
    names = [Path(step.img_filename).stem for step in steps]
    for alike, what in ((_twice(names), "img_filename"), (_twice([step.img_idx for step in steps]), "img_idx")):
        if alike is not None:
            raise DataError(
                f"trajectory {folder.name}: metadata.json numbers two frames alike ({what} {alike}); {_HINT}"
            )
    by_stem = _images(home)
    unknown = sorted(by_stem.keys() - set(names))
    if len(unknown) > len(set(names) - by_stem.keys()):  # a frame under another name is one that is missing
        raise DataError(
            f"trajectory {folder.name}: {len(by_stem)} frames but {len(steps)} entries in metadata.json "
            f"(none for {unknown[0]}); {_HINT}"
        )
    # A file that is missing spoils the questions that show it, and no other: whoever asks for it is told.
    return {
        step.img_idx: FrameRef(by_stem.get(name, home / Path(step.img_filename).name))
        for step, name in zip(steps, names, strict=True)
    }


def _image_folder(folder: Path) -> Path:
    for name in _IMAGE_FOLDERS:
        if (folder / name).is_dir():
            return folder / name
    raise DataError(f"trajectory {folder.name}: neither img/ nor img_768/ in {folder}; {_HINT}")


def _images(folder: Path) -> dict[str, Path]:
    images = sorted(path for path in folder.iterdir() if path.suffix.lower() in _IMAGE_SUFFIXES)
    twice = _twice([path.stem for path in images])
    if twice is not None:
        raise DataError(f"{folder}: two frames of the name {twice} (.png, .jpg); take one of them out")
    return {path.stem: path for path in images}


def _twice(values: Sequence[T]) -> T | None:
    """The first value that stands twice."""
    return next((value for value, count in Counter(values).items() if count > 1), None)


def _size(path: Path) -> int | None:
    """Of a file, in bytes; None where there is none."""
    try:
        return path.stat().st_size
    except OSError:
        return None
