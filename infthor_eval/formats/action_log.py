"""Which frames show what each low-level action did (`expert_log.json`): one each in our sets, several in others."""

import json
from collections.abc import Mapping
from pathlib import Path

from infthor_eval.errors import DataError

__all__ = ["read_action_log"]


def read_action_log(path: Path, places: Mapping[str, int]) -> dict[int, tuple[int, ...]]:
    """The frames of each low-level action that has some.

    Args:
        path: the file.
        places: a frame's name without its suffix to its place in the trajectory.

    Raises:
        DataError: it is missing, of another form, or names other frames.
    """
    found: dict[int, list[int]] = {}
    try:
        for image in json.loads(path.read_text(encoding="utf-8"))["images"]:
            found.setdefault(int(image["low_idx"]), []).append(places[Path(image["image_name"]).stem])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"{path}: not a log of actions and their frames ({error}); replay it again") from error
    return {action: tuple(found[action]) for action in sorted(found)}
