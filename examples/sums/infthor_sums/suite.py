"""The suite: its options, records, baselines, summary and tables. `evaluation.py` does the work.

The command line imports this module for its options (`infthor-eval run --help`), so nothing heavy
is imported here.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import msgspec

from infthor_eval.rates import Rate, clustered_rate, format_percent
from infthor_eval.runs import (
    RecordTypes,
    RunConfig,
    RunHeader,
    RunSummary,
    TaskFile,
    TaskRequest,
    UnitRecord,
)
from infthor_eval.runs.suite import BaselineSubject
from infthor_eval.settings import Setting
from infthor_eval.tables import Column, Row, Table

__all__ = ["Calculator", "Sum", "SumsConfig", "SumsOptions", "SumsSuite", "SumsSummary"]

KINDS = ("without carry", "with carry")


class Sum(msgspec.Struct, frozen=True, tag_field="type", tag="sum"):
    """The payload of a record: a sum, and the reply to it.

    Attributes:
        a: first number.
        b: second number.
        reply: the model's reply; None as long as there is none.
    """

    a: int
    b: int
    reply: str | None = None

    @property
    def kind(self) -> str:
        """Whether the last digits carry."""
        return KINDS[self.a % 10 + self.b % 10 >= 10]

    @property
    def is_right(self) -> bool:
        """Whether the first number of the reply is the sum."""
        number = re.search(r"-?\d+", self.reply or "")
        return number is not None and int(number[0]) == self.a + self.b


class SumsConfig(RunConfig[dict[str, Any]], frozen=True, kw_only=True, omit_defaults=True):
    """What the numbers of a run depend on, in the header of its journal.

    Attributes:
        question: text of the question.
    """

    question: str = ""


class SumsSummary(msgspec.Struct, frozen=True):
    """The summary of a run.

    Attributes:
        tasks: share of right sums by task, then by kind and for "all" of them.
    """

    tasks: dict[str, dict[str, Rate]]


@dataclass(frozen=True)
class SumsOptions:
    """Options of `infthor-eval run` for this suite."""

    question: Annotated[
        str, Setting(help="Text of a question, with {a} and {b} for the numbers.")
    ] = "What is {a} + {b}? Answer with a number."


class Calculator(BaselineSubject):
    """A baseline that is always right."""

    name = "calculator"


class SumsSuite:
    """See `infthor_eval.runs.Suite`."""

    name: ClassVar[str] = "sums"
    needs: ClassVar[str] = "conversation"
    options: ClassVar[type] = SumsOptions
    baselines: ClassVar[Mapping[str, type]] = {"calculator": Calculator}
    records: ClassVar[RecordTypes] = RecordTypes(Sum, config=SumsConfig)

    def check_task(self, task: TaskFile) -> None:
        """See `Suite.check_task`."""
        from infthor_sums.evaluation import settings_of

        settings_of(task)

    def prepare(self, request: TaskRequest):
        """See `Suite.prepare`."""
        from infthor_sums.evaluation import SumsEvaluation

        return SumsEvaluation(request)

    def summarise(self, header: RunHeader, records: Sequence[UnitRecord[Sum]]) -> SumsSummary:
        """See `Suite.summarise`."""
        tasks = {}
        for task in header.config.tasks:
            chosen = [
                record for record in records if record.task == task and record.excluded is None
            ]
            groups = {
                "all": chosen,
                **{kind: [r for r in chosen if r.payload.kind == kind] for kind in KINDS},
            }
            rates = {name: self._rate(group) for name, group in groups.items()}
            tasks[task] = {name: rate for name, rate in rates.items() if rate is not None}
        return SumsSummary(tasks)

    def _rate(self, records: Sequence[UnitRecord[Sum]]) -> Rate | None:
        """Return the share of right answers, over the records that have one."""
        answered = [record for record in records if record.state == "answered"]
        rate = clustered_rate(
            [self.scores(record)["right"] for record in answered],
            [record.cluster for record in answered],
        )
        return None if rate is None else rate.out_of(len(records))

    def scores(self, record: UnitRecord[Sum]) -> Mapping[str, float]:
        """See `Suite.scores`."""
        return {"right": float(record.payload.is_right)} if record.failure is None else {}

    def primary_metrics(self, summary: SumsSummary) -> Mapping[str, Rate]:
        """See `Suite.primary_metrics`."""
        return {task: rates["all"] for task, rates in summary.tasks.items() if "all" in rates}

    def overview(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.overview`."""
        return [_table(runs, ("all",))]

    def tables(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.tables`."""
        return [_table(runs, ("all", *KINDS))]


def _table(runs: Sequence[RunSummary], kinds: Sequence[str]) -> Table:
    rows = [
        Row(
            (
                run.header.name,
                task,
                *(format_percent(rates.get(kind)) for kind in kinds),
                str(rates["all"].n if "all" in rates else 0),
            )
        )
        for run in runs
        for task, rates in run.summary.tasks.items()
        if "all" in rates
    ]
    columns = (Column("model", False), Column("task", False), *map(Column, (*kinds, "sums")))
    return Table("Right sums, %, 95 % interval in brackets", columns, tuple(rows))
