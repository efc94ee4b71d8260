"""What replies tell of: all objects, or some."""

from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []


@action("SetObjectFilter")
def set_object_filter(sim: Simulation, objectIds: list[str]) -> None:
    """Leave out of the metadata all objects but these; the world stays as it is."""
    sim.told = frozenset(objectIds)


@action("ResetObjectFilter")
def reset_object_filter(sim: Simulation) -> None:
    """Tell of all objects again."""
    sim.told = None
