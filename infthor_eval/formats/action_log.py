"""The frames of each low-level action: one each in our sets, possibly several in others.

They are in `expert_log.json`, or in the step log of the layout that the branch `dev` reads.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import msgspec

from infthor_eval.errors import wrap_errors
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.step_log import Step

_HINT = "replay it again"


class _Image(msgspec.Struct):
    low_idx: int
    image_name: str


class _Log(msgspec.Struct):
    images: list[_Image]


def read_action_log(path: Path, positions: Mapping[str, int]) -> dict[int, tuple[int, ...]]:
    """Return the frames of each low-level action that has any; `positions` are those of file stems.

    Raises:
        DataError: the file is missing, has another form, or names frames not in `positions`.
    """
    log = read_json(path, _HINT, _Log)
    with wrap_errors(f"{path}: not a log of actions and their frames", _HINT, catch=KeyError):
        return _by_action(
            (image.low_idx, positions[Path(image.image_name).stem]) for image in log.images
        )


def logged_action_frames(steps: Sequence[Step]) -> dict[int, tuple[int, ...]] | None:
    """Return each low-level action's frames, by position, from the step log; None if it has none.

    As in the published loader, frames of action 0 are left out with those before the first action:
    both have 0 there.
    """
    if all(step.low_idx is None for step in steps):
        return None
    return _by_action((step.low_idx, index) for index, step in enumerate(steps) if step.low_idx)


def _by_action(frames: Iterable[tuple[int, int]]) -> dict[int, tuple[int, ...]]:
    """Return frames by their actions, in the order of these."""
    positions: dict[int, list[int]] = {}
    for action, position in frames:
        positions.setdefault(action, []).append(position)
    return {action: tuple(positions[action]) for action in sorted(positions)}
