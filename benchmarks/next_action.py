"""Measure how often a model predicts the expert's next action on held-out trajectories, and
baselines without frames.

    python benchmarks/next_action.py --data SET [--model qwen2.5-vl-nano] [--model-args k=v,...]
    [--frames shown,blank]

SET is a replayed set (`infthor-eval replay`) with questions (`questions SET --out
SET/qa_set.csv`), which are not asked. At every action the model gets the true history up to
it (teacher forcing) and replies greedily. `history` predicts what experts did next in other scenes
after the same action in a plan of the same words (infthor_eval/plans/actors/habits.py). `most
frequent` always predicts the most frequent action.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from infthor_eval.cli.options.values import parse_model_args
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.pictures.blank import blank_like
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.sequence_text import ACT
from infthor_eval.plans.actors.habits import Habits
from infthor_eval.plans.history.segments import PlanSegment
from infthor_eval.statistics import MeanEstimate, clustered_mean, paired_difference
from infthor_eval.training.data import read_history, trajectory_names
from model_adapters import Decoding, load

Show = Callable[[FrameRef], FrameRef]
_SHOWN: dict[str, Show] = {"shown": lambda frame: frame, "blank": blank_like}


def main() -> None:
    """Predict all actions and print the accuracies."""
    options = _arguments()
    data = NiehSet(options.data)
    histories = [read_history(data, name, Words.PUBLISHED) for name in trajectory_names(data)]
    clusters = [
        trajectory.traj_id
        for trajectory, segments in histories
        for segment in segments
        for _ in segment.steps
    ]
    rows = {
        "most frequent": [float(hit) for hit in most_frequent_hits(histories)],
        "history": [float(hit) for hit in habit_hits(histories)],
    }
    model: Any = load(options.model, parse_model_args(options.model_args), seed=0)
    for way in options.frames.split(","):
        rows[f"{options.model}, frames {way}"] = [
            float(hit)
            for _, segments in histories
            for hit in model_hits(model, segments, _SHOWN[way])
        ]
    print(
        f"{len(clusters)} actions of {len(histories)} trajectories; accuracy of the next action, "
        "%, with 95 % interval"
    )
    for name, hits in rows.items():
        print(f"{name:40} {_interval(clustered_mean(hits, clusters))}", end="")
        print(
            "   over history "
            f"{_interval(paired_difference(rows['history'], hits, clusters).estimate)}"
        )


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="a replayed set")
    parser.add_argument("--model", default="qwen2.5-vl-nano")
    parser.add_argument("--model-args", default="")
    parser.add_argument("--frames", default="shown,blank")
    return parser.parse_args()


def most_frequent_hits(histories: Sequence[tuple[Trajectory, Sequence[PlanSegment]]]) -> list[bool]:
    """Return True for each action that is the most frequent one."""
    actions = [
        action for _, segments in histories for segment in segments for action, _ in segment.steps
    ]
    ((first, _),) = Counter(actions).most_common(1)
    return [action == first for action in actions]


def habit_hits(histories: Sequence[tuple[Trajectory, Sequence[PlanSegment]]]) -> Iterator[bool]:
    """Yield True for each action that the habits of the other scenes predict."""
    for trajectory, segments in histories:
        scene = trajectory.scene.floor_plan
        habits = Habits(
            (other for other, _ in histories if other.scene.floor_plan != scene), Words.PUBLISHED
        )
        for segment in segments:
            done: list[str] = []
            for action, _ in segment.steps:
                yield habits.next_action(segment.plan, done) == action
                done.append(action)


def model_hits(model: Any, segments: Sequence[PlanSegment], show: Show) -> Iterator[bool]:
    """Yield True for each action that a model predicts, given the true history before it."""
    talk, decoding = model.conversation(), Decoding(max_new_tokens=10, stop=(ACT,))
    for segment in segments:
        talk.append(*(part if isinstance(part, str) else show(part) for part in segment.opening()))
        for action, frame in segment.steps:
            talk.append(ACT)
            yield talk.reply(decoding).text.strip() == action
            talk.append(f"{action}{ACT}", show(frame))


def _interval(estimate: MeanEstimate) -> str:
    low, high = (
        value if value is None else round(100 * value, 1) for value in (estimate.low, estimate.high)
    )
    return f"{100 * estimate.mean:5.1f} [{low}, {high}]"


if __name__ == "__main__":
    main()
