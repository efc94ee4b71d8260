"""The records of runs started by the command line."""

from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_eval.nieh.records import RECORDS, NiehAnswer
from infthor_eval.runs import UnitRecord, read_run


@pytest.fixture
def records_in() -> Callable[[Path], list[UnitRecord[NiehAnswer]]]:
    """Gives the records of the one run below a folder."""

    def records_in(folder: Path) -> list[UnitRecord[NiehAnswer]]:
        (journal,) = folder.rglob("journal")
        return read_run(journal.parent, RECORDS)[1]

    return records_in
