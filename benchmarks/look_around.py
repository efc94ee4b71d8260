"""What looking around changes: the same tasks walked with the camera as planned, and level.

    python benchmarks/look_around.py [--subgoals 16] [--seed 1] [--model MODEL] [--out DIR]

In two scenes of each kind of room it generates a trajectory without and one with `--look-around`,
as long in sub-goals, replays both, and makes questions on them. It prints what the frames show, how
many questions there are to ask, how far what they ask about is from the camera, and how often the
small model of the package is right on the frames with the clues.
"""

import argparse
import contextlib
import io
import json
import math
import random
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import mean, median

from infthor_eval.cli.main import main as command
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.jobs import trajectory_jobs
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.generate import (
    candidates_of,
    further_candidates_of,
    generate_questions,
)
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.scene_types import scene_type
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

_SCENES = tuple(
    f"{room}-{number}"
    for room in ("kitchen", "living-room", "bedroom", "bathroom")
    for number in (61, 62)
)
_ONE_DEGREE = 1.0


def main() -> None:
    """Print a table with a column for each way of walking."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--subgoals", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--model", default="qwen2.5-vl-nano")
    parser.add_argument("--out", type=Path, help="folder of the sets; default: temporary")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        columns = []
        for name, look_around in (("as planned", False), ("looking around", True)):
            folder = out / name.replace(" ", "-")
            make_set(folder, options.seed, options.subgoals, look_around)
            columns.append(figures(folder) | accuracies(folder, options.model))
    one, other = columns
    print("| | as planned | looking around |\n|---|---|---|")
    for row in sorted(one.keys() | other.keys(), key=[*one, *other].index):
        print(f"| {row} | {one.get(row, 0):.4g} | {other.get(row, 0):.4g} |")


def make_set(folder: Path, seed: int, n_subgoals: int, look_around: bool) -> None:
    """Generate, replay and ask about a trajectory in each scene."""
    jobs = trajectory_jobs(
        _SCENES,
        seed=seed,
        count=1,
        min_steps=1,
        min_subgoals=n_subgoals,
        final_task=False,
        look_around=look_around,
    )
    with Simulator(embedded_launch(), image=False, max_copies=16) as simulator:
        made = generate_set(jobs, simulator, folder / "trajectories")
    with Simulator(embedded_launch()) as simulator:
        replayed = replay_set(select([folder / "trajectories"]), simulator, folder / "set")
    if made.failures or replayed.failures:
        raise SystemExit(f"not made: {made.failures}, not replayed: {replayed.failures}")
    generated = generate_questions(folder / "set", further=True)
    write_questions(folder / "set" / "qa_set_look_around.csv", generated.questions)


def figures(folder: Path) -> dict[str, float]:
    """Return the figures of a set by name."""
    histories = [
        TrajectoryHistory(path.name, read_steps(path))
        for path in sorted((folder / "set" / "metadata").iterdir())
    ]
    steps = [step for history in histories for step in history.steps]
    level = [abs(step.pose.horizon) < _ONE_DEGREE for step in steps if step.pose is not None]
    shown = [sum(1 for frame in range(len(one)) for _ in _shown(one, frame)) for one in histories]
    found = [
        (history, candidate)
        for history in histories
        for candidate in _candidates(history, histories)
    ]
    clues = [len(candidate.clues) for _, candidate in found if candidate.clues]
    distances = [metres for pair in found for metres in _distances(*pair)]
    return {
        "frames": len(steps),
        "frames at level horizon, %": 100 * mean(level),
        "objects shown in a frame": sum(shown) / len(steps),
        "distinct objects shown in a trajectory": mean(len(_all_shown(one)) for one in histories),
        "candidates of questions": len(found),
        "clues of a candidate": mean(clues),
        "distance of what a clue shows, m, median": median(distances),
        **{
            f"candidates, {name}": count
            for name, count in sorted(Counter(item.question_type for _, item in found).items())
        },
    }


def accuracies(folder: Path, model: str) -> dict[str, float]:
    """Return how often a model is right on the clue frames, of all questions of a set."""
    words = ["run", "--model", model, "--tasks", "nieh_gt", "--data", str(folder / "set")]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        command([*words, "--out", str(folder / "runs")])
    (scores,) = (folder / "runs").rglob("scores.jsonl")
    rows = [json.loads(line)["scores"] for line in scores.read_text().splitlines()]
    strict = mean(row.get("strict", 0.0) for row in rows)
    return {"questions": len(rows), f"{model} on clue frames, strict, %": 100 * strict}


def _candidates(
    history: TrajectoryHistory, histories: Sequence[TrajectoryHistory]
) -> Iterator[Candidate]:
    """Yield all questions on a trajectory, as `generate_questions` finds them."""
    kind = scene_type(history.traj_id.rpartition("-")[0])
    alike = [one for one in histories if scene_type(one.traj_id.rpartition("-")[0]) == kind]
    vocabulary = frozenset[str]().union(*(one.all_object_types for one in alike))
    rng = random.Random(history.traj_id)
    yield from candidates_of(history, vocabulary, rng)
    yield from further_candidates_of(history, rng)


def _shown(history: TrajectoryHistory, frame: int) -> Iterator[str]:
    """Yield the ids of the objects that a frame shows large enough."""
    return (key for key in history.objects_in_frame(frame) if history.shows(frame, key))


def _all_shown(history: TrajectoryHistory) -> set[str]:
    return {key for frame in range(len(history)) for key in _shown(history, frame)}


def _distances(history: TrajectoryHistory, candidate: Candidate) -> Iterator[float]:
    """Yield how far the nearest object of each type asked about is in each clue, metres along the
    floor."""
    for frame in () if candidate.absence else candidate.clues:
        pose = history.steps[frame].pose
        states = history.states(frame)
        near: dict[str, float] = {}
        for key in _shown(history, frame):
            state = states.get(key)
            if pose is not None and state is not None and state.type in candidate.subjects:
                x, _, z = state.position
                metres = math.hypot(x - pose.x, z - pose.z)
                near[state.type] = min(metres, near.get(state.type, math.inf))
        yield from near.values()


if __name__ == "__main__":
    main()
