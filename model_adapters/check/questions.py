"""Questions that the checks ask, and the comparison of replies."""

from model_adapters.protocols import Conversation, Decoding, Model, Part, Reply

__all__ = ["GREEDY", "NEW_TOKENS", "QUESTION", "ask", "same_reply", "start_conversation"]

NEW_TOKENS = 8
GREEDY = Decoding(max_new_tokens=NEW_TOKENS)
QUESTION = "\nQuestion: What do you see? Answer with a single word."


def start_conversation(model: Model, *parts: Part) -> Conversation:
    """Return a new conversation with a user turn of these parts."""
    conversation = model.conversation()
    conversation.append(*parts)
    return conversation


def ask(model: Model, *parts: Part, decoding: Decoding = GREEDY) -> Reply:
    """Return the reply to a user turn of these parts in a new conversation."""
    return start_conversation(model, *parts).reply(decoding)


def same_reply(one: Reply, other: Reply) -> bool:
    """Return whether text and token ids of two replies are equal."""
    return (one.text, one.token_ids) == (other.text, other.token_ids)
