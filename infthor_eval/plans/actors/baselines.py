"""Baselines that see no frame: the expert, chance, a script, habits of experts, recall of the log.

To add a baseline of agents: a class in `BASELINES` here, and its name in `infthor_eval/suites.py`.
"""

import random
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.affordances import KNOWN_TYPES
from infthor_eval.plans.actors.habits import Habits
from infthor_eval.plans.actors.protocols import Act, PlanActor, PlanBaseline, PlanSituation
from infthor_eval.plans.actors.script import read_plan, scripted_action
from infthor_eval.plans.environment import PlanEnvironment, StepOutcome
from infthor_eval.plans.history.clue_steps import object_logs
from infthor_eval.runs.suite import BaselineSubject
from infthor_eval.thor.actions import applicable_calls
from infthor_eval.thor.view import SimulatorView, ThorObject
from model_adapters import Capabilities

_IN_FLIGHT = 4  # trajectories at a time; each has its own simulator


class _PlanBaseline(BaselineSubject):
    capabilities = Capabilities(counts_tokens=False, token_ids=False, max_in_flight=_IN_FLIGHT)
    _actor: ClassVar[type[PlanActor]]

    def fit(self, trajectories: Sequence[Trajectory]) -> None:
        """See `PlanBaseline`; there is nothing to learn."""

    def actor(self, trajectory: Trajectory, words: Words) -> PlanActor:
        """See `PlanBaseline`."""
        return self._actor()


class _BaselineActor:
    """An actor that knows the plan and its own actions so far."""

    def begin(self, situation: PlanSituation) -> None:
        self._situation = situation
        self._done: list[str] = []
        self._view = situation.observation.view

    def observe(self, outcome: StepOutcome) -> None:
        self._done.append(outcome.info.action)
        self._view = outcome.observation.view


class _ExpertActor(_BaselineActor):
    def act(self) -> Act:
        actions = self._situation.environment.expert_actions(self._situation.plan.index)
        return Act(actions[len(self._done)].call if len(self._done) < len(actions) else "NoOp")


class _RandomPlanActor(_BaselineActor):
    def begin(self, situation: PlanSituation) -> None:
        super().begin(situation)
        self._random = random.Random(situation.seed)

    def act(self) -> Act:
        look_degrees = self._situation.environment.look_degrees
        return Act(self._random.choice(applicable_calls(self._view, look_degrees)))


class _ScriptedActor(_BaselineActor):
    def act(self) -> Act:
        return Act(scripted_action(self._situation.plan.text, self._done))


class _HabitualActor(_BaselineActor):
    def __init__(self, habits: Habits) -> None:
        self._habits = habits

    def act(self) -> Act:
        return Act(self._habits.next_action(self._situation.plan.text, self._done))


class _RecallingActor(_BaselineActor):
    def begin(self, situation: PlanSituation) -> None:
        super().begin(situation)
        environment = situation.environment
        logs = object_logs(environment.trajectory)[: situation.plan.low[0] + 1]
        self._way = way_by_memory(situation.plan.text, environment, self._view, logs)

    def act(self) -> Act:
        n_done = len(self._done)
        if n_done < len(self._way):
            return Act(self._way[n_done])
        return Act(scripted_action(self._situation.plan.text, self._done[len(self._way) :]))


class PlannerAgent(_PlanBaseline):
    """Repeats the expert's actions: the upper bound."""

    name = "planner"
    _actor = _ExpertActor


class RandomAgent(_PlanBaseline):
    """Draws uniformly, by the seed alone, from the calls possible in view, with any object."""

    name = "random"
    _actor = _RandomPlanActor


class ScriptedAgent(_PlanBaseline):
    """Does what the plan's words say, and nothing else; see `script`."""

    name = "scripted"
    _actor = _ScriptedActor


class HabitualAgent(_PlanBaseline):
    """Does what experts did next elsewhere, after the same action in an equal plan (`Habits`)."""

    name = "history"

    def fit(self, trajectories: Sequence[Trajectory]) -> None:
        """See `PlanBaseline`."""
        self._trajectories = trajectories

    def actor(self, trajectory: Trajectory, words: Words) -> _HabitualActor:
        """See `PlanBaseline`; it learns from other scenes than the trajectory's."""
        scene = trajectory.scene.floor_plan
        elsewhere = (one for one in self._trajectories if one.scene.floor_plan != scene)
        return _HabitualActor(Habits(elsewhere, words))


class RecallingAgent(_PlanBaseline):
    """Goes where the trajectory's log last had the plan's object, then is scripted (`recall`)."""

    name = "recall"
    _actor = _RecallingActor


BASELINES: Mapping[str, Callable[[int], PlanBaseline]] = {
    baseline.name: baseline
    for baseline in (PlannerAgent, RandomAgent, ScriptedAgent, HabitualAgent, RecallingAgent)
}


def way_by_memory(
    plan: str, environment: PlanEnvironment, view: SimulatorView, logs: Sequence[ObjectLog]
) -> list[str]:
    """Return the actions to where a plan's object was last seen, or is to be put.

    What it is in is opened. There are none for plans that neither pick up nor put, and where the
    place is not known. The log has types alone. So of several drawers this goes to the nearest, and
    on a long counter it may look at the wrong end.

    Args:
        plan: text of the plan.
        environment: the environment, reset to it.
        view: what that shows.
        logs: log of each frame so far.
    """
    verb, names = read_plan(plan)
    place = None
    if names and verb == "put":
        place = names[-1]
    elif names and verb == "pick up":
        place = last_place(names[0], logs)
    known = [obj for obj in view.objects.values() if _is_named(obj, place)]
    if not known:
        return []
    nearest = min(known, key=lambda obj: (obj.distance, obj.object_id))
    actions = environment.actions_to(nearest.object_id)
    if verb == "pick up" and nearest.openable and not nearest.is_open:
        actions.append(f"OpenObject {nearest.object_type}")
    return actions


def last_place(name: str, logs: Sequence[ObjectLog]) -> str | None:
    """Return the type of the furniture that an object was last seen in or on; None if never."""
    for log in reversed(logs):
        holders = [
            (len(contents), receptacle)
            for receptacle, contents in log.recep_objs.items()
            if name in contents and receptacle in KNOWN_TYPES
        ]
        if holders:
            return min(holders)[1]  # a drawer rather than the dresser that it is in
    return None


def _is_named(obj: ThorObject, name: str | None) -> bool:
    return bool(obj.receptacle) and name in (
        obj.object_type,
        Words.PUBLISHED.name_of(obj.object_id),
    )
