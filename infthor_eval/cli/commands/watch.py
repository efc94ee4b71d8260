"""`infthor-eval watch`: the episodes of a run as a film."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, FiniteFloat, default_option
from infthor_eval.errors import UsageError
from infthor_eval.storage.files import file_name, prepare_file, write_output

if TYPE_CHECKING:
    from infthor_eval.report.presenter import Recording, Replay
    from infthor_eval.run import Run
    from infthor_eval.terminal import PlainConsole

_FOLDER = Path("results/recordings")


@example_command(
    "watch",
    "infthor-eval watch results/scripted/RUN --trajectory kitchen-4-seed0 --out scripted.mp4",
)
@click.argument("run", type=PATH)
@click.option("--trajectory", metavar="NAME", help="A trajectory of the run, if it has several.")
@click.option("--task", metavar="NAME", help="A task of the run, if it has several.")
@click.option("--plans", metavar="N or N-M", help="Only these plans, counted from 1; else all.")
@click.option(
    "--episode",
    metavar="N,...",
    help="For arms: only the episodes of these expert actions; else all.",
)
@click.option(
    "--sheet",
    type=PATH,
    metavar="FILE.png",
    help="For arms: frames of a few episodes on one page instead.",
)
@click.option(
    "--out",
    type=PATH,
    metavar="FILE",
    help=f"The file to write, .mp4 or .gif.  [default: in {_FOLDER}]",
)
@click.option(
    "--data",
    type=PATH,
    help="File or folder of the trajectories, if they do not come with the package.",
)
@click.option(
    "--scenes", type=PATH, help="Folder with recorded floor plans (thor_scenes/), as for the run."
)
@default_option("--fps", FiniteFloat(0, 30, min_open=True), 2.0, "Actions shown in a second.")
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
    """Show the episodes of a run of plans or of manipulation, beside what the agent or the arm saw.

    RUN is the run's folder. A journal has every action and no frame: the actions are replayed in
    the simulator of the run. Where an action ends otherwise than recorded, a line says so.
    """
    from infthor_eval.cli.progress.notes import print_failure
    from infthor_eval.formats.pictures.animations import require_animation_name
    from infthor_eval.report.presenter import EpisodeSelection
    from infthor_eval.run import open_runs

    if out is not None:
        require_animation_name(out)
    if sheet is not None and sheet.suffix.lower() != ".png":
        raise UsageError(f"--sheet {sheet}: a sheet is a PNG; give a file whose name ends in .png")
    (recorded,) = open_runs([run], print_failure)
    replay = _require_replay(recorded)
    _refuse_options(recorded, replay, {"--plans": plans, "--episode": episode, "--sheet": sheet})
    if sheet is not None and out is not None:
        raise UsageError("--sheet and --out: one picture or a recording; give one of the two")
    most = None if sheet is None else replay.sheet_rows
    recording = replay.select(recorded, EpisodeSelection(task, trajectory, plans, episode, most))
    choice = [text.strip() for text in (plans, episode) if text is not None]
    parts = [recorded.label, *recording.tasks, recording.trajectory, *choice]
    # A file of its own for each choice.
    path = prepare_file(sheet or out or _FOLDER / f"{file_name('-'.join(parts))}.mp4")
    rate = None if sheet is not None else fps
    _write(recorded, recording, path, data=data, scenes=scenes, fps=rate)


def _require_replay(run: Run) -> Replay:
    from infthor_eval.suites import find_presenter, suite_names

    if run.presenter.replay is None:
        others = [name for name in suite_names() if find_presenter(name).replay is not None]
        others.sort(reverse=True)
        raise UsageError(
            f"{run.folder}: is a run of {run.suite.name}, and only runs of {' and '.join(others)} "
            "can be watched"
        )
    return run.presenter.replay


def _refuse_options(run: Run, replay: Replay, options: Mapping[str, object]) -> None:
    """Refuse options that are given and that the suite of a run does not have."""
    for option, value in options.items():
        if value is not None and option not in replay.options:
            raise UsageError(
                f"{option}: is not for runs of {run.suite.name}, and {run.folder} is one; leave it "
                "out"
            )


def _write(
    run: Run,
    recording: Recording,
    path: Path,
    *,
    data: Path | None,
    scenes: Path | None,
    fps: float | None,
) -> None:
    """Replay recorded episodes and write a film of them, or a sheet if `fps` is None."""
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.formats.pictures.animations import write_animation
    from infthor_eval.terminal import error_console, print_line, progress_bar

    replay = _require_replay(run)
    tasks = sorted({record.task for record in recording.records})
    simulator = "embedded simulator" if recording.simulator == "embedded" else recording.simulator
    heading = "  ·  ".join([run.label, *tasks, recording.trajectory, simulator])
    notes = error_console()
    with recording.open(data, scenes) as session, progress_bar(notes) as progress:
        n_frames = sum(len(run.presenter.steps(record)) + 1 for record in recording.records)
        bar = PacedBar(progress, recording.trajectory, n_frames)
        frames = _watch_frames(session.frames(recording.records), bar.advance, notes)
        if fps is None:
            assert replay.draw_sheet is not None  # or --sheet is refused
            sheet = replay.draw_sheet(frames, heading)
            with write_output(path, "give another --sheet") as partial:
                sheet.save(partial, format="png")
            length = ""
        else:
            length = f", {write_animation(path, replay.pictures(frames, heading), fps) / fps:.0f} s"
    print_line(f"{len(recording.records)} of {session.n_episodes} {replay.unit}{length}: {path}")


def _watch_frames(
    frames: Iterable[Any], advance: Callable[[], None], notes: PlainConsole
) -> Iterator[Any]:
    """Yield the same frames, and report progress and differences from the recorded episodes."""
    for frame in frames:
        if frame.note:
            notes.print(f"otherwise than recorded: {frame.note}")
        advance()
        yield frame
