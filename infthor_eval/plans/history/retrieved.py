"""An agent's image memory by the trajectory's own `retrieved_image`, as the script reads it.

The file has, for low-level actions, the names of the frames that a retriever found before each
(`top20`). A name is looked up in `images`, which has the action that each frame was taken at; what
is shown is this run's own frame after that action, so that past and present come from one
simulator.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
from PIL import Image

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.history.past import ChosenHistory, CountTokens, Past
from infthor_eval.plans.history.segments import Part
from infthor_eval.storage.files import writing_hint

_SIDE = 336  # pixels, of remembered frames in the published script; the present one keeps its size
_FIRST = "000000000"  # the frame before the first action, which `images` does not list


class NamedImage(msgspec.Struct):
    """A frame by the name of its file, with the action during which it was taken."""

    low_idx: Annotated[int, msgspec.Meta(ge=0)]
    image_name: str


class RetrievedFrames(ChosenHistory):
    """The K frames that the file names for a plan's first action, the goal, and the plan."""

    def __init__(self, k: int) -> None:
        """Set the number of frames: the file must have a list `topK`."""
        self._k = k

    def choose(self, past: Past, count: CountTokens) -> list[Part]:
        """Return the frames in the file's order, 336x336 pixels."""
        frames = [step.frame for step in past.observations()]
        if past.trajectory is None:
            raise DataError("the trajectory's file is not known, which --history retrieved:K reads")
        steps = retrieved_steps(past.trajectory, len(frames) - 1, self._k)
        return [_resized(frames[step]) for step in steps]


def require_retrieved(trajectories: Iterable[Trajectory], task: str) -> None:
    """Check that some trajectory names retrieved frames; `task` is for the message."""
    if not any(trajectory.retrieved_image for trajectory in trajectories):
        missing = "no trajectory there has retrieved_image, which --history retrieved:K shows"
        raise DataError(f"{task}: {missing}; take --history frames:K, or the published test files")


def retrieved_steps(trajectory: Trajectory, action: int, k: int) -> Sequence[int]:
    """Return the frames that a file names before an action: 0 is the first, n + 1 after n."""
    entry = f'trajectory {trajectory.traj_id}: retrieved_image["{action}"]["top{k}"]'
    names = _names(trajectory.retrieved_image, action, k, entry)
    steps = _steps_of_images(trajectory)
    retrieved = []
    for name in names:
        step = steps.get(Path(name).stem)
        if step is None or step > action:
            wrong = "is in no entry of images" if step is None else "is taken after that action"
            raise DataError(f"{entry}: {name!r:.60} {wrong}; restore the file")
        retrieved.append(step)
    return retrieved


def _names(retrieved: Mapping[str, Any] | None, action: int, k: int, entry: str) -> Sequence[str]:
    """Return the file names of frames before an action; `entry` says in messages where they are."""
    lists = (retrieved or {}).get(str(action))
    if lists is None or (isinstance(lists, dict) and f"top{k}" not in lists):
        there = "nothing was retrieved before this action"
        if lists:
            there = f"it has {', '.join(sorted(lists))}"
        raise DataError(f"{entry} is not in the file ({there}); take --history frames:{k}")
    problem = f"{entry} is no list of frame names"
    with wrap_errors(problem, "restore the file", catch=msgspec.ValidationError):
        return msgspec.convert(lists, dict[str, list[str]])[f"top{k}"]


def _steps_of_images(trajectory: Trajectory) -> Mapping[str, int]:
    """Return the step of each named frame; all frames of one action stand for its last one."""
    images = images_of(trajectory)
    return {Path(image.image_name).stem: image.low_idx + 1 for image in images} | {_FIRST: 0}


def images_of(trajectory: Trajectory) -> list[NamedImage]:
    """Return the frames that a trajectory's file lists."""
    where = f"trajectory {trajectory.traj_id}: images is no list of low_idx and image_name"
    with wrap_errors(where, "restore the file", catch=msgspec.ValidationError):
        return msgspec.convert(trajectory.images, list[NamedImage])


def _resized(frame: FrameRef) -> FrameRef:
    """Return a frame in the published size, in a file beside it, which ends with the episode."""
    assert isinstance(frame.path, Path)  # of a running episode
    path = frame.path.with_name(f"{Path(frame.name).stem}-{_SIDE}.png")
    if not path.is_file():
        image = frame.load().resize((_SIDE, _SIDE), resample=Image.Resampling.LANCZOS)
        with wrap_errors(f"{path}: cannot be written", writing_hint(", or set TMPDIR")):
            image.save(path, compress_level=1)
    return FrameRef(path)
