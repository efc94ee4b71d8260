"""What a run tells: an observer that keeps it, and the replies of its records."""

from infthor_eval.runs import RunOutcome, Silent, UnitKey, UnitRecord, Workload


def replies(outcome: RunOutcome) -> dict[UnitKey, str | None]:
    """The reply of each unit."""
    return {record.key: record.payload.reply for record in outcome.records}


class Watcher(Silent):
    """Keeps the work, and the records that were evaluated now and those of the journal."""

    def __init__(self) -> None:
        self.work: Workload | None = None
        self.evaluated: list[UnitRecord] = []
        self.resumed: list[UnitRecord] = []

    def begin(self, work: Workload, n_recovered: int) -> None:
        """See `Observer`."""
        self.work = work

    def done(self, record: UnitRecord, resumed: bool) -> None:
        """See `Observer`."""
        (self.resumed if resumed else self.evaluated).append(record)
