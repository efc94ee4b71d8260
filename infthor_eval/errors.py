"""Errors meant for people.

Every message is one line that says what is wrong, where, and how to fix it. The command line prints
it without a traceback and exits with the error's `exit_code`.

To add an error that a user may meet: one of these classes, and a row in `tests/faults/`.

To add a library's error as one line: `with wrap_errors(...)` around the call.
"""

import difflib
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

_LONGEST = 200  # characters of another library's message
# characters of a message of ours, and of its ends if it is longer
_LONGEST_MESSAGE = 1000
_HEAD = 650
_TAIL = 300
_LINE_BREAKS = {
    ord(letter): repr(letter)[1:-1] for letter in "\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"
}


class InfthorError(Exception):
    """Base of all errors that the command line shows as one line.

    Messages quote what is in files and replies, and that may be anything: line breaks and lone
    surrogates are escaped, and the middle of a very long message is left out.
    """

    exit_code = 2

    def __init__(self, message: str) -> None:
        line = _as_unicode(message.translate(_LINE_BREAKS))
        super().__init__(
            line if len(line) <= _LONGEST_MESSAGE else f"{line[:_HEAD]} [...] {line[-_TAIL:]}"
        )


class UsageError(InfthorError):
    """The command was misused: an unknown name, or options that do not fit together."""


class DataError(InfthorError):
    """A file is missing or not of its documented form; the message names the file and the place."""


class ModelError(InfthorError):
    """A model cannot be loaded, or cannot do what is required of it."""


class NotAskedError(ModelError):
    """A model was not asked, by the user's own wish (a cap is reached): no fault, and no result."""


class UserCodeError(InfthorError):
    """Code that is not this package's raised an unexpected exception, the cause of this one."""


class AdapterError(UserCodeError, ModelError):
    """A model adapter raised an unexpected exception."""


class SimulatorError(InfthorError):
    """The simulator cannot be started, died, hung, or sent something that is not its protocol."""

    exit_code = 1


class SceneError(SimulatorError):
    """The simulator has no such scene or refuses it; a retry would end the same way."""


class Terminated(SystemExit):
    """SIGTERM arrived: temporary folders and simulators are removed as on Ctrl-C."""


class OutputClosed(SystemExit):
    """Nobody reads standard output any more: `infthor-eval ls tasks | head` has its lines."""


# What ends the program from outside. Whoever catches whatever code of others raises (it may call
# `sys.exit`) lets these pass.
STOPS = (KeyboardInterrupt, Terminated, OutputClosed)


def unknown_name(what: str, name: str, known: Iterable[str]) -> UsageError:
    """Return the error for an unknown name of a kind ("task"); it suggests the closest, or all."""
    names = sorted(known)
    longer = [each for each in names if name and each.startswith(name)]
    near = longer or difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(names)}"
    return UsageError(f"unknown {what} {name!r}; {hint}")


def in_one_line(error: BaseException) -> str:
    """Return another library's error message as one line, short enough for one of ours."""
    reason = error.strerror if isinstance(error, OSError) else None  # `str` would repeat the path
    text = _as_unicode(" ".join((reason or _text_of(error)).split())) or type(error).__name__
    if isinstance(error, KeyError):  # its text is only the key
        text = f"no {text}"
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def _text_of(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:  # noqa: BLE001 - of a class of others, whose text may fail too
        return ""


def _as_unicode(text: str) -> str:
    """Return a text that files and terminals take: lone surrogates are escaped."""
    return text.encode("utf-8", "backslashreplace").decode()


def describe_exception(error: BaseException) -> str:
    """Return type, place and message of an unexpected exception, in one line."""
    if isinstance(error, SyntaxError) and error.filename:  # of what was to be imported
        return f"{type(error).__name__} in {Path(error.filename).name}:{error.lineno}: {error.msg}"
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(frame.filename).name}:{frame.lineno} ({frame.name})"
    return f"{type(error).__name__} in {where}: {in_one_line(error)}"


@contextmanager
def wrap_errors(
    problem: str,
    hint: str | Callable[[BaseException], str],
    *,
    catch: type[BaseException] | tuple[type[BaseException], ...] = OSError,
    raise_as: type[InfthorError] = DataError,
) -> Iterator[None]:
    """Turn errors of a library or the system into one-line errors; our own pass unchanged.

    Args:
        problem: the problem and its place ("set.json: not JSON").
        hint: the way to fix it; a function if that depends on the error.

    Raises:
        InfthorError: an instance of `raise_as`, with the message "PROBLEM (REASON); HINT".
    """
    try:
        yield
    except InfthorError:
        raise
    except catch as error:
        remedy = hint if isinstance(hint, str) else hint(error)
        raise raise_as(f"{problem} ({in_one_line(error)}); {remedy}") from error


@contextmanager
def wrap_user_code(
    problem: str, hint: str, raise_as: type[UserCodeError] = UserCodeError
) -> Iterator[None]:
    """Turn whatever code of others raises into an error of one line, with its place; ours pass.

    `sys.exit` in it is an error like any other: it must not end a run, nor choose the exit code.
    A generator may not yield to its reader within the context: to close it raises in it, too.

    Args:
        problem: the code and what it fails to do ("the memory NAME fails").
        hint: the way to fix it.

    Raises:
        UserCodeError: an instance of `raise_as`; its cause is what was raised.
    """
    try:
        yield
    except (InfthorError, *STOPS):
        raise
    except BaseException as error:
        raise raise_as(f"{problem} ({describe_exception(error)}); {hint}") from error
