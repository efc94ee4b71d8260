"""Sparse attention, as the options of a model name it."""

import re
from dataclasses import dataclass

_NUMBER = r"[1-9]\d{0,8}"
_WINDOW = re.compile(rf"(?:sinks:({_NUMBER})\+)?window:({_NUMBER})")
_SHARE = re.compile(r"vertical-slash:(0?\.\d+|1|1\.0)")
_BLOCKS = re.compile(rf"block-sparse:({_NUMBER})")
POSITIONS = ("ceiling", "cache", "absolute")
UNITS = ("tokens", "frames")


@dataclass(frozen=True)
class Window:
    """Each token sees the first tokens and the last ones (LM-Infinite, StreamingLLM).

    Attributes:
        sinks: how many of the first.
        window: how many of the last, itself among them.
    """

    sinks: int
    window: int


@dataclass(frozen=True)
class VerticalSlash:
    """Per head, the columns and diagonals that the last queries of a chunk need (MInference).

    Attributes:
        share: how many of all columns, and as many diagonals, from 0 to 1.
    """

    share: float


@dataclass(frozen=True)
class BlockSparse:
    """Per head and block of queries, the blocks of keys with the largest pooled scores.

    Attributes:
        n_blocks: how many blocks.
    """

    n_blocks: int


AttentionShape = Window | VerticalSlash | BlockSparse


def parse_attention(text: str) -> AttentionShape:
    """Return the shape that a text names.

    Raises:
        ValueError: it names none.
    """
    if match := _WINDOW.fullmatch(text):
        return Window(int(match[1] or 0), int(match[2]))
    if match := _SHARE.fullmatch(text):
        if float(match[1]) > 0:
            return VerticalSlash(float(match[1]))
    elif match := _BLOCKS.fullmatch(text):
        return BlockSparse(int(match[1]))
    raise ValueError(
        f"attention={text:.60} is none of sinks:N+window:N, window:N, vertical-slash:SHARE and "
        "block-sparse:N, with N a whole number from 1 and SHARE above 0, at most 1"
    )
