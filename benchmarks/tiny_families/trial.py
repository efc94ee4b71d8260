"""The trial of a checkpoint: the same questions asked in three ways, and by transformers itself."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from infthor_eval.errors import InfthorError, ModelError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from model_adapters import Decoding, load

__all__ = [
    "PEERS",
    "WAYS",
    "Reference",
    "Replies",
    "Trial",
    "Work",
    "ask",
    "converse",
    "reference_replies",
    "torchvision_path",
]

PEERS = Path(sys.prefix) / "test-peers"  # torchvision's Python half, which `make test` puts there
_SHIM = Path(__file__).parents[2] / "tests" / "peers"  # lets it load without its compiled half
_REFERENCE = Path(__file__).parent / "reference.py"
WAYS = ("alone", "together", "unshared")

Replies = list[tuple[int, ...]]


@dataclass(frozen=True)
class Work:
    """What every family is asked.

    Attributes:
        frames: frames of the one context.
        questions: questions, each asked on all frames.
        new_tokens: most tokens of a reply.
    """

    frames: Sequence[Path]
    questions: Sequence[str]
    new_tokens: int


@dataclass
class Trial:
    """What came of a checkpoint.

    Attributes:
        replies: replies by way, for each way that gave some.
        errors: one line for each way that failed, as a user sees it.
    """

    replies: dict[str, Replies] = field(default_factory=dict)
    errors: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Reference:
    """What transformers' own processor and `generate` reply.

    Attributes:
        replies: a reply to each question.
        margins: by how much the logit of each token is above that of the next likely one.
        inverted: the reply to the first question on inverted frames.
    """

    replies: Replies
    margins: Sequence[Sequence[float]]
    inverted: tuple[int, ...]


def ask(folder: Path, work: Work) -> Trial:
    """Ask a checkpoint through `hf-vlm` in each way; a way that fails leaves one line."""
    trial = Trial()
    for way in WAYS:
        try:
            with wrap_errors(
                "a crash", "no user should see it", catch=Exception, raise_as=ModelError
            ):
                trial.replies[way] = _ask_in(way, folder, work)
        except InfthorError as error:
            trial.errors[way] = str(error).replace(f"{folder.parent}{os.sep}", "")
    return trial


def _ask_in(way: str, folder: Path, work: Work) -> Replies:
    settings = {"share_prefix": "false"} if way == "unshared" else {}
    return converse("hf-vlm", folder, settings, work, together=way == "together")


def converse(
    name: str, folder: Path, settings: Mapping[str, str], work: Work, *, together: bool = False
) -> Replies:
    """Return the replies of a checkpoint that this adapter loads, one after the other or together.

    Raises:
        InfthorError: the adapter does not load it, or fails.
    """
    decoding = Decoding(max_new_tokens=work.new_tokens)
    model = load(name, {"pretrained": str(folder), **settings}, 0)
    with closing(model):
        talk = model.conversation()  # type: ignore[union-attr]
        talk.append(*map(FrameRef, work.frames))
        if together:
            replies = talk.replies([[question] for question in work.questions], decoding)
        else:
            mark = talk.mark()
            replies = []
            for question in work.questions:
                talk.append(question)
                replies.append(talk.reply(decoding))
                talk.rewind(mark)
    return [reply.token_ids or () for reply in replies]


def reference_replies(folders: Mapping[str, Path], work: Work) -> dict[str, Reference | str]:
    """Return the replies of transformers' own processor and `generate`, or one line of error, by
    family.

    torchvision is on the path if it was set aside for tests.

    Raises:
        ModelError: the process failed.
    """
    request = {
        "folders": {name: str(folder) for name, folder in folders.items()},
        "frames": list(map(str, work.frames)),
        "questions": list(work.questions),
        "new_tokens": work.new_tokens,
    }
    done = subprocess.run(
        [sys.executable, _REFERENCE],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | torchvision_path(),
    )
    if done.returncode:
        raise ModelError(f"transformers' own way failed: {done.stderr.strip().splitlines()[-1]}")
    answers = json.loads(done.stdout.splitlines()[-1])
    return {
        name: answer if isinstance(answer, str) else _read_reference(answer)
        for name, answer in answers.items()
    }


def _read_reference(answer: Sequence[Mapping[str, Any]]) -> Reference:
    *replies, inverted = (tuple(reply["tokens"]) for reply in answer)
    return Reference(replies, [reply["margins"] for reply in answer[:-1]], inverted)


def torchvision_path() -> dict[str, str]:
    """Return the path of a process that has torchvision; empty if it was not set aside."""
    if not PEERS.is_dir():
        return {}
    before = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    return {"PYTHONPATH": os.pathsep.join([str(_SHIM), str(PEERS), *filter(None, before)])}
