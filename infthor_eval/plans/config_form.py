"""The part of a run's config that its summary and tables read, as `task.PlansTask.config` writes
it."""

from typing import Any

import msgspec

from infthor_eval.episodes.config_form import EpisodesConfig, EpisodeTaskForm

__all__ = ["PlansConfig"]


class _TaskFile(msgspec.Struct):
    dataset_kwargs: dict[str, Any]


class _Task(EpisodeTaskForm, kw_only=True):
    config: _TaskFile
    rewards: dict[str, Any] | None
    after_failure: str | None = None


PlansConfig = EpisodesConfig[_Task]
