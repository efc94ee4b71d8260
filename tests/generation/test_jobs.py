import pytest

from infthor_eval.errors import UsageError
from infthor_eval.generation.jobs import trajectory_jobs, without_bathrooms
from infthor_eval.household.tasks import SAMPLED, TaskType


def test_every_scene_has_as_many_seeds_as_asked_for():
    length = {"min_steps": 5, "min_subgoals": 1, "final_task": True}
    jobs = trajectory_jobs(["kitchen-1", "bedroom-2"], seed=7, count=2, **length)
    names = ["kitchen-1-seed7", "kitchen-1-seed8", "bedroom-2-seed7", "bedroom-2-seed8"]
    assert [job.traj_id for job in jobs] == names
    assert all(job.final_task and job.min_steps == 5 for job in jobs)


def test_bathrooms_are_known_by_their_names():
    scenes = [
        "FloorPlan401",
        "kitchen-1",
        "FloorPlan30",
        "bathroom-2",
        "FloorPlan430",
        "FloorPlan431",
    ]
    chosen, skipped = without_bathrooms(scenes)
    assert chosen == ["kitchen-1", "FloorPlan30", "FloorPlan431"]
    assert skipped == ["FloorPlan401", "FloorPlan430", "bathroom-2"]
    with pytest.raises(UsageError, match=r"FloorPlan401, bathroom-2: bathrooms are left out"):
        without_bathrooms(["bathroom-2", "FloorPlan401"])


def test_a_room_is_asked_for_what_is_usual_there_unless_the_filter_is_off():
    length = {"min_steps": 5, "min_subgoals": 1, "final_task": False}
    (usual,) = trajectory_jobs(["bathroom-1"], seed=0, count=1, **length)
    (all_types,) = trajectory_jobs(
        ["bathroom-1"], seed=0, count=1, **length, scene_goal_filter=False
    )
    assert usual.sampled_types() == {TaskType.PLACE, TaskType.PLACE_TWO, TaskType.CLEAN}
    assert all_types.sampled_types() == set(SAMPLED)
    assert usual.document() != all_types.document()


@pytest.mark.parametrize("option", ["min_steps", "min_subgoals"])
def test_a_length_that_takes_months_is_told_at_once(option, monkeypatch):
    length = {"min_steps": 5, "min_subgoals": 1, "final_task": False, option: 10**9}
    with pytest.raises(UsageError) as refused:
        trajectory_jobs(["kitchen-1"], seed=0, count=1, **length)
    assert str(refused.value) == (
        f"--{option.replace('_', '-')} 1000000000: takes 318 days of a processor and 860 GB for "
        "each trajectory, or more; if this is intended, set INFTHOR_EVAL_MAX_STEPS to more than "
        "100000"
    )
    monkeypatch.setenv("INFTHOR_EVAL_MAX_STEPS", str(10**9))
    assert len(trajectory_jobs(["kitchen-1"], seed=0, count=1, **length)) == 1
