"""An NIEH set: questions about long egocentric trajectories, and the frames of these.

The folder has the layout of the published data (hub dataset `PEARLS-Lab/infini-thor-nieh`):
`qa_set*.csv` beside `metadata/<traj_id>/` with `img/` (or `img_768/`), `metadata.json`,
`expert_log.json` and, in some sets, `<traj_id>_10fps.mp4`. The trajectory files are in a separate
folder (published data) or inside the set (ours). Twins share pictures (`shared_frames`). A set may
be packed in Parquet (`packed`). An action has one frame in our sets, and possibly several in others
(`expert_log.json`, or the step log of the layout that the branch `dev` reads).

Question files alone, without `metadata/`, are a set too: for whatever needs no frame. So is a
folder of one's own frames and questions (`own_folder`).
"""

import hashlib
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import TypeVar

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.frames import FrameRef, find_images
from infthor_eval.formats.outline import Outline, find_outline, read_outline, read_states
from infthor_eval.formats.own_folder import OWN_FRAMES, OwnFolder, find_own_folder
from infthor_eval.formats.packed.paths import SetPath, metadata_folder
from infthor_eval.formats.pictures.video import Video, read_video
from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.formats.reading import first_duplicate, read_json
from infthor_eval.formats.set_info import simulator_of
from infthor_eval.formats.shared_frames import read_shared_frames
from infthor_eval.formats.step_log import Step, log_file, read_steps
from infthor_eval.formats.twins import TwinPair, has_pairs, read_pairs
from infthor_eval.grouping import grouped

T = TypeVar("T")
K = TypeVar("K")
_LONGEST = 40  # characters of a name in a message
_HINT = "unpack the trajectory again"
_NO_FRAMES = "has no metadata/ with frames; unpack the set's metadata.tar there"
_GIVE_A_SET = (
    "give the folder of an NIEH set, or download the published one with `infthor-eval fetch nieh`"
)
IMAGE_FOLDERS = ("img", "img_768")
_REPLAY_HINT = "replay it again"


class NiehSet:
    """Questions and frames of one folder. A trajectory is read when it is first needed, and cached.

    Attributes:
        root: folder of the set, or one question file, also of one's own folder.
        directory: folder of the set's files.
        question_files: its files with questions, sorted.
        has_frames: False if there are question files alone.
        trajectories: folder of its trajectories (`<traj_id>.json` or `.txt`), or None if they are
            inside the set.
        files: all questions by the name of their file, in its order, also those that cannot be
            asked; rows that are no question are `SkippedQuestion`.
        simulator: simulator that rendered the frames ("embedded", "unity"), `OWN_FRAMES`, or None
            if the set does not say.
    """

    def __init__(
        self, root: Path, trajectories: Path | None = None, *, needs_questions: bool = True
    ) -> None:
        """Read the questions of the set in `root`, which may have none if they are not needed.

        Raises:
            DataError: a folder or file is missing, the set has another format version, or a
                question file has no row that is a question.
        """
        if not root.exists():
            raise DataError(f"{root}: no such folder; {_GIVE_A_SET}")
        self.root = root
        self.directory = root if root.is_dir() else root.parent
        self.question_files = sorted(root.glob("qa_set*.csv")) if root.is_dir() else [root]
        self._metadata = metadata_folder(self.directory if root.is_file() else root)
        self.has_frames = self._metadata.is_dir()
        self._own: OwnFolder | None = None
        if not self.has_frames and (root.is_file() or not self.question_files):
            self._own = find_own_folder(root)
        if self._own is not None:
            self.question_files = [self._own.file]
            self.has_frames = True
        if needs_questions and not self.question_files:
            raise DataError(
                f"{root}: has no qa_set*.csv, as an NIEH set has beside metadata/; {_GIVE_A_SET}"
            )
        if not self.has_frames and not needs_questions:
            raise DataError(f"{root}: {_NO_FRAMES}")
        if trajectories is not None and not trajectories.is_dir():
            raise DataError(
                f"{trajectories}: no such folder; give the folder of the trajectories with "
                "--trajectories"
            )
        self.trajectories = trajectories
        self.simulator = OWN_FRAMES if self._own else simulator_of(self.directory)
        self.files = {file.stem: self._read_file(file) for file in self.question_files}
        self._shared_frames: dict[str, FrameRef] = {}
        self._frames: dict[str, dict[int, FrameRef] | DataError] = {}
        # One tuple per trajectory, shared by all its questions: a copy each would be thousands of
        # references.
        self._all_frames: dict[str, tuple[FrameRef, ...] | DataError] = {}
        self._places: dict[str, dict[FrameRef, list[int]] | DataError] = {}
        self._videos: dict[tuple[str, float], Video | DataError] = {}
        self._outlines: dict[str, Outline | DataError] = {}
        self._action_frames: dict[str, dict[int, tuple[int, ...]]] = {}

    @cached_property
    def rows(self) -> tuple[Question | SkippedQuestion, ...]:
        """All questions in the files' order, as `SkippedQuestion` where they cannot be asked."""
        rows: list[Question | SkippedQuestion] = []
        seen = set()
        for question in chain.from_iterable(self.files.values()):
            if isinstance(question, SkippedQuestion):
                rows.append(question)
                continue
            reason = "is in the files twice" if question.id in seen else self._problem(question)
            seen.add(question.id)
            rows.append(SkippedQuestion(question, reason) if reason else question)
        # Of a set of one's own a frame may be none: then the other question of its pair is left.
        return tuple(rows if self._own is None else self._own.refuse_half_pairs(rows))

    @property
    def malformed(self) -> list[SkippedQuestion]:
        """Rows of the question files that are no question, in the order of the files."""
        return [
            row
            for row in chain.from_iterable(self.files.values())
            if isinstance(row, SkippedQuestion)
        ]

    @cached_property
    def skipped(self) -> tuple[SkippedQuestion, ...]:
        """Questions that cannot be asked, in the order of the files."""
        return tuple(row for row in self.rows if isinstance(row, SkippedQuestion))

    @cached_property
    def questions(self) -> tuple[Question, ...]:
        """The questions that can be asked, in the order of the files."""
        return tuple(row for row in self.rows if isinstance(row, Question))

    @cached_property
    def by_id(self) -> Mapping[str, Question]:
        """The questions that can be asked, by their ids."""
        return {question.id: question for question in self.questions}

    @cached_property
    def twins(self) -> Mapping[str, TwinPair]:
        """Pairs of worlds by the names of both trajectories; none of a set of pairs of moments.

        Raises:
            DataError: `twins.jsonl` is malformed, or missing where two trajectories are a pair.
        """
        have_worlds = any(map(_have_worlds, self.files.values()))
        return self._worlds if have_worlds or has_pairs(self.directory) else {}

    @cached_property
    def _worlds(self) -> Mapping[str, TwinPair]:
        pairs = read_pairs(self.directory)
        return {name: pair for pair in pairs for name in pair.traj_ids}

    @cached_property
    def fingerprint(self) -> str:
        """Hash of questions, pairs of worlds, step logs, and names and sizes of the frames (hex, 32
        characters)."""
        # Not the content of frames, which would mean reading all of it: a record has the digests of
        # its own frames.
        digest = hashlib.blake2b(digest_size=16)
        for file in self.question_files if self._own is None else self._own.files:
            digest.update(file.read_bytes())
        if _have_pairs(self.questions) and self.twins:  # the pair tells a question's cluster
            digest.update(msgspec.json.encode(self.twins))
        for traj_id in sorted({question.traj_id for question in self.questions if self.has_frames}):
            if self._own is None:  # one's own frames have no log
                digest.update(log_file(self.folder(traj_id)).read_bytes())
            for index, frame in self._trajectory(traj_id).items():
                digest.update(f"{traj_id}/{index}:{frame.name}:{frame.n_bytes}\n".encode())
        return digest.hexdigest()

    def _read_file(self, file: Path) -> tuple[Question | SkippedQuestion, ...]:
        name = file.stem if len(self.question_files) > 1 else ""
        rows = read_questions(file) if self._own is None else self._own.read_questions()
        bases: Mapping[str, str] = {}
        if _have_pairs(rows) and (has_pairs(self.directory) or _have_worlds(rows)):
            bases = {name: pair.base for name, pair in self._worlds.items()}
        return tuple(
            row
            if isinstance(row, SkippedQuestion)
            else replace(row, file=name, base=bases.get(row.traj_id, ""))
            for row in rows
        )

    def reasons(self) -> Counter[str]:
        """Return the number of skipped questions by reason."""
        return Counter(question.reason for question in self.skipped)

    def folder(self, traj_id: str) -> SetPath:
        """Return the folder of a trajectory's frames and metadata, that of all without a name."""
        if self._own is not None:
            return self._own.folder(traj_id)
        return self._metadata / traj_id

    def frames(self, traj_id: str) -> tuple[FrameRef, ...]:
        """Return all frames of a trajectory in time order.

        Raises:
            DataError: the trajectory is not in the set, or its frames do not match its metadata.
        """
        return _read_once(
            self._all_frames, traj_id, lambda: tuple(self._trajectory(traj_id).values())
        )

    def frame_numbers(self, traj_id: str) -> list[int]:
        """Return the numbers (`img_idx`) of a trajectory's frames in time order."""
        return list(self._trajectory(traj_id))

    def frames_until(self, question: Question) -> tuple[FrameRef, ...]:
        """Return the frames of a question's trajectory up to its moment, in time order."""
        frames = self.frames(question.traj_id)
        if question.moment is None:
            return frames
        return frames[: bisect_right(self.frame_numbers(question.traj_id), question.moment)]

    def find_places(self, traj_id: str, frames: Sequence[FrameRef]) -> list[int]:
        """Return where in a trajectory's time order frames in time order are; none where one of
        them is no frame of it."""
        # Some pictures are there twice.
        numbered = ((frame, place) for place, frame in enumerate(self.frames(traj_id)))
        by_frame = _read_once(self._places, traj_id, lambda: grouped(numbered))
        found: list[int] = []
        for frame in frames:
            places = by_frame.get(frame)
            if places is None:
                return []
            # Of equal pictures the next one: requests are in time order.
            later = (place for place in places if not found or place > found[-1])
            found.append(next(later, places[0]))
        return found

    def clue_frames(self, question: Question) -> tuple[FrameRef, ...]:
        """Return the frames with a question's evidence, in the order of its clues."""
        frames = self._trajectory(question.traj_id)
        return tuple(frames[index] for index in question.clues)

    def clue_positions(self, question: Question) -> tuple[int, ...]:
        """Return where in the trajectory's time order a question's clues are, in their own order.

        Not by the frames themselves: several steps may share a picture.
        """
        position_of = {number: at for at, number in enumerate(self._trajectory(question.traj_id))}
        return tuple(position_of[number] for number in question.clues)

    def outline_file(self, traj_id: str) -> SetPath | None:
        """Return the file of the trajectory itself, or None if there is none."""
        if self.trajectories is not None:
            return find_outline(self.trajectories, traj_id)
        path = self.folder(traj_id) / "traj_data.json"
        return path if path.is_file() else None

    def outline(self, traj_id: str) -> Outline | None:
        """Return goals, actions and states from the trajectory's file, or None if there is none.

        Raises:
            DataError: the file is not a trajectory.
        """
        path = self.outline_file(traj_id)
        return (
            None
            if path is None
            else _read_once(self._outlines, traj_id, lambda: read_outline(path))
        )

    @property
    def missing_outline(self) -> str:
        """The reason for a question whose trajectory file is missing."""
        location = "metadata/" if self.trajectories is None else f"{self.trajectories}"
        return f"the trajectory's JSON is not in {location}; give its folder with --trajectories"

    def action_frames(self, traj_id: str) -> dict[int, tuple[int, ...]]:
        """Return the positions in time order of the frames of each low-level action that has any.

        They come from `expert_log.json`, or else from a step log that names the action of each
        frame.

        Raises:
            DataError: neither says, or `expert_log.json` names frames that the trajectory does not
                have.
        """
        if traj_id not in self._action_frames:
            self._action_frames[traj_id] = self._read_action_frames(traj_id)
        return self._action_frames[traj_id]

    def _read_action_frames(self, traj_id: str) -> dict[int, tuple[int, ...]]:
        path = self.folder(traj_id) / "expert_log.json"
        if not path.exists():
            logged = _logged_action_frames(
                sorted(read_steps(self.folder(traj_id)), key=lambda step: step.img_idx)
            )
            if logged is not None:
                return logged
        positions = {
            Path(frame.name).stem: index for index, frame in enumerate(self.frames(traj_id))
        }
        return _read_action_log(path, positions)

    def states(self, traj_id: str) -> dict[int, str]:
        """Return the states of a trajectory in words, by low-level action.

        They come from the trajectory's file, or else from `state_summary.json` beside its frames.

        Raises:
            DataError: the file is malformed.
        """
        outline = self.outline(traj_id)
        return (outline and outline.state_summary) or read_states(
            self.folder(traj_id) / "state_summary.json"
        )

    def video(self, traj_id: str) -> SetPath | None:
        """Return the trajectory's video, or None if it has none."""
        path = self._video_path(traj_id)
        return path if path.is_file() else None

    def sampled_video(self, traj_id: str, fps: float) -> Video:
        """Return the trajectory's video, sampled at this rate.

        Raises:
            DataError: the video is missing or cannot be decoded.
        """
        return _read_once(
            self._videos, (traj_id, fps), lambda: read_video(self._video_path(traj_id), fps)
        )

    def _video_path(self, traj_id: str) -> SetPath:
        return self.folder(traj_id) / f"{traj_id}_10fps.mp4"

    def _problem(self, question: Question) -> str | None:
        """Return why a question cannot be asked, or None if it can."""
        if not question.answers:
            return "no gold answer"
        if not question.clues:
            return "no clue frame"
        if not self.has_frames:
            return None
        try:
            frames = self._trajectory(question.traj_id)
        except DataError as error:
            return str(error)
        return _misplaced(question, frames) or next(
            filter(None, (frames[index].problem for index in question.clues)), None
        )

    def _trajectory(self, traj_id: str) -> dict[int, FrameRef]:
        if not self.has_frames:
            raise DataError(f"{self.root}: {_NO_FRAMES}")
        if Path(traj_id).name != traj_id or traj_id in {"", ".", ".."}:
            raise DataError(f"trajectory {traj_id!r} is not a plain folder name")
        return _read_once(
            self._frames, traj_id, lambda: _read_frames(self.folder(traj_id), self._shared_frames)
        )


def _misplaced(question: Question, frames: Mapping[int, FrameRef]) -> str | None:
    """Return why a question's clues and moment do not fit the frames; None if they do."""
    named = [("clue", index) for index in question.clues]
    if question.moment is not None:
        named.append(("moment", question.moment))
    for what, index in named:
        if index not in frames:
            where = f"trajectory {question.traj_id} ({len(frames)} frames)"
            return f"{what} {index} is outside {where}"
    if question.moment is not None and max(question.clues) > question.moment:
        return f"clue {max(question.clues)} is after the question's moment {question.moment}"
    return None


def _read_once(cache: dict[K, T | DataError], key: K, read: Callable[[], T]) -> T:
    """Read something of a trajectory, or repeat the earlier result or error."""
    # Errors are cached too, or a broken trajectory would be read again for each of its questions.
    if key not in cache:
        try:
            cache[key] = read()
        except DataError as error:
            cache[key] = error
    result = cache[key]
    if isinstance(result, DataError):
        raise result
    return result


def _read_frames(folder: SetPath, shared_frames: dict[str, FrameRef]) -> dict[int, FrameRef]:
    """Return the frames by their number (`img_idx`), in time order.

    Pictures that several trajectories share are kept in `shared_frames`, by their line.
    """
    with wrap_errors(f"trajectory {folder.name[:_LONGEST]}: its folder cannot be read", _HINT):
        if not folder.is_dir():
            raise DataError(f"trajectory {folder.name} is not in metadata/")
    steps = sorted(read_steps(folder), key=lambda step: step.img_idx)
    shared = read_shared_frames(folder, [step.img_idx for step in steps], shared_frames)
    if shared is not None:
        return shared
    home = next((folder / name for name in IMAGE_FOLDERS if (folder / name).is_dir()), folder)
    if home == folder and log_file(folder).exists():
        raise DataError(f"trajectory {folder.name}: neither img/ nor img_768/ in {folder}; {_HINT}")
    # By stem: published sets of other sizes (img_768) keep the names and change the suffix.
    names = [Path(step.img_filename).stem for step in steps]
    numbers = [step.img_idx for step in steps]
    for duplicate, what in (
        (first_duplicate(names), "img_filename"),
        (first_duplicate(numbers), "img_idx"),
    ):
        if duplicate is not None:
            raise DataError(
                f"trajectory {folder.name}: two entries of metadata.json have {what} {duplicate}; "
                f"{_HINT}"
            )
    by_stem = find_images(home)
    unknown = sorted(by_stem.keys() - set(names))
    # Only a surplus of files is an error of the trajectory. A renamed frame is one unknown and one
    # missing file.
    if len(unknown) > len(set(names) - by_stem.keys()):
        raise DataError(
            f"trajectory {folder.name}: {len(by_stem)} frames but {len(steps)} entries in "
            f"metadata.json (none for {unknown[0]}); {_HINT}"
        )
    # A missing file affects only the questions that show it, so it raises an error only when it is
    # read.
    return {
        step.img_idx: FrameRef(by_stem.get(name, home / Path(step.img_filename).name))
        for step, name in zip(steps, names, strict=True)
    }


class _Image(msgspec.Struct):
    low_idx: int
    image_name: str


class _Log(msgspec.Struct):
    images: list[_Image]


def _read_action_log(path: SetPath, positions: Mapping[str, int]) -> dict[int, tuple[int, ...]]:
    """Return the frames of each low-level action that has any; `positions` are those of file
    stems."""
    log = read_json(path, _REPLAY_HINT, _Log)
    with wrap_errors(
        f"{path}: not a log of actions and their frames", _REPLAY_HINT, catch=KeyError
    ):
        return _by_action(
            (image.low_idx, positions[Path(image.image_name).stem]) for image in log.images
        )


def _have_pairs(rows: Iterable[Question | SkippedQuestion]) -> bool:
    return any(isinstance(row, Question) and row.pair for row in rows)


def _have_worlds(rows: Iterable[Question | SkippedQuestion]) -> bool:
    """Return True if both questions of a pair are on trajectories of their own."""
    paired = [row for row in rows if isinstance(row, Question) and row.pair]
    first = {row.pair: row.traj_id for row in paired}
    return any(first[row.pair] != row.traj_id for row in paired)


def _logged_action_frames(steps: Sequence[Step]) -> dict[int, tuple[int, ...]] | None:
    """Return each low-level action's frames, by position, from the step log; None if it has none.

    As in the published loader, frames of action 0 are left out with those before the first action:
    both have 0 there.
    """
    if all(step.low_idx is None for step in steps):
        return None
    return _by_action((step.low_idx, index) for index, step in enumerate(steps) if step.low_idx)


def _by_action(frames: Iterable[tuple[int, int]]) -> dict[int, tuple[int, ...]]:
    """Return frames by their actions, in the order of these."""
    positions = grouped(frames)
    return {action: tuple(positions[action]) for action in sorted(positions)}
