"""What `infthor-eval watch` does with a run of manipulation."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from infthor_eval.cli.watching import Wanted, followed, heading, place_of, refuse_options

if TYPE_CHECKING:
    from infthor_eval.manipulation.moments import ArmMoment
    from infthor_eval.manipulation.replaying import Record, RecordedEpisodes

__all__ = ["watch_arms"]


def watch_arms(wanted: Wanted) -> None:
    """Write the recording of a trajectory's episodes, or a sheet of their frames."""
    from infthor_eval.cli.paced_bar import PacedBar
    from infthor_eval.errors import UsageError
    from infthor_eval.formats.files import prepare_file
    from infthor_eval.manipulation.curve_runs import arm_runs
    from infthor_eval.manipulation.replaying import recorded_episodes, replay_episodes
    from infthor_eval.runs import read_header
    from infthor_eval.terminal import error_console, print_line, progress_bar

    refuse_options(wanted, "manipulation", {"--plans": wanted.plans})
    if wanted.sheet is not None and wanted.out is not None:
        raise UsageError("--sheet and --out: one picture or a recording; give one of the two")
    (run,) = arm_runs([wanted.run], [read_header(wanted.run).name])
    recorded = recorded_episodes(run, wanted.task, wanted.trajectory)
    chosen = _chosen(recorded, wanted)
    path = prepare_file(wanted.sheet or wanted.out or _place(recorded, wanted))
    above = heading([run.label, *sorted({record.task for record in chosen}), recorded.trajectory], run.about.simulator)
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


def _chosen(recorded: RecordedEpisodes, wanted: Wanted) -> Sequence[Record]:
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


def _place(recorded: RecordedEpisodes, wanted: Wanted) -> Path:
    choice = [] if wanted.episode is None else [wanted.episode.strip()]
    tasks = sorted({record.task for record in recorded.episodes})
    return place_of([recorded.run.label, *tasks, recorded.trajectory, *choice])
