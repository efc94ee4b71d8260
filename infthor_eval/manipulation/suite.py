"""Manipulation as a suite: an arm does the pick-ups and puts of long trajectories' experts."""

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from infthor_eval.manipulation.actors import BASELINES
from infthor_eval.manipulation.evaluation import ManipulationEvaluation
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import RECORDS, ArmRecord
from infthor_eval.manipulation.summary import ManipulationSummary, summarise_manipulation
from infthor_eval.manipulation.tables import overview_table, result_tables
from infthor_eval.manipulation.task import check_task_file
from infthor_eval.rates import Rate
from infthor_eval.runs import (
    RecordTypes,
    RunHeader,
    RunSummary,
    TaskFile,
    TaskRequest,
    UnitRecord,
)
from infthor_eval.runs.config import require_tasks
from infthor_eval.runs.suite import Need
from infthor_eval.tables import Table
from model_adapters import Subject


class ManipulationSuite:
    """The suite; see `infthor_eval.runs.Suite`."""

    name: ClassVar[str] = "manipulation"
    needs: ClassVar[Need] = "policy"
    options: ClassVar[type] = ManipulationOptions
    baselines: ClassVar[Mapping[str, Callable[[int], Subject]]] = BASELINES
    records: ClassVar[RecordTypes[ArmRecord]] = RECORDS

    def check_task(self, task: TaskFile) -> None:
        """See `Suite.check_task`."""
        check_task_file(task)

    def prepare(self, request: TaskRequest[ManipulationOptions]) -> ManipulationEvaluation:
        """See `Suite.prepare`."""
        return ManipulationEvaluation(request)

    def summarise(
        self, header: RunHeader, records: Sequence[UnitRecord[ArmRecord]]
    ) -> ManipulationSummary:
        """See `Suite.summarise`; raises DataError for a journal without tasks."""
        require_tasks(header.config, header.name)
        return summarise_manipulation(header.config, records, header.units_by_task)

    def scores(self, record: UnitRecord[ArmRecord]) -> Mapping[str, float]:
        """See `Suite.scores`: whether the episode is a success, and its reward."""
        payload = record.payload
        return (
            {"success": float(payload.done), "reward": payload.reward} if payload.attempted else {}
        )

    def primary_metrics(self, summary: ManipulationSummary) -> Mapping[str, Rate]:
        """See `Suite.primary_metrics`: share of successful episodes."""
        return {
            name: task.success for name, task in summary.tasks.items() if task.success is not None
        }

    def overview(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.overview`."""
        return [overview_table(runs)]

    def tables(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.tables`."""
        return result_tables(runs)
