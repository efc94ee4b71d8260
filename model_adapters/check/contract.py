"""The contract of models and policies, checked up to the first violation or as a whole."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import cast

from infthor_eval.errors import InfthorError, describe_exception
from infthor_eval.formats.frames import FrameRef
from model_adapters.check.clauses import ContractError, frames_of_one_colour
from model_adapters.check.model import model_checks
from model_adapters.check.policy import policy_checks
from model_adapters.protocols import Model, Policy

__all__ = ["CheckResult", "check_adapter", "run_checks"]

_MEMBERS = "members"


@dataclass(frozen=True)
class CheckResult:
    """Result of one check.

    Attributes:
        name: name of the check, a word.
        violation: the clause that does not hold, or the error that the adapter raised; None if the check passes.
    """

    name: str
    violation: str | None


def check_adapter(adapter: Model | Policy, frame_size: tuple[int, int] = (300, 300)) -> None:
    """Check a model or a policy against its contract, as far as its capabilities go.

    The adapter answers a few dozen short questions on frames of one colour.

    Args:
        adapter: the adapter to check; it is not closed.
        frame_size: width and height of the frames, in pixels.

    Raises:
        ContractError: a clause does not hold; the message names it.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        for check in _checks(adapter, black, white).values():
            check()


def run_checks(adapter: Model | Policy, frame_size: tuple[int, int] = (300, 300)) -> Iterator[CheckResult]:
    """Run all checks of `check_adapter`, also after a violation; only a missing member ends them.

    Args:
        adapter: the adapter to check; it is not closed.
        frame_size: width and height of the frames, in pixels.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        for name, check in _checks(adapter, black, white).items():
            violation = _violation(check)
            yield CheckResult(name, violation)
            if violation is not None and name == _MEMBERS:  # nothing else can be checked without them
                return


def _checks(adapter: Model | Policy, black: FrameRef, white: FrameRef) -> dict[str, Callable[[], None]]:
    if hasattr(adapter, "act"):
        return policy_checks(cast(Policy, adapter), black, white)
    return model_checks(adapter, black, white)


def _violation(check: Callable[[], None]) -> str | None:
    try:
        check()
    except ContractError as error:
        return str(error)
    except InfthorError as error:
        return f"it raises {type(error).__name__}: {error}"
    except Exception as error:  # noqa: BLE001 - an adapter is anybody's code, and its error is the result
        return f"it raises {describe_exception(error)}"
    return None
