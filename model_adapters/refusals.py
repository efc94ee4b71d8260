"""Checks of requests and of steps, with the same messages for every model."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager

from infthor_eval.errors import AdapterError, ModelError, UsageError, wrap_user_code
from infthor_eval.formats.pictures.video import Video
from infthor_eval.quantities import MOST
from infthor_eval.storage.deadlines import limit_by
from infthor_eval.storage.limits import OWN_CODE_SECONDS
from model_adapters.protocols import ArmDelta, BatchModel, Capabilities, Decoding, Subject, Turn

_N_NUMBERS = 7  # of a policy's step


def check_decoding(name: str, capabilities: Capabilities, decoding: Decoding) -> None:
    """Check that the model of this name supports this way of decoding.

    Raises:
        ModelError: the model does not sample, cannot be restricted to choices, or has no cache that
            can be cut.
    """
    if not (decoding.greedy or capabilities.sampling):
        raise ModelError(
            f"{name} decodes greedily only, not at temperature {decoding.temperature}; ask at "
            "temperature 0"
        )
    if decoding.choices and not capabilities.choices:
        raise ModelError(
            f"{name} does not support choices ({len(decoding.choices)} given); ask without choices"
        )
    if decoding.cache is not None and not capabilities.cache_cuts:
        raise ModelError(
            f"{name} has no cache that a memory can cut; use a memory of frames, or a model of "
            "transformers with share_prefix=true and without attention"
        )


def check_turns(name: str, capabilities: Capabilities, turns: Sequence[Turn]) -> None:
    """Check that it is this model's turn, and that it takes all parts of the conversation.

    Raises:
        ModelError: the conversation is empty, its last turn is not the user's, or it has frames or
            a video and the model no input for them.
    """
    if not turns or turns[-1].role != "user":
        state = f"the last turn is the {turns[-1].role}'s" if turns else "the conversation is empty"
        raise ModelError(f"{name} has nothing to reply to: {state}; append a user turn")
    if not capabilities.image_input and any(
        not isinstance(part, str) for turn in turns for part in turn.parts
    ):
        raise ModelError(
            f"{name} reads text alone, and this context has frames; leave them out (--frames "
            "none), or ask a model with vision"
        )
    if not capabilities.video_input and any(
        isinstance(part, Video) for turn in turns for part in turn.parts
    ):
        raise ModelError(f"{name} has no video input; give it the video's frames as images")


def refuse_batches(subject: Subject) -> None:
    """Refuse batches where replies are needed at once (UsageError)."""
    if isinstance(subject, BatchModel) and subject.uses_batches:
        subject.close()
        raise UsageError(
            f"{subject.name}: batch=true is for `infthor-eval run`, where replies may come hours "
            "later; leave it out"
        )


def check_chunk(name: str, chunk: Sequence[object]) -> None:
    """Check that the policy of this name gives steps of 7 finite numbers each, at least one."""
    if not chunk:
        raise ModelError(f"{name} gives no movement; a policy gives at least one")
    for step in chunk:
        if not isinstance(step, ArmDelta):
            raise ModelError(f"{name} gives {step!r:.60} for a step; it must be an ArmDelta")
        _check_step(name, step)


def _check_step(name: str, step: ArmDelta) -> None:
    try:
        numbers = (*step.translation, *step.rotation, step.gripper)
        is_whole = (len(step.translation), len(step.rotation)) == (3, 3)
    except TypeError as error:
        raise ModelError(f"{name} gives {step!r:.60} for a step (not of numbers)") from error
    if not is_whole:
        raise ModelError(f"{name} gives {len(numbers)} numbers for a step; it must be {_N_NUMBERS}")
    try:  # not beyond the limit either: a simulator takes metres and radians
        is_finite = all(abs(number) <= MOST for number in numbers)
    except TypeError:
        is_finite = False
    if not is_finite:
        raise ModelError(
            f"{name} gives numbers that are not finite; its weights or its input are broken"
        )


def wrap_adapter_errors(problem: str) -> AbstractContextManager[None]:
    """Turn any error in an adapter's code into an `AdapterError` of one line.

    The line has the place of the error. The error itself, with its traceback, is the cause of the
    `AdapterError`.

    Args:
        problem: the model and what it fails to do, for the message.
    """
    return wrap_user_code(problem, "fix the adapter, or report it", AdapterError)


@contextmanager
def wrap_closing(name: str) -> Iterator[None]:
    """Turn any error of an adapter's `close` into one of one line, also if it does not end.

    Args:
        name: the model, for the message.
    """
    problem = f"{name}: close() fails"
    with wrap_adapter_errors(problem), limit_by(OWN_CODE_SECONDS, problem, AdapterError):
        yield


def wrap_request_errors(name: str) -> AbstractContextManager[None]:
    """Turn any error of an adapter on a request into a failure of this request alone; see
    `wrap_adapter_errors`."""
    return wrap_adapter_errors(f"{name} fails on the request")
