"""All that the contract checks find, where an author wants to see it together."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import cast

from infthor_eval.errors import InfthorError, describe_exception
from model_adapters.check.clauses import ContractError, frames_of_one_colour
from model_adapters.check.model import model_checks
from model_adapters.check.policy import policy_checks
from model_adapters.protocols import Model, Policy

__all__ = ["CheckResult", "run_checks"]

_FIRST = "members"  # without them nothing else can be asked


@dataclass(frozen=True)
class CheckResult:
    """What came of one check.

    Attributes:
        about: what it is about, a word.
        broken: the clause that does not hold, or what the adapter raised; None where all is well.
    """

    about: str
    broken: str | None


def run_checks(adapter: Model | Policy, frame_size: tuple[int, int] = (300, 300)) -> Iterator[CheckResult]:
    """Check an adapter as `check_adapter` and `check_policy` do, going on behind a broken clause.

    What acts is taken for a policy, anything else for a model. Where a member is missing nothing else is checked.

    Args:
        adapter: what to check; it stays open.
        frame_size: width and height of the frames to show it, in pixels.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        if hasattr(adapter, "act"):
            checks = policy_checks(cast(Policy, adapter), black, white)
        else:
            checks = model_checks(adapter, black, white)
        for about, check in checks.items():
            broken = _broken(check)
            yield CheckResult(about, broken)
            if broken is not None and about == _FIRST:
                return


def _broken(check: Callable[[], None]) -> str | None:
    try:
        check()
    except ContractError as error:
        return str(error)
    except InfthorError as error:
        return f"it raises {type(error).__name__}: {error}"
    except Exception as error:  # noqa: BLE001 - an adapter is anybody's code, and what it raises is the finding
        return f"it raises {describe_exception(error)}"
    return None
