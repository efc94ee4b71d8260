"""The frames of each low-level action (`expert_log.json`): one each in our sets, possibly several in others."""

import json
from collections.abc import Mapping
from pathlib import Path

from infthor_eval.errors import DataError

__all__ = ["read_action_log"]


def read_action_log(path: Path, places: Mapping[str, int]) -> dict[int, tuple[int, ...]]:
    """Return the frames of each low-level action that has any; `places` are their positions by the stem of the file.

    Raises:
        DataError: the file is missing, has another form, or names frames that are not in `places`.
    """
    frames: dict[int, list[int]] = {}
    try:
        for image in json.loads(path.read_text(encoding="utf-8"))["images"]:
            frames.setdefault(int(image["low_idx"]), []).append(places[Path(image["image_name"]).stem])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"{path}: not a log of actions and their frames ({error}); replay it again") from error
    return {action: tuple(frames[action]) for action in sorted(frames)}
