"""The frames of each low-level action (`expert_log.json`): one each in our sets, possibly several in others."""

from collections.abc import Mapping
from pathlib import Path

import msgspec

from infthor_eval.errors import wrap_errors
from infthor_eval.formats.reading import read_json

__all__ = ["read_action_log"]

_HINT = "replay it again"


class _Image(msgspec.Struct):
    low_idx: int
    image_name: str


class _Log(msgspec.Struct):
    images: list[_Image]


def read_action_log(path: Path, places: Mapping[str, int]) -> dict[int, tuple[int, ...]]:
    """Return the frames of each low-level action that has any; `places` are their positions by the stem of the file.

    Raises:
        DataError: the file is missing, has another form, or names frames that are not in `places`.
    """
    frames: dict[int, list[int]] = {}
    log = read_json(path, _HINT, _Log)
    with wrap_errors(f"{path}: not a log of actions and their frames", _HINT, catch=KeyError):
        for image in log.images:
            frames.setdefault(image.low_idx, []).append(places[Path(image.image_name).stem])
    return {action: tuple(frames[action]) for action in sorted(frames)}
