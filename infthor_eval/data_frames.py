"""Runs as data frames of pandas, which is imported when the first one is asked for."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from infthor_eval.report.presented import read_report_runs
from infthor_eval.report.sample_table import sample_table

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = ["load_run"]


def load_run(folder: str | os.PathLike[str]) -> DataFrame:
    """Return the samples of the run in a folder, a row each; `infthor_eval.load_run` documents
    it."""
    return sample_table(read_report_runs([Path(folder)])).to_pandas()
