"""The smallest suite: sums, in two groups, one of which cannot be done; and runs of it."""

from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from infthor_eval import runs
from infthor_eval.errors import DataError
from infthor_eval.rates import Rate
from infthor_eval.tables import Column, Row, Table
from model_adapters import Capabilities


class Sum(msgspec.Struct, frozen=True, tag_field="type", tag="sum"):
    numbers: tuple[int, int]
    answer: int | None = None


class Adder:
    name, capabilities = "adder", Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self, seed=0):
        self.identity, self.close = lambda: {"baseline": "adder"}, lambda: None


class Sums:
    """The bound evaluation."""

    def __init__(self):
        units = [
            runs.Unit(runs.UnitKey("sums", f"{a}+{b}"), f"from {a}", Sum((a, b)))
            for a in (1, 2)
            for b in (3, 4)
        ]
        skipped = [runs.Skipped(runs.UnitKey("sums", "0+0"), "nothing to add")]
        groups = [runs.Group(units[:2]), runs.Group(units[2:])]
        self.workload = runs.Workload(groups, skipped, runs.RunConfig(tasks={"sums": {}}))

    def run(self, group, session):
        for unit in group.units:
            if is_broken(group):
                raise DataError("the abacus is broken")
            yield session.find_record(unit, "f") or unit.record(
                "f", Sum(unit.payload.numbers, sum(unit.payload.numbers))
            )

    def close(self):
        pass


def is_broken(group):
    return group.units[0].cluster == "from 2"


@dataclass
class Prepared:
    """The evaluation: creates a bound one for every subject."""

    create: Callable

    def bind(self, subject):
        return self.create()

    def to_doc(self, header, record):
        a, b = record.payload.numbers
        return runs.UnitDoc(
            a * 10 + b, {"numbers": [a, b]}, str(a + b), f"{a}+{b}", {}, str(record.payload.answer)
        )


def make_suite(create):
    """A toy suite with another bound evaluation."""
    return type("OtherToySuite", (ToySuite,), {"prepare": lambda self, request: Prepared(create)})()


class ToySuite:
    name, needs, options, records = "toy", "conversation", object, runs.RecordTypes(Sum)
    baselines = {"adder": Adder}  # noqa: RUF012

    def check_task(self, task):
        pass

    def prepare(self, request):
        return Prepared(Sums)

    def summarise(self, header, records):
        return Sum(
            (sum(r.failure is None for r in records), sum(r.failure is not None for r in records))
        )

    def scores(self, record):
        return {"right": float(record.payload.answer == sum(record.payload.numbers))}

    def primary_metrics(self, summary):
        right, wrong = summary.numbers
        return {"sums": Rate(right / (right + wrong), None, None, right + wrong)}

    def overview(self, summaries):
        return self.tables(summaries)

    def tables(self, summaries):
        rows = tuple(Row((run.header.name, str(run.summary.numbers[0]))) for run in summaries)
        return [Table("Sums", (Column("who", False), Column("right")), rows)]


class Watching:
    """Keeps what a run tells; it has no notes."""

    def __init__(self):
        self.begun, self.seen = None, []

    def begin(self, work, n_recovered):
        self.begun = (work.n_units, len(work.skipped), n_recovered)

    def done(self, record, resumed):
        self.seen.append((record.id, record.failure, resumed))

    def notify(self, text):
        raise AssertionError(text)


def run(run_request, suite=None):
    """The outcome of a run, and what it told."""
    watching = Watching()
    return runs.execute(runs.prepare(run_request, suite or ToySuite()), watching), watching
