"""NIEH as a suite: questions about needles in an embodied haystack."""

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from infthor_eval.nieh.asking.baselines import BASELINES
from infthor_eval.nieh.evaluation import NiehEvaluation
from infthor_eval.nieh.options import NiehOptions
from infthor_eval.nieh.records import RECORDS, NiehAnswer
from infthor_eval.nieh.results.summary import NiehSummary, primary_metrics, summarise
from infthor_eval.nieh.results.tables import overview, tables
from infthor_eval.nieh.task import check_task_file
from infthor_eval.rates import Rate
from infthor_eval.runs import RecordTypes, RunHeader, RunSummary, TaskFile, TaskRequest, UnitRecord
from infthor_eval.runs.config import require_tasks
from infthor_eval.runs.suite import Need
from infthor_eval.tables import Table
from model_adapters import Subject


class NiehSuite:
    """The suite."""

    name: ClassVar[str] = "nieh"
    needs: ClassVar[Need] = "conversation"
    options: ClassVar[type] = NiehOptions
    baselines: ClassVar[Mapping[str, Callable[[int], Subject]]] = BASELINES
    records: ClassVar[RecordTypes[NiehAnswer]] = RECORDS

    def check_task(self, task: TaskFile) -> None:
        """See `Suite.check_task`."""
        check_task_file(task)

    def prepare(self, request: TaskRequest[NiehOptions]) -> "NiehEvaluation":
        """See `Suite.prepare`."""
        return NiehEvaluation(request)

    def summarise(
        self, header: RunHeader, records: Sequence[UnitRecord[NiehAnswer]]
    ) -> NiehSummary:
        """See `Suite.summarise`; raises DataError for a journal without tasks."""
        require_tasks(header.config, header.name)
        return summarise(header.config, records)

    def scores(self, record: UnitRecord[NiehAnswer]) -> Mapping[str, float]:
        """See `Suite.scores`."""
        return record.payload.scores

    def primary_metrics(self, summary: NiehSummary) -> Mapping[str, Rate]:
        """See `Suite.primary_metrics`: the strict scorer, or the task's own first metric."""
        return primary_metrics(summary)

    def overview(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.overview`."""
        return overview(runs)

    def tables(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.tables`."""
        return tables(runs)
