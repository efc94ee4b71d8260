"""The true states from which arms act: before each pick-up and put of an expert's trajectory."""

from dataclasses import dataclass

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import LowAction, Trajectory
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.thor.actions import object_type_of
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.recorded import MissingObjectError, translate
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView

__all__ = ["Errand", "History", "ManipulationKind", "Moment", "UnfitEpisodeError", "errands_of", "history_of"]


class UnfitEpisodeError(DataError):
    """Nobody can act in an episode here, so it counts for nobody."""


_KINDS = {"PickupObject": ManipulationKind.PICKUP, "PutObject": ManipulationKind.PUT}


@dataclass(frozen=True)
class Errand:
    """One pick-up or put of a trajectory.

    Attributes:
        index: of the expert's low-level action.
        kind: which of the two.
        object_type: what is picked up or put.
        receptacle_type: where to; None of pick-ups.
    """

    index: int
    kind: ManipulationKind
    object_type: str
    receptacle_type: str | None = None


@dataclass(frozen=True)
class Moment:
    """The true state before an errand.

    Attributes:
        view: the world then.
        object_id: what is to be picked up or put, as this simulator names it.
        receptacle_id: where to, likewise; None of pick-ups.
    """

    view: SimulatorView
    object_id: str
    receptacle_id: str | None = None


@dataclass(frozen=True)
class History:
    """What the expert did, as far as this simulator carried it out.

    Attributes:
        moments: by the low-level action that follows.
        refusal: why there are no more; empty where there are all.
    """

    moments: dict[int, Moment]
    refusal: str = ""

    def moment(self, errand: Errand) -> Moment:
        """The state before an errand.

        Raises:
            UnfitEpisodeError: this simulator refuses an action of the expert before its end.
        """
        found = self.moments.get(errand.index)
        if found is None:
            raise UnfitEpisodeError(self.refusal)
        return found


def errands_of(trajectory: Trajectory) -> list[Errand]:
    """The pick-ups and puts of a trajectory, in time order."""
    numbered = enumerate(trajectory.plan.low_actions)
    return [_errand(number, low) for number, low in numbered if low.api_action.action in _KINDS]


def _errand(number: int, low: LowAction) -> Errand:
    recorded = low.api_action
    if recorded.object_id is None or (recorded.action == "PutObject" and recorded.receptacle_id is None):
        raise DataError(f"action {number} ({recorded.action}) names no object; restore the file")
    receptacle = None if recorded.receptacle_id is None else object_type_of(recorded.receptacle_id)
    kind = _KINDS[recorded.action]
    where = receptacle if kind == ManipulationKind.PUT else None
    return Errand(number, kind, object_type_of(recorded.object_id), where)


def history_of(trajectory: Trajectory, simulator: Simulator) -> History:
    """Carry out the expert's actions, and keep the state before each pick-up and put that succeeds.

    Args:
        trajectory: whose expert is the truth.
        simulator: of AI2-THOR's default agent; it ends where the trajectory does.

    Raises:
        SceneError: the simulator has no such scene.
        SimulatorError: the simulator fails.
    """
    restore(simulator, trajectory.scene)
    grounding = Grounding(simulator.view)
    moments: dict[int, Moment] = {}
    for number, low in enumerate(trajectory.plan.low_actions):
        before = simulator.view
        try:
            call = translate(low, grounding, before)
        except MissingObjectError as error:
            return History(moments, _refusal(number, low, str(error)))
        after = simulator.step(**call)
        if not after.success:
            return History(moments, _refusal(number, low, after.error or "refused without a message"))
        if low.api_action.action in _KINDS:
            moments[number] = _moment(low, before, call["objectId"])
    return History(moments)


def _moment(low: LowAction, before: SimulatorView, named: str) -> Moment:
    if low.api_action.action == "PickupObject":
        return Moment(before, named)
    return Moment(before, before.inventory[0], named)


def _refusal(number: int, low: LowAction, why: str) -> str:
    return f"the expert's action {number} ({low.api_action.action}) is refused here: {why}"
