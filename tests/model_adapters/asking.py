"""Short ways to say how and what tests ask."""

from typing import Any

from model_adapters import Decoding, Part, Turn
from model_adapters.hf.prompting.prompt import token_ids

__all__ = ["require_same", "talk_of", "up_to", "user"]


def up_to(n: int, **settings: Any) -> Decoding:
    """Decoding of at most so many tokens."""
    return Decoding(max_new_tokens=n, **settings)


def user(*parts: Part) -> tuple[Turn, ...]:
    """A conversation of one user turn."""
    return (Turn("user", parts),)


def talk_of(model: Any, turns: tuple[Turn, ...]) -> Any:
    """A conversation of some turns."""
    talk = model.conversation()
    for turn in turns:
        talk.append(*turn.parts, role=turn.role)
    return talk


def require_same(
    model: Any, turns: tuple[Turn, ...], ids: list[int], reply: list[int], n_new: int
) -> None:
    """A model of `hf` reads these ids from the turns, and replies what is given, up to where it
    ends its turn."""
    talk = talk_of(model, turns)
    assert talk.n_tokens == len(ids)
    assert not hasattr(model, "pieces") or list(token_ids(model.pieces(turns))) == ids
    answer = list(talk.reply(up_to(n_new)).token_ids)
    assert answer == reply[: len(answer)]
    assert reply[len(answer) :] == [] or reply[len(answer)] in model._loaded.generation.end_ids
