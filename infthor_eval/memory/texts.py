"""Memories that recall texts: an exact observer's log, and the model's own notes."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import ClassVar

from infthor_eval.formats.step_log import ObjectLog, ObjectState, Step
from infthor_eval.memory.protocol import (
    CHARACTERS_PER_TOKEN,
    MemoryCapabilities,
    Observation,
    Query,
    Recalled,
)
from infthor_eval.memory.steps import StepMemory


class TextLog(StepMemory):
    """An exact observer's log: each goal and action, and objects seen, from the metadata.

    A line says what is new: each object that is seen first, or seen changed, with what it is in or
    on and its state. Published logs have types alone: those that come into view, what is open, in
    the hand, and in or on what is seen. Of a log beyond the budget the last lines are recalled.
    """

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(privileged=True)

    def recall(self, query: Query, budget: int | None) -> Recalled:
        """See `Memory`; one text."""
        lines = list(_lines([*self.past, query.present]))
        kept = _last_that_fit(lines, budget)
        return ["".join(kept)] if kept else []


class Notes(StepMemory):
    """The model's own notes: on every window of frames it writes a short text.

    A note depends on the frames of its window alone. The paper reports a memory in text
    (long-horizon tasks), but not how the text is written. Of notes beyond the budget the last are
    recalled.
    """

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(writes=True)

    def __init__(self, window: int = 20, tokens: int = 64) -> None:
        """Set the number of frames of a note and the limit of a note in tokens."""
        super().__init__()
        if window < 1 or tokens < 1:
            raise ValueError("window and tokens are whole numbers from 1")
        self._window = window
        self._tokens = tokens

    def recall(self, query: Query, budget: int | None) -> Recalled:
        """See `Memory`; one text, a line for each window."""
        steps = [*self.past, query.present]
        lines = [
            self._line(steps[at : at + self._window]) for at in range(0, len(steps), self._window)
        ]
        kept = _last_that_fit(lines, budget)
        return ["".join(kept)] if kept else []

    def _line(self, window: Sequence[Observation]) -> str:
        if self.facts.write is None:
            raise ValueError("notes need a model that writes them")
        steps = _steps(window[0].number, window[-1].number)
        note = self.facts.write(
            [*(observation.frame for observation in window), note_request(steps)], self._tokens
        )
        return f"{steps}: {' '.join(note.split())}\n"


def note_request(steps: str) -> str:
    """Return the text behind a window's frames ("Steps 0-19"), which asks for a note on them."""
    return (
        f"\n{steps} of an embodied agent's trajectory, one view per step in time order. You will "
        "be asked about them later without seeing them. Note in a few short phrases which room it "
        "is, which objects are where, how many of them and in which state, and what the agent does "
        "with them.\nNote: "
    )


def _steps(first: int, last: int) -> str:
    return f"Step {last}" if last == first else f"Steps {first}-{last}"


def _last_that_fit(lines: Sequence[str], budget: int | None) -> Sequence[str]:
    """Return as many of the last lines as a budget in tokens holds."""
    if budget is None:
        return lines
    room = budget * CHARACTERS_PER_TOKEN
    for number, line in enumerate(reversed(lines)):
        room -= len(line)
        if room < 0:
            return lines[len(lines) - number :]
    return lines


def _lines(steps: Sequence[Observation]) -> Iterator[str]:
    """Yield a line for each step that tells anything new."""
    goal = None
    before = ObjectLog()
    observer = _Observer()
    for step in steps:
        sentences = [f"goal: {step.goal}"] if step.goal != goal and step.goal else []
        if step.step is not None and step.step.seen is not None:
            sentences += observer.news(step.step)
        else:
            log = step.log or ObjectLog()
            sentences += [*([step.action] if step.action else []), *_news(before, log)]
            before = log
        if sentences:
            yield f"Step {step.number}: {'; '.join(sentences)}.\n"
        goal = step.goal


class _Observer:
    """Tells objects apart, and knows what it has told of each: "Mug 2 at CounterTop 1"."""

    def __init__(self) -> None:
        self._states: dict[str, ObjectState] = {}
        self._names: dict[str, str] = {}
        self._n_named: Counter[str] = Counter()
        self._told: dict[str, str] = {}

    def news(self, step: Step) -> list[str]:
        """Return the action with its objects, and each object that is seen first, or seen changed,
        or that is no more."""
        self._states |= step.changes
        news = [self._action(step)] if step.action else []
        gone = [key for key in self._told if not self._states[key].exists]
        news += [f"{self._name(key)} is gone" for key in gone]
        for key in gone:
            del self._told[key]
        seen = {key: self._describe(key) for key in step.seen or () if key in self._states}
        new = {key: text for key, text in seen.items() if text != self._told.get(key)}
        self._told |= new
        for verb, held in (("sees", False), ("holds", True)):
            objects = [text for key, text in new.items() if self._states[key].held == held]
            news += [f"{verb} {', '.join(objects)}"] if objects else []
        return news

    def _action(self, step: Step) -> str:
        objects = [key for key in (step.target, step.receptacle) if key in self._states]
        verb, *words = (step.action or "").split()
        named = " ".join([verb, *(map(self._name, objects) if objects else words)])
        return named if step.success else f"{named} (refused)"

    def _describe(self, key: str) -> str:
        state = self._states[key]
        place = f" at {self._name(state.parents[0])}" if state.parents else ""
        flags = {
            "open": state.is_open,
            "closed": state.is_open is False,
            "on": state.is_on,
            "off": state.is_on is False,
            "sliced": state.is_sliced,
            "dirty": state.is_dirty,
            "cooked": state.is_cooked,
            state.temperature.lower(): state.temperature != "RoomTemp",
        }
        told = ", ".join(flag for flag, holds in flags.items() if holds)
        return f"{self._name(key)}{place}{f' ({told})' if told else ''}"

    def _name(self, key: str) -> str:
        if key not in self._names:
            kind = self._states[key].type if key in self._states else key.split("|", maxsplit=1)[0]
            self._n_named[kind] += 1
            self._names[key] = f"{kind} {self._n_named[kind]}"
        return self._names[key]


def _news(before: ObjectLog, now: ObjectLog) -> list[str]:
    news = []
    seen = sorted(set(now.visible) - set(before.visible))
    if seen:
        news.append(f"sees {', '.join(seen)}")
    for receptacle, objects in sorted(now.recep_objs.items()):
        if objects and objects != before.recep_objs.get(receptacle):
            news.append(f"{receptacle} has {', '.join(objects)}")
    opened = sorted(set(now.is_open) - set(before.is_open))
    if opened:
        news.append(f"open: {', '.join(opened)}")
    if now.inven_obj != before.inven_obj:
        news.append(f"holds {', '.join(now.inven_obj) or 'nothing'}")
    return news
