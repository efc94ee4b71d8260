"""The records of a group, whatever its suite does: what fails is recorded, and no other group with it."""

from collections.abc import Iterator
from typing import Any, TypeVar

import msgspec

from infthor_eval.errors import InfthorError, describe_exception
from infthor_eval.runs.records import Unit, UnitRecord
from infthor_eval.runs.suite import BoundEvaluation, Group, Session

__all__ = ["group_records"]

P = TypeVar("P")
U = TypeVar("U", bound=Unit[Any])


def group_records(evaluation: BoundEvaluation[U, P], group: Group[U], session: Session[P]) -> Iterator[UnitRecord[P]]:
    """The records of a group; units that it came to no record of have failed, and no other group with them.

    Raises:
        MemoryError: the machine has no more; the run ends.
    """
    waiting = {unit.key: unit for unit in group.units}
    reason = "the suite gives no record of it; mend the suite"
    try:
        for record in evaluation.run(group, session):
            msgspec.json.encode(record)  # what cannot be written is to fail here, not where the journal writes it
            waiting.pop(record.key, None)
            yield record
    except InfthorError as error:
        reason = str(error)
    except MemoryError:  # of the machine, and not of the group alone
        raise
    except Exception as error:  # noqa: BLE001 - a suite is anybody's code, and may raise anything
        reason = f"{describe_exception(error)}; mend the suite and run the same command again"
    yield from (unit.failed(reason) for unit in waiting.values())
