"""A reader of logs that makes no mistake: what `text-log` tells a model that reads all of it.

infthor-eval --model benchmarks/log_reader.py:answer --tasks nieh_mini_twins --context memory \\
    --memory text-log --frames none

It reads the log's lines back into facts of frames, and answers with the independent solver that
checks questions. It knows neither the set nor the answer key, so what a model misses on the same
text it has not read. Where the log does not tell, it says "not sure".
"""

import re
from collections.abc import Iterator

from infthor_eval.formats.step_log import ObjectState
from infthor_eval.generation.questions.facts import FrameFacts
from infthor_eval.generation.questions.solvers import answer as solve
from infthor_eval.household.affordances import STOWABLE

_LINE = re.compile(r"Step (\d+): (.*)\.")
_SEES = re.compile(r"(sees|holds) (.*)")
_GONE = re.compile(r"(\w+ \d+) is gone")
_ACTION = re.compile(r"(\w+) (\w+ \d+)(?: \w+ \d+)?")
_OBJECT = re.compile(r"(\w+) (\d+)(?: at (\w+ \d+))?(?: \(([\w, ]+)\))?")
_BETWEEN = re.compile(r", (?![^(]*\))")  # objects, not their states
_ASKED = re.compile(r"Question: (.*\?)")
_UNKNOWN = "not sure"


def answer(parts: list[object]) -> str:
    """Return the answer to the last question of a conversation, by the log in it."""
    text = "".join(part for part in parts if isinstance(part, str))
    facts = list(_facts(text))
    found = solve(_ASKED.findall(text)[-1], facts)
    return ", ".join(found) if found else _UNKNOWN


def _facts(text: str) -> Iterator[FrameFacts]:
    """Yield what is known at each line of a log."""
    known: dict[str, ObjectState] = {}
    for number, line in _LINE.findall(text):
        logged = None
        seen: dict[str, ObjectState] = {}
        for sentence in line.split("; "):
            if match := _SEES.fullmatch(sentence):
                held = match[1] == "holds"
                seen |= dict(_read_object(text, held) for text in _BETWEEN.split(match[2]))
            elif match := _GONE.fullmatch(sentence):
                known.pop(_id_of(match[1]), None)
            elif match := _ACTION.fullmatch(sentence):
                logged = match[1], _id_of(match[2])
        known |= seen
        yield FrameFacts(int(number), logged, dict(known), frozenset(seen), True, STOWABLE)


def _read_object(text: str, held: bool) -> tuple[str, ObjectState]:
    """Return the id and the state of "Mug 2 at CounterTop 1 (dirty)"."""
    match = _OBJECT.fullmatch(text)
    assert match is not None, text
    kind, number, place, states = match.groups()
    flags = set((states or "").split(", "))
    is_open = "open" in flags
    is_on = "on" in flags
    return _id_of(f"{kind} {number}"), ObjectState(
        type=kind,
        parents=(_id_of(place),) if place else (),
        held=held,
        is_open=is_open if flags & {"open", "closed"} else None,
        is_on=is_on if flags & {"on", "off"} else None,
    )


def _id_of(name: str) -> str:
    """Return an id as the simulator has it, whose type can be read: "Mug|2"."""
    kind, number = name.split(" ")
    return f"{kind}|{number}"
