"""How the checks ask a model, and when two replies are the same."""

from model_adapters.protocols import Conversation, Decoding, Model, Part, Reply

__all__ = ["GREEDY", "NEW_TOKENS", "QUESTION", "ask", "opened", "same"]

NEW_TOKENS = 8
GREEDY = Decoding(max_new_tokens=NEW_TOKENS)
QUESTION = "\nQuestion: What do you see? Answer with a single word."


def opened(model: Model, *parts: Part) -> Conversation:
    """A new conversation with a user turn of these parts."""
    talk = model.conversation()
    talk.append(*parts)
    return talk


def ask(model: Model, *parts: Part, decoding: Decoding = GREEDY) -> Reply:
    """The reply of a new conversation to a user turn of these parts."""
    return opened(model, *parts).reply(decoding)


def same(one: Reply, other: Reply) -> bool:
    """Whether text and ids are equal."""
    return (one.text, one.token_ids) == (other.text, other.token_ids)
