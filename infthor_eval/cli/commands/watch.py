"""`infthor-eval watch`: what an agent or an arm did, as a film."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

import click

from infthor_eval.cli.options.values import FiniteFloat

if TYPE_CHECKING:
    from infthor_eval.manipulation.moments import ArmMoment
    from infthor_eval.manipulation.replaying import Record as ArmRecord
    from infthor_eval.manipulation.replaying import RecordedEpisodes
    from infthor_eval.plans.replaying import Record as PlanRecord
    from infthor_eval.plans.replaying import Recorded
    from infthor_eval.terminal import PlainConsole

__all__ = ["command"]

_PATH = click.Path(path_type=Path)
FOLDER = Path("results/recordings")


class _Moment(Protocol):
    @property
    def note(self) -> str: ...


M = TypeVar("M", bound=_Moment)


@dataclass(frozen=True)
class Wanted:
    """The options of `watch`, as typed."""

    run: Path
    trajectory: str | None
    task: str | None
    plans: str | None
    episode: str | None
    sheet: Path | None
    out: Path | None
    data: str | None
    scenes: Path | None
    fps: float


@click.command("watch")
@click.argument("run", type=_PATH)
@click.option("--trajectory", metavar="NAME", help="Which trajectory of the run, where it has several.")
@click.option("--task", metavar="NAME", help="Which task of the run, where it has several.")
@click.option("--plans", metavar="N or N-M", help="Only these plans of it, counted from 1; else all.")
@click.option("--episode", metavar="N,...", help="Of arms: only those for these actions of the expert's; else all.")
@click.option("--sheet", type=_PATH, metavar="FILE.png", help="Of arms: frames of a few episodes on one page instead.")
@click.option("--out", type=_PATH, metavar="FILE", help=f"What to write, .mp4 or .gif.  [default: in {FOLDER}]")
@click.option("--data", type=_PATH, help="File or folder of the trajectories, where they do not come with the package.")
@click.option("--scenes", type=_PATH, help="Folder with recorded floor plans (thor_scenes/), as for the run.")
@click.option(
    "--fps", type=FiniteFloat(0, 30, min_open=True), default=2.0, show_default=True, help="Actions shown in a second."
)
def command(
    run: Path,
    trajectory: str | None,
    task: str | None,
    plans: str | None,
    episode: str | None,
    sheet: Path | None,
    out: Path | None,
    data: Path | None,
    scenes: Path | None,
    fps: float,
) -> None:
    """Show what was done in a run of plans or of manipulation, beside what was seen.

    RUN is the run's folder. A journal has every action and no frame: the actions are carried out again, in the
    simulator of the run. Where one ends otherwise than recorded, a line says so.
    """
    from infthor_eval.cli.commands.watch import watch_arms, watch_plans
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.animations import require_animation_name
    from infthor_eval.runs import read_header

    if out is not None:
        require_animation_name(out)
    if sheet is not None and sheet.suffix.lower() != ".png":
        raise UsageError(f"--sheet {sheet}: a sheet is a PNG; give a file whose name ends in .png")
    wanted = Wanted(
        run, trajectory, task, plans, episode, sheet, out, str(data) if data is not None else None, scenes, fps
    )
    suites = {"plans": watch_plans, "manipulation": watch_arms}
    suite = read_header(run).suite
    if suite not in suites:
        raise UsageError(f"{run}: is a run of {suite}, and only runs of {' and '.join(suites)} can be watched")
    suites[suite](wanted)


def refuse_options(wanted: Wanted, suite: str, options: Mapping[str, object]) -> None:
    """See that no option is given that is not for runs of a suite.

    Raises:
        UsageError: one is.
    """
    from infthor_eval.errors import UsageError

    for option, value in options.items():
        if value is not None:
            raise UsageError(f"{option}: is not for runs of {suite}, and {wanted.run} is one; leave it out")


def place_of(parts: Sequence[str], ending: str = ".mp4") -> Path:
    """A file of its own for each choice."""
    name = "-".join(re.sub(r"[^\w.-]", "_", part) for part in parts)
    return FOLDER / f"{name:.200}{ending}"


def heading(parts: Sequence[str], simulator: str) -> str:
    """What stands above each picture."""
    named = "embedded simulator" if simulator == "embedded" else simulator
    return "  ·  ".join([*parts, named])


def followed(moments: Iterable[M], advance: Callable[[], None], notes: PlainConsole) -> Iterator[M]:
    """The same moments, with progress and with what there is to be told of them."""
    for moment in moments:
        if moment.note:
            notes.print(f"otherwise than recorded: {moment.note}")
        advance()
        yield moment


def watch_arms(wanted: Wanted) -> None:
    """Write the recording of a trajectory's episodes, or a sheet of their frames."""
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.files import prepare_file
    from infthor_eval.manipulation.recorded_runs import ArmRun
    from infthor_eval.manipulation.replaying import recorded_episodes, replay_episodes
    from infthor_eval.terminal import error_console, print_line, progress_bar

    refuse_options(wanted, "manipulation", {"--plans": wanted.plans})
    if wanted.sheet is not None and wanted.out is not None:
        raise UsageError("--sheet and --out: one picture or a recording; give one of the two")
    run = ArmRun.read(wanted.run)
    recorded = recorded_episodes(run, wanted.task, wanted.trajectory)
    chosen = _chosen_episodes(recorded, wanted)
    path = prepare_file(wanted.sheet or wanted.out or _arm_place(recorded, wanted))
    above = heading([run.label, *sorted({record.task for record in chosen}), recorded.trajectory], run.config.simulator)
    notes = error_console()
    with replay_episodes(recorded, wanted.data, wanted.scenes) as stage, progress_bar(notes) as progress:
        bar = PacedBar(progress, recorded.trajectory, sum(len(record.payload.steps) + 1 for record in chosen))
        moments = followed(stage.moments(chosen), bar.advance, notes)
        made = _recording(path, moments, above, wanted.fps) if wanted.sheet is None else _sheet(path, moments, above)
    print_line(f"{len(chosen)} of {len(recorded.episodes)} episodes{made}: {path}")


def _recording(path: Path, moments: Iterable[ArmMoment], above: str, fps: float) -> str:
    from infthor_eval.formats.animations import write_animation
    from infthor_eval.report.arm_recording import arm_pictures

    return f", {write_animation(path, arm_pictures(moments, above), fps) / fps:.0f} s"


def _sheet(path: Path, moments: Iterable[ArmMoment], above: str) -> str:
    from infthor_eval.errors import wrap_errors
    from infthor_eval.formats.files import write_atomically
    from infthor_eval.report.episode_sheet import draw_sheet

    picture = draw_sheet(list(_rows(moments)), above)
    with wrap_errors(f"{path}: cannot be written", "give another --sheet"), write_atomically(path) as partial:
        picture.save(partial, format="png")
    return ""


def _rows(moments: Iterable[ArmMoment]) -> Iterator[list[ArmMoment]]:
    """By episode those that have a place; of a difference between two of them the later one tells."""
    from dataclasses import replace

    from infthor_eval.report.episode_sheet import shown_steps

    row: list[ArmMoment] = []
    note = ""
    for moment in moments:
        note = moment.note or note
        if moment.number in shown_steps(moment.title.n_steps):
            row.append(replace(moment, note=note))
            note = ""
        if moment.ending:
            yield row
            row, note = [], ""


def _chosen_episodes(recorded: RecordedEpisodes, wanted: Wanted) -> Sequence[ArmRecord]:
    """Those that are asked for; for a sheet no more than it has room for, evenly out of all."""
    from infthor_eval.errors import UsageError
    from infthor_eval.report.episode_sheet import MOST_ROWS

    if wanted.episode is None:
        every = recorded.episodes
        if wanted.sheet is None or len(every) <= MOST_ROWS:
            return every
        return [every[round(number * (len(every) - 1) / (MOST_ROWS - 1))] for number in range(MOST_ROWS)]
    if re.fullmatch(r"\s*\d{1,9}\s*(,\s*\d{1,9}\s*)*", wanted.episode, re.ASCII) is None:
        raise UsageError(f"--episode {wanted.episode!r:.60}: is no number of an action; write 17, or 17,75")
    chosen = recorded.standing_for([int(number) for number in wanted.episode.split(",")])
    if wanted.sheet is not None and len(chosen) > MOST_ROWS:
        raise UsageError(f"--episode: {len(chosen)} episodes, and a sheet has room for {MOST_ROWS}; give fewer")
    return chosen


def _arm_place(recorded: RecordedEpisodes, wanted: Wanted) -> Path:
    choice = [] if wanted.episode is None else [wanted.episode.strip()]
    tasks = sorted({record.task for record in recorded.episodes})
    return place_of([recorded.run.label, *tasks, recorded.trajectory, *choice])


def watch_plans(wanted: Wanted) -> None:
    """Write the recording of a trajectory's plans."""
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.formats.animations import write_animation
    from infthor_eval.formats.files import prepare_file
    from infthor_eval.plans.recorded_runs import PlansRun
    from infthor_eval.plans.replaying import recorded_plans, replay
    from infthor_eval.report.recording import pictures
    from infthor_eval.terminal import error_console, print_line, progress_bar

    refuse_options(wanted, "plans", {"--episode": wanted.episode, "--sheet": wanted.sheet})
    recorded = recorded_plans(PlansRun.read(wanted.run), wanted.task, wanted.trajectory)
    chosen = _chosen_plans(recorded, wanted.plans)
    label, parts = recorded.run.label, [recorded.task, recorded.trajectory]
    choice = [] if wanted.plans is None else [wanted.plans.strip()]
    path = prepare_file(wanted.out or place_of([label, *parts, *choice]))
    above = heading([label, *parts], recorded.run.config.simulator)
    notes = error_console()
    with replay(recorded, wanted.data, wanted.scenes) as stage, progress_bar(notes) as progress:
        bar = PacedBar(progress, recorded.trajectory, sum(len(plan.payload.steps) + 1 for plan in chosen))
        moments = followed(stage.moments(chosen), bar.advance, notes)
        n_pictures = write_animation(path, pictures(moments, above), wanted.fps)
    print_line(f"{len(chosen)} of {stage.n_plans} plans, {n_pictures / wanted.fps:.0f} s: {path}")


def _chosen_plans(recorded: Recorded, plans: str | None) -> Sequence[PlanRecord]:
    from infthor_eval.errors import UsageError

    if plans is None:
        return recorded.plans
    found = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", plans.strip())
    if found is None:
        raise UsageError(f"--plans {plans!r:.60}: is neither a plan's number nor two of them; write 7, or 3-7")
    return recorded.between(int(found[1]), int(found[2] or found[1]))
