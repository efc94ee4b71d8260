"""The key: out of the environment, into a request's head, and nowhere else."""

import os

from infthor_eval.errors import ModelError

__all__ = ["Secret", "read_key"]

_LEAST = 8  # characters: what is shorter ("EMPTY") keeps no secret, and is found in ordinary words


class Secret:
    """A key that is not shown by accident.

    Attributes:
        value: the key; None where there is none.
    """

    def __init__(self, value: str | None) -> None:
        self.value = value

    def __repr__(self) -> str:
        return "Secret(...)"

    def hidden_in(self, text: str) -> str:
        """A text with the key taken out: a server may say what it was told."""
        if self.value is None or len(self.value) < _LEAST:
            return text
        return text.replace(self.value, "[key]")


def read_key(variable: str, *, needed: bool) -> Secret:
    """The key in an environment variable, whose name is not told either: it may be the key, put there by mistake.

    Args:
        variable: its name.
        needed: whether the server takes nobody without a key.

    Raises:
        ModelError: there is none where one is needed, or it is none that can be sent.
    """
    value = os.environ.get(variable, "").strip()
    if not value:
        if needed:
            raise ModelError("the environment variable that api_key_env names holds no key; set it (OPENAI_API_KEY)")
        return Secret(None)
    if not (value.isascii() and value.isprintable()) or " " in value:
        raise ModelError("the environment variable that api_key_env names holds no key (blanks, or no ASCII); mend it")
    return Secret(value)
