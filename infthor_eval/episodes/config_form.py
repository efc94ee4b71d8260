"""The part of a run's config that summaries and tables of episodes read, as `EpisodeTask.config`
writes it."""

from typing import Generic, TypeVar

import msgspec

__all__ = ["EpisodeTaskForm", "EpisodesConfig"]


class EpisodeTaskForm(msgspec.Struct, kw_only=True):
    """The config of a task; `broken` has the names of trajectories that could not be read, and
    why."""

    broken: list[tuple[str, str]]


T = TypeVar("T", bound=EpisodeTaskForm)


class EpisodesConfig(msgspec.Struct, Generic[T]):
    """The config of a run."""

    tasks: dict[str, T]
    simulator: str
    frames: str
