"""Runs that grow while they are watched."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from infthor_eval.nieh.records import RECORDS, NiehAnswer
from infthor_eval.report.live.state import LiveRun
from infthor_eval.runs import RunHeader
from infthor_eval.runs.journals.journal import Journal
from tests.helpers.nieh_runs import make_config, make_header, make_record

N_UNITS = 8


def header_of(name: str = "m") -> RunHeader:
    """The header of a run of as many questions."""
    config = make_config(model=name, checkpoint=None, n_parameters=None, simulator="embedded")
    config["tasks"]["nieh_gt"]["n_samples"] = N_UNITS
    return msgspec.structs.replace(make_header(config, name), n_units=N_UNITS)


@pytest.fixture
def open_journal(tmp_path: Path) -> Callable[..., Journal[NiehAnswer]]:
    """Opens the journal of a run below `results`, as a run does."""

    def open_journal(name: str = "m", worker: int = 0) -> Journal[NiehAnswer]:
        return Journal(tmp_path / "results" / name / "nieh-1", header_of(name), RECORDS, worker)

    return open_journal


@pytest.fixture
def begun(open_journal: Callable[..., Journal[NiehAnswer]]) -> None:
    """A run with one answer, which nobody goes on with."""
    with open_journal() as journal:
        journal.append(make_record(0, "Sofa", ("Sofa",)))


@pytest.fixture
def live(tmp_path: Path) -> LiveRun:
    """The run below `results`, as it is watched."""
    return LiveRun(tmp_path / "results")
