"""Errors meant for people.

Every message is one line that says what is wrong, where, and the mend. The command line prints it without a
traceback and exits with the error's `exit_code`.
"""

import difflib
from collections.abc import Iterable

__all__ = ["DataError", "InfthorError", "ModelError", "SimulatorError", "UsageError", "unknown_name"]


class InfthorError(Exception):
    """Base of all errors that the command line shows as one line."""

    exit_code = 2


class UsageError(InfthorError):
    """The command was misused: an unknown name, an option that does not fit."""


class DataError(InfthorError):
    """A file is missing or does not have the documented form; the message names the file and the place in it."""


class ModelError(InfthorError):
    """A model cannot be loaded, or cannot do what is asked of it."""


class SimulatorError(InfthorError):
    """The simulator cannot be started, died, hung, or answered with something that is not its protocol."""

    exit_code = 1


def unknown_name(what: str, name: str, known: Iterable[str]) -> UsageError:
    """The error of a name that there is not: with the nearest known one, or all of them.

    Args:
        what: what it should name ("task").
        name: as typed.
        known: the names that there are.
    """
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(names)}"
    return UsageError(f"unknown {what} {name!r}; {hint}")
