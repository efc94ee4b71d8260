"""The trajectories to generate for a set."""

from collections.abc import Mapping, Sequence
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.formats.object_ids import Words
from infthor_eval.generation.settings import MAX_FAIL, FinalTask, TrajectorySettings
from infthor_eval.scene_types import BATHROOM, scene_type
from infthor_eval.storage.limits import STEPS, TRAJECTORIES

# Of one action: processor time at 10,000 actions (benchmarks/generation.md), and size in the file.
_STEP_S = 0.0275
_STEP_BYTES = 860


def trajectory_jobs(
    scenes: Sequence[str],
    *,
    seed: int,
    count: int,
    min_steps: int,
    min_subgoals: int,
    final_task: FinalTask,
    max_fail: int = MAX_FAIL,
    save_floor: int = 0,
    look_around: bool = False,
    words: Words = Words.NATURAL,
    scene_goal_filter: bool = True,
    houses: Mapping[str, dict[str, Any]] | None = None,
) -> list[TrajectorySettings]:
    """Return the settings of all trajectories of a set, scene by scene.

    Args:
        scenes: names of the scenes.
        seed: seed of the first trajectory of each scene; the others have the next seeds.
        count: number of trajectories for each scene.
        min_steps: minimum number of low-level actions.
        min_subgoals: minimum number of sub-goals: tasks and put-downs.
        final_task: True, or MEMORY, to end each trajectory with a final task.
        max_fail: number of failed tasks in a row after which the last sub-goals are dropped.
        save_floor: number of steps from which a trajectory that gives up is kept as far as it got;
            0: never.
        look_around: True to walk long stretches with a level camera.
        words: the words of tasks, plain English or the published generator's.
        scene_goal_filter: False to sample task types that a scene's room type has not, too.
        houses: ProcTHOR houses among the scenes, by their names.
    """
    _check_length("--min-steps", min_steps)
    _check_length("--min-subgoals", min_subgoals)
    if count * len(scenes) > TRAJECTORIES.value:
        raise UsageError(
            f"{count} trajectories for each of {len(scenes)} scenes are too many; "
            f"{TRAJECTORIES.hint}"
        )
    seeds = range(seed, seed + count)
    return [
        TrajectorySettings(
            scene,
            k,
            min_steps,
            min_subgoals,
            final_task,
            max_fail=max_fail,
            save_floor=save_floor,
            look_around=look_around,
            words=words,
            scene_goal_filter=scene_goal_filter,
            house=(houses or {}).get(scene),
        )
        for scene in scenes
        for k in seeds
    ]


def _check_length(option: str, length: int) -> None:
    """Refuse a trajectory that would take days; a sub-goal takes one action or more."""
    if length > STEPS.value:
        days = length * _STEP_S / 86_400
        raise UsageError(
            f"{option} {length}: takes {days:,.0f} days of a processor and "
            f"{length * _STEP_BYTES / 1e9:,.0f} GB for each trajectory, or more; {STEPS.hint}"
        )


def without_bathrooms(scenes: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the scenes without the bathrooms, and the bathrooms in alphabetical order."""
    chosen = [scene for scene in scenes if scene_type(scene) != BATHROOM]
    skipped = sorted(set(scenes) - set(chosen))
    if not chosen:
        raise UsageError(
            f"{', '.join(skipped)}: bathrooms are left out of test sets; give other scenes"
        )
    return chosen, skipped
