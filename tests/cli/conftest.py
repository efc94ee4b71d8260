"""The records of runs started by the command line."""

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
import pytest

from infthor_eval.nieh.records import RECORDS, NiehAnswer
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.runs import UnitRecord

from ..helpers.command_line import CliRunner, option_words, read_success
from ..helpers.journals import write_journal
from ..helpers.nieh_runs import make_config, make_header
from .commands.rescored import REPLIES


@pytest.fixture
def evaluate(tmp_path: Path, run_cli: CliRunner) -> Callable[..., Path]:
    """Runs a model; returns the folder of its run."""

    def evaluate(model: str = "oracle", tasks: str = "nieh_gt", **options: object) -> Path:
        out = tmp_path / "evaluated"
        read_success(run_cli(*option_words(model=model, tasks=tasks, out=out, **options)))
        return max((out / model).iterdir(), key=lambda folder: folder.stat().st_mtime_ns)

    return evaluate


@pytest.fixture
def source(tmp_path: Path) -> Callable[..., Path]:
    """Writes the journal of a run, and nothing else; returns its folder."""

    def source(
        records: Sequence[UnitRecord[NiehAnswer]] = REPLIES,
        suite: str = "nieh",
        n_samples: int = 8,
        metrics: tuple[str, ...] = SCORERS,
        **changes: object,
    ) -> Path:
        config = (
            make_config(model="m", checkpoint=None, n_parameters=None, metrics=metrics) | changes
        )
        config["tasks"]["nieh_gt"]["n_samples"] = n_samples
        folder = tmp_path / "elsewhere" / "a run"
        header = msgspec.structs.replace(make_header(config, "m"), suite=suite)
        return write_journal(folder, header, records, RECORDS)

    return source


@pytest.fixture
def rescore(
    tmp_path: Path, run_cli: CliRunner, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[int, str, Path | None]]:
    """Scores a run again; returns exit code, what was said, and the folder of the new run."""
    monkeypatch.chdir(tmp_path)

    def rescore(folder: Path, *options: object) -> tuple[int, str, Path | None]:
        code, out, err = run_cli("rescore", folder, "--out", tmp_path / "out", *options)
        folders = sorted((tmp_path / "out").glob("*/*"), key=lambda path: path.stat().st_mtime)
        return code, out + err, folders[-1] if folders else None

    return rescore
