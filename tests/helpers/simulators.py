"""The embedded simulator for the tests of a module."""

from collections.abc import Iterator

import pytest

from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

__all__ = ["simulator"]


@pytest.fixture(scope="module")
def simulator() -> Iterator[Simulator]:
    """A simulator of its own for a module's tests."""
    with Simulator(embedded_launch()) as simulator:
        yield simulator
