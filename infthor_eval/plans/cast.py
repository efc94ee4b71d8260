"""Who acts for a subject: a model that is led in the task's manner, or a baseline."""

from collections.abc import Sequence
from typing import Protocol

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.actors import Actor, Baseline
from infthor_eval.plans.model_actor import ModelActor
from infthor_eval.plans.task import PlansTask
from model_adapters import Model, Subject

__all__ = ["Cast", "cast_of"]


class Cast(Protocol):
    """Gives the actors of a subject.

    Attributes:
        sees: whether they look at frames.
    """

    sees: bool

    def actor(self, task: PlansTask, trajectory: Trajectory) -> Actor:
        """What carries out the plans of a trajectory."""
        ...


class _Models:
    sees = True

    def __init__(self, model: Model) -> None:
        self._model = model

    def actor(self, task: PlansTask, trajectory: Trajectory) -> Actor:
        return ModelActor(self._model, task.manner())


class _Baselines:
    sees = False

    def __init__(self, baseline: Baseline) -> None:
        self._baseline = baseline

    def actor(self, task: PlansTask, trajectory: Trajectory) -> Actor:
        return self._baseline.actor(trajectory)


def cast_of(subject: Subject, trajectories: Sequence[Trajectory]) -> Cast:
    """The cast of a subject.

    Args:
        subject: a model or a baseline; a baseline is fitted to the trajectories.
        trajectories: all trajectories of the run.

    Raises:
        TypeError: it is neither a model nor a baseline; the run sees to that before.
    """
    if isinstance(subject, Baseline):
        subject.fit(trajectories)
        return _Baselines(subject)
    if isinstance(subject, Model):
        return _Models(subject)
    raise TypeError(f"{subject.name} is neither a model nor a baseline of plans")
