"""The text of replies: what is thought told from what is answered, what marks stand around the
answer, and cut at stop strings.

Models that think write it before the answer, between markers of their family. The markers below are
those of the families' chat templates and of vLLM's reasoning parsers. Some templates write the
first marker themselves, so that a reply has the second alone. A server that tells thoughts apart
sends them in a field of their own (`Reply.thinking`).

Around the answer there may be marks, which are taken off wherever the thoughts are: `<answer>`,
`<response>`, GLM's box, `\\boxed{}`. The last marks with anything between them count, whatever
stands before and behind them. Marks that are opened alone are those of a reply that was cut off,
unless a sentence names them ("I use <answer> tags").

To add markers of a family that thinks: a line in `MARKERS`.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

from model_adapters.protocols import Reply

# Before and behind what a model thinks, by the families that write them.
MARKERS = {
    "Qwen3-VL, QwQ, QVQ, DeepSeek-R1, GLM-4.1V, InternVL3.5, MiMo-VL": ("<think>", "</think>"),
    "LLaMA-based reasoners, R1-VL": ("<thinking>", "</thinking>"),
    "Magistral, Pixtral": ("[THINK]", "[/THINK]"),
    "Kimi-VL": ("◁think▷", "◁/think▷"),
    "Seed-OSS": ("<seed:think>", "</seed:think>"),
    "MiniMax": ("<mm:think>", "</mm:think>"),
    "Command A": ("<|START_THINKING|>", "<|END_THINKING|>"),
    "Gemma": ("<|channel>", "<channel|>"),
    "Granite": ("Here is my thought process:", "Here is my response:"),
}
_IN_WORDS = {"Here is my response:"}  # which may be a part of any answer
# Around the answer: GLM-V, Hunyuan, Granite, models trained like R1 or on mathematics.
_TAG = r"<(?:answer|response)\s*>"
_BOX = r"<\|begin_of_box\|>"
_BOXED = r"\\boxed\s*\{"
_IN_BRACES = r"(?:[^{}]++|\{(?:[^{}]++|\{(?:[^{}]++|\{[^{}]*+\})*+\})*+\})*+"
_MARKED = re.compile(
    rf"<(answer|response)\s*>(?P<tag>(?:(?!{_TAG}).)*?)</\1\s*>"
    rf"|{_BOX}(?P<box>(?:(?!{_BOX}).)*?)<\|end_of_box\|>"
    rf"|{_BOXED}(?P<boxed>{_IN_BRACES})\}}",
    re.DOTALL | re.IGNORECASE,
)
# Where a line or a sentence begins with it, or the answer follows at once; the box has no name
# that a sentence would use.
_OPENED = re.compile(
    rf"(?:(?:^|[.:!?])[^\S\n]*(?:{_TAG}|{_BOXED})|{_TAG}(?=[\w\n])|{_BOXED}(?=\w)|{_BOX})",
    re.MULTILINE | re.IGNORECASE,
)
_CLOSED = re.compile(r"(?:</(?:answer|response)\s*>|<\|end_of_box\|>)\Z", re.IGNORECASE)
_CUT_OFF = re.compile(r"<[/|][\w|]*\s*>?\Z")  # closing marks, or the beginning of some
_LATEX_TEXT = re.compile(r"\\(?:text|mathrm|mathbf)(?:bf|it|rm)?\s*\{([^{}]*)\}")


class Thought(NamedTuple):
    """A reply in two parts.

    Attributes:
        thinking: what the model thought, without markers; None if it wrote no thoughts.
        answer: what it answered; empty if it was cut off while it thought.
    """

    thinking: str | None
    answer: str


def split_thinking(text: str) -> Thought:
    """Return thoughts and answer of a text; one without markers and marks is the answer as it
    is."""
    for before, behind in MARKERS.values():
        opened = text.lstrip().startswith(before)
        thinking, closed, answer = text.rpartition(behind)
        if closed and (opened or behind not in _IN_WORDS):
            return Thought(_without(thinking, before), _unwrapped(answer.strip()))
        if opened:
            return Thought(_without(text, before), "")
    return Thought(None, _unwrapped(text))


def answer_of(reply: Reply) -> Thought:
    """Return thoughts and answer of a reply."""
    if reply.thinking is not None:
        return Thought(reply.thinking, _unwrapped(reply.text))
    return split_thinking(reply.text)


def opening_marker(prompt: str) -> str:
    """Return the marker that a prompt ends with, so that the reply begins in thought; empty if
    there is none."""
    return next((before for before, _ in MARKERS.values() if prompt.rstrip().endswith(before)), "")


def _without(thinking: str, before: str) -> str:
    return thinking.lstrip().removeprefix(before).strip()


def _unwrapped(answer: str) -> str:
    """Return what stands between the marks of an answer, if there are any."""
    bare = answer.strip()
    marked = list(_MARKED.finditer(bare))
    full = [match for match in marked if (match[match.lastgroup or 0] or "").strip()]
    if full:
        inner = full[-1][full[-1].lastgroup or 0].strip()
        return _unwrapped(_LATEX_TEXT.sub(r"\1", inner) if full[-1]["boxed"] else inner)
    if marked and bare == marked[-1][0]:
        return ""
    *_, opened = [None, *_OPENED.finditer(bare)]
    if opened is not None:
        return _CUT_OFF.sub("", bare[opened.end() :]).strip()
    closed = _CLOSED.search(bare)
    return answer if closed is None else bare[: closed.start()].strip()


def cut_at_stop(text: str, stop: Sequence[str]) -> str | None:
    """Return the text before its first stop string, or None if it holds none."""
    positions = [text.index(string) for string in stop if string in text]
    return text[: min(positions)] if positions else None
