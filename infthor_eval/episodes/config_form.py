"""The part of a run's config that summaries and tables of episodes read, as `EpisodeTask.config` writes it."""

import msgspec

__all__ = ["EpisodeTaskForm"]


class EpisodeTaskForm(msgspec.Struct, kw_only=True):
    """The config of a task; `broken` has the names of trajectories that could not be read, and why."""

    broken: list[tuple[str, str]]
