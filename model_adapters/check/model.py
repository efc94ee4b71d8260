"""The contract of models and their conversations."""

from collections.abc import Callable
from functools import partial

from infthor_eval.formats.frames import FrameRef
from model_adapters.check.claims import check_choices, check_flight, check_sampling
from model_adapters.check.clauses import check_identity, check_members, frames_of_one_colour
from model_adapters.check.conversation import check_counts, check_marks, check_parts, check_turns
from model_adapters.check.replies import check_continuations, check_frames, check_reply, check_sharing
from model_adapters.protocols import Conversation, Model

__all__ = ["check_adapter", "model_checks"]


def check_adapter(model: Model, frame_size: tuple[int, int] = (300, 300)) -> None:
    """Check a model against the contract of `Model` and `Conversation`, as far as its capabilities go.

    It makes a few dozen short replies on frames of one colour.

    Args:
        model: the adapter to check; it stays open.
        frame_size: width and height of the frames to show it, in pixels.

    Raises:
        ContractError: names the clause that does not hold.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        for check in model_checks(model, black, white).values():
            check()


def model_checks(model: Model, black: FrameRef, white: FrameRef) -> dict[str, Callable[[], None]]:
    """All checks of a model, by what they are about; each raises ContractError where a clause does not hold.

    Args:
        model: the adapter to check.
        black: a frame of that colour.
        white: likewise.
    """
    return {
        "members": partial(_check_members, model),
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
        "flight": partial(check_flight, model, black, white),
    }


def _check_members(model: Model) -> None:
    check_members(model, Model)
    check_members(model.conversation(), Conversation)
