"""The records of a group of units, whatever the suite raises."""

from collections.abc import Iterator, Mapping

from infthor_eval.errors import STOPS, ModelError
from infthor_eval.runs.journals.record_encoder import RecordEncoder, RefusedRecordError
from infthor_eval.runs.journals.records import Payload, SuiteUnit, Unit, UnitKey, UnitRecord
from infthor_eval.runs.suite import BoundEvaluation, Group, Session


def group_records(
    evaluation: BoundEvaluation[SuiteUnit, Payload],
    group: Group[SuiteUnit],
    session: Session[Payload],
    encoder: RecordEncoder[Payload],
) -> Iterator[UnitRecord[Payload]]:
    """Yield the records of a group; units without a record when it ends have failed.

    So has a unit whose record the journal cannot hold: that is the fault of who gave what is in it,
    and of no other unit.

    Raises:
        MemoryError: the machine has no more memory; the run ends.
    """
    units = {unit.key: unit for unit in group.units}
    waiting = dict(units)
    records: Iterator[UnitRecord[Payload]] | None = None
    fault: BaseException
    # No loop over the records with a `yield` in the `try`: it would catch what ends this generator.
    while True:
        try:
            records = records or iter(evaluation.run(group, session))
            record = next(records)
            unit = _unit_of(record, units)
        except StopIteration:
            fault = ModelError("the suite gives no record of it; fix the suite")
            break
        except (MemoryError, *STOPS):  # the next group would have no more memory than this one
            raise
        except BaseException as error:  # noqa: BLE001 - a suite is anybody's code, see STOPS
            fault = error
            break
        waiting.pop(record.key, None)
        yield _kept(record, unit, session, encoder)
    for unit in waiting.values():
        yield unit.record_failure(session.describe_failure(unit, fault))


def _unit_of(record: UnitRecord[Payload], units: Mapping[UnitKey, Unit[Payload]]) -> Unit[Payload]:
    unit = units.get(record.key)
    if unit is None:
        raise ModelError(
            f"the suite gives a record of {record.key!r:.200}, no unit of its group; fix the suite"
        )
    return unit


def _kept(
    record: UnitRecord[Payload],
    unit: Unit[Payload],
    session: Session[Payload],
    encoder: RecordEncoder[Payload],
) -> UnitRecord[Payload]:
    """Return a record that the journal can hold, or else that of its unit's failure."""
    try:
        encoder.encode(record)
    except RefusedRecordError as error:
        return unit.record_failure(session.describe_failure(unit, error))
    return record
