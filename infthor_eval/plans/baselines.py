"""Yardsticks that see no frame: the expert itself, chance, what the words of a plan say, and habit."""

import random
from collections.abc import Callable, Mapping, Sequence

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.actors import Act, Baseline, Situation
from infthor_eval.plans.environment import StepOutcome
from infthor_eval.plans.habits import Habits
from infthor_eval.plans.script import scripted
from infthor_eval.runs.baseline import BaselineSubject
from infthor_eval.thor.actions import applicable_calls
from model_adapters import Capabilities

__all__ = ["BASELINES"]

_IN_FLIGHT = 4  # episodes at a time; each has a simulator of its own


class _Unseeing(BaselineSubject):
    """What the baselines of plans have in common."""

    capabilities = Capabilities(counts_tokens=False, token_ids=False, max_in_flight=_IN_FLIGHT)

    def fit(self, trajectories: Sequence[Trajectory]) -> None:
        """Nothing to learn."""


class _Reader:
    """An actor that knows the plan and its own actions so far."""

    def begin(self, situation: Situation) -> None:
        self._situation = situation
        self._done: list[str] = []
        self._view = situation.observation.view

    def saw(self, outcome: StepOutcome) -> None:
        self._done.append(outcome.info.action)
        self._view = outcome.observation.view


class _ExpertActor(_Reader):
    def act(self) -> Act:
        actions = self._situation.environment.expert_actions(self._situation.plan.index)
        return Act(actions[len(self._done)].call if len(self._done) < len(actions) else "NoOp")


class _RandomActor(_Reader):
    def begin(self, situation: Situation) -> None:
        super().begin(situation)
        self._draw = random.Random(situation.seed)

    def act(self) -> Act:
        return Act(self._draw.choice(applicable_calls(self._view, self._situation.environment.look_degrees)))


class _ScriptedActor(_Reader):
    def act(self) -> Act:
        return Act(scripted(self._situation.plan.text, self._done))


class _HabitualActor(_Reader):
    def __init__(self, habits: Habits) -> None:
        self._habits = habits

    def act(self) -> Act:
        return Act(self._habits.next(self._situation.plan.text, self._done))


class Planner(_Unseeing):
    """Does what the expert did: the upper bound."""

    name = "planner"

    def actor(self, trajectory: Trajectory) -> _ExpertActor:
        """The same for all."""
        return _ExpertActor()


class Random(_Unseeing):
    """Any action that is possible in the present view, with any of the objects there: each call as likely."""

    name = "random"

    def actor(self, trajectory: Trajectory) -> _RandomActor:
        """The draws depend on the situation's seed alone."""
        return _RandomActor()


class Scripted(_Unseeing):
    """What the plan's words ask for, and nothing else; see `script`."""

    name = "scripted"

    def actor(self, trajectory: Trajectory) -> _ScriptedActor:
        """The same for all."""
        return _ScriptedActor()


class History(_Unseeing):
    """What experts did next in other scenes, after the same action in a plan of the same words; see `Habits`."""

    name = "history"

    def fit(self, trajectories: Sequence[Trajectory]) -> None:
        """Learn from all of them; what acts in one has not learnt from its scene."""
        self._trajectories = trajectories

    def actor(self, trajectory: Trajectory) -> _HabitualActor:
        """What was learnt in other scenes than this trajectory's."""
        scene = trajectory.scene.floor_plan
        return _HabitualActor(Habits(item for item in self._trajectories if item.scene.floor_plan != scene))


BASELINES: Mapping[str, Callable[[int], Baseline]] = {made.name: made for made in (Planner, Random, Scripted, History)}
