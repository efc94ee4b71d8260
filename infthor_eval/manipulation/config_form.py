"""The part of a run's config that its summary and tables read, as `task.ManipulationTask.config` writes it."""

import msgspec

from infthor_eval.episodes.config_form import EpisodeTaskForm

__all__ = ["ManipulationConfig"]


class _Task(EpisodeTaskForm, kw_only=True):
    kind: str
    radius: float


class ManipulationConfig(msgspec.Struct):
    """The config of a run."""

    tasks: dict[str, _Task]
    simulator: str
    frames: str
