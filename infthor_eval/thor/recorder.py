"""Recording the frames and the step log of an episode."""

from collections import deque
from collections.abc import Sequence
from operator import attrgetter

from infthor_eval.errors import SimulatorError
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.pictures.png import PngWriter
from infthor_eval.formats.step_log import (
    LoggedPose,
    ObjectInFrame,
    ObjectLog,
    ObjectState,
    Step,
    iter_object_states,
)
from infthor_eval.thor.drawn_pictures import DrawnPictures
from infthor_eval.thor.outline import shares_in_frame
from infthor_eval.thor.segmentation import Instance
from infthor_eval.thor.view import SimulatorView, ThorObject

# All that `state_of` reads: for most objects it is what it was a frame before.
_TOLD = attrgetter(
    "object_type", "parent_receptacles", "position", "is_picked_up", "openable", "is_open",
    "toggleable", "is_toggled", "is_sliced", "is_dirty", "is_cooked", "temperature",
)  # fmt: skip


class Recorder:
    """Turns simulator states into log entries (`steps`, one a frame), and images into a folder."""

    def __init__(
        self,
        images: PngWriter | None = None,
        drawn: DrawnPictures | None = None,
        beginning: Sequence[Step] = (),
    ) -> None:
        """Start after a beginning whose frames are written, or without a frame.

        Args:
            images: writes the frames; None for no files.
            drawn: pictures of earlier recordings, which are not drawn again.
            beginning: entries that an earlier recording has in common with this one.
        """
        self._images = images
        self._drawn = drawn
        states = deque(iter_object_states(beginning), maxlen=1)
        self._states = {key: it for last in states for key, it in last.items() if it.exists}
        self._told: dict[str, tuple[object, ...]] = {}
        self._n_drawn = len(beginning)
        self.steps = list(beginning)

    def draw(self, view: SimulatorView) -> None:
        """Write the next frame's file."""
        images, name = self._images, _file_name(self._n_drawn)
        self._n_drawn += 1
        assert images is not None
        if self._drawn is not None and view.image_digest is not None:
            self._drawn.write(images, name, view, view.image_digest)
        elif view.frame is not None:
            images.write(name, view.frame)
        else:
            raise SimulatorError(f"{name}: the simulator sent no frame; start it with rendering on")

    def record(
        self,
        view: SimulatorView,
        *,
        step: int = 0,
        action: str | None = None,
        error: str | None = None,
        high_idx: int | None = None,
        target: str | None = None,
        receptacle: str | None = None,
    ) -> None:
        """Add the entry of the next frame.

        Args:
            step: index of the action; 0 also for the first frame.
            action: text of the action; None for the first frame.
            error: why it was refused; None if it was not.
            high_idx: index of the action's sub-goal.
            target: id of the object acted on.
            receptacle: id of the receptacle acted on.
        """
        number = len(self.steps)
        entry = Step(
            img_idx=number,
            img_filename=_file_name(number),
            step=step,
            object_log=object_log(view),
            action=action,
            success=error is None,
            error=error,
            high_idx=high_idx,
            pose=_pose(view),
            target=target,
            receptacle=receptacle,
            seen=_objects_in_frame(view),
            changes=self._changes(view),
        )
        self.steps.append(entry)

    def _changes(self, view: SimulatorView) -> dict[str, ObjectState]:
        changes = {}
        for key, obj in view.objects.items():
            told = _TOLD(obj)
            if self._told.get(key) == told:
                continue
            self._told[key] = told
            state = state_of(obj)
            if self._states.get(key) != state:
                changes[key] = self._states[key] = state
        for key in self._states.keys() - view.objects.keys():
            changes[key] = ObjectState(self._states.pop(key).type, exists=False)
            self._told.pop(key, None)
        return changes


def _file_name(number: int) -> str:
    return f"{number:09d}.png"


def object_log(view: SimulatorView) -> ObjectLog:
    """Return the published fields of a log entry: object types, each once, alphabetically."""
    visible = [obj for obj in view.objects.values() if obj.visible]
    inside: dict[str, set[str]] = {}
    for obj in visible:
        for parent in obj.parent_receptacles or ():
            if parent in view.objects and view.objects[parent].visible:
                inside.setdefault(view.objects[parent].object_type, set()).add(obj.object_type)
    return ObjectLog(
        visible=_types(visible),
        pickupable=_types([obj for obj in visible if obj.pickupable]),
        is_open=_types([obj for obj in visible if obj.openable and obj.is_open]),
        inven_obj=sorted(object_type_of(key) for key in view.inventory),
        receptacles=_types([obj for obj in visible if obj.receptacle]),
        recep_objs={object_type: sorted(types) for object_type, types in sorted(inside.items())},
    )


def state_of(obj: ThorObject) -> ObjectState:
    """Return the logged part of an object's metadata, with the position to the millimetre."""
    at = obj.position
    return ObjectState(
        type=obj.object_type,
        parents=tuple(obj.parent_receptacles or ()),
        position=(round(at.x, 3), round(at.y, 3), round(at.z, 3)),
        held=obj.is_picked_up,
        is_open=bool(obj.is_open) if obj.openable else None,
        is_on=obj.is_toggled if obj.toggleable else None,
        is_sliced=obj.is_sliced,
        is_dirty=obj.is_dirty,
        is_cooked=obj.is_cooked,
        temperature=obj.temperature,
    )


def _types(objects: list[ThorObject]) -> list[str]:
    return sorted({obj.object_type for obj in objects})


def _pose(view: SimulatorView) -> LoggedPose:
    at = view.agent.position
    return LoggedPose(
        round(at.x, 4),
        round(at.y, 4),
        round(at.z, 4),
        round(view.agent.rotation, 2),
        round(view.agent.horizon, 2),
    )


def _objects_in_frame(view: SimulatorView) -> dict[str, ObjectInFrame] | None:
    if view.instances is None:
        return None
    return {
        key: _in_frame(view, view.objects[key], instance)
        for key, instance in sorted(view.instances.items())
        if key in view.objects
    }


def _in_frame(view: SimulatorView, obj: ThorObject, instance: Instance) -> ObjectInFrame:
    shown = ObjectInFrame(instance.pixels, instance.box, obj.visible)
    if view.segmentation is None or view.camera is None or obj.axis_aligned_bounding_box is None:
        return shown
    height, width = view.segmentation.codes.shape
    left, top, right, bottom = instance.box
    if min(left, top) > 0 and right < width - 1 and bottom < height - 1:
        return shown
    shown.inside, shown.top_inside = shares_in_frame(
        obj.axis_aligned_bounding_box, view.camera, width, height
    )
    return shown
