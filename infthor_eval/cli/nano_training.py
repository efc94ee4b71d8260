"""What `train --recipe tiny` does: make data where none is given, teach the small model, and write it."""

from collections.abc import Sequence
from pathlib import Path

from infthor_eval.cli.paced_bar import PacedBar, StepBars
from infthor_eval.cli.progress import NOTES, say
from infthor_eval.errors import DataError
from infthor_eval.formats.files import prepare_folder
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.generation.generate_set import generate_with_workers
from infthor_eval.generation.jobs import trajectory_jobs
from infthor_eval.generation.questions.make import make_questions
from infthor_eval.generation.replay_set import replay_with_workers, select
from infthor_eval.terminal import console, progress_bar
from infthor_eval.thor.launch import embedded
from infthor_eval.training.export import export
from infthor_eval.training.nano.school import Lesson, teach
from infthor_eval.training.nano.settings import NanoRecipe, Scenes
from infthor_eval.workers import WorkerSettings

__all__ = ["make_data", "train_nano"]

_PER_TRAJECTORY = 500  # questions at most: all that there are
_PARTS = {"see": "learning to see", "read": "learning to read", "tell": "learning to answer and to act"}


def train_nano(recipe: NanoRecipe, folders: Sequence[Path], out: Path, worker_settings: WorkerSettings) -> int:
    """Train the small model.

    Args:
        recipe: how.
        folders: of replayed sets with questions; made in `out` where there are none.
        out: folder of the run.
        worker_settings: who makes the data.

    Returns:
        Exit code: 0.

    Raises:
        DataError: data cannot be made or read.
    """
    prepare_folder(out)
    sets = list(folders) or [make_data(recipe.scenes, recipe.seed, out / "data", worker_settings)]
    with progress_bar(NOTES) as progress:
        bars = StepBars(progress)

        def watch(done: Lesson) -> None:
            bars.advance(_PARTS[done.part], done.step, done.n_steps, f"loss {done.loss:.3f}")

        loaded = teach(recipe, sets, watch, say)
    export(loaded, out / "checkpoint")
    console().print(f"{out / 'checkpoint'}")
    return 0


def make_data(scenes: Scenes, seed: int, out: Path, worker_settings: WorkerSettings) -> Path:
    """Trajectories in procedural scenes, replayed, with every question that can be asked on them.

    What is there already is not made again.

    Args:
        scenes: which.
        seed: of the trajectories and the questions.
        out: folder of both.
        worker_settings: who makes them.

    Returns:
        The folder of the set.

    Raises:
        DataError: a trajectory cannot be made or replayed.
    """
    trajectories, made_set = prepare_folder(out / "trajectories"), prepare_folder(out / "set")
    jobs = trajectory_jobs(
        scenes.names, seed=seed, count=1, min_steps=scenes.min_steps, min_subgoals=1, final_task=False, max_fail=20
    )
    with progress_bar(NOTES) as progress:
        made = PacedBar(progress, "trajectories", len(jobs))
        generated = generate_with_workers(jobs, embedded(), trajectories, worker_settings, made.advance, say)
        selection, shown = select([trajectories]), PacedBar(progress, "frames", len(jobs))
        replayed = replay_with_workers(selection, embedded(), made_set, worker_settings, 1, shown.advance, say)
    failures = [str(item) for item in generated.failures]
    failures += [f"{item.place}: {item.message}" for item in replayed.failures]
    if failures:
        raise DataError(f"{out}: {failures[0]}; give other scenes")
    questions = make_questions(
        made_set, seed=seed, per_trajectory=_PER_TRAJECTORY, further=True, worker_settings=worker_settings, say=say
    )
    write_questions(made_set / "qa_set_data.csv", questions.questions)
    say(f"{len(jobs)} trajectories, {len(questions.questions):,} questions: {made_set}")
    return made_set
