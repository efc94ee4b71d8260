"""A task of plans: what its file says, and whom it leads through which trajectories."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from infthor_eval.episodes.task_settings import task_settings
from infthor_eval.plans.environment import MAX_STEPS
from infthor_eval.plans.memory import Memory, memory_named
from infthor_eval.plans.model_actor import Manner
from infthor_eval.plans.options import PlansOptions
from infthor_eval.plans.plan import Plan
from infthor_eval.plans.rewards import RewardRules, reward_rules
from infthor_eval.plans.trajectories import Course, Courses, find_courses
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.runs.generation_kwargs import decoding_of
from infthor_eval.runs.limiting import limited
from model_adapters import Decoding

__all__ = ["PlansTask", "TaskSettings"]


@dataclass(frozen=True, kw_only=True)
class TaskSettings:
    """What `dataset_kwargs` of a task can say.

    Attributes:
        plans: "all" of them, or those of the "final" long-horizon task.
        bundled: name of a set of trajectories that comes with the package.
        rewards: name of the rules.
        history: what a model is given of the past.
        after_failure: whether an episode is to "continue" from the true state after a failed plan, or to "stop".
        max_steps: of one plan.
        preamble: what a model is told before everything else.
    """

    plans: str = "all"
    bundled: str | None = None
    rewards: str = "default"
    history: str = "full"
    after_failure: str = "continue"
    max_steps: int = MAX_STEPS
    preamble: str = ""


_CHOICES = {"plans": ("all", "final"), "after_failure": ("continue", "stop")}


class PlansTask:
    """A task file, read."""

    def __init__(self, file: TaskFile, request: TaskRequest[PlansOptions]) -> None:
        """Check the file and find its trajectories.

        Raises:
            UsageError: a setting that does not fit, or there are no trajectories.
            DataError: the file or all of its trajectories are not what they should be.
        """
        file.require("dataset_kwargs", "generation_kwargs")
        self.file = file
        self.name = file.name
        self._options = request.options
        told = {name: getattr(self._options, name) for name in ("rewards", "history", "after_failure")}
        self.settings = task_settings(file, TaskSettings, told, _CHOICES)
        self.rules: RewardRules = reward_rules(self.settings.rewards)
        self.decoding: Decoding = self._decoding(request.seed)
        self.memory: Memory = memory_named(self.settings.history, self._options.retriever)
        data = str(request.data) if request.data is not None else None
        self.courses: Courses = find_courses(data, self.settings.bundled)
        self._limit, self._seed = request.limit, request.seed

    @property
    def limited(self) -> list[Course]:
        """The trajectories that are gone through."""
        having = [course for course in self.courses.found if self.plans(course)]
        return limited(having, lambda course: course.traj_id, self._seed, self._limit)

    def plans(self, course: Course) -> list[Plan]:
        """The plans of a trajectory that are evaluated."""
        return [plan for plan in course.plans if plan.is_final or self.settings.plans == "all"]

    def manner(self) -> Manner:
        """How a model is led."""
        return Manner(
            decoding=self.decoding,
            memory=self.memory,
            preamble=self.settings.preamble,
            constrained=self._options.constrained,
            blank=self._options.frames == "blank",
        )

    def identity(self) -> dict[str, Any]:
        """What its numbers depend on, as JSON values."""
        return {
            "config": dict(self.file.settings),
            "history": self.settings.history,
            "after_failure": self.settings.after_failure,
            "rewards": self.rules.document(),
            "decoding": self.decoding.document(),
            "trajectories": {course.traj_id: course.digest for course in self.limited},
            "broken": [list(item) for item in self.courses.broken],
        }

    def _decoding(self, seed: int) -> Decoding:
        given: Mapping[str, Any] = self.file.settings["generation_kwargs"]
        if self._options.greedy and isinstance(given, Mapping):
            given = {**given, "do_sample": False, "temperature": 0.0}
        return decoding_of(given, seed, self.name)
