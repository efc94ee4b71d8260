"""A sample in words, as its suite's presenter gives them."""

from typing import NamedTuple

import msgspec

THOUGHT = "thought"  # name of the detail of a record that a model thought before its reply


class Description(NamedTuple):
    """A sample in words.

    Attributes:
        title: the question or the instruction.
        target: the gold answers or the goal.
        kind: type of the question or the episode, for the page's filter; empty for none.
        clues: number of clues in words, for the page's filter; empty for none.
    """

    title: str
    target: str = ""
    kind: str = ""
    clues: str = ""


class StepRow(msgspec.Struct, frozen=True, omit_defaults=True):
    """A step of an episode.

    Attributes:
        action: the action in words; empty if the reply held none that could be tried.
        reply: the model's reply, if it is not the action.
        error: what was wrong with the action.
        reward: reward of the step; None if steps have none.
        note: further numbers, in words.
    """

    action: str = ""
    reply: str = ""
    error: str = ""
    reward: float | None = None
    note: str = ""
