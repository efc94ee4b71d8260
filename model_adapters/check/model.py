"""Checks of models and their conversations."""

from collections.abc import Callable
from functools import partial

from infthor_eval.formats.frames import FrameRef
from model_adapters.check.claims import check_choices, check_flight, check_sampling, check_video
from model_adapters.check.clauses import check_identity, check_members
from model_adapters.check.conversation import check_counts, check_marks, check_parts, check_turns
from model_adapters.check.replies import (
    check_continuations,
    check_frames,
    check_reply,
    check_sharing,
)
from model_adapters.protocols import Model

__all__ = ["model_checks"]


def model_checks(model: Model, black: FrameRef, white: FrameRef) -> dict[str, Callable[[], None]]:
    """Return all checks of a model by name; each raises `ContractError` if a clause does not
    hold."""
    return {
        "members": partial(check_members, model),
        "identity": partial(check_identity, model),
        "parts": partial(check_parts, model, black),
        "counts": partial(check_counts, model, black),
        "marks": partial(check_marks, model, black),
        "reply": partial(check_reply, model, black),
        "turns": partial(check_turns, model, black),
        "frames": partial(check_frames, model, black, white),
        "sharing": partial(check_sharing, model, black, white),
        "continuations": partial(check_continuations, model, black, white),
        "sampling": partial(check_sampling, model, black),
        "choices": partial(check_choices, model, black),
        "video": partial(check_video, model, black, white),
        "flight": partial(check_flight, model, black, white),
    }
