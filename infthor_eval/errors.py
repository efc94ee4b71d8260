"""Errors meant for people.

Every message is one line that says what is wrong, where, and the mend. The command line prints it without a
traceback and exits with the error's `exit_code`.
"""

__all__ = ["DataError", "InfthorError", "ModelError", "SimulatorError", "UsageError"]


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
