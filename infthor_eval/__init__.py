"""infthor-eval: evaluation of multimodal models on long-horizon embodied tasks (∞-THOR)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import os

    from pandas import DataFrame

__all__ = ["__version__", "load_run"]

__version__ = "0.1.0"


def load_run(folder: str | os.PathLike[str]) -> DataFrame:
    """Return the samples of a run, of any suite, as a data frame of pandas.

    Args:
        folder: folder of the run ("results/oracle/nieh_mini_gt-HASH"); the run may still be going
            on.

    Returns:
        A row per sample (a question, a plan, an episode of an arm). Numbers are numbers: scores (1
        is right, NaN does not count), seconds, tokens, clues. docs/formats.md lists the columns. A
        cell without a value is NaN.

    Raises:
        DataError: there is no journal in the folder, or one with a bad line, or of another format.
        UsageError: the suite of the run is not known here.
    """
    # By name: every module imports this one, and few need pandas.
    from infthor_eval.plugins import import_target

    frame: DataFrame = import_target("infthor_eval.report.sample_table:load_run")(folder)
    return frame
