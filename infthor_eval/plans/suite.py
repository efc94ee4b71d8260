"""Plans as a suite: an agent follows a long trajectory plan by plan."""

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from msgspec import UNSET

from infthor_eval.plans.actors.baselines import BASELINES
from infthor_eval.plans.evaluation import PlansEvaluation
from infthor_eval.plans.options import PlansOptions
from infthor_eval.plans.records import RECORDS, PlanRecord
from infthor_eval.plans.summary import PlansSummary, PlanTaskSummary, summarise_plans
from infthor_eval.plans.tables import overview_table, result_tables
from infthor_eval.plans.task import check_task_file
from infthor_eval.plans.twins.results import first_place_score
from infthor_eval.rates import Rate
from infthor_eval.runs import RecordTypes, RunHeader, RunSummary, TaskFile, TaskRequest, UnitRecord
from infthor_eval.runs.config import require_tasks
from infthor_eval.runs.suite import Need
from infthor_eval.tables import Table
from model_adapters import Subject


class PlansSuite:
    """The suite; see `infthor_eval.runs.Suite`."""

    name: ClassVar[str] = "plans"
    needs: ClassVar[Need] = "conversation"
    options: ClassVar[type] = PlansOptions
    baselines: ClassVar[Mapping[str, Callable[[int], Subject]]] = BASELINES
    records: ClassVar[RecordTypes[PlanRecord]] = RECORDS

    def check_task(self, task: TaskFile) -> None:
        """See `Suite.check_task`."""
        check_task_file(task)

    def prepare(self, request: TaskRequest[PlansOptions]) -> PlansEvaluation:
        """See `Suite.prepare`."""
        return PlansEvaluation(request)

    def summarise(
        self, header: RunHeader, records: Sequence[UnitRecord[PlanRecord]]
    ) -> PlansSummary:
        """See `Suite.summarise`; raises DataError for a journal without tasks."""
        require_tasks(header.config, header.name)
        return summarise_plans(header.config, records, header.units_by_task)

    def scores(self, record: UnitRecord[PlanRecord]) -> Mapping[str, float]:
        """See `Suite.scores`: whether the plan was completed, and its reward if it has one.

        Of twins, also whether the place looked at first is the right one.
        """
        payload = record.payload
        if not payload.attempted:
            return {}
        reward = {} if payload.max_reward is None else {"reward": payload.reward}
        return {"success": float(payload.done), **reward, **first_place_score(payload)}

    def primary_metrics(self, summary: PlansSummary) -> Mapping[str, Rate]:
        """See `Suite.primary_metrics`: net pairs of twins, else share of completed plans."""
        rates = {name: _primary_rate(task) for name, task in summary.tasks.items()}
        return {name: rate for name, rate in rates.items() if rate is not None}

    def overview(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.overview`."""
        return [overview_table(runs)]

    def tables(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.tables`."""
        return result_tables(runs)


def _primary_rate(task: PlanTaskSummary) -> Rate | None:
    return task.success.get("total") if task.twins is UNSET else task.twins.net_pairs
