"""Short ways to say how and what tests ask."""

from typing import Any

from model_adapters import Decoding, Part, Reply, Turn, load
from model_adapters.hf.prompting.prompt import token_ids

__all__ = ["ask", "load_saved", "load_with", "require_same", "talk_of", "up_to", "user"]


def load_with(name: str, **options: object) -> Any:
    """A model or policy with these options, whose values need not be texts."""
    return load(name, {option: str(value) for option, value in options.items()}, 0)


def load_saved(name: str, folder: object, **options: object) -> Any:
    """The model of a checkpoint in a folder, on the CPU."""
    return load_with(name, **{"pretrained": folder, "device": "cpu", **options})


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


def ask(model: Any, *parts: Part, new: int = 4, **settings: Any) -> Reply:
    """The reply of at most so many tokens to one user turn."""
    reply: Reply = talk_of(model, user(*parts)).reply(up_to(new, **settings))
    return reply


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
