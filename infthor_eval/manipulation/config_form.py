"""The part of a run's config that its summary and tables read, as `task.ManipulationTask.config`
writes it."""

from infthor_eval.episodes.config_form import EpisodesConfig, EpisodeTaskForm

__all__ = ["ManipulationConfig"]


class _Task(EpisodeTaskForm, kw_only=True):
    kind: str
    radius: float


ManipulationConfig = EpisodesConfig[_Task]
