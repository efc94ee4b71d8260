"""The text of replies: what is thought told from what is answered, and cut at stop strings.

Models that think write it before the answer, between markers of their family. The markers below are
those of the families' chat templates and of vLLM's reasoning parsers. Some templates write the
first marker themselves, so that a reply has the second alone. A server that tells thoughts apart
sends them in a field of their own (`Reply.thinking`).

To add markers of a family that thinks: a line in `MARKERS`.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

from model_adapters.protocols import Reply

__all__ = ["MARKERS", "Thought", "answer_of", "cut_at_stop", "opening_marker", "split_thinking"]

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
# Around the answer behind the thoughts (GLM-4.1V, Hunyuan, models trained like R1).
_WRAPPERS = (
    ("<answer>", "</answer>"),
    ("<response>", "</response>"),
    ("<|begin_of_box|>", "<|end_of_box|>"),
)


class Thought(NamedTuple):
    """A reply in two parts.

    Attributes:
        thinking: what the model thought, without markers; None if it wrote no thoughts.
        answer: what it answered; empty if it was cut off while it thought.
    """

    thinking: str | None
    answer: str


def split_thinking(text: str) -> Thought:
    """Return thoughts and answer of a text; one without markers is the answer as it is."""
    for before, behind in MARKERS.values():
        opened = text.lstrip().startswith(before)
        thinking, closed, answer = text.rpartition(behind)
        if closed and (opened or behind not in _IN_WORDS):
            return Thought(_without(thinking, before), _unwrapped(answer.strip()))
        if opened:
            return Thought(_without(text, before), "")
    return Thought(None, text)


def answer_of(reply: Reply) -> Thought:
    """Return thoughts and answer of a reply."""
    if reply.thinking is not None:
        return Thought(reply.thinking, reply.text)
    return split_thinking(reply.text)


def opening_marker(prompt: str) -> str:
    """Return the marker that a prompt ends with, so that the reply begins in thought; empty if
    there is none."""
    return next((before for before, _ in MARKERS.values() if prompt.rstrip().endswith(before)), "")


def _without(thinking: str, before: str) -> str:
    return thinking.lstrip().removeprefix(before).strip()


def _unwrapped(answer: str) -> str:
    """Return what stands between the markers of an answer, if there are any."""
    for before, behind in _WRAPPERS:
        match = re.search(
            f"{re.escape(before)}(.*?)(?:{re.escape(behind)}|$)", answer, flags=re.DOTALL
        )
        if match is not None:
            return match[1].strip()
    return answer


def cut_at_stop(text: str, stop: Sequence[str]) -> str | None:
    """Return the text before its first stop string, or None if it holds none."""
    positions = [text.index(string) for string in stop if string in text]
    return text[: min(positions)] if positions else None
