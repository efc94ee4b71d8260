"""The result of a check, as `doctor` prints it."""

from typing import Literal

import msgspec

__all__ = ["Check"]


class Check(msgspec.Struct, frozen=True):
    """The result of one check.

    Attributes:
        name: what is checked.
        state: "ok"; "optional" if it is missing and only some uses need it; "wrong" if every use
            needs it.
        detail: what is installed, or what is missing.
        hint: how to fix it; empty if there is nothing to fix.
    """

    name: str
    state: Literal["ok", "optional", "wrong"]
    detail: str
    hint: str = ""
