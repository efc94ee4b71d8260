"""Which trajectories a set is made of."""

from collections.abc import Sequence

from infthor_eval.errors import UsageError
from infthor_eval.formats.limits import TRAJECTORIES
from infthor_eval.generation.settings import MAX_FAIL, TrajectorySettings
from infthor_eval.household.scene_types import BATHROOM, scene_type

__all__ = ["trajectory_jobs", "without_bathrooms"]


def trajectory_jobs(
    scenes: Sequence[str],
    *,
    seed: int,
    count: int,
    min_steps: int,
    min_subgoals: int,
    final_task: bool,
    max_fail: int = MAX_FAIL,
) -> list[TrajectorySettings]:
    """The settings of every trajectory of a set, scene by scene.

    Args:
        scenes: names of the scenes.
        seed: of the first trajectory of each scene; the others have the seeds after it.
        count: trajectories for each scene.
        min_steps: low-level actions at least.
        min_subgoals: tasks at least.
        final_task: whether a final task follows.
        max_fail: tasks that may fail in one trajectory.

    Raises:
        UsageError: there would be more of them than the limit.
    """
    if count * len(scenes) > TRAJECTORIES.value:
        raise UsageError(f"{count} trajectories for each of {len(scenes)} scenes are too many; {TRAJECTORIES.hint}")
    seeds = range(seed, seed + count)
    return [
        TrajectorySettings(scene, k, min_steps, min_subgoals, final_task, max_fail=max_fail)
        for scene in scenes
        for k in seeds
    ]


def without_bathrooms(scenes: Sequence[str]) -> tuple[list[str], list[str]]:
    """The scenes that a test set may have, and the others in alphabetical order.

    Raises:
        UsageError: all of them are bathrooms.
    """
    chosen = [scene for scene in scenes if scene_type(scene) != BATHROOM]
    skipped = sorted(set(scenes) - set(chosen))
    if not chosen:
        raise UsageError(f"{', '.join(skipped)}: bathrooms are left out of test sets; name other scenes")
    return chosen, skipped
