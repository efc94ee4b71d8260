"""The command line as the tests call it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_eval.cli import main
from infthor_eval.nieh.records import RECORDS, NiehAnswer
from infthor_eval.runs import UnitRecord, read_run


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Runs the command in this process; gives its exit code, standard output and standard error."""

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        return ended.value.code, *capfd.readouterr()

    return run


@pytest.fixture
def records_in() -> Callable[[Path], list[UnitRecord[NiehAnswer]]]:
    """Gives the records of the one run below a folder."""

    def records_in(folder: Path) -> list[UnitRecord[NiehAnswer]]:
        (journal,) = folder.rglob("journal")
        return read_run(journal.parent, RECORDS)[1]

    return records_in
