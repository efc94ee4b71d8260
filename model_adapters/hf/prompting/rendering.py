"""From the turns of a conversation to the text that the checkpoint's chat template renders."""

import resource
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from threading import Lock
from typing import Any

from jinja2 import TemplateError
from transformers.utils.chat_template_utils import _compile_jinja_template

from infthor_eval.errors import ModelError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.storage.deadlines import limit_time
from infthor_eval.storage.limits import TEMPLATE_CHARACTERS, TEMPLATE_MB, TEMPLATE_SECONDS
from model_adapters.protocols import Part, Turn

# Errors of a template that is broken or does not support the turns: Jinja's, and those of its
# expressions.
_REFUSALS = (
    TemplateError,
    TypeError,  # a list where the template joins strings
    ValueError,
    LookupError,
    ArithmeticError,
    AttributeError,
    RecursionError,
)
# What templates that write the date (Mistral Small's) take for today: the same prompt every day.
_TODAY = date(2025, 1, 1)
_PRINTED = "{'type': 'text'"  # appears where a template that expects a string prints a list
_SIZE = Path("/proc/self/statm")  # its first number is the process's address space in pages
_MB = 1024 * 1024
# Of two nested limits, the second would restore the first as if it were the original.
_LOCK = Lock()


@dataclass(frozen=True)
class Marks:
    """Tokens that stand for a frame and for a video in the text of a template; None where there is
    none."""

    image: str | None
    video: str | None = None

    def of(self, part: Part) -> str:
        """Return the text that a part has in a template: the token of a frame or a video, a text
        without its edges."""
        if isinstance(part, Video):
            return self.video or ""
        return (self.image or "") if isinstance(part, FrameRef) else part.strip()


def render(tokenizer: Any, template: str, turns: Sequence[Turn], marks: Marks) -> str:
    """Render the chat template over all turns, asking for the reply.

    Some templates (LLaVA's) write all images of a turn before its texts. If that would move frames
    or videos away from between the texts, the turn is passed as one text that contains their
    tokens. Some templates (Pixtral's) accept a system turn only as a string instead of a list of
    texts; those of models without images are made for strings.
    """
    trials = [_render_alone(tokenizer, template, turn) for turn in turns]
    ordered = [
        _with_frames_in_place(turn, trial, marks) for turn, trial in zip(turns, trials, strict=True)
    ]
    if len(turns) == 1 and trials[0] is not None and ordered[0] == replace(turns[0], role="user"):
        return trials[0]  # the trial rendered the whole conversation
    forms = [
        [_message(turn) for turn in ordered],
        [
            _message(turn) if marks.image and turn.role == "user" else _string_message(turn)
            for turn in ordered
        ],
    ]
    first, second = forms if marks.image else reversed(forms)
    try:
        return _apply(tokenizer, template, ordered, first)
    except ModelError:
        if first == second:
            raise
    return _apply(tokenizer, template, ordered, second)


def starts_with_bos(tokenizer: Any, text: str) -> bool:
    """Return whether the template wrote the beginning-of-sequence token; if not, the tokenizer has
    to add it."""
    return tokenizer.bos_token is not None and text.startswith(tokenizer.bos_token)


def writes_videos(tokenizer: Any, template: str, marks: Marks) -> bool:
    """Return whether a template writes a video's token where a turn has one; without a video."""
    if marks.video is None:
        return False
    messages = [
        {
            "role": "user",
            "content": [{"type": "video"}, {"type": "text", "text": "?", "content": "?"}],
        }
    ]
    try:
        return _apply(tokenizer, template, (), messages).count(marks.video) == 1
    except ModelError:
        return False


def _render_alone(tokenizer: Any, template: str, turn: Turn) -> str | None:
    """Return the text of a turn with texts and more, as a user's only turn; None for other turns.

    It is rendered alone because templates may treat a turn differently when another one follows.
    """
    if len({isinstance(part, str) for part in turn.parts}) < 2:
        return None
    alone = replace(turn, role="user")
    return _apply(tokenizer, template, [alone], [_message(alone)])


def prompt_end(tokenizer: Any, template: str) -> str:
    """Return what the template writes behind a user's turn; empty if it needs frames there."""
    probe = "?"
    turn = Turn("user", (probe,))
    for message in (_message(turn), _string_message(turn)):
        try:
            return _apply(tokenizer, template, (turn,), [message]).rpartition(probe)[2]
        except ModelError:
            continue
    return ""


def _with_frames_in_place(turn: Turn, trial: str | None, marks: Marks) -> Turn:
    """Return the turn as one text with tokens of frames and videos if the template would change its
    parts' order."""
    parts = [marks.of(part) for part in turn.parts]
    tokens = Counter(marks.of(part) for part in turn.parts if not isinstance(part, str))
    if (
        trial is None
        or any(trial.count(token) != n for token, n in tokens.items())
        or _in_order(trial, parts)
    ):
        return turn
    return replace(
        turn,
        parts=("".join(part if isinstance(part, str) else marks.of(part) for part in turn.parts),),
    )


def _message(turn: Turn) -> dict[str, Any]:
    return {"role": turn.role, "content": [_content_part(part) for part in turn.parts]}


def _content_part(part: Part) -> dict[str, str]:
    if isinstance(part, str):
        # Most templates read "text", a few "content".
        return {"type": "text", "text": part, "content": part}
    return {"type": "video" if isinstance(part, Video) else "image"}


def _string_message(turn: Turn) -> dict[str, Any]:
    texts = [part for part in turn.parts if isinstance(part, str)]
    if len(texts) < len(turn.parts):
        return _message(turn)
    return {"role": turn.role, "content": "".join(texts)}


def _apply(
    tokenizer: Any, template: str, turns: Sequence[Turn], messages: Sequence[dict[str, Any]]
) -> str:
    problem = f"the chat template refuses {_roles(turns)}"
    # A template is code that comes with the checkpoint: it must neither run forever nor use up the
    # memory.
    seconds = TEMPLATE_SECONDS.value
    late = f"{problem} (it is not done after {seconds} s); fix it; {TEMPLATE_SECONDS.hint}"
    smaller = f"fix it; {TEMPLATE_MB.hint}"
    with (
        limit_time(seconds, ModelError(late)),
        wrap_errors(problem, smaller, catch=_OutOfMemoryError, raise_as=ModelError),
        wrap_errors(problem, "use other turns, or fix it", catch=_REFUSALS, raise_as=ModelError),
        _limit_memory(TEMPLATE_MB.value),
    ):
        # transformers takes no function from outside for a template.
        _compile_jinja_template(template).globals["strftime_now"] = _TODAY.strftime
        text: str = tokenizer.apply_chat_template(
            list(messages),
            chat_template=template,
            tokenize=False,
            add_generation_prompt=True,
        )
    if len(text) > TEMPLATE_CHARACTERS.value:  # the tokenizer would take minutes and gigabytes
        raise ModelError(
            f"{problem} (it writes {len(text):,} characters); fix it; {TEMPLATE_CHARACTERS.hint}"
        )
    _check_texts(text, turns)
    return text


def _check_texts(text: str, turns: Sequence[Turn]) -> None:
    """Raise `ModelError` unless a rendered text contains every text of every turn."""
    parts = [
        (turn.role, part.strip()) for turn in turns for part in turn.parts if isinstance(part, str)
    ]
    # Counting scans the whole text for every part, so it is done only if the parts do not appear in
    # order.
    counts = (
        {} if _in_order(text, (part for _, part in parts)) else Counter(part for _, part in parts)
    )
    for part, count in counts.items():
        if text.count(part) < count:
            roles = " or ".join(sorted({role for role, other in parts if other == part}))
            raise ModelError(
                f"the chat template drops the text {part[:40]!r} of a turn ({roles}); it cannot be "
                "used"
            )
    if _PRINTED in text and not any(_PRINTED in part for _, part in parts):
        raise ModelError(
            f"the chat template writes lists instead of texts for {_roles(turns)}; use other turns"
        )


def _roles(turns: Sequence[Turn]) -> str:
    return "the turns " + ", ".join(turn.role for turn in turns)


def _in_order(text: str, parts: Iterable[str]) -> bool:
    """Return whether the parts appear in a rendered text in this order."""
    at = 0
    for part in parts:
        at = text.find(part, at)
        if at < 0:
            return False
        at += len(part)
    return True


class _OutOfMemoryError(Exception):
    """Code needed more memory than allowed."""


@contextmanager
def _limit_memory(megabytes: int) -> Iterator[None]:
    """Refuse allocations beyond the process's current memory plus this limit; no limit if the
    system has no /proc.

    The operating system enforces it, because Python has many ways to build a large text. The limit
    applies to the whole process, other threads included, and one thread at a time may set it.

    Raises:
        OutOfMemoryError: more memory was needed.
    """
    with _LOCK:
        before, highest = resource.getrlimit(resource.RLIMIT_AS)
        bound = _bound(
            megabytes, [limit for limit in (before, highest) if limit != resource.RLIM_INFINITY]
        )
        resource.setrlimit(resource.RLIMIT_AS, (before if bound is None else bound, highest))
        try:
            yield
        except MemoryError as error:
            raise _OutOfMemoryError(f"it takes more than {megabytes} MB of memory") from error
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (before, highest))


def _bound(megabytes: int, others: list[int]) -> int | None:
    """Return the allowed address space of the process in bytes; lower limits of others are kept."""
    try:
        pages = int(_SIZE.read_text().split()[0])
    except OSError:
        return None
    # setrlimit cannot represent larger values.
    return min(pages * resource.getpagesize() + megabytes * _MB, 2**62, *others)
