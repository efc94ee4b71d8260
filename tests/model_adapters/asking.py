"""Short ways to say how and what tests ask."""

from typing import Any

from model_adapters import Decoding, Part, Turn

__all__ = ["up_to", "user"]


def up_to(n: int, **settings: Any) -> Decoding:
    """Decoding of at most so many tokens."""
    return Decoding(max_new_tokens=n, **settings)


def user(*parts: Part) -> tuple[Turn, ...]:
    """A conversation of one user turn."""
    return (Turn("user", parts),)
