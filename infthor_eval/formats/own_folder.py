"""A data set of one's own: a folder of frames and one CSV file of questions on them.

The frames are PNG, JPEG or WebP files in the folder itself (one trajectory), or in a folder of
their own for each trajectory. Numbers in their names count as numbers: `2.png` comes before
`10.png`.

Columns: `question`, `answer`, `clue_frames` (optional: names or numbers of frames, with commas
between them) and, with several trajectories, `trajectory`. A question without clue frames has all
frames of its trajectory as such. Other columns are ignored, unless they look like one of these
misspelt.
"""

import difflib
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.csv_files import CsvRow, read_rows, unshield
from infthor_eval.formats.frames import find_images
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.question import Question, SkippedQuestion

_COLUMNS = ("question", "answer")
_OPTIONAL = ("clue_frames", "trajectory")
_HINT = f"it is a UTF-8 CSV file with the columns {', '.join(_COLUMNS)} and clue_frames"
_ONLY = "frames"  # name of the only trajectory; not the folder's own, which may be moved


@dataclass(frozen=True)
class OwnFolder:
    """Where questions and frames of such a data set are.

    Attributes:
        file: its CSV file.
        folders: folder of the frames of each trajectory, by its name.
    """

    file: Path
    folders: Mapping[str, Path]

    def read_questions(self) -> list[Question | SkippedQuestion]:
        """Read the CSV file; a row that cannot be used is a `SkippedQuestion` that names its
        line."""
        rows = list(read_rows(self.file, _COLUMNS, _HINT))
        self._refuse_misspelt(rows[0].columns if rows else ())
        images = {name: find_images(folder) for name, folder in self.folders.items()}
        entries = [self._entry(row, images) for row in rows]
        if not any(isinstance(entry, Question) for entry in entries):
            reasons = [entry.reason for entry in entries if isinstance(entry, SkippedQuestion)]
            raise DataError(
                f"{self.file}: no row is a question ({reasons[0] if reasons else 'it has none'}); "
                f"{_HINT}"
            )
        return entries

    def _refuse_misspelt(self, names: Collection[str]) -> None:
        """Refuse a column that is one of the optional ones misspelt: its cells would be ignored."""
        for name in names:
            near = difflib.get_close_matches(name.lower(), _OPTIONAL, n=1)
            if near and near[0] not in names:
                raise DataError(
                    f"{self.file}: the column {name!r} is not known; did you mean {near[0]}? "
                    "Rename or remove it"
                )

    def _entry(
        self, row: CsvRow, images: Mapping[str, Mapping[str, SetPath]]
    ) -> Question | SkippedQuestion:
        cells = {name: unshield(cell).strip() for name, cell in row.cells.items()}
        traj_id = cells.get("trajectory", "")
        if not traj_id and len(self.folders) == 1:
            traj_id = next(iter(self.folders))
        try:
            if row.problem is not None:
                raise DataError(row.problem)
            for name in _COLUMNS:
                if not cells[name]:
                    raise DataError(f"{name} is empty; fill it or remove the row")
            if traj_id not in images:
                raise DataError(
                    "trajectory is not the name of a folder of frames; it is one of "
                    f"{', '.join(list(images)[:3])}{', ...' if len(images) > 3 else ''}"
                )
            clues = _clues(cells.get("clue_frames", ""), images[traj_id])
        except DataError as error:
            incomplete = Question(traj_id, cells["question"], (), ())
            return SkippedQuestion(incomplete, f"{self.file.name}, line {row.line}: {error}")
        return Question(traj_id, cells["question"], clues, (cells["answer"],))


def find_own_folder(root: Path) -> OwnFolder | None:
    """Return the parts of a data set of one's own, or None if there is none.

    Args:
        root: its folder, or its CSV file: that may be one of several there, but a question file of
            the published form is none.
    """
    given = [root] if root.is_file() else None
    root = root.parent if given else root
    with wrap_errors(f"{root}: the folder cannot be read", "check its permissions"):
        files = given or sorted(path for path in root.iterdir() if path.suffix.lower() == ".csv")
        folders = {path.name: path for path in sorted(root.iterdir()) if path.is_dir()}
        folders = {name: path for name, path in folders.items() if find_images(path)}
        in_itself = bool(find_images(root))
    if not files or not (in_itself or folders):
        return None
    if given and "traj_id" in next((row.cells for row in read_rows(files[0], (), _HINT)), {}):
        return None
    if len(files) > 1:
        raise DataError(
            f"{root}: has several CSV files ({files[0].name}, {files[1].name}); leave one, of the "
            "questions on its frames"
        )
    if in_itself and folders:
        raise DataError(
            f"{root}: has frames in itself and in {next(iter(folders))}/; give each trajectory a "
            "folder of its own"
        )
    return OwnFolder(files[0], {_ONLY: root} if in_itself else folders)


def _clues(cell: str, images: Mapping[str, SetPath]) -> tuple[int, ...]:
    """Return the places of clue frames in time order, from 0."""
    if not cell:
        return tuple(range(len(images)))
    places = {stem: at for at, stem in enumerate(images)}
    places |= {path.name: at for at, path in enumerate(images.values())}
    # Where names are numbers, a number is a name: "7" is 0007.png, wherever that stands.
    numbered = all(stem.isdecimal() for stem in images)
    numbers = {int(stem) if numbered else at: at for at, stem in enumerate(images)}
    return tuple(_place(entry.strip(), places, numbers) for entry in cell.split(","))


def _place(entry: str, places: Mapping[str, int], numbers: Mapping[int, int]) -> int:
    place = places.get(entry)
    if place is None and entry.isdecimal() and len(entry) < 19:
        place = numbers.get(int(entry))
    if place is None:
        raise DataError(
            "clue_frames has an entry that is no frame of the trajectory; write names or numbers "
            "of its frames, as in 12, 13"
        )
    return place
