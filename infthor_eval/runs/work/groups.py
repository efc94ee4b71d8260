"""The records of a group: whatever its suite raises fails the group alone, and is recorded."""

from collections.abc import Iterator

import msgspec

from infthor_eval.errors import ModelError
from infthor_eval.runs.journals.records import P, U, UnitRecord
from infthor_eval.runs.suite import BoundEvaluation, Group, Session

__all__ = ["group_records"]


def group_records(
    evaluation: BoundEvaluation[U, P], group: Group[U], session: Session[P]
) -> Iterator[UnitRecord[P]]:
    """Yield the records of a group; units without a record when it ends have failed.

    Raises:
        MemoryError: the machine has no more memory; the run ends.
    """
    waiting = {unit.key: unit for unit in group.units}
    fault: Exception = ModelError("the suite gives no record of it; fix the suite")
    try:
        for record in evaluation.run(group, session):
            msgspec.json.encode(
                record
            )  # a record that cannot be written must fail here, not in the journal
            waiting.pop(record.key, None)
            yield record
    except MemoryError:  # the next group would have no more memory than this one
        raise
    except Exception as error:  # noqa: BLE001 - a suite is anybody's code, and may raise anything
        fault = error
    yield from (
        unit.record_failure(session.describe_failure(unit, fault)) for unit in waiting.values()
    )
