"""Printing the results of checks of anybody's code."""

from collections.abc import Iterable

from infthor_eval.terminal import print_line
from model_adapters.check import CheckResult

__all__ = ["print_checks"]


def print_checks(name: str, results: Iterable[CheckResult]) -> int:
    """Print a line for each result and one for all; return the exit code, 1 if a clause is
    broken."""
    n_broken = 0
    for result in results:
        verdict = "holds" if result.violation is None else "broken"
        print_line(f"{verdict:8}{result.name:16}{result.violation or ''}".rstrip())
        n_broken += result.violation is not None
    print_line(f"{name}: {f'{n_broken} broken' if n_broken else 'keeps the contract'}")
    return int(n_broken > 0)
