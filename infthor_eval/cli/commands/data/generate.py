"""`infthor-eval generate`: generate long trajectories from seeds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import (
    PATH,
    SceneName,
    WholeNumber,
    default_option,
    floor_plans_option,
    split_names,
)
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options

if TYPE_CHECKING:
    from rich.console import Console

    from infthor_eval.generation.generate_set import GenerationSummary


@example_command("generate", "infthor-eval generate --scene kitchen-3 --seed 1 --out trajectories")
@click.option(
    "--scene",
    "scenes",
    metavar="SCENE,...",
    multiple=True,
    required=True,
    callback=lambda context, option, texts: tuple(
        SceneName(houses=True).convert(name, option, context)
        for text in texts
        for name in split_names(text, "--scene")
    ),
    help="kitchen-3, FloorPlan10, ... (see `ls scenes`), or the file of a ProcTHOR house "
    "(house.json); several with commas.",
)
@default_option("--min-steps", click.IntRange(1), 300, "Low-level actions, at least.")
@default_option(
    "--min-subgoals",
    click.IntRange(1),
    default=10,
    help="Sub-goals, at least: tasks, and put-downs of what they leave in the hand.",
)
@default_option(
    "--max-fail",
    click.IntRange(1),
    default=20,
    help="Failed tasks in a row after which the last sub-goals are dropped.",
)
@default_option(
    "--save-floor",
    click.IntRange(0),
    default=0,
    help="Keep a trajectory that gives up as far as it got, if it has so many low-level actions; "
    "0: never.",
)
@default_option("--seed", WholeNumber(0), 0, "Seed of the first trajectory.")
@default_option("--count", click.IntRange(1), 1, "Trajectories for each scene.")
@click.option(
    "--final-task",
    is_flag=True,
    help="Add a final task that needs objects seen early and late in the trajectory.",
)
@click.option(
    "--final-task-memory",
    is_flag=True,
    help="Add a final task on one object seen in the first fifth of the steps alone and one in the "
    "last alone; up to 8 more tasks come before it, until there is one. In a room there often is "
    "none.",
)
@click.option(
    "--test-set",
    is_flag=True,
    help="Generate a test set as published: with a final task, without bathrooms.",
)
@click.option(
    "--look-around",
    is_flag=True,
    help="Walk long stretches with a level camera, as an option of the published generator does.",
)
@default_option(
    "--words",
    click.Choice(("natural", "published")),
    default="natural",
    help="Tasks in plain English, or in the words of the published generator, drawn by the seed.",
)
@click.option(
    "--no-scene-goal-filter",
    is_flag=True,
    help="Sample tasks of all types in every room, not only those published for its kind.",
)
@click.option("--out", required=True, type=PATH, help="Folder for the trajectory files.")
@floor_plans_option
@worker_options
@click.option("--json", "as_json", is_flag=True, help="Print the summary as one JSON object.")
def command(
    scenes: tuple[str | Path, ...],
    min_steps: int,
    min_subgoals: int,
    max_fail: int,
    save_floor: int,
    seed: int,
    count: int,
    final_task: bool,
    final_task_memory: bool,
    test_set: bool,
    look_around: bool,
    words: str,
    no_scene_goal_filter: bool,
    out: Path,
    data: Path | None,
    as_json: bool,
    **workers: Any,
) -> int:
    """Generate trajectories: sample tasks, plan them, and run the plans in the embedded simulator.

    Trajectories in the folder are not generated again. Exit code 1 if one cannot be generated.
    """
    from infthor_eval.cli.progress.bar import JobBar, PacedBar
    from infthor_eval.formats.floor_plans import read_house
    from infthor_eval.formats.object_ids import Words
    from infthor_eval.generation.generate_set import generate_with_workers
    from infthor_eval.generation.jobs import trajectory_jobs, without_bathrooms
    from infthor_eval.generation.settings import MEMORY
    from infthor_eval.storage.files import hold_folder
    from infthor_eval.terminal import console, error_console, progress_bar
    from infthor_eval.thor.launch import embedded_launch

    worker_settings = parse_worker_settings(**workers)
    notes = error_console()
    named = [read_house(scene) if isinstance(scene, Path) else (scene, None) for scene in scenes]
    houses = {name: house for name, house in named if house is not None}
    names = [name for name, _ in named]
    chosen, skipped = without_bathrooms(names) if test_set else (names, [])
    if skipped:
        notes.print(f"bathrooms are left out of test sets: {', '.join(skipped)}")
    jobs = trajectory_jobs(
        chosen,
        seed=seed,
        count=count,
        min_steps=min_steps,
        min_subgoals=min_subgoals,
        final_task=MEMORY if final_task_memory else final_task or test_set,
        max_fail=max_fail,
        save_floor=save_floor,
        look_around=look_around,
        words=Words(words),
        scene_goal_filter=not no_scene_goal_filter,
        houses=houses,
    )
    with hold_folder(out), progress_bar(notes) as progress:
        bar = PacedBar(progress, "generate", len(jobs))
        result = generate_with_workers(
            jobs,
            embedded_launch(data),
            out,
            worker_settings,
            bar.advance,
            notes.print,
            JobBar(progress).show,
        )
    if as_json:
        import msgspec

        click.echo(msgspec.json.encode(result.summary()))
    elif result.paths:
        _print(result.summary(), out, console())
    for failure in result.failures:
        notes.print(f"not generated: {failure}", style="red")
    return int(bool(result.failures))


def _print(summary: GenerationSummary, out: Path, output: Console) -> None:
    from infthor_eval.generation.tables import final_tasks_table, generation_notes, tasks_table
    from infthor_eval.report.terminal import print_table

    output.print(
        f"{summary.trajectories} trajectories ({summary.resumed} generated earlier), "
        f"{summary.steps} steps: {out}"
    )
    print_table(tasks_table(summary), output)
    if summary.final_tasks:
        print_table(final_tasks_table(summary), output)
    for note in generation_notes(summary):
        output.print(note, markup=False, highlight=False)
