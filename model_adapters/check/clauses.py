"""What the checks of models and of policies have in common."""

import json
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Generic, Protocol

from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters.protocols import Model, Policy

__all__ = ["ContractError", "check_identity", "check_members", "frames_of_one_colour", "raises", "require"]


class ContractError(AssertionError):
    """An adapter broke a clause of its protocol; the message says which."""


def require(holds: bool, clause: str) -> None:
    """Have a clause hold.

    Raises:
        ContractError: it does not.
    """
    if not holds:
        raise ContractError(clause)


def raises(error_type: type[Exception], call: Callable[..., Any], *args: Any, **kwargs: Any) -> bool:
    """Whether a call raises such an error."""
    try:
        call(*args, **kwargs)
    except error_type:
        return True
    return False


def check_members(found: object, protocol: type) -> None:
    """Check that an object has all that a protocol has, without asking for any of it.

    Raises:
        ContractError: names what is missing.
    """
    bases = [base for base in protocol.__mro__ if base not in (Protocol, Generic, object)]
    names = {name for base in bases for name in vars(base) if not name.startswith("_")}
    missing = sorted(names - set(dir(found)))
    require(not missing, f"{type(found).__name__} lacks a member of {protocol.__name__}: {', '.join(missing)}")


def check_identity(adapter: Model | Policy) -> None:
    """Check name, identity and capabilities.

    Raises:
        ContractError: names the clause that does not hold.
    """
    identity = adapter.identity()
    try:
        again = json.loads(json.dumps(identity))
    except TypeError as error:
        raise ContractError(f"identity() is not made of JSON values: {error}") from error
    require(again == identity, "identity() changes when written as JSON and read back")
    require(adapter.identity() == identity, "identity() differs from call to call")
    require(bool(adapter.name), "the name is empty")
    able = adapter.capabilities
    require(able.batch_size >= 1, "batch_size is below 1")
    require(able.max_in_flight >= 1, "max_in_flight is below 1")


@contextmanager
def frames_of_one_colour(size: tuple[int, int]) -> Iterator[tuple[FrameRef, FrameRef]]:
    """A black frame and a white one of this width and height, for as long as they are needed."""
    with tempfile.TemporaryDirectory() as folder:
        yield _frame(Path(folder), "black", size), _frame(Path(folder), "white", size)


def _frame(folder: Path, colour: str, size: tuple[int, int]) -> FrameRef:
    path = folder / f"{colour}.png"
    Image.new("RGB", size, colour).save(path)
    return FrameRef(path)
