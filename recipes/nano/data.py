"""The data that the small model is trained on: views, trajectories, frames, questions, twins."""

from functools import partial
from pathlib import Path

from infthor_eval.cli.progress.bar import JobBar, PacedBar
from infthor_eval.cli.progress.notes import NOTES, print_note
from infthor_eval.errors import DataError
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.generation.generate_set import generate_with_workers
from infthor_eval.generation.jobs import trajectory_jobs
from infthor_eval.generation.questions.generate import generate_questions
from infthor_eval.generation.replay_set import replay_with_workers, select
from infthor_eval.generation.twins.drafting import TwinSettings, draft_twins
from infthor_eval.generation.twins.kinds import KINDS
from infthor_eval.generation.twins.twin_set import make_twins
from infthor_eval.nieh.scoring import score
from infthor_eval.storage.files import prepare_folder
from infthor_eval.terminal import progress_bar
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.workers import WorkerSettings
from recipes.nano.architecture import PATCH_SIDE, PATCHES
from recipes.nano.settings import SceneSettings, ViewSettings
from recipes.nano.views.generate import ViewJob, generate_views

_EVERY = 500  # more than there are questions on a trajectory


def generate_training_data(
    scenes: SceneSettings, seed: int, out: Path, worker_settings: WorkerSettings
) -> list[Path]:
    """Generate and replay trajectories, write every question on them, and make twins of some.

    What is in the folder already is not generated again.

    Returns:
        The set, and the set of twins if the scenes have some.
    """
    trajectories = prepare_folder(out / "trajectories")
    sets = [prepare_folder(out / "set")]
    _generate(scenes, seed, trajectories, worker_settings)
    _replay(trajectories, sets[0], worker_settings)
    questions = generate_questions(
        sets[0],
        seed=seed,
        per_trajectory=_EVERY,
        further=True,
        by_subject=False,
        worker_settings=worker_settings,
        notify=print_note,
    ).questions
    write_questions(sets[0] / "qa_set_data.csv", questions)
    print_note(f"{len(scenes.names)} trajectories, {len(questions):,} questions: {sets[0]}")
    if scenes.twins:
        sets.append(prepare_folder(out / "twins"))
        _make_twins(scenes, seed, trajectories, sets[1], worker_settings)
    return sets


def generate_training_views(
    views: ViewSettings, seed: int, out: Path, worker_settings: WorkerSettings
) -> list[Path]:
    """Generate labelled views of rooms; those that are there already are not generated again.

    Views of other settings are kept beside them, in a folder of their own.

    Returns:
        A file for each room.
    """
    side = PATCHES * PATCH_SIDE
    settings = f"seed{seed}-{views.arrangements}x{views.per_arrangement}-{side}px-{PATCHES}"
    folder = prepare_folder(out / settings)
    jobs = [
        ViewJob(name, seed, views.arrangements, views.per_arrangement, side, PATCHES)
        for name in views.names
    ]
    with progress_bar(NOTES) as progress:
        generated = generate_views(
            jobs,
            embedded_launch(),
            folder,
            worker_settings,
            PacedBar(progress, "views", len(jobs)).advance,
            print_note,
        )
    _require_whole(folder, generated.failures)
    print_note(f"{generated.views:,} views of {len(jobs)} rooms: {folder}")
    return generated.paths


def _generate(
    scenes: SceneSettings, seed: int, trajectories: Path, worker_settings: WorkerSettings
) -> None:
    jobs = trajectory_jobs(
        scenes.names,
        seed=seed,
        count=1,
        min_steps=scenes.min_steps,
        min_subgoals=1,
        final_task=False,
        max_fail=20,
    )
    with progress_bar(NOTES) as progress:
        bar = PacedBar(progress, "trajectories", len(jobs))
        generated = generate_with_workers(
            jobs,
            embedded_launch(),
            trajectories,
            worker_settings,
            bar.advance,
            print_note,
            JobBar(progress).show,
        )
    _require_whole(trajectories, generated.failures)


def _replay(trajectories: Path, replayed_set: Path, worker_settings: WorkerSettings) -> None:
    selection = select([trajectories])
    with progress_bar(NOTES) as progress:
        bar = PacedBar(progress, "frames", len(selection.items))
        replayed = replay_with_workers(
            selection,
            embedded_launch(),
            replayed_set,
            worker_settings,
            advance=bar.advance,
            notify=print_note,
            on_progress=JobBar(progress).show,
        )
    failures = [f"{failure.place}: {failure.message}" for failure in replayed.failures]
    _require_whole(replayed_set, failures)


def _make_twins(
    scenes: SceneSettings,
    seed: int,
    trajectories: Path,
    twin_set: Path,
    worker_settings: WorkerSettings,
) -> None:
    chosen = [path for name in scenes.names_with_twins for path in trajectories.glob(f"{name}-*")]
    selection = select([path for path in chosen if path.suffix == ".json"])
    with progress_bar(NOTES) as progress:
        summary = make_twins(
            selection,
            embedded_launch(),
            twin_set,
            TwinSettings(KINDS.names, seed, scenes.twins_per_edit),
            partial(draft_twins, score=partial(score, scorer="strict")),
            per_trajectory=_EVERY,
            worker_settings=worker_settings,
            advance=PacedBar(progress, "twins", len(selection.items)).advance,
            notify=print_note,
        )
    _require_whole(twin_set, summary.failures)
    print_note(
        f"{sum(summary.kept.values())} twins, {summary.pairs:,} paired questions: {twin_set}"
    )


def _require_whole(folder: Path, failures: list[str]) -> None:
    if failures:
        raise DataError(f"{folder}: {failures[0]}; give other scenes")
