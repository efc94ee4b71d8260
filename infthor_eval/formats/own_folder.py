"""A data set of one's own: frames or films in a folder, and one file of questions on them.

The frames are PNG, JPEG or WebP files in the folder itself (one trajectory), or in a folder of
their own for each trajectory. Numbers in their names count as numbers: `2.png` comes before
`10.png`. A film in the folder is a trajectory as well, of 1 frame a second (`own_films`).

Columns of the CSV file, of which the first two must be there:

- `question`
- `answer`: several as in `plate | mug` or `["plate", "mug"]`; all are required.
- `trajectory`: name of the folder, or of the film without its suffix, if there are several.
- `clue_frames`: names or numbers of frames, with commas between them; of a film, numbers of its
  sampled frames from 0. Or `clue_seconds`, of a film, as in `12.5, 14-16`. A question without
  either has all frames of its trajectory up to its moment.
- `moment`: name or number of the frame after which it is asked. Or `moment_seconds`.
- `pair`: name of a pair of questions, in both of their rows.

Other columns are ignored, unless they look like one of these misspelt. JSON annotations can be in
place of the CSV file (`own_annotations`).
"""

import difflib
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.csv_files import CsvRow, read_rows, unshield
from infthor_eval.formats.frames import find_images
from infthor_eval.formats.own_annotations import MAPPING, read_annotations
from infthor_eval.formats.own_films import FILM_SUFFIXES, SampledFilm, sample_film
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.question import Answer, Question, SkippedQuestion
from infthor_eval.formats.twins import has_pairs, read_pairs

OWN_FRAMES = "own frames"  # in place of the simulator that rendered them
_COLUMNS = ("question", "answer")
_OPTIONAL = ("clue_frames", "clue_seconds", "trajectory", "moment_seconds")
_SHORT = ("moment", "pair")  # near to other words (comment, part), so misspelt is nearer still
_NEAR_SHORT = 0.8
_HINT = f"it is a UTF-8 CSV file with the columns {', '.join(_COLUMNS)} and clue_frames"
_ONLY = "frames"  # name of the only trajectory; not the folder's own, which may be moved
_WRITE_ANSWERS = 'write ["plate", "mug"] or plate | mug'
_LARGEST = 2**63  # JSON readers refuse larger numbers


@dataclass(frozen=True)
class _Trajectory:
    """A trajectory: its frames by stem, and what they are sampled from if that is a film."""

    images: Mapping[str, SetPath]
    film: SampledFilm | None = None


@dataclass(frozen=True)
class OwnFolder:
    """Where questions and frames of such a data set are.

    Attributes:
        file: its CSV file, or its annotations.
        folders: folder of the frames of each trajectory, by its name.
        films: film of each further trajectory, by its name.
    """

    file: Path
    folders: Mapping[str, Path]
    films: Mapping[str, Path] = field(default_factory=dict)
    # Of the films that a question is on: decoding takes minutes where it is done the first time.
    _sampled: dict[str, SampledFilm | DataError] = field(default_factory=dict)

    @property
    def files(self) -> tuple[Path, ...]:
        """The files with its questions: the annotations are nothing without their mapping."""
        is_csv = self.file.suffix.lower() != ".json"
        return (self.file,) if is_csv else (self.file, self.file.parent / MAPPING)

    def folder(self, traj_id: str) -> Path:
        """Return the folder of a trajectory's frames, that of all without a name.

        Raises:
            DataError: it is a film that cannot be decoded.
        """
        if traj_id in self.films:
            return self._film(traj_id).folder
        return self.folders.get(traj_id, self.file.parent)

    def _film(self, name: str) -> SampledFilm:
        if name not in self._sampled:
            self._sampled[name] = sample_film(self.films[name])
        film = self._sampled[name]
        if isinstance(film, DataError):
            raise film
        return film

    def read_questions(self) -> list[Question | SkippedQuestion]:
        """Read the questions; a row that cannot be used is a `SkippedQuestion` that names its
        line."""
        is_csv = len(self.files) == 1
        rows = list(
            read_rows(self.file, _COLUMNS, _HINT) if is_csv else read_annotations(self.file)
        )
        self._refuse_misspelt(rows[0].columns if rows else ())
        found = {name: _Trajectory(find_images(folder)) for name, folder in self.folders.items()}
        unit = "line" if is_csv else "entry"
        places = [f"{self.file.name}, {unit} {row.line}: " for row in rows]
        entries = [self._entry(row, place, found) for row, place in zip(rows, places, strict=True)]
        entries = self.refuse_half_pairs(entries, places)
        if not any(isinstance(entry, Question) for entry in entries):
            reasons = [entry.reason for entry in entries if isinstance(entry, SkippedQuestion)]
            raise DataError(
                f"{self.file}: no row is a question ({reasons[0] if reasons else 'it has none'}); "
                f"{_HINT if is_csv else f'see {MAPPING}'}"
            )
        return entries

    def refuse_half_pairs(
        self, rows: Sequence[Question | SkippedQuestion], places: Sequence[str] = ()
    ) -> list[Question | SkippedQuestion]:
        """Return the rows with a reason in place of each question whose pair is not whole.

        Args:
            rows: all rows.
            places: what a reason begins with, for each row.
        """
        by_pair: dict[str, list[Question | SkippedQuestion]] = defaultdict(list)
        for row in rows:
            by_pair[row.pair if isinstance(row, Question) else row.question.pair].append(row)
        folder = self.file.parent
        pairs = read_pairs(folder) if has_pairs(folder) else []
        worlds = [set(pair.traj_ids) for pair in pairs]
        reasons = {name: _half(name, both, worlds) for name, both in by_pair.items() if name}
        return [
            SkippedQuestion(row, f"{place}pair: {reason}")
            if isinstance(row, Question) and (reason := reasons.get(row.pair))
            else row
            for row, place in zip(rows, places or [""] * len(rows), strict=True)
        ]

    def _refuse_misspelt(self, names: Collection[str]) -> None:
        """Refuse a column that is one of the optional ones misspelt: its cells would be ignored."""
        for name in names:
            word = name.lower()
            near = difflib.get_close_matches(word, _SHORT, n=1, cutoff=_NEAR_SHORT)
            near = near or difflib.get_close_matches(word, _OPTIONAL, n=1)
            if near and near[0] not in names:
                raise DataError(
                    f"{self.file}: the column {name!r} is not known; did you mean {near[0]}? "
                    "Rename or remove it"
                )

    def _entry(
        self, row: CsvRow, place: str, found: dict[str, _Trajectory]
    ) -> Question | SkippedQuestion:
        cells = {name: unshield(cell).strip() for name, cell in row.cells.items()}
        names = sorted([*self.folders, *self.films])
        traj_id = cells.get("trajectory", "")
        if not traj_id and len(names) == 1:
            traj_id = names[0]
        pair = cells.get("pair", "")
        try:
            if row.problem is not None:
                raise DataError(row.problem)
            for name in _COLUMNS:
                if not cells[name]:
                    raise DataError(f"{name} is empty; fill it or remove the row")
            if traj_id not in names:
                or_film = " or a film" if self.films else ""
                raise DataError(
                    f"trajectory is not the name of a folder of frames{or_film}; it is one of "
                    f"{', '.join(names[:3])}{', ...' if len(names) > 3 else ''}"
                )
            answers = _answers(cells["answer"])
            if traj_id not in found:
                film = self._film(traj_id)
                found[traj_id] = _Trajectory(find_images(film.folder), film)
            clues, moment = _clues_and_moment(cells, found[traj_id])
        except DataError as error:
            incomplete = Question(traj_id, cells["question"], (), (), pair=pair)
            return SkippedQuestion(incomplete, f"{place}{error}")
        return Question(traj_id, cells["question"], clues, answers, moment=moment, pair=pair)


def find_own_folder(root: Path) -> OwnFolder | None:
    """Return the parts of a data set of one's own, or None if there is none.

    Args:
        root: its folder, or its CSV file: that may be one of several there, but a question file of
            the published form is none.
    """
    given = [root] if root.is_file() else None
    root = root.parent if given else root
    with wrap_errors(f"{root}: the folder cannot be read", "check its permissions"):
        paths = sorted(root.iterdir())
        files = given or [path for path in paths if path.suffix.lower() == ".csv"]
        if not files and (root / MAPPING).is_file():
            files = [path for path in paths if path.suffix.lower() == ".json"]
        folders = {path.name: path for path in paths if path.is_dir()}
        folders = {name: path for name, path in folders.items() if find_images(path)}
        in_itself = bool(find_images(root))
    films = _find_films(paths, folders)
    if not files or not (in_itself or folders or films):
        return None
    is_csv = files[0].suffix.lower() != ".json"
    if given and is_csv:
        first = next((row.cells for row in read_rows(files[0], (), _HINT)), {})
        if "traj_id" in first:
            return None
    if len(files) > 1:
        raise DataError(
            f"{root}: has several {files[0].suffix[1:].upper()} files ({files[0].name}, "
            f"{files[1].name}); leave one, of the questions on its frames"
        )
    if in_itself and (folders or films):
        other = f"{next(iter(folders))}/" if folders else next(iter(films.values())).name
        raise DataError(
            f"{root}: has frames in itself and in {other}; give each trajectory a folder of its own"
        )
    return OwnFolder(files[0], {_ONLY: root} if in_itself else folders, films)


def _find_films(paths: Sequence[Path], folders: Mapping[str, Path]) -> dict[str, Path]:
    films: dict[str, Path] = {}
    for path in paths:
        if path.suffix.lower() in FILM_SUFFIXES and path.is_file():
            other = folders.get(path.stem) or films.get(path.stem)
            if other is not None:
                raise DataError(
                    f"{path}: {other.name} is a trajectory of that name as well; rename one of them"
                )
            films[path.stem] = path
    return films


def _half(
    name: str, both: Sequence[Question | SkippedQuestion], worlds: Sequence[set[str]]
) -> str | None:
    """Return why the questions of a pair cannot be scored as one; None if they can."""
    if len(both) != 2:
        return (
            f"{name!r:.40} is in {len(both)} {'row' if len(both) == 1 else 'rows'}; write it in "
            "those of its two questions"
        )
    asked = [row for row in both if isinstance(row, Question)]
    if len(asked) != 2:
        return (
            f"the other question of {name!r:.40} cannot be asked; correct it, or leave pair empty"
        )
    if asked[0].id == asked[1].id:
        return f"both questions of {name!r:.40} are the same; write another moment in one of them"
    trajectories = {question.traj_id for question in asked}
    if len(trajectories) == 2 and trajectories not in worlds:
        return (
            f"{name!r:.40} is on two trajectories that no twins.jsonl compares; pair two moments "
            "of one, or leave pair empty"
        )
    return None


def _answers(cell: str) -> tuple[Answer, ...]:
    """Return the answers that a cell has, all of which are required."""
    answers: list[Answer] = [part.strip() for part in cell.split("|")]
    if cell.startswith("["):
        try:
            answers = msgspec.json.decode(cell, type=list[str | int | float])
        except (msgspec.DecodeError, RecursionError):
            answers = []
        if not answers:
            raise DataError(f"answer: is no JSON list of texts and numbers; {_WRITE_ANSWERS}")
    for answer in answers:
        if isinstance(answer, str) and not answer.strip():
            raise DataError(f"answer: has an empty part; {_WRITE_ANSWERS}")
        if not isinstance(answer, str) and not abs(answer) < _LARGEST:
            raise DataError(f"answer: has a number that no reply can match; {_WRITE_ANSWERS}")
    return tuple(answers)


def _clues_and_moment(
    cells: Mapping[str, str], trajectory: _Trajectory
) -> tuple[tuple[int, ...], int | None]:
    """Return the places of a question's clue frames and of its moment, from 0."""
    clue_column, clues = _frames_of(cells, "clue_frames", "clue_seconds", trajectory)
    column, moments = _frames_of(cells, "moment", "moment_seconds", trajectory)
    last = len(trajectory.images) - 1
    if len(moments) > 1:
        raise DataError(f"{column}: is {len(moments)} frames; write one, as in 12")
    moment = moments[0] if moments else None
    if moment is None and cells.get("pair"):
        moment = last  # of a pair of moments each has one
    if moment is not None and clues and max(clues) > moment:
        raise DataError(
            f"{clue_column}: frame {max(clues)} is after the question's moment, frame {moment}; "
            "write an earlier clue or a later moment"
        )
    return clues or tuple(range((last if moment is None else moment) + 1)), moment


def _frames_of(
    cells: Mapping[str, str], by_frame: str, by_second: str, trajectory: _Trajectory
) -> tuple[str, tuple[int, ...]]:
    """Return the column of two that is filled, and the places of the frames that it means."""
    frames, seconds = cells.get(by_frame, ""), cells.get(by_second, "")
    if frames and seconds:
        raise DataError(f"{by_second}: {by_frame} is filled as well; leave one of them empty")
    if not seconds:
        return by_frame, _places(by_frame, frames, trajectory) if frames else ()
    if trajectory.film is None:
        raise DataError(f"{by_second}: frames in a folder have no time; write {by_frame}")
    try:
        return by_second, trajectory.film.frames_at(seconds)
    except DataError as error:
        raise DataError(f"{by_second}: {error}") from error


def _places(column: str, cell: str, trajectory: _Trajectory) -> tuple[int, ...]:
    images = trajectory.images
    places = {stem: at for at, stem in enumerate(images)}
    places |= {path.name: at for at, path in enumerate(images.values())}
    # Where names are numbers, a number is a name: "7" is 0007.png, wherever that stands. Nobody
    # has seen the names of a film's frames.
    numbered = trajectory.film is None and all(stem.isdecimal() for stem in images)
    numbers = {int(stem) if numbered else at: at for at, stem in enumerate(images)}

    def place(entry: str) -> int:
        found = places.get(entry)
        if found is None and entry.isdecimal() and len(entry) < 19:
            found = numbers.get(int(entry))
        if found is None:
            raise DataError(
                f"{column} has an entry that is no frame of the trajectory ({entry!r:.40}); write "
                "names or numbers of its frames, as in 12, 13"
            )
        return found

    return tuple(place(entry.strip()) for entry in cell.split(","))
