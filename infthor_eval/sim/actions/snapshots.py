"""Keeping a state and coming back to it, which Unity cannot: generation discards what fails and repeats nothing."""

from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []


@action("SaveState", query=True)
def save_state(sim: Simulation) -> None:
    """Keeps the present state; an earlier one is forgotten."""
    sim.save()


@action("RestoreState")
def restore_state(sim: Simulation) -> None:
    """Brings the kept state back; it stays kept."""
    if not sim.restore():
        raise ActionError("There is no saved state of this scene")
