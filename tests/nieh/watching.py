"""What a run tells: an observer that keeps it, and the replies of its records."""

from infthor_eval.runs import RunOutcome, UnitKey, UnitRecord, Workload


def replies(outcome: RunOutcome) -> dict[UnitKey, str | None]:
    """The reply of each unit."""
    return {record.key: record.payload.reply for record in outcome.records}


class Watcher:
    """Keeps the work, and every record with whether it was found in the journal."""

    def __init__(self) -> None:
        self.work: Workload | None = None
        self.n_recovered = 0
        self.notes: list[str] = []
        self.done_units: list[tuple[UnitRecord, bool]] = []

    def begin(self, work: Workload, n_recovered: int) -> None:
        """See `Observer`."""
        self.work, self.n_recovered = work, n_recovered

    def done(self, record: UnitRecord, resumed: bool) -> None:
        """See `Observer`."""
        self.done_units.append((record, resumed))

    def notify(self, text: str) -> None:
        """See `Observer`."""
        self.notes.append(text)

    @property
    def evaluated(self) -> list[UnitRecord]:
        """What was evaluated now."""
        return [record for record, resumed in self.done_units if not resumed]

    @property
    def resumed(self) -> list[UnitRecord]:
        """What was in the journal."""
        return [record for record, resumed in self.done_units if resumed]
