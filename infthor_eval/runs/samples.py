"""The samples of a run for readers that know no suites."""

import tempfile
from collections.abc import Iterable, Iterator

import msgspec

from infthor_eval.runs.suite import UnitSample

__all__ = ["StoredSamples"]


class StoredSamples:
    """Samples in a temporary file, read as often as needed.

    The evaluation that converts records to samples is closed with its run, but readers come later.
    In memory the prompts of long trajectories would take gigabytes.
    """

    def __init__(self, samples: Iterable[UnitSample]) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed with its owner
        for sample in samples:
            self._file.write(msgspec.json.encode(sample) + b"\n")

    def __iter__(self) -> Iterator[UnitSample]:
        self._file.seek(0)
        for line in self._file:
            yield msgspec.json.decode(line, type=UnitSample)
