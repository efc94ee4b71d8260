"""The config of a run of episodes: what plans and manipulation have in common."""

from typing import TypeVar

import msgspec

from infthor_eval.runs import RunConfig, TaskConfig


class EpisodeTaskConfig(TaskConfig, frozen=True, kw_only=True, omit_defaults=True):
    """The config of a task.

    Attributes:
        trajectories: digests of the trajectories by name.
        broken: trajectories that could not be read, and why.
    """

    trajectories: dict[str, str] = msgspec.field(default_factory=dict)
    broken: tuple[tuple[str, str], ...]

    @property
    def skip_reasons(self) -> list[str]:
        """See `TaskConfig`: of each trajectory that could not be read."""
        return [reason for _, reason in self.broken]


EpisodeTaskConfigType = TypeVar("EpisodeTaskConfigType", bound=EpisodeTaskConfig)


class EpisodesConfig(
    RunConfig[EpisodeTaskConfigType], frozen=True, kw_only=True, omit_defaults=True
):
    """The config of a run.

    Attributes:
        ai2thor: version of ai2thor's client.
        floor_plans: digest of the recorded floor plans; None where none are given.
    """

    ai2thor: str = ""
    floor_plans: str | None = None
