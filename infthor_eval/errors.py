"""Errors meant for people.

Every message is one line that says what is wrong, where, and how to fix it. The command line prints it without a
traceback and exits with the error's `exit_code`.
"""

import difflib
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = [
    "DataError",
    "InfthorError",
    "ModelError",
    "SceneError",
    "SimulatorError",
    "UsageError",
    "describe_exception",
    "in_one_line",
    "unknown_name",
    "wrap_errors",
]

_LONGEST = 200  # characters of another library's message


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


class SceneError(SimulatorError):
    """The simulator has no such scene, or refuses it; another try would end the same way."""


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


def in_one_line(error: BaseException) -> str:
    """What an error of another library says, short enough to stand within a message of ours."""
    reason = error.strerror if isinstance(error, OSError) else None
    said = " ".join((reason or str(error)).split()) or type(error).__name__
    if isinstance(error, KeyError):  # whose text is the key alone
        said = f"no {said}"
    return said if len(said) <= _LONGEST else said[: _LONGEST - 3] + "..."


def describe_exception(error: Exception) -> str:
    """What a programming error is, where, and what it says."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(place.filename).name}:{place.lineno} ({place.name})"
    return f"{type(error).__name__} in {where}: {in_one_line(error)}"


@contextmanager
def wrap_errors(
    problem: str,
    hint: str,
    *,
    catch: type[BaseException] | tuple[type[BaseException], ...] = OSError,
    raise_as: type[InfthorError] = DataError,
) -> Iterator[None]:
    """Turn errors of another library, or of the system, into a one-line error for people; ours pass unchanged.

    Args:
        problem: what is wrong, and where ("set.json: not JSON").
        hint: how to fix it.
        catch: the errors to convert.
        raise_as: the class to convert them to.

    Raises:
        InfthorError: an instance of `raise_as`, with the message "PROBLEM (REASON); HINT".
    """
    try:
        yield
    except InfthorError:
        raise
    except catch as error:
        raise raise_as(f"{problem} ({in_one_line(error)}); {hint}") from error
