"""Errors: those for people, and refused actions with AI2-THOR's error codes."""

from enum import StrEnum

_LONGEST_REASON = 200  # characters of another library's message
# characters of a message of ours, and of its ends if it is longer
_LONGEST = 1000
_HEAD = 650
_TAIL = 300
_LINE_BREAKS = {
    ord(letter): repr(letter)[1:-1] for letter in "\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"
}


class SimulatorError(Exception):
    """Base of all errors that a command prints as one line, without a traceback.

    Messages quote what is in files and messages, and that may be anything: line breaks are escaped,
    and the middle of a very long message is left out.

    Attributes:
        exit_code: of the process that the error ends.
    """

    exit_code = 1

    def __init__(self, message: str) -> None:
        line = message.translate(_LINE_BREAKS)
        super().__init__(line if len(line) <= _LONGEST else f"{line[:_HEAD]} [...] {line[-_TAIL:]}")


class UsageError(SimulatorError):
    """A command or an environment variable was misused."""

    exit_code = 2


class DataError(SimulatorError):
    """A file is missing or malformed, or a scene is unknown; the message names it."""

    exit_code = 2


def in_one_line(error: BaseException) -> str:
    """Return another library's message as one line, short enough to be part of our message."""
    reason = error.strerror if isinstance(error, OSError) else None  # `str` would repeat the path
    text = " ".join((reason or str(error)).split()) or type(error).__name__
    if isinstance(error, KeyError):  # its text is only the key
        text = f"no {text}"
    return text if len(text) <= _LONGEST_REASON else text[: _LONGEST_REASON - 3] + "..."


class ErrorCode(StrEnum):
    """`errorCode` of AI2-THOR's metadata; the client raises ValueError on the first four."""

    INVALID_ACTION = "InvalidAction"
    MISSING_ARGUMENTS = "MissingArguments"
    AMBIGUOUS_ACTION = "AmbiguousAction"
    INVALID_ARGUMENT = "InvalidArgument"
    LOOK_UP_LIMIT = "LookUpCantExceedMax"
    LOOK_DOWN_LIMIT = "LookDownCantExceedMin"
    INVENTORY_FULL = "InventoryFull"
    NOT_PICKUPABLE = "ObjectNotPickupable"
    NOT_VISIBLE = "ObjectNotVisible"
    NOT_IN_INVENTORY = "ObjectNotInInventory"
    NOT_ALLOWED = "ObjectNotAllowedInReceptacle"
    RECEPTACLE_CLOSED = "ReceptacleNotOpen"
    RECEPTACLE_FULL = "ReceptacleFull"
    NONE = ""


class ActionError(Exception):
    """A refused action: its reply has `lastActionSuccess` false, this message and code."""

    def __init__(self, message: str, code: ErrorCode = ErrorCode.NONE) -> None:
        super().__init__(message)
        self.message = message
        self.code = code
