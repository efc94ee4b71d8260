"""What models say: answers, thoughts, actions; and options as they are typed."""

from functools import cache, partial
from pathlib import Path

from infthor_eval.formats.object_ids import Words
from infthor_eval.memory.registry import open_memory, parse_options
from infthor_eval.nieh.rescoring.judge_prompts import JUDGE_PROMPTS
from infthor_eval.nieh.scoring import scores
from infthor_eval.plans.published.script import current_call
from infthor_eval.thor.actions import UngroundedError, ground, parse_action
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView
from model_adapters.thinking import split_thinking

from ..damage import Form
from ..reader import Reader

__all__ = ["READERS"]

_FILE = "said.txt"
_ANSWERS = (("yes",), ("SideTable", "Shelf"), (3,), (0.5, "no"))


def _make(text: str, folder: Path) -> Path:
    (folder / _FILE).write_text(text)
    return folder / _FILE


def _said(folder: Path) -> str:
    return (folder / _FILE).read_bytes().decode(errors="replace")


def _score(folder: Path) -> None:
    split_reply = split_thinking(_said(folder))
    for answers in _ANSWERS:
        for value in scores(split_reply.answer, answers).values():
            assert 0 <= value <= 2


@cache
def _view() -> SimulatorView:
    with Simulator(embedded_launch(), width=64, height=64) as simulator:
        return simulator.reset("kitchen-1")


def _act(folder: Path) -> None:
    text = _said(folder)
    for words in Words:
        try:
            ground(parse_action(text), _view(), words=words)
        except UngroundedError as error:
            assert error.misuse
    try:
        current_call(text, _view())
    except UngroundedError as error:
        assert error.misuse


def _judge(name: str, folder: Path) -> None:
    score = JUDGE_PROMPTS[name].read(_said(folder))
    assert score is None or 0 <= score <= 1


def _remember(folder: Path) -> None:
    for name in ("notes",):
        open_memory(name, tuple((parse_options(_said(folder)) or {}).items()))


READERS = (
    Reader(
        "answer",
        Form.TEXT,
        partial(_make, "<think>\nso\n</think>\nThe answer is: 2 SideTables, yes.\n"),
        _score,
    ),
    *(
        Reader(
            f"verdict of a judge, {name}",
            Form.TEXT,
            partial(_make, text),
            partial(_judge, name),
        )
        for name, text in (("yes-no", "Yes, both say so.\n"), ("published", "Score: 0.5\n"))
    ),
    Reader("action", Form.TEXT, partial(_make, "PutObject Apple Fridge"), _act),
    Reader("options of a memory", Form.TEXT, partial(_make, "window=20,tokens=64"), _remember),
)
