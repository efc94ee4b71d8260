"""Retrying work for which the simulator failed for good."""

from collections.abc import Callable
from typing import TypeVar

from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.thor.simulator import Simulator

T = TypeVar("T")
_MAX_TRIES = 3


def with_retries(
    simulator: Simulator, do: Callable[[], T], reset: Callable[[], None]
) -> tuple[T, tuple[str, ...]]:
    """Do something, and retry it in a fresh process if the simulator fails.

    The simulator itself survives the loss of its process by repeating the actions since the last
    mark. It gives up if these end otherwise than before, or if it is lost again and again; then
    only the whole work can be done again.

    Args:
        reset: drops everything that was built in the failed process.

    Returns:
        The result, and the faults on the way: errors of the simulator, and restarts that it
        survived itself.
    """
    faults: list[str] = []
    while True:
        restarts = simulator.restarts
        try:
            result = do()
        except SceneError:
            raise
        except SimulatorError as error:
            reset()
            faults.append(str(error))
            if len(faults) == _MAX_TRIES:
                raise
        else:
            if simulator.restarts > restarts:
                faults.append(f"simulator started again: {simulator.restarts - restarts}")
            return result, tuple(faults)
