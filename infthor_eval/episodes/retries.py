"""Doing something again where the simulator failed for good."""

from collections.abc import Callable
from typing import TypeVar

from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.thor.simulator import Simulator

__all__ = ["with_retries"]

T = TypeVar("T")
_TRIALS = 3


def with_retries(
    simulator: Simulator, do: Callable[[], T], begin_anew: Callable[[], None]
) -> tuple[T, tuple[str, ...]]:
    """What comes of something, tried again in a fresh process where the simulator fails.

    Args:
        simulator: what it is done in; failures that it mends by itself are told too.
        do: what is done.
        begin_anew: forgets what was made in the failed process.

    Returns:
        What came of it, and the simulator's faults on the way.

    Raises:
        SceneError: the simulator has no such scene; another try would end the same way.
        SimulatorError: it failed every time.
    """
    faults: list[str] = []
    while True:
        restarts = simulator.restarts
        try:
            made = do()
        except SceneError:
            raise
        except SimulatorError as error:
            begin_anew()
            faults.append(str(error))
            if len(faults) == _TRIALS:
                raise
        else:
            if simulator.restarts > restarts:
                faults.append(f"simulator started again: {simulator.restarts - restarts}")
            return made, tuple(faults)
