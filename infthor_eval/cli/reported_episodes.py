"""Where episodes are carried out again, for a report to show what was seen."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from infthor_eval.manipulation.replaying import recorded_episodes, replay_episodes
from infthor_eval.plans.replaying import recorded_plans, replay
from infthor_eval.report.web.arm_samples import arm_run
from infthor_eval.report.web.episode_samples import Opener, Stage
from infthor_eval.report.web.plan_samples import plans_run
from infthor_eval.report.web.runs import ReportRun

__all__ = ["stages"]


def stages(scenes: Path | None) -> Mapping[str, Opener]:
    """The stages, by suite.

    Args:
        scenes: folder with recorded floor plans, for the embedded simulator.
    """

    @contextmanager
    def plans(run: ReportRun, task: str, trajectory: str, data: Path | None) -> Iterator[Stage]:
        with replay(recorded_plans(plans_run(run), task, trajectory), _text(data), scenes) as stage:
            yield stage

    @contextmanager
    def errands(run: ReportRun, task: str, trajectory: str, data: Path | None) -> Iterator[Stage]:
        with replay_episodes(recorded_episodes(arm_run(run), task, trajectory), _text(data), scenes) as stage:
            yield stage

    return {"plans": plans, "manipulation": errands}


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)
