"""Saving and restoring the scene's state, which Unity cannot: generation undoes failed subtasks
without a replay."""

from infthor_sim.actions.registry import action
from infthor_sim.errors import ActionError
from infthor_sim.simulation import Simulation


@action("SaveState", query=True)
def save_state(sim: Simulation, slot: int = 0) -> None:
    """Keep the present state in a slot, in place of an earlier one."""
    sim.save(slot)


@action("RestoreState")
def restore_state(sim: Simulation, slot: int = 0) -> None:
    """Bring back the state kept in a slot; it stays kept."""
    if not sim.restore(slot):
        raise ActionError("There is no saved state of this scene")
