"""Presenter of manipulation: an arm's episodes step by step, its reward, its success by radius."""

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.manipulation.recorded.curves import arm_curves
from infthor_eval.manipulation.recorded.radii import success_by_radius
from infthor_eval.manipulation.recorded.runs import ArmRun, label_by_radius
from infthor_eval.manipulation.records import ArmRecord, ArmStep
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.presenter import (
    Description,
    EpisodeSelection,
    Figure,
    FigureRequest,
    FigureResult,
    Recording,
)
from infthor_eval.report.recordings.arm_pictures import (
    MOST_ROWS,
    arm_pictures,
    draw_sheet,
    sheet_rows,
)
from infthor_eval.report.recordings.reach_view import draw_reach
from infthor_eval.report.runs import choose_evenly
from infthor_eval.report.suites.episode_columns import ARM_COLUMNS
from infthor_eval.report.web.samples import StepRow
from infthor_eval.report.web.sections import Section
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord

if TYPE_CHECKING:
    from infthor_eval.manipulation.recorded.replay_frames import ArmFrame, ArmObservation
    from infthor_eval.manipulation.recorded.replaying import RecordedEpisodes

Record = UnitRecord[ArmRecord]


class ArmEpisodesReplay:
    """See `Replay`."""

    unit = "episodes"
    options: Collection[str] = ("--episode", "--sheet")
    sheet_rows = MOST_ROWS

    def select(self, run: Run, selection: EpisodeSelection) -> Recording:
        """See `Replay.select`."""
        from infthor_eval.manipulation.recorded.replaying import recorded_episodes, replay_episodes

        recorded = recorded_episodes(_arm_run(run), selection.task, selection.trajectory)
        return Recording(
            trajectory=recorded.trajectory,
            tasks=recorded.tasks,
            records=_select_episodes(recorded, selection),
            simulator=recorded.run.config.simulator,
            open=lambda data, scenes: replay_episodes(recorded, data, scenes),
        )

    def draw_map(self, observation: "ArmObservation", size: int) -> Image.Image:
        """See `Replay.draw_map`: the arm's reach, from above and from the side."""
        return draw_reach(observation.reach, size)

    def pictures(self, frames: Iterable["ArmFrame"], heading: str) -> Iterator[Image.Image]:
        """See `Replay.pictures`."""
        return arm_pictures(frames, heading)

    def draw_sheet(self, frames: Iterable["ArmFrame"], heading: str) -> Image.Image:
        """See `Replay.draw_sheet`."""
        return draw_sheet(list(sheet_rows(frames)), heading)


def _select_episodes(recorded: "RecordedEpisodes", selection: EpisodeSelection) -> Sequence[Record]:
    most = selection.most
    if selection.episode is None:
        return recorded.records if most is None else choose_evenly(recorded.records, most)
    if re.fullmatch(r"\s*\d{1,9}\s*(,\s*\d{1,9}\s*)*", selection.episode, re.ASCII) is None:
        raise UsageError(
            f"--episode {selection.episode!r:.60}: is no number of an action; write 17, or 17,75"
        )
    chosen = recorded.at_actions([int(number) for number in selection.episode.split(",")])
    if most is not None and len(chosen) > most:
        raise UsageError(
            f"--episode: {len(chosen)} episodes, and a sheet has room for {most}; give fewer"
        )
    return chosen


def _arm_run(run: Run) -> ArmRun:
    return ArmRun(run.label, run.header, run.records)


def _model_runs(runs: Sequence[Run]) -> list[ArmRun]:
    """Runs named after their models: those of one model with several radii become one line."""
    return [replace(_arm_run(run), label=run.model) for run in runs]


def _runs_by_radius(runs: Sequence[Run]) -> list[ArmRun]:
    """Runs named after models and radii, or by all options that differ if that is ambiguous."""
    named = label_by_radius(_model_runs(runs))
    return (
        named
        if len({run.label for run in named}) == len(named)
        else [_arm_run(run) for run in runs]
    )


def _build_figure_6(runs: Sequence[Run], request: FigureRequest) -> FigureResult:
    from infthor_eval.report.suites.reward_curves import curves_result

    return curves_result(arm_curves(_runs_by_radius(runs), request.task), request.panels)


def _build_radius_figure(runs: Sequence[Run], request: FigureRequest) -> FigureResult:
    from infthor_eval.report.figures.radius import radii_figure, radii_table

    by_radius = success_by_radius(_model_runs(runs), request.task)
    return FigureResult(radii_table(by_radius), lambda: radii_figure(by_radius))


class ManipulationPresenter(PlainPresenter):
    """See `Presenter`."""

    title = "Pick-ups and puts"
    measure = "successful episodes"
    finding = "succeeds in {} of the episodes"
    target_label = "target"
    reply_label = "ended"
    main_metric = "success"
    replay = ArmEpisodesReplay()
    columns = ARM_COLUMNS
    figures: Mapping[str, Figure] = {
        "6": Figure("reward of pick-ups and puts along trajectories", _build_figure_6),
        "radius": Figure(
            "success of pick-ups and puts by the radius of the hand", _build_radius_figure, False
        ),
    }

    def is_share(self, metric: str, scores: Sequence[float]) -> bool:
        """See `Presenter.is_share`."""
        return metric == self.main_metric

    def bounds(self, metric: str) -> tuple[float, float]:
        """See `Presenter.bounds`: a reward has none."""
        return (0.0, 1.0) if metric == self.main_metric else (-math.inf, math.inf)

    def sections(self, runs: Sequence[Run]) -> Iterator[Section]:
        """See `Presenter.sections`: reward along trajectories, and success by radius where there
        are several radii."""
        from infthor_eval.report.figures.radius import radii_chart, radii_table
        from infthor_eval.report.suites.reward_curves import (
            DrawnFigure,
            curves_on_page,
            figure_section,
        )

        def radii_on_page() -> DrawnFigure:
            by_radius = success_by_radius(_model_runs(runs))
            return DrawnFigure([radii_chart(by_radius)], radii_table(by_radius))

        arm_runs = _runs_by_radius(runs)
        title = "Reward of pick-ups and puts"
        yield figure_section("arm-rewards", title, lambda: curves_on_page(arm_curves(arm_runs)))
        if len({task.radius for run in arm_runs for task in run.config.tasks.values()}) > 1:
            yield figure_section("arm-radius", "Success by the hand's radius", radii_on_page)

    def describe(self, record: Record) -> Description:
        """See `Presenter.describe`."""
        payload = record.payload
        target = " → ".join(
            name for name in (payload.object_id, payload.receptacle_id) if name is not None
        )
        return Description(payload.instruction, target, payload.kind)

    def reply(self, record: Record) -> str:
        """See `Presenter.reply`: how the episode ended."""
        return record.payload.ended

    def details(self, record: Record) -> Mapping[str, str]:
        """See `Presenter.details`: the page shows all of it elsewhere."""
        return {}

    def steps(self, record: Record) -> list[StepRow]:
        """See `Presenter.steps`."""
        return [_step_row(step) for step in record.payload.steps]


def _step_row(step: ArmStep) -> StepRow:
    actions = [str(call.get("action", "")) for call in step.calls]
    delta = [] if step.delta is None else [f"{value:+.3f}" for value in step.delta]
    return StepRow(
        action=", ".join(actions),
        reply=" ".join(delta),
        error="; ".join(step.refusals),
        note=f"{step.distance:.3f} m off",
    )
