"""The trajectories to generate for a set."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.generation.settings import TrajectorySettings
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
    houses: Mapping[str, dict[str, Any]] | None = None,
    **settings: Any,
) -> list[TrajectorySettings]:
    """Return the settings of all trajectories of a set, scene by scene.

    Args:
        scenes: names of the scenes.
        seed: seed of the first trajectory of each scene; the others have the next seeds.
        count: number of trajectories for each scene.
        houses: ProcTHOR houses among the scenes, by their names.
        settings: the other settings, which all have (`TrajectorySettings`).
    """
    shared = TrajectorySettings("", seed, **settings)
    _check_length("--min-steps", shared.min_steps)
    _check_length("--min-subgoals", shared.min_subgoals)
    if count * len(scenes) > TRAJECTORIES.value:
        raise UsageError(
            f"{count} trajectories for each of {len(scenes)} scenes are too many; "
            f"{TRAJECTORIES.hint}"
        )
    return [
        replace(shared, scene=scene, seed=own_seed, house=(houses or {}).get(scene))
        for scene in scenes
        for own_seed in range(seed, seed + count)
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
