"""Trial of `hf-vlm` in real vLLM on the families of `families.py`: does it load, reply equally?

    make .venv-vllm/.installed
    .venv-vllm/bin/python benchmarks/families_on_vllm.py --out table.md

Each family's tiny checkpoint is asked the same questions by vLLM as by transformers' own processor
and `generate`, greedily and in float32. Of a reply that differs, the first token that does is named
with its margin: by how much its logit is above the next likely one's in transformers. Each family
has a process of its own, since vLLM keeps its memory.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from families import QUESTIONS, make, trial_parser, write_frames
from tiny_families.trial import Reference, Replies, Work, converse, reference_replies

from infthor_eval.errors import InfthorError, ModelError, wrap_errors

__all__ = ["Row", "difference", "main", "report"]

# On a CPU a float32 logit differs between the engines by less than this.
_TIE = 1e-3
_SETTINGS = {"dtype": "float32", "enforce_eager": "true"}
# vLLM on a CPU: no memory is taken beyond this many GB, and no process is started beside this one.
_ENVIRONMENT = {
    "HF_HUB_OFFLINE": "1",
    "VLLM_CPU_KVCACHE_SPACE": "1",
    "VLLM_CPU_OMP_THREADS_BIND": "nobind",
    "VLLM_ENABLE_V1_MULTIPROCESSING": "0",
}
_MOST_SECONDS = 300  # of a family, whose engine may hang


@dataclass(frozen=True)
class Row:
    """What came of a family.

    Attributes:
        name: transformers' name of the family.
        equal: number of replies equal to transformers'; None if it does not run.
        asked: number of questions.
        note: what went wrong, in one line.
    """

    name: str
    equal: int | None
    asked: int
    note: str = ""


def main(words: Sequence[str] | None = None) -> None:
    """Try the families, and print a row for each and the totals."""
    options = _arguments(words)
    if options.one is not None:
        _answer(options.one)
        return
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        work = Work(write_frames(root, options.frames), QUESTIONS, options.new_tokens)
        rows = []
        for name in options.families:
            rows.append(_try(name, root / name, work))
            print(_line(rows[-1]), rows[-1].note, file=sys.stderr, flush=True)
    text = report(rows)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n", encoding="utf-8")


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = trial_parser(__doc__)
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)  # a checkpoint, asked by vLLM
    return parser.parse_args(words)


def _try(name: str, folder: Path, work: Work) -> Row:
    problem = make(name, folder)
    if problem is not None:
        return Row(name, None, len(work.questions), f"not made: {problem}")
    try:
        replies = _replies_of_vllm(folder, work)
        reference = reference_replies({name: folder}, work)[name]
    except InfthorError as error:
        return Row(name, None, len(work.questions), str(error))
    if isinstance(reference, str):
        return Row(name, None, len(work.questions), f"transformers' own way fails: {reference}")
    note = difference(replies, reference)
    equal = sum(ours == theirs for ours, theirs in zip(replies, reference.replies, strict=True))
    return Row(name, equal, len(replies), note)


def _replies_of_vllm(folder: Path, work: Work) -> Replies:
    request = {**asdict(work), "frames": list(map(str, work.frames))}
    try:
        done = subprocess.run(
            [sys.executable, __file__, "--one", folder],
            input=json.dumps(request),
            capture_output=True,
            text=True,
            check=False,
            timeout=_MOST_SECONDS,
            env=_ENVIRONMENT | os.environ,
        )
    except subprocess.TimeoutExpired as error:
        raise ModelError(f"vLLM did not end within {_MOST_SECONDS} s") from error
    answer = done.stdout.splitlines()[-1:] if done.returncode == 0 else []
    if not answer:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise ModelError(f"vLLM's process ended with {done.returncode}: {last}")
    content = json.loads(answer[0])
    if isinstance(content, str):
        raise ModelError(content.replace(f"{folder.parent}{os.sep}", ""))
    return list(map(tuple, content))


def _answer(folder: Path) -> None:
    """Print the replies of vLLM to what the standard input asks, or one line of error."""
    request = json.load(sys.stdin)
    work = Work(list(map(Path, request["frames"])), request["questions"], request["new_tokens"])
    try:
        with wrap_errors("a crash", "no user should see it", catch=Exception, raise_as=ModelError):
            replies: Replies | str = converse("hf-vlm@vllm", folder, _SETTINGS, work)
    except InfthorError as error:
        replies = str(error)
    print(json.dumps(replies), flush=True)


def difference(replies: Replies, reference: Reference) -> str:
    """Return in words where the first reply that differs does so; empty if none does."""
    for number, (ours, theirs, margins) in enumerate(
        zip(replies, reference.replies, reference.margins, strict=True), 1
    ):
        if ours == theirs:
            continue
        pairs = enumerate(zip(ours, theirs, strict=False))
        length = min(len(ours), len(theirs))
        token = next((at for at, (one, other) in pairs if one != other), length)
        margin = margins[token]
        kind = "a near tie" if margin < _TIE else "no tie"
        return f"question {number} differs at token {token + 1}, {kind} (margin {margin:.1g})"
    return ""


def report(rows: Sequence[Row]) -> str:
    """Return the table, the totals and what went wrong, a line each, in Markdown."""
    lines = ["| family | equal in vLLM |", "|---|---|", *map(_line, rows), ""]
    runs = [row for row in rows if row.equal is not None]
    equal = sum(row.equal == row.asked for row in runs)
    lines.append(f"**{equal} of {len(rows)} reply equally in vLLM; {len(runs)} run.**")
    notes = [f"{row.name}: {row.note}" for row in rows if row.note]
    return "\n".join([*lines, "", "```", *notes, "```"] if notes else lines)


def _line(row: Row) -> str:
    cell = "-" if row.equal is None else f"{row.equal} of {row.asked}"
    return f"| {row.name} | {cell} |"


if __name__ == "__main__":
    main()
