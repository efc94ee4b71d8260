"""What a card says of a set, counted from its files; and what its owner says."""

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import fmean
from typing import Any

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.own_folder import OWN_FRAMES
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.set_info import frames_of, writer_of
from infthor_eval.nieh.guessing.audit import Audit, audit
from infthor_eval.nieh.guessing.chains import form_of
from infthor_eval.nieh.guessing.clue_facts import read_scenes
from infthor_eval.nieh.set_contents import SetContents, read_contents

_MANIFEST = "manifest.json"
_PAIRS = "twins.jsonl"
_HINT = "write the set again"


@dataclass(frozen=True, kw_only=True)
class About:
    """What the owner of a set says of it.

    Attributes:
        name: its name.
        licence: SPDX identifier of its licence ("CC-BY-4.0").
        version: its version ("1.0.0").
        published: day of its publication, YYYY-MM-DD.
        url: where it can be had; None if it is not published yet.
        creators: names of its creators.
        citation: how to cite it, as BibTeX, say; empty if there is nothing to cite yet.
    """

    name: str
    licence: str
    version: str
    published: str
    url: str | None = None
    creators: tuple[str, ...] = ()
    citation: str = ""


@dataclass(frozen=True)
class FileFact:
    """A file of a set.

    Attributes:
        path: path within the set, with slashes.
        size: bytes.
        sha256: digest of the content, hex.
    """

    path: str
    size: int
    sha256: str


@dataclass(frozen=True, kw_only=True)
class SetFacts:
    """What can be counted in a set.

    Attributes:
        data: the set.
        contents: questions, frames and what cannot be read.
        audited: what guessers that see no frame get.
        forms: numbers of questions by form.
        scenes: numbers of trajectories by scene; empty if the set does not tell.
        manifest: what determines the set, if it was built from a manifest; else empty.
        written_by: version of infthor-eval that wrote the set; None if it does not say.
        frames: version of the embedded simulator's drawing; None if it does not say.
        question_files: files with questions.
        pairs_file: `twins.jsonl`; None if the set has no pairs.
    """

    data: NiehSet
    contents: SetContents
    audited: Audit
    forms: Mapping[str, int]
    scenes: Mapping[str, int] = field(default_factory=dict)
    manifest: Mapping[str, Any] = field(default_factory=dict)
    written_by: str | None = None
    frames: int | None = None
    question_files: Sequence[FileFact] = ()
    pairs_file: FileFact | None = None

    @property
    def n_questions(self) -> int:
        """Number of questions that can be asked."""
        return len(self.data.questions)

    @property
    def n_frames(self) -> int:
        """Number of frames of all trajectories."""
        return sum(self.contents.frames)

    @cached_property
    def kinds(self) -> Mapping[str, int]:
        """Numbers of paired questions by kind of edit; empty without pairs."""
        if self.pairs_file is None:
            return {}
        of_first = (
            self.data.twins[question.traj_id]
            for question in self.data.questions
            if self.data.twins[question.traj_id].traj_ids[0] == question.traj_id
        )
        return Counter(world.kind for world in of_first)

    @property
    def n_pairs(self) -> int:
        """Number of pairs of questions."""
        return sum(self.kinds.values())

    @property
    def n_bases(self) -> int:
        """Number of trajectories that pairs of worlds were made of."""
        return len({question.base for question in self.data.questions if question.base})

    @property
    def n_facts(self) -> int:
        """Number of facts that the pairs are about."""
        return len({question.fact for question in self.data.questions if question.pair})

    @property
    def seeds(self) -> list[str]:
        """Scene and seed of each trajectory of the manifest."""
        return [f"{one['scene']} {one['seed']}" for one in self.manifest.get("trajectories", ())]

    @property
    def blind(self) -> float:
        """What `blind` has of the set without a frame, %."""
        return 100 * fmean(audited.scores[-1] for audited in self.audited.questions)


def read_facts(root: Path) -> SetFacts:
    """Count what is in a set.

    Raises:
        UsageError: its frames are of no simulator, of which a card's texts would say nothing true.
        DataError: the set cannot be read, or no question of it can be asked.
    """
    data = NiehSet(root)
    if data.simulator == OWN_FRAMES:
        raise UsageError(
            f"{root}: has frames of your own, and a card speaks of simulated homes; write its "
            "README.md yourself"
        )
    if not data.questions:
        raise DataError(f"{root}: no question can be asked; fix the set, or give another")
    folder = data.directory
    manifest = folder / _MANIFEST
    pairs = folder / _PAIRS
    return SetFacts(
        data=data,
        contents=read_contents(data),
        audited=audit(data),
        forms=Counter(map(form_of, data.questions)),
        scenes=_read_scenes(data),
        manifest=read_json(manifest, _HINT, dict[str, Any]) if manifest.is_file() else {},
        written_by=writer_of(folder),
        frames=frames_of(folder),
        question_files=[_file_fact(path, folder) for path in data.question_files],
        pairs_file=_file_fact(pairs, folder) if pairs.is_file() else None,
    )


def _read_scenes(data: NiehSet) -> Mapping[str, int]:
    scenes = read_scenes(data)
    if not scenes and any(question.pair for question in data.questions):
        scenes = {name: pair.floor_plan for name, pair in data.twins.items()}
    return Counter(scenes.values())


def _file_fact(path: Path, folder: Path) -> FileFact:
    with wrap_errors(f"{path}: cannot be read", "check its permissions"), path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return FileFact(path.relative_to(folder).as_posix(), path.stat().st_size, digest)
