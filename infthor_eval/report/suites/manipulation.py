"""Presenter of manipulation: an arm's episodes step by step, its reward, its success by radius."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from msgspec import UNSET
from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.manipulation.choices import score_choices
from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.recorded.curves import arm_curves
from infthor_eval.manipulation.recorded.radii import Points, SuccessByRadius, success_by_radius
from infthor_eval.manipulation.recorded.runs import ArmRun, label_by_radius
from infthor_eval.manipulation.records import ArmRecord, ArmStep
from infthor_eval.manipulation.summary import ManipulationSummary
from infthor_eval.rates import format_percent
from infthor_eval.report.charts import Chart, Class, Panels, Series, point_of
from infthor_eval.report.descriptions import Description, StepRow
from infthor_eval.report.presenter import (
    EpisodeSelection,
    Figure,
    FigureRequest,
    FigureResult,
    GroupScore,
    Recording,
    Replay,
)
from infthor_eval.report.recordings.arm_pictures import (
    MOST_ROWS,
    arm_pictures,
    draw_sheet,
    sheet_rows,
)
from infthor_eval.report.recordings.reach_view import draw_reach
from infthor_eval.report.runs import choose_evenly
from infthor_eval.report.suites.episodes import ARM_COLUMNS, EpisodesPresenter
from infthor_eval.report.suites.reward_curves import (
    curves_on_page,
    curves_result,
    embedded_note,
    figure_section,
    trajectories_text,
)
from infthor_eval.report.web.sections import Section
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord
from infthor_eval.tables import Column, Row, Table

if TYPE_CHECKING:
    from infthor_eval.manipulation.recorded.replay_frames import ArmFrame, ArmObservation
    from infthor_eval.manipulation.recorded.replaying import RecordedEpisodes

Record = UnitRecord[ArmRecord]
_FLOOR = "in the sphere at the start"


def _select_recorded(run: Run, selection: EpisodeSelection) -> Recording:
    """Find the selected episodes in a run; see `Replay.select`."""
    from infthor_eval.manipulation.recorded.replaying import recorded_episodes, replay_episodes

    recorded = recorded_episodes(_arm_run(run), selection.task, selection.trajectory)
    return Recording(
        trajectory=recorded.trajectory,
        tasks=recorded.tasks,
        records=_select_episodes(recorded, selection),
        simulator=recorded.run.config.simulator,
        open=partial(replay_episodes, recorded),
    )


def _draw_map(observation: "ArmObservation", size: int) -> Image.Image:
    """Draw the arm's reach, from above and from the side."""
    return draw_reach(observation.reach, size)


def _draw_sheet(frames: Iterable["ArmFrame"], heading: str) -> Image.Image:
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
    return curves_result(arm_curves(_runs_by_radius(runs), request.task), request.panels)


def _build_radius_figure(runs: Sequence[Run], request: FigureRequest) -> FigureResult:
    return radii_result(success_by_radius(_model_runs(runs), request.task))


def radii_result(success: SuccessByRadius) -> FigureResult:
    """Return the figure of success by radius, a panel per kind."""
    # Loads matplotlib, which the page does without.
    from infthor_eval.report.figures import draw_figure

    drawn = {line.kind for line in success.lines}
    kinds = [kind for kind in ManipulationKind if kind in drawn]
    charts = [_radii_chart(success, [kind], "radius of the hand's sphere (m)") for kind in kinds]
    panels = Panels("", list(dict.fromkeys(line.label for line in success.lines)), charts)
    titles = [KIND_NAMES[kind] for kind in kinds]
    plot = partial(draw_figure, _radii_heading(success), titles, [panels], success.notes)
    return FigureResult(radii_table(success), plot)


def _radii_chart(success: SuccessByRadius, kinds: Iterable[ManipulationKind], axis: str) -> Chart:
    """Return the chart of some kinds: a class per kind and radius, a series per model."""
    floor = dict(success.floor)
    classes: dict[tuple[ManipulationKind, float], Class] = {}
    for kind in kinds:
        of_kind = (line.points for line in success.lines if line.kind == kind)
        for radius in sorted({radius for points in of_kind for radius, _ in points}):
            heading = "" if any(other == kind for other, _ in classes) else KIND_NAMES[kind]
            has_floor = kind == ManipulationKind.PICKUP and radius in floor
            chance = 100 * floor[radius].mean if has_floor else None
            classes[kind, radius] = Class(f"{radius:g} m", heading, chance, radius)
    numbers = {known: number for number, known in enumerate(classes)}
    series: dict[str, Series] = {}
    for line in success.lines:
        one = series.setdefault(line.label, Series(line.label, [], len(series), line.is_bound))
        points = [
            point_of(numbers[line.kind, radius], rate, rate.n)
            for radius, rate in line.points
            if (line.kind, radius) in numbers
        ]
        series[line.label] = one._replace(points=[*one.points, *points])
    return Chart(
        title="Success by the hand's radius",
        caption=(
            "A row is a radius of the hand's sphere, a dot a model with its 95 % interval; of "
            "pick-ups the dashed line is an arm that only closes its hand."
        ),
        axes=(axis, "success (%)"),
        series=list(series.values()),
        classes=list(classes.values()),
        dashed=_FLOOR,
    )


def radii_table(success: SuccessByRadius) -> Table:
    """Return a table with a row per model and kind and a column per radius."""
    all_points = (success.floor, *(line.points for line in success.lines))
    radii = sorted({radius for points in all_points for radius, _ in points})
    rows = [_radii_row(line.label, line.kind, line.points, radii) for line in success.lines]
    if success.floor:
        rows.append(_radii_row(f"({_FLOOR})", ManipulationKind.PICKUP, success.floor, radii))
    names = (*(f"{radius:g} m" for radius in radii), "episodes")
    columns = (Column("model", False), Column("kind", False), *map(Column, names))
    title = f"{success.task}: success by radius, %, of {trajectories_text(success.n_trajectories)}"
    return Table(title, columns, tuple(rows), (*_embedded(success), *success.notes))


def _radii_row(
    label: str,
    kind: ManipulationKind,
    points: Points,
    radii: Sequence[float],
) -> Row:
    rates = dict(points)
    cells = (format_percent(rates.get(radius)) for radius in radii)
    return Row((label, KIND_NAMES[kind], *cells, str(points[0][1].n)))


def _radii_heading(success: SuccessByRadius) -> list[str]:
    intervals = ", 95 % intervals beside the points" if success.n_trajectories > 1 else ""
    title = (
        f"Success by radius on {success.task}: episodes of "
        f"{trajectories_text(success.n_trajectories)}{intervals}"
    )
    return [title, *_embedded(success)]


def _embedded(success: SuccessByRadius) -> tuple[str, ...]:
    """Return the note on numbers of the embedded simulator."""
    by_label = {line.label: line.is_embedded for line in success.lines}
    label = embedded_note(
        [name for name, is_embedded in by_label.items() if is_embedded], len(by_label), "results"
    )
    return () if label is None else (label,)


class ManipulationPresenter(EpisodesPresenter):
    """See `PlainPresenter`."""

    title = "Pick-ups and puts"
    measure = "successful episodes"
    finding = "succeeds in {} of the episodes"
    target_label = "target"
    replay = Replay(
        unit="episodes",
        options=("--episode", "--sheet"),
        select=_select_recorded,
        draw_map=_draw_map,
        pictures=arm_pictures,
        draw_sheet=_draw_sheet,
        sheet_rows=MOST_ROWS,
    )
    columns = ARM_COLUMNS
    figures: Mapping[str, Figure] = {
        "6": Figure("reward of pick-ups and puts along trajectories", _build_figure_6),
        "radius": Figure(
            "success of pick-ups and puts by the radius of the hand", _build_radius_figure, False
        ),
    }

    def has_pairs(self, task: str, summary: ManipulationSummary) -> bool:
        """See `PlainPresenter.has_pairs`."""
        return summary.tasks[task].choices is not UNSET

    def group_scores(self, records: Sequence[Record]) -> Iterator[GroupScore]:
        """See `PlainPresenter.group_scores`: net pairs of twins."""
        for pair in score_choices(records):
            for name, score in pair.shares.by_metric.items():
                yield GroupScore(name, pair.pair, pair.cluster, score)

    def sections(self, runs: Sequence[Run]) -> Iterator[Section]:
        """See `PlainPresenter.sections`: reward along trajectories, and success by radius where
        there are several radii."""

        def radii_on_page() -> tuple[Sequence[Chart], Table]:
            success = success_by_radius(_model_runs(runs))
            kinds = dict.fromkeys(line.kind for line in success.lines)
            return [_radii_chart(success, kinds, "kind and radius")], radii_table(success)

        arm_runs = _runs_by_radius(runs)
        title = "Reward of pick-ups and puts"
        yield figure_section("arm-rewards", title, lambda: curves_on_page(arm_curves(arm_runs)))
        if len({task.radius for run in arm_runs for task in run.config.tasks.values()}) > 1:
            yield figure_section("arm-radius", "Success by the hand's radius", radii_on_page)

    def describe(self, record: Record) -> Description:
        """See `PlainPresenter.describe`."""
        payload = record.payload
        target = " → ".join(
            name for name in (payload.object_id, payload.receptacle_id) if name is not None
        )
        return Description(payload.instruction, target, payload.kind)

    def steps(self, record: Record) -> list[StepRow]:
        """See `PlainPresenter.steps`."""
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
