"""Which objects replies list: all, or some."""

from infthor_sim.actions.registry import action
from infthor_sim.simulation import Simulation


@action("SetObjectFilter")
def set_object_filter(sim: Simulation, objectIds: list[str]) -> None:
    """Leave all objects but these out of the metadata; the world stays as it is."""
    sim.object_filter = frozenset(objectIds)


@action("ResetObjectFilter")
def reset_object_filter(sim: Simulation) -> None:
    """List all objects again."""
    sim.object_filter = None
