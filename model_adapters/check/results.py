"""Results of checks of anybody's code."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from infthor_eval.errors import STOPS, InfthorError, describe_exception
from model_adapters.check.clauses import ContractError

MEMBERS = "members"  # the check that all others need


@dataclass(frozen=True)
class CheckResult:
    """Result of one check.

    Attributes:
        name: name of the check, a word.
        violation: the clause that does not hold, or the error that the checked code raised; None if
            the check passes.
    """

    name: str
    violation: str | None


def run_each(checks: Mapping[str, Callable[[], None]]) -> Iterator[CheckResult]:
    """Run checks by name, also after a violation; only a missing member ends them."""
    for name, check in checks.items():
        violation = _violation(check)
        yield CheckResult(name, violation)
        if violation is not None and name == MEMBERS:
            return


def _violation(check: Callable[[], None]) -> str | None:
    try:
        check()
    except ContractError as error:
        return str(error)
    except InfthorError as error:
        return f"it raises {type(error).__name__}: {error}"
    except STOPS:
        raise
    except BaseException as error:  # noqa: BLE001 - anybody's code; its error is the result
        return f"it raises {describe_exception(error)}"
    return None
