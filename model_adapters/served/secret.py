"""The API key: read from the environment, sent in a request's header, shown nowhere."""

import os

from infthor_eval.errors import ModelError

_LEAST = 8  # characters; a shorter value ("EMPTY") is not secret and may be part of ordinary words


class Secret:
    """A key that cannot be shown by accident, or None."""

    def __init__(self, value: str | None) -> None:
        self.value = value

    def __repr__(self) -> str:
        return "Secret(...)"

    def redact(self, text: str) -> str:
        """Return a text without the key; servers may repeat it in messages."""
        if self.value is None or len(self.value) < _LEAST:
            return text
        return text.replace(self.value, "[key]")


def read_key(variable: str, *, usual: str, needed: bool) -> Secret:
    """Return the key in an environment variable; `needed` says that the server requires one.

    `usual` is the variable's name unless a user gives another.

    Messages do not repeat the name of the variable: it may be the key, given by mistake.
    """
    value = os.environ.get(variable, "").strip()
    if not value:
        if needed:
            raise ModelError(
                f"the environment variable that api_key_env names holds no key; set it ({usual})"
            )
        return Secret(None)
    if not (value.isascii() and value.isprintable()) or " " in value:
        raise ModelError(
            "the environment variable that api_key_env names holds no key (blanks, or not ASCII); "
            "fix it"
        )
    return Secret(value)
