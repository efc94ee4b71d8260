"""The contract of models and policies, checked up to the first violation or as a whole."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import cast

from infthor_eval.formats.frames import FrameRef
from model_adapters.check.claims import check_choices, check_flight, check_sampling, check_video
from model_adapters.check.clauses import check_identity, check_members, frames_of_one_colour
from model_adapters.check.conversation import check_counts, check_marks, check_parts, check_turns
from model_adapters.check.policy import policy_checks
from model_adapters.check.replies import (
    check_continuations,
    check_frames,
    check_reply,
    check_sharing,
)
from model_adapters.check.results import CheckResult, run_each
from model_adapters.protocols import Model, Policy


def check_adapter(adapter: Model | Policy, frame_size: tuple[int, int] = (300, 300)) -> None:
    """Check a model or a policy against its contract, as far as its capabilities go.

    The adapter answers a few dozen short questions on frames of one colour.

    Args:
        adapter: the adapter to check; it is not closed.
        frame_size: width and height of the frames, in pixels.

    Raises:
        ContractError: a clause does not hold; the message names it.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        for check in _checks(adapter, black, white).values():
            check()


def run_checks(
    adapter: Model | Policy, frame_size: tuple[int, int] = (300, 300)
) -> Iterator[CheckResult]:
    """Run all checks of `check_adapter`, also after a violation; only a missing member ends them.

    Args:
        adapter: the adapter to check; it is not closed.
        frame_size: width and height of the frames, in pixels.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        yield from run_each(_checks(adapter, black, white))


def _checks(
    adapter: Model | Policy, black: FrameRef, white: FrameRef
) -> dict[str, Callable[[], None]]:
    if hasattr(adapter, "act"):
        return policy_checks(cast(Policy, adapter), black, white)
    return model_checks(adapter, black, white)


def model_checks(model: Model, black: FrameRef, white: FrameRef) -> dict[str, Callable[[], None]]:
    """Return all checks of a model by name; each raises `ContractError` for a broken clause."""
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
