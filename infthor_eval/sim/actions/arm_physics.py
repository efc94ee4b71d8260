# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""What scripts for ManipulaTHOR say about physics: nothing moves between actions here, so most is done already."""

from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []

_ARMS = ("arm", "stretch")
_LONGEST = 0.05  # seconds of one step of Unity's physics


@action("PausePhysicsAutoSim", "UnpausePhysicsAutoSim", "MakeAllObjectsMoveable", modes=_ARMS)
def leave_physics(sim: Simulation) -> None:
    """Nothing: things lie still, and loose things give way to the arm."""


@action("AdvancePhysicsStep", modes=_ARMS)
def advance_physics(
    sim: Simulation, timeStep: float = 0.02, simSeconds: float | None = None, allowAutoSimulation: bool = False
) -> None:
    """Nothing: what was let go has fallen."""
    if not 0 < timeStep <= _LONGEST:
        raise ActionError(
            "Please use a timeStep between 0.0 and 0.05. Larger timeSteps produce inconsistent simulation results."
        )


@action("MakeObjectsOfTypeUnbreakable", modes=_ARMS)
def make_unbreakable(sim: Simulation, objectType: str) -> None:
    """Things of a type survive every fall from now on."""
    sim.world.unbreakable.add(objectType)
