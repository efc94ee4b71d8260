"""The key of a private set: the set with its answers, and which public question each of them is.

`key.json` lies in the folder of the set with the answers. The public part has other names, another
order and no answers, so ids of its questions are others, too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.reading import read_json
from infthor_eval.storage.files import write_atomically

_KEY = "key.json"
_FORMAT = 1
_HINT = "give the folder `key` that private-set wrote, or make it again from the seed file"


class _Document(msgspec.Struct, frozen=True):
    """The file; `public` is the fingerprint of the public part."""

    public: str
    questions: dict[str, str]
    format: int = _FORMAT


@dataclass(frozen=True)
class AnswerKey:
    """The key of a private set.

    Attributes:
        data: the set with its answers.
        public: fingerprint of its public part.
        ids: id of each question by its id in the public part.
    """

    data: NiehSet
    public: str
    ids: Mapping[str, str]

    def question(self, public_id: str) -> Question:
        """Return the question, with its answers, that has this id in the public part."""
        question = self.data.by_id.get(self.ids.get(public_id, ""))
        if question is None:
            raise DataError(
                f"{self.data.root}: the key has no question {public_id!r:.80}; give the key of the "
                "set that was asked"
            )
        return question


def read_key(folder: Path) -> AnswerKey:
    """Read the key in a folder."""
    if not (folder / _KEY).is_file():
        raise DataError(f"{folder}: no {_KEY} in it; {_HINT}")
    document = read_json(folder / _KEY, _HINT, _Document)
    if document.format != _FORMAT:
        raise DataError(f"{folder / _KEY}: of format {document.format}, not {_FORMAT}; {_HINT}")
    return AnswerKey(NiehSet(folder), document.public, document.questions)


def write_key(folder: Path, public: NiehSet, ids: Mapping[str, str]) -> None:
    """Write the key of a public part beside the set with its answers."""
    document = _Document(public.fingerprint, dict(sorted(ids.items())))
    with write_atomically(folder / _KEY) as partial:
        partial.write_bytes(msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n")
