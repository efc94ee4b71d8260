"""Keeping a state and coming back to it, which Unity cannot: generation discards what fails and repeats nothing."""

from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []


@action("SaveState", query=True)
def save_state(sim: Simulation, slot: int = 0) -> None:
    """Keep the present state; an earlier one of the same slot is forgotten."""
    sim.save(slot)


@action("RestoreState")
def restore_state(sim: Simulation, slot: int = 0) -> None:
    """Bring the state kept in a slot back; it stays kept."""
    if not sim.restore(slot):
        raise ActionError("There is no saved state of this scene")
