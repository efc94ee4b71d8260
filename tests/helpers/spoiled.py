"""Records of every suite, each field of which is replaced by the worst values there are."""

import copy
import datetime
import decimal
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import msgspec
import numpy as np

from infthor_eval.manipulation.records import ArmRecord, ArmStep
from infthor_eval.nieh.records import BlindGuess, NiehAnswer, NiehRecall, ShownClues, TwinSide
from infthor_eval.plans.records import PlanRecord, StepRecord, TwinRecord
from infthor_eval.runs import RunHeader, Tokens, UnitRecord, Usage

from .arm_runs import make_arm_run, make_episode_record
from .nieh_runs import make_config, make_header, make_record
from .plan_runs import make_plan_record, make_plans_run

__all__ = ["SUITES", "WORST", "fields_of", "replace_field"]


def _nested(depth: int) -> list[Any]:
    nested: list[Any] = []
    for _ in range(depth):
        nested = [nested]
    return nested


# What code of others has returned, or might.
WORST: tuple[Any, ...] = (
    float("nan"),
    float("inf"),
    float("-inf"),
    -1,
    -1.5,
    -0.0,
    0,
    1e-320,
    1.7e308,
    2**53,
    2**53 + 1,
    2**63,
    2**64,
    -(2**63) - 1,
    10**400,
    True,
    False,
    None,
    "",
    "3",
    "NaN",
    "=1+1",
    "\ud800",
    "a\udcff",
    "\x00\x1b[31m\r\n\u2028\u202e",
    "é" * 100_000,
    b"bytes",
    bytearray(b"\xff"),
    (),
    [],
    [None],
    [float("nan")],
    {},
    {"a": 1},
    {1: 2},
    {"\ud800": 1.0},
    {"a": float("inf")},
    {"strict": 1.7e308, "reference": -1.7e308},
    {"strict": True},
    {1, 2},
    frozenset(),
    object(),
    int,
    len,
    1j,
    decimal.Decimal("NaN"),
    decimal.Decimal("1.5"),
    Fraction(1, 3),
    np.float64("nan"),
    np.float64(0.5),
    np.int64(3),
    np.array([1.0]),
    datetime.datetime(2020, 1, 1),
    (value for value in (1, 2)),
    ValueError("x"),
    _nested(200),
    _nested(5000),
    Tokens(reply=-1),
    Usage(cost=float("nan")),
)


def fields_of(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The paths of all fields in a struct: its own, those of structs in it, and items of tuples."""
    if isinstance(value, msgspec.Struct):
        items = [(name, getattr(value, name)) for name in value.__struct_fields__]
    elif isinstance(value, tuple):
        items = list(enumerate(value))
    elif isinstance(value, dict):
        items = list(value.items())
    else:
        return
    for name, item in items:
        yield (*path, name)
        yield from fields_of(item, (*path, name))


def replace_field(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    """The same struct with another value at a path."""
    if not path:
        return new
    name, *rest = path
    if isinstance(value, msgspec.Struct):
        changed = copy.copy(value)
        field = replace_field(getattr(value, name), tuple(rest), new)
        msgspec.structs.force_setattr(changed, name, field)  # as if its own check were not there
        return changed
    if isinstance(value, dict):
        return value | {name: replace_field(value[name], tuple(rest), new)}
    items = list(value)
    items[name] = replace_field(items[name], tuple(rest), new)
    return tuple(items)


_ENVELOPE = {
    "variant": "depth=0.4",
    "faults": ("a retry",),
    "seconds": 1.5,
    "tokens": Tokens(10, 5, 2),
    "usage": Usage(1, 10, 5, 2, 0.01),
}


def _nieh() -> tuple[RunHeader, UnitRecord[NiehAnswer]]:
    twin = TwinSide(
        pair="p/1",
        fact="mug",
        kind="swap",
        traj_id="t0-one",
        answers=("sofa",),
        n_frames=3,
        n_differing=1,
        n_after_clues=1,
        age=2,
        span=2,
        length=9,
    )
    record = make_record(
        0,
        "the mug",
        blind=BlindGuess(form="f", scores={"strict": 0.5}, form_scores={"strict": 0.25}),
        shown_clues=ShownClues(n_shown=1, n_clues=1, n_after=3),
        twin=twin,
        recall=NiehRecall(recalled=(0, "a text"), build_s=0.5, recall_s=0.1),
        **_ENVELOPE,
    )
    payload = msgspec.structs.replace(record.payload, thinking="hm", n_watched=2)
    record = msgspec.structs.replace(record, payload=payload)
    return make_header(make_config(model="m")), record


def _plans() -> tuple[RunHeader, UnitRecord[PlanRecord]]:
    record = make_plan_record("t0", 0, (0, 3), 1.0, most=2.0)
    payload = msgspec.structs.replace(
        record.payload,
        is_final=True,
        expert_reward=2.0,
        steps=(
            StepRecord(
                reply="MoveAhead",
                action="MoveAhead",
                call={"action": "MoveAhead", "degrees": 90.0, "forceAction": True},
                message="blocked",
                reward=0.5,
                n_context_tokens=10,
            ),
        ),
        conditions=(1, 2),
        clue_distance=3,
        clue_tokens=30,
        twin=TwinRecord(pair="p", base="b", finds=True, n_opened=1),
    )
    record = msgspec.structs.replace(record, payload=payload, **_ENVELOPE)
    return make_plans_run("m", [record]).header, record


def _arm() -> tuple[RunHeader, UnitRecord[ArmRecord]]:
    record = make_episode_record("t0", 0)
    payload = msgspec.structs.replace(
        record.payload,
        receptacle_id="Sink|1",
        steps=(
            ArmStep(
                delta=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
                calls=({"action": "MoveArm", "position": {"x": 0.5}},),
                hand=(1.0, 2.0, 3.0),
                distance=0.5,
                refusals=("Collided with a wall",),
            ),
        ),
    )
    record = msgspec.structs.replace(record, payload=payload, **_ENVELOPE)
    return make_arm_run("m", [record]).header, record


# Header and whole record of each suite, by its name.
SUITES = {"nieh": _nieh, "plans": _plans, "manipulation": _arm}
