"""From the turns of a conversation to the text that the checkpoint's own chat template makes of them."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from jinja2 import TemplateError

from infthor_eval.errors import ModelError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.limits import TEMPLATE_CHARACTERS, TEMPLATE_MB, TEMPLATE_SECONDS
from model_adapters.hf.memory_limit import OutOfMemoryError, taking_at_most
from model_adapters.hf.time_limit import OutOfTimeError, computing_at_most
from model_adapters.protocols import Turn

__all__ = ["begins", "render"]

# What a template raises that does not fit or is broken: Jinja's own, and those of the Python that it computes.
_REFUSALS = (
    TemplateError,
    TypeError,  # a list where the template joins strings
    ValueError,
    LookupError,
    ArithmeticError,
    AttributeError,
    RecursionError,
)
_PRINTED = "{'type': 'text'"  # how a content looks where a template that wants a string writes a list


def render(tokenizer: Any, template: str, turns: Sequence[Turn], image_token: str) -> str:
    """The chat template over all turns, asking for the reply.

    Some templates (LLaVA's) write all images of a turn before its texts. Where that would take frames out of the places
    between texts, the turn is given to them as one text with the image's token in it. Some (Pixtral's) want what the
    system says as a string instead of a list of texts, and get it so.

    Args:
        tokenizer: the checkpoint's.
        template: its chat template (Jinja).
        turns: the conversation.
        image_token: what the template writes for an image.

    Raises:
        ModelError: the template refuses the turns, or leaves a text out.
    """
    trials = [_trial(tokenizer, template, turn) for turn in turns]
    shown = [_in_place(turn, trial, image_token) for turn, trial in zip(turns, trials, strict=True)]
    if len(turns) == 1 and trials[0] is not None and shown[0] == replace(turns[0], role="user"):
        return trials[0]  # what was tried is the whole conversation
    listed = [_message(turn) for turn in shown]
    try:
        return _written(tokenizer, template, shown, listed)
    except ModelError:
        strings = [_string_message(turn) for turn in shown]
        if strings == listed:
            raise
    return _written(tokenizer, template, shown, strings)


def begins(tokenizer: Any, text: str) -> bool:
    """Whether the template wrote the token that begins every text; where not, processors let the tokenizer add it."""
    return tokenizer.bos_token is not None and text.startswith(tokenizer.bos_token)


def _trial(tokenizer: Any, template: str, turn: Turn) -> str | None:
    """What is written of a turn of frames and texts alone, as the user's; None for other turns.

    It is tried alone so that what comes after it does not change how it is written.
    """
    if len({isinstance(part, FrameRef) for part in turn.parts}) < 2:
        return None
    alone = replace(turn, role="user")
    return _written(tokenizer, template, [alone], [_message(alone)])


def _in_place(turn: Turn, trial: str | None, image_token: str) -> Turn:
    """The turn with its image tokens in one text, where the template would not leave frames in their places."""
    parts = [part.strip() if isinstance(part, str) else image_token for part in turn.parts]
    n_frames = sum(isinstance(part, FrameRef) for part in turn.parts)
    if trial is None or trial.count(image_token) != n_frames or _in_order(trial, parts):
        return turn
    return replace(turn, parts=("".join(part if isinstance(part, str) else image_token for part in turn.parts),))


def _message(turn: Turn) -> dict[str, Any]:
    # Most templates read a text under "text", a few under "content".
    content = [
        {"type": "text", "text": part, "content": part} if isinstance(part, str) else {"type": "image"}
        for part in turn.parts
    ]
    return {"role": turn.role, "content": content}


def _string_message(turn: Turn) -> dict[str, Any]:
    text = turn.parts[0]
    if turn.role == "user" or len(turn.parts) > 1 or not isinstance(text, str):
        return _message(turn)
    return {"role": turn.role, "content": text}


def _written(tokenizer: Any, template: str, turns: Sequence[Turn], messages: Sequence[dict[str, Any]]) -> str:
    refused = f"the chat template refuses {_roles(turns)}"
    with (
        wrap_errors(refused, f"mend it; {TEMPLATE_SECONDS.hint}", catch=OutOfTimeError, raise_as=ModelError),
        wrap_errors(refused, f"mend it; {TEMPLATE_MB.hint}", catch=OutOfMemoryError, raise_as=ModelError),
        wrap_errors(refused, "ask in other turns, or mend it", catch=_REFUSALS, raise_as=ModelError),
        computing_at_most(TEMPLATE_SECONDS.value),
        taking_at_most(TEMPLATE_MB.value),
    ):
        text: str = tokenizer.apply_chat_template(
            list(messages), chat_template=template, tokenize=False, add_generation_prompt=True
        )
    if len(text) > TEMPLATE_CHARACTERS.value:  # which would take the tokenizer minutes, and gigabytes
        raise ModelError(f"{refused} (it makes {len(text):,} characters); mend it; {TEMPLATE_CHARACTERS.hint}")
    _check_texts(text, turns)
    return text


def _check_texts(text: str, turns: Sequence[Turn]) -> None:
    """See that a rendered text has every text of every turn.

    Raises:
        ModelError: one is left out.
    """
    said = [(turn.role, part.strip()) for turn in turns for part in turn.parts if isinstance(part, str)]
    # Counting reads the whole text for every part, and is only needed where they are not there in order.
    counts = {} if _in_order(text, (part for _, part in said)) else Counter(part for _, part in said)
    for part, count in counts.items():
        if text.count(part) < count:
            roles = " or ".join(sorted({role for role, other in said if other == part}))
            raise ModelError(
                f"the chat template leaves out the text {part[:40]!r} of a turn ({roles}); it cannot be used"
            )
    if _PRINTED in text and not any(_PRINTED in part for _, part in said):
        raise ModelError(f"the chat template writes lists instead of texts for {_roles(turns)}; ask in other turns")


def _roles(turns: Sequence[Turn]) -> str:
    return "the turns " + ", ".join(turn.role for turn in turns)


def _in_order(text: str, parts: Iterable[str]) -> bool:
    """Whether the parts stand in a rendered text one after the other."""
    at = 0
    for part in parts:
        at = text.find(part, at)
        if at < 0:
            return False
        at += len(part)
    return True
