"""What a run's folder is asked for."""

from pathlib import Path

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.nieh.records import RECORDS
from infthor_eval.run import Run, open_runs
from tests.helpers.journals import write_journal
from tests.helpers.nieh_runs import make_config, make_header, make_record


def write(folder: Path, **model: str) -> Path:
    """Write the journal of a run of one answer."""
    header = make_header(make_config() | {"model": model})
    return write_journal(folder, header, [make_record(0, "mug")], RECORDS)


def test_a_baseline_is_told_from_a_model_of_its_name(tmp_path: Path) -> None:
    baseline, model = write(tmp_path / "a", baseline="blind"), write(tmp_path / "b", name="blind")
    assert [Run.open(folder).is_baseline for folder in (baseline, model)] == [True, False]


def test_a_run_that_is_given_twice_is_refused_unless_that_is_meant(tmp_path: Path) -> None:
    folder = write(tmp_path / "a", name="m")
    with pytest.raises(UsageError, match="one run is given twice; give each once"):
        open_runs([folder, tmp_path / "b" / ".." / "a"])
    assert len(open_runs([folder, folder], twice=True)) == 2
