"""Trial of `hf-vlm` on the families of vision-language models: does it load, share, reply equally?

A tiny checkpoint with random weights is made of each, and asked the same questions on the same
frames through `hf-vlm`: one after the other on a shared prefix, together, and without sharing.
Replies are compared with those of transformers' own processor and `generate`, greedily.

    python benchmarks/families.py --out table.md
    python benchmarks/families.py --families qwen3_vl,gemma3
    python benchmarks/families.py --torchvision         # as if torchvision were installed

Many of transformers' own processors need torchvision, which has no build beside torch for CPUs.
They run in a process of their own with the Python half of it that `make test` sets aside; without
it, or where they fail, replies are compared with those without sharing.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from tiny_families.checkpoint import save
from tiny_families.crops import CROPS
from tiny_families.grids import GRIDS
from tiny_families.squares import SQUARES
from tiny_families.tiles import TILES
from tiny_families.trial import (
    PEERS,
    WAYS,
    Reference,
    Replies,
    Trial,
    Work,
    ask,
    reference_replies,
    torchvision_path,
)

from infthor_eval.errors import InfthorError, ModelError, wrap_errors

__all__ = [
    "FAMILIES",
    "QUESTIONS",
    "Row",
    "main",
    "make",
    "report",
    "trial_parser",
    "try_families",
    "write_frames",
]

_ALL = {**GRIDS, **SQUARES, **TILES, **CROPS}
# In the order of those that people bring.
_ORDER = (
    "qwen2_vl",
    "qwen2_5_vl",
    "qwen3_vl",
    "qwen3_vl_moe",
    "qwen3_5",
    "glm4v",
    "glm46v",
    "glm4v_moe",
    "ernie4_5_vl_moe",
    "gemma3",
    "gemma4",
    "internvl",
    "llama4",
    "mistral3",
    "smolvlm",
    "idefics2",
    "idefics3",
    "llava",
    "llava_next",
    "vipllava",
    "llava_onevision",
    "deepseek_vl",
    "aya_vision",
    "janus",
    "ovis2",
    "mllama",
    "paligemma",
    "minicpmv4_6",
    "molmo2",
    "cohere2_vision",
    "lfm2_vl",
    "nemotron_h_omni",
    "video_llama_3",
)
FAMILIES = {name: _ALL[name] for name in _ORDER}
QUESTIONS = (
    "Did you see a mug on the table?",
    "What object did you put on the dresser?",
    "How many plates did you see in the kitchen?",
    "Which room has a sofa and a television?",
    "What is the colour of the bowl that you picked up first?",
)


@dataclass(frozen=True)
class Row:
    """What came of a family.

    Attributes:
        name: transformers' name of the family.
        loads: whether `hf-vlm` loads it in some way.
        equal: number of replies equal to the reference's by way; None for a way that failed.
        asked: number of questions.
        notes: what went wrong, a line each, as users see it.
        reference: what replies were compared with: `generate`, `unshared`, or `-` for nothing.
    """

    name: str
    loads: bool
    equal: Mapping[str, int | None]
    asked: int
    notes: tuple[str, ...]
    reference: str = "-"

    def right(self, *ways: str) -> bool:
        """Return whether all replies of these ways are equal to the reference's."""
        return all(self.equal[way] == self.asked for way in ways)


def main(words: Sequence[str] | None = None) -> None:
    """Try the families, and print a row for each and the totals."""
    options = _arguments(words)
    if options.torchvision:
        _start_again_with_torchvision()
    try:
        with tempfile.TemporaryDirectory() as folder:
            rows = try_families(options.families, Path(folder), options.frames, options.new_tokens)
    except InfthorError as error:
        sys.exit(str(error))
    text = report(rows)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n", encoding="utf-8")


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = trial_parser(__doc__)
    parser.add_argument(
        "--torchvision", action="store_true", help="have torchvision, as `make test` sets it aside"
    )
    return parser.parse_args(words)


def trial_parser(about: str) -> argparse.ArgumentParser:
    """Return a parser of the options of a trial; `about` is its text, the first line a title."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument(
        "--families", type=_names, default=list(FAMILIES), help="names with commas between them"
    )
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--new-tokens", type=int, default=8)
    parser.add_argument("--out", type=Path, help="file for the table, in Markdown")
    return parser


def _names(text: str) -> list[str]:
    names = text.split(",")
    unknown = [name for name in names if name not in FAMILIES]
    if unknown:
        raise argparse.ArgumentTypeError(f"{unknown[0]} is not one of {', '.join(FAMILIES)}")
    return names


def _start_again_with_torchvision() -> None:
    if not PEERS.is_dir():
        sys.exit(f"{PEERS}: no torchvision; run `make test` once, which puts it there")
    words = [word for word in sys.argv if word != "--torchvision"]
    os.execve(sys.executable, [sys.executable, *words], os.environ | torchvision_path())


def try_families(
    names: Sequence[str], root: Path, n_frames: int = 24, new_tokens: int = 8
) -> list[Row]:
    """Make a checkpoint of each family in a folder, and try it; one that fails stops no other.

    Args:
        names: some of `FAMILIES`.
        root: an existing folder.
        n_frames: frames of the one context, 160 x 160 pixels each.
        new_tokens: most tokens of a reply.

    Raises:
        ModelError: the process of transformers' own way failed.
    """
    work = Work(write_frames(root, n_frames), QUESTIONS, new_tokens)
    unmade = {name: make(name, root / name) for name in names}
    made = {name: root / name for name in names if unmade[name] is None}
    expected = reference_replies(made, work)
    return [
        _row(name, ask(made[name], work), expected[name])
        if name in made
        else _unmade_row(name, unmade[name])
        for name in names
    ]


def write_frames(folder: Path, count: int) -> list[Path]:
    """Write different frames of coarse coloured noise."""
    draw = np.random.default_rng(0)
    paths = [folder / f"{number:02d}.png" for number in range(count)]
    for path in paths:
        coarse = Image.fromarray(draw.integers(0, 256, (8, 8, 3), dtype=np.uint8))
        coarse.resize((160, 160), Image.Resampling.BICUBIC).save(path)
    return paths


def make(name: str, folder: Path) -> str | None:
    """Write a checkpoint; return one line if that failed."""
    try:
        with wrap_errors(name, "see its config", catch=Exception, raise_as=ModelError):
            save(name, FAMILIES[name], folder)
    except InfthorError as error:
        return str(error)
    return None


def _unmade_row(name: str, reason: str | None) -> Row:
    return Row(name, False, dict.fromkeys(WAYS), len(QUESTIONS), (f"not made: {reason}",))


def _row(name: str, trial: Trial, reference: Reference | str) -> Row:
    notes = list(dict.fromkeys(trial.errors.values()))
    if isinstance(reference, str):
        notes.append(f"transformers' own way fails: {reference}")
        expected = trial.replies.get("unshared", [])
        compared = "unshared" if expected else "-"
    else:
        expected = reference.replies
        compared = "generate"
        if reference.inverted == expected[0]:
            notes.append("replies do not depend on the frames")
    return Row(
        name,
        loads=bool(trial.replies),
        equal={way: _n_equal(trial.replies.get(way), expected) for way in WAYS},
        asked=len(QUESTIONS),
        notes=tuple(notes),
        reference=compared,
    )


def _n_equal(replies: Replies | None, expected: Replies) -> int | None:
    if replies is None:
        return None
    return sum(ours == theirs for ours, theirs in zip(replies, expected, strict=False))


def report(rows: Sequence[Row]) -> str:
    """Return the table, the totals and what went wrong, a line each, in Markdown."""
    lines = [
        "| family | loads | equal alone | equal together | equal unshared | compared with |",
        "|---|---|---|---|---|---|",
        *map(_line, rows),
        "",
        _totals(rows),
    ]
    notes = [f"{row.name}: {note}" for row in rows for note in row.notes]
    return "\n".join([*lines, "", "```", *notes, "```"] if notes else lines)


def _line(row: Row) -> str:
    cells = ["-" if row.equal[way] is None else f"{row.equal[way]} of {row.asked}" for way in WAYS]
    words = [row.name, "yes" if row.loads else "no", *cells, row.reference]
    return f"| {' | '.join(words)} |"


def _totals(rows: Sequence[Row]) -> str:
    shares = sum(row.right("alone", "together") for row in rows)
    runs = sum(row.right("unshared") and not row.right("alone", "together") for row in rows)
    loads = sum(row.loads for row in rows)
    return (
        f"**{shares} of {len(rows)} share with equal replies, alone and together; {runs} run only "
        f"unshared, equally; {len(rows) - loads} do not load.**"
    )


if __name__ == "__main__":
    main()
