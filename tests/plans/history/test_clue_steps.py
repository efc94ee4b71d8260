"""Where the objects of final tasks were last in view, in the bundled trajectories, looked up by
hand in their logs."""

import gzip

import msgspec
import pytest

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.history.clue_steps import clue_step, object_logs
from infthor_eval.plans.plan import plans_of
from infthor_eval.storage.folders import packaged_folder


@pytest.fixture(scope="module")
def bundled():
    with gzip.open(packaged_folder("sets/plans_mini") / "trajectories.jsonl.gz") as lines:
        trajectories = [msgspec.json.decode(line, type=Trajectory) for line in lines]
    return {trajectory.traj_id: trajectory for trajectory in trajectories}


def final_plans(trajectory):
    return [plan for plan in plans_of(trajectory, Words.PUBLISHED) if plan.is_final]


def test_a_clue_is_the_last_frame_with_what_the_plan_needs(bundled):
    trajectory = bundled["kitchen-5-seed0"]
    logs, plans = object_logs(trajectory), final_plans(trajectory)
    first = plans[0].low[0]
    wanted = ["Cabinet", "Tomato", "Fridge", "Fridge", "Drawer", "Knife", "Fridge", "Tomato"]
    for plan, name in zip(plans, wanted, strict=True):
        frame = clue_step(logs, trajectory, plan, first)
        frames_with_it = [
            number
            for number in range(first + 1)
            if name in trajectory.object_log[number]["visible"]
        ]
        assert frame == (frames_with_it[-1] if frames_with_it else None), plan.text
        assert (frame is None) == (name == "Knife"), "what was never in view has no clue"


def test_nothing_after_the_moment_counts(bundled):
    trajectory = bundled["bedroom-4-seed0"]
    logs, plan = object_logs(trajectory), final_plans(trajectory)[1]  # pick up the credit card
    frames = [clue_step(logs, trajectory, plan, before) for before in range(-1, len(logs))]
    assert frames[0] is None and all(
        frame is None or frame <= at - 1 for at, frame in enumerate(frames)
    )
    known = [frame for frame in frames if frame is not None]
    assert known == sorted(known)


def test_without_a_log_of_every_frame_no_clue_is_known(bundled):
    trajectory = bundled["bedroom-4-seed0"]
    for log in ([], trajectory.object_log[1:], [{"visible": 3}] * len(trajectory.object_log)):
        other = msgspec.structs.replace(trajectory, object_log=log)
        assert object_logs(other) == ()
        assert clue_step((), other, final_plans(other)[0], 100) is None
