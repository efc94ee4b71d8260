"""The fenced blocks of a page."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
_FENCE = re.compile(r'^```(\w*)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block: its language (empty for commands and what they print), the file that it is,
    its text."""

    language: str
    title: str
    text: str


def blocks_of(page: str) -> list[Block]:
    """All blocks of a page of the repository."""
    return [Block(*match) for match in _FENCE.findall((ROOT / page).read_text())]


def written_files(page: str, folder: Path) -> list[Path]:
    """Write the blocks of a page that have a file's name below a folder."""
    files = []
    for block in blocks_of(page):
        if block.title:
            files.append(folder / block.title)
            files[-1].parent.mkdir(parents=True, exist_ok=True)
            files[-1].write_text(block.text)
    return files
