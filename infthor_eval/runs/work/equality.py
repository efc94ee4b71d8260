"""Whether a run's engine settings change replies: some units, with them and without.

A model's switches (`model_adapters.switches`) are to save time or memory and to change nothing
else. Whether they do depends on model, device and library, so it is tried.
"""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, field, replace

from infthor_eval.errors import UsageError
from infthor_eval.runs.journals.record_encoder import RecordEncoder
from infthor_eval.runs.journals.records import Payload, SuiteUnit, UnitKey
from infthor_eval.runs.request import RunRequest, prepare
from infthor_eval.runs.suite import Suite
from infthor_eval.runs.work.binding import BoundRun, bind_run, group_records
from infthor_eval.runs.work.executor import UnrecordedSession
from model_adapters import is_known, switched_on, switches

_Replies = Mapping[UnitKey, str]


@dataclass(frozen=True)
class Equality:
    """How many replies a run's switches change.

    Attributes:
        switched: the switches as typed.
        n_units: number of units that were asked.
        n_differing: number of those with another reply without the switches.
        n_unstable: number of those with another reply when they are asked again, in another order,
            without the switches; 0 if none differs.
        alone: number of differing replies by switch, each alone; empty if none differs, or for one
            switch.
    """

    switched: Mapping[str, str]
    n_units: int
    n_differing: int
    n_unstable: int = 0
    alone: Mapping[str, int] = field(default_factory=dict)


def require_switches(request: RunRequest, n_units: int) -> Mapping[str, str]:
    """Return the switches of a request; nothing is loaded.

    Args:
        n_units: number of units to ask, for the message.

    Raises:
        UsageError: there is none.
        ModelError: the adapter cannot be imported.
    """
    known = switches(request.model) if is_known(request.model) else ()
    switched = switched_on(request.model, request.model_options) if known else {}
    if not switched:
        there_are = f"its switches are {', '.join(known)}" if known else "it has none"
        raise UsageError(
            f"--check-equality {n_units}: --model-args turns no switch of {request.model} on, so "
            f"there is nothing to compare; {there_are}"
        )
    return switched


def check_equality(request: RunRequest, suite: Suite[SuiteUnit, Payload], n_units: int) -> Equality:
    """Ask `n_units` units of each task with and without the request's switches; nothing is written.

    The model is loaded twice, one after the other; if replies differ and there are several
    switches, once more with each.

    Raises:
        UsageError: the request turns no switch on.
        InfthorError: as `execute`.
    """
    switched = require_switches(request, n_units)
    limit = request.tasks.limit
    few = n_units if limit is None else min(n_units, limit)
    request = replace(request, tasks=replace(request.tasks, limit=few))
    encoder = RecordEncoder(suite.records)
    with closing(_bind(request, suite, switched)) as bound:
        ours = _replies(bound, encoder)
    with closing(_bind(request, suite, {})) as bound:
        plain = _replies(bound, encoder)
        n_differing = _n_differing(ours, plain)
        if not n_differing:
            return Equality(switched, len(plain), 0)
        n_unstable = _n_differing(_replies(bound, encoder, backwards=True), plain)
    alone = {}
    for option, value in switched.items() if len(switched) > 1 else ():
        with closing(_bind(request, suite, {option: value})) as bound:
            alone[option] = _n_differing(_replies(bound, encoder), plain)
    return Equality(switched, len(plain), n_differing, n_unstable, alone)


def _bind(
    request: RunRequest, suite: Suite[SuiteUnit, Payload], switched: Mapping[str, str]
) -> BoundRun[SuiteUnit, Payload]:
    """Load the model with these of its switches alone."""
    known = switches(request.model)
    others = {name: value for name, value in request.model_options.items() if name not in known}
    return bind_run(prepare(replace(request, model_options={**others, **switched}), suite))


def _replies(
    bound: BoundRun[SuiteUnit, Payload], encoder: RecordEncoder[Payload], *, backwards: bool = False
) -> _Replies:
    """Return the replies by unit; a failure in its place, as it has to be the same."""
    session = UnrecordedSession()
    evaluation = bound.evaluation
    step = -1 if backwards else 1
    replies = {}
    for group in evaluation.workload.groups[::step]:
        ordered = replace(group, units=group.units[::step])
        for record in group_records(evaluation, ordered, session, encoder):
            reply = bound.prepared.evaluation.to_doc(bound.header, record).reply
            failure = record.failure
            replies[record.key] = reply if failure is None else f"failed: {failure}"
    return replies


def _n_differing(some: _Replies, others: _Replies) -> int:
    return sum(reply != others.get(key) for key, reply in some.items())
