"""Failures of actions, with AI2-THOR's error codes."""

from enum import StrEnum

__all__ = ["ActionError", "ErrorCode"]


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
    """An action that the world refuses: the reply has `lastActionSuccess` false and this message
    and code."""

    def __init__(self, message: str, code: ErrorCode = ErrorCode.NONE) -> None:
        super().__init__(message)
        self.message = message
        self.code = code
