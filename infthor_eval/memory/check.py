"""Contract checks for anybody's memory, through the protocol alone; a violation is one line.

To add or change a rule of memories' contract: a check here, and in `docs/memories.md`.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PIL import Image

from infthor_eval.errors import UserCodeError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.memory.protocol import (
    Memory,
    MemoryCapabilities,
    Observation,
    Query,
    TrajectoryFacts,
    tokens_of,
)
from infthor_eval.storage.deadlines import limit_time
from infthor_eval.storage.limits import MEMORY_SECONDS
from infthor_eval.storage.scratch import ScratchFolder
from model_adapters.check.clauses import check_identity_values, require
from model_adapters.check.results import MEMBERS, CheckResult, run_each

_STEPS = 24
_TOKENS_PER_FRAME = 121  # of Qwen2.5-VL at 300x300
_BUDGETS = (0, 60, 121, 500, 3000)
_QUESTIONS = ("Where is the mug now?", "How many times did you move the plate?")
_CLUES = (3, 9)


def check_memory(memory: Memory) -> Iterator[CheckResult]:
    """Yield each check's result: a memory observes two short trajectories, and is asked on them.

    A model that it may ask answers with the number of frames it was given.
    """
    with ScratchFolder() as folder:
        checks: dict[str, Callable[[], None]] = {
            MEMBERS: partial(_check_members, memory),
            "identity": lambda: check_identity_values(memory.identity),
            "recalls": partial(_check_recalls, memory, folder),
            "empty": partial(_check_empty, memory, folder),
            "budget": partial(_check_budget, memory, folder),
            "repeats": partial(_check_repeats, memory, folder),
            "forgets": partial(_check_forgets, memory, folder),
        }
        yield from run_each({name: partial(_in_time, check) for name, check in checks.items()})


def _in_time(check: Callable[[], None]) -> None:
    seconds = MEMORY_SECONDS.value
    late = f"it is not done after {seconds} s; {MEMORY_SECONDS.hint}"
    with limit_time(seconds, UserCodeError(late)):
        check()


def _check_members(memory: Any) -> None:
    for name in ("capabilities", "identity", "begin", "observe", "recall"):
        require(hasattr(memory, name), f"it has no {name}")
    require(
        isinstance(memory.capabilities, MemoryCapabilities), "capabilities is no MemoryCapabilities"
    )


def _check_recalls(memory: Memory, folder: Path) -> None:
    steps = _observe(memory, "first", folder)
    for piece in memory.recall(_query(memory, steps), None):
        _require_recallable(piece, steps[:-1])


def _check_empty(memory: Memory, folder: Path) -> None:
    """A question can come at the first step, before anything was observed."""
    steps = _steps(memory, "empty", folder, 1)
    memory.begin(_facts(memory, "empty"))
    for piece in memory.recall(_query(memory, steps), 500):
        _require_recallable(piece, [])


def _check_budget(memory: Memory, folder: Path) -> None:
    steps = _observe(memory, "first", folder)
    for budget in _BUDGETS:
        n_tokens = tokens_of(memory.recall(_query(memory, steps), budget), _TOKENS_PER_FRAME)
        require(n_tokens <= budget, f"it recalls {n_tokens} tokens where the budget is {budget}")


def _check_repeats(memory: Memory, folder: Path) -> None:
    """Recalling changes nothing, so that the order of questions does not matter."""
    if not memory.capabilities.deterministic:
        return
    question, other_question = _QUESTIONS
    steps = _observe(memory, "first", folder)
    first = list(memory.recall(_query(memory, steps, question), None))
    other = list(memory.recall(_query(memory, steps, other_question), None))
    again = list(memory.recall(_query(memory, steps, question), None))
    require(first == again, "the same question recalls another thing after one more question")
    steps = _observe(memory, "first", folder)
    require(
        list(memory.recall(_query(memory, steps), None)) == first,
        "the same trajectory recalls another thing",
    )
    require(
        list(memory.recall(_query(memory, steps, other_question), None)) == other,
        "the order of questions matters",
    )


def _check_forgets(memory: Memory, folder: Path) -> None:
    before = _observe(memory, "first", folder)
    steps = _observe(memory, "second", folder, n_steps=5)
    known = [step.frame for step in before]
    for piece in memory.recall(_query(memory, steps), None):
        _require_recallable(piece, steps[:-1])
        require(
            isinstance(piece, str) or piece.frame not in known,
            "it recalls a frame of the trajectory before",
        )


def _require_recallable(piece: Any, past: Sequence[Observation]) -> None:
    if isinstance(piece, str):
        require(bool(piece.strip()), "it recalls an empty text")
        return
    require(
        isinstance(piece, Observation),
        f"it recalls {piece!r:.60}, neither a text nor an observation",
    )
    require(
        piece in past, "it recalls a step that it has not observed; the current one is shown anyway"
    )


def _observe(memory: Memory, name: str, folder: Path, n_steps: int = _STEPS) -> list[Observation]:
    """Let a memory observe all steps of a trajectory but the last; return all."""
    steps = _steps(memory, name, folder, n_steps)
    memory.begin(_facts(memory, name))
    for step in steps[:-1]:
        memory.observe(step)
    return steps


def _facts(memory: Memory, name: str) -> TrajectoryFacts:
    def write(parts: Sequence[str | FrameRef], max_new_tokens: int) -> str:
        return f"{sum(isinstance(part, FrameRef) for part in parts)} frames"[:max_new_tokens]

    return TrajectoryFacts(
        name=name,
        tokens_per_frame=_TOKENS_PER_FRAME,
        seed=0,
        write=write if memory.capabilities.writes else None,
    )


def _steps(memory: Memory, name: str, folder: Path, n_steps: int) -> list[Observation]:
    return [
        Observation(
            number=number,
            frame=_frame(folder / f"{name}-{number}.png", number),
            action="MoveAhead" if number else None,
            goal="Put a mug in the sink",
            log=_log(number) if memory.capabilities.privileged else None,
        )
        for number in range(n_steps)
    ]


def _log(number: int) -> ObjectLog:
    return ObjectLog(visible=["Mug"] if number in _CLUES else ["Sink"])


def _frame(path: Path, number: int) -> FrameRef:
    if not path.is_file():
        Image.new("RGB", (300, 300), (10 * number % 256, 90, 160)).save(path)
    return FrameRef(path)


def _query(memory: Memory, steps: Sequence[Observation], text: str = _QUESTIONS[0]) -> Query:
    clues = tuple(number for number in _CLUES if number < len(steps) - 1)
    return Query(
        text=text, present=steps[-1], clues=clues if memory.capabilities.privileged else None
    )
