"""The contract of models and their conversations."""

from model_adapters.check.claims import check_choices, check_flight, check_sampling
from model_adapters.check.clauses import check_identity, check_members, frames_of_one_colour
from model_adapters.check.conversation import check_counts, check_marks, check_parts, check_turns
from model_adapters.check.replies import check_continuations, check_frames, check_reply, check_sharing
from model_adapters.protocols import Conversation, Model

__all__ = ["check_adapter"]


def check_adapter(model: Model, frame_size: tuple[int, int] = (300, 300)) -> None:
    """Check a model against the contract of `Model` and `Conversation`, as far as its capabilities go.

    It makes a few dozen short replies on frames of one colour.

    Args:
        model: the adapter to check; it stays open.
        frame_size: width and height of the frames to show it, in pixels.

    Raises:
        ContractError: names the clause that does not hold.
    """
    check_members(model, Model)
    check_members(model.conversation(), Conversation)
    check_identity(model)
    with frames_of_one_colour(frame_size) as (black, white):
        check_parts(model, black)
        check_counts(model, black)
        check_marks(model, black)
        check_reply(model, black)
        check_turns(model, black)
        check_frames(model, black, white)
        check_sharing(model, black, white)
        check_continuations(model, black, white)
        check_sampling(model, black)
        check_choices(model, black)
        check_flight(model, black, white)
