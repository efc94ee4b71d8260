"""A typed view of what the simulator reports after an action."""

from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from infthor_eval.errors import SimulatorError

__all__ = [
    "AgentPose",
    "ArmJoint",
    "ArmState",
    "AxisAngle",
    "Box",
    "Instance",
    "SimulatorView",
    "ThorObject",
    "Vector",
    "instances_of",
    "view_of",
]


class Vector(msgspec.Struct, frozen=True):
    """Metres in Unity's axes (y up), or degrees about them."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Box(msgspec.Struct, frozen=True):
    """An axis-aligned box, metres."""

    center: Vector
    size: Vector


class ThorObject(msgspec.Struct, rename="camel", frozen=True):
    """One object of `metadata["objects"]`; the names and meanings are AI2-THOR's."""

    object_id: str
    object_type: str
    name: str
    position: Vector
    rotation: Vector = Vector()
    distance: float = 0.0
    visible: bool = False
    receptacle: bool = False
    receptacle_object_ids: list[str] | None = None
    parent_receptacles: list[str] | None = None
    pickupable: bool = False
    moveable: bool = False
    is_picked_up: bool = False
    openable: bool = False
    is_open: bool = False
    openness: float = 0.0
    toggleable: bool = False
    is_toggled: bool = False
    sliceable: bool = False
    is_sliced: bool = False
    breakable: bool = False
    is_broken: bool = False
    dirtyable: bool = False
    is_dirty: bool = False
    cookable: bool = False
    is_cooked: bool = False
    can_fill_with_liquid: bool = False
    is_filled_with_liquid: bool = False
    temperature: str = "RoomTemp"
    axis_aligned_bounding_box: Box | None = None


class AgentPose(msgspec.Struct, frozen=True):
    """Where the agent is; `rotation` is about the vertical, `horizon` downwards, both in degrees.

    `standing` is None where the agent cannot crouch.
    """

    position: Vector
    rotation: float
    horizon: float
    standing: bool | None = True


class AxisAngle(msgspec.Struct, frozen=True):
    """A rotation by `w` degrees about the axis (x, y, z), a unit vector."""

    x: float = 1.0
    y: float = 0.0
    z: float = 0.0
    w: float = 0.0


class ArmJoint(msgspec.Struct, rename="camel", frozen=True):
    """One joint of an arm.

    `root_relative_position` and `root_relative_rotation` are in the frame of the arm's base, `local_rotation` in that
    of the joint before; what the first joint alone tells is None at the others.
    """

    name: str
    position: Vector
    root_relative_position: Vector
    rotation: AxisAngle
    root_relative_rotation: AxisAngle
    local_rotation: AxisAngle
    arm_base_height: float | None = None
    elbow_orientation: float | None = None


class ArmState(msgspec.Struct, frozen=True):
    """`metadata["arm"]`: how the arm is bent, what it holds, and what the sphere of its hand meets.

    Attributes:
        joints: from the base to the wrist.
        held: ids of what it holds.
        pickupable: ids of what `PickupObject` would pick up now.
        touched: ids of all loose things and furniture in the sphere that it does not hold.
        sphere_center: metres, in the world.
        sphere_radius: metres.
    """

    joints: list[ArmJoint]
    held: list[str] = msgspec.field(name="heldObjects")
    pickupable: list[str] = msgspec.field(name="pickupableObjects")
    touched: list[str] = msgspec.field(name="touchedNotHeldObjects")
    sphere_center: Vector = msgspec.field(name="handSphereCenter")
    sphere_radius: float = msgspec.field(name="handSphereRadius")

    @property
    def wrist(self) -> Vector:
        """Where the wrist is, metres in the world."""
        return self.joints[-1].position

    @property
    def base_height(self) -> float:
        """Height of the arm's base in the world, metres."""
        return self.joints[0].position.y


@dataclass(frozen=True)
class Instance:
    """The pixels that show one object: their number and [xmin, ymin, xmax, ymax], both ends inclusive."""

    pixels: int
    box: tuple[int, int, int, int]


@dataclass(frozen=True)
class SimulatorView:
    """The world after one action.

    Attributes:
        frame: RGB, uint8, [height, width, 3], contiguous; None where frames are off.
        depth: metres, float32, [height, width]; None where depth is off.
        objects: the objects by id.
        agent: the agent's pose.
        inventory: ids of the objects that the agent holds, in its hand or with its arm.
        success: whether the action was carried out.
        error: the simulator's message where it was not.
        error_code: the simulator's code for it.
        result: `actionReturn`.
        scene: name of the scene.
        instances: what the frame shows, by object id; None where instance segmentation is off.
        arm: the agent's arm; None for an agent without.
    """

    frame: NDArray[np.uint8] | None
    depth: NDArray[np.float32] | None
    objects: dict[str, ThorObject]
    agent: AgentPose
    inventory: tuple[str, ...]
    success: bool
    error: str
    error_code: str
    result: Any
    scene: str
    instances: dict[str, Instance] | None
    arm: ArmState | None = None


def view_of(event: Any) -> SimulatorView:
    """Turn an `ai2thor.server.Event` into a View.

    Raises:
        SimulatorError: the metadata lacks a field or has it in another form.
    """
    metadata = event.metadata
    try:
        objects = msgspec.convert(metadata["objects"], list[ThorObject])
        agent = _pose(metadata["agent"])
        arm = msgspec.convert(metadata.get("arm"), ArmState | None)
        # Arm agents leave the inventory empty and tell of what they hold among the arm's state.
        in_hand = [item["objectId"] for item in metadata["inventoryObjects"] or ()]
    except (msgspec.ValidationError, KeyError, TypeError) as error:
        raise SimulatorError(f"metadata of {metadata['lastAction']}: {error}; use AI2-THOR 5.x") from error
    return SimulatorView(
        frame=None if event.frame is None else np.ascontiguousarray(event.frame),
        depth=None if event.depth_frame is None else np.ascontiguousarray(event.depth_frame),
        objects={item.object_id: item for item in objects},
        agent=agent,
        inventory=tuple(in_hand if arm is None else arm.held),
        success=bool(metadata["lastActionSuccess"]),
        error=metadata["errorMessage"] or "",
        error_code=str(metadata["errorCode"] or ""),
        result=metadata["actionReturn"],
        scene=metadata["sceneName"],
        instances=_instances(event),
        arm=arm,
    )


def instances_of(codes: NDArray[np.uint32]) -> dict[int, Instance]:
    """Count and box the pixels of each code.

    Args:
        codes: one code per pixel, [height, width].

    Returns:
        Code to its instance.
    """
    width = codes.shape[1]
    # Work on runs of equal pixels within a row: there are some thousands of them, not 90,000.
    starts = np.empty(codes.shape, dtype=bool)
    starts[:, 0] = True
    np.not_equal(codes[:, 1:], codes[:, :-1], out=starts[:, 1:])
    first = np.flatnonzero(starts)
    length = np.diff(first, append=codes.size)
    shown, which = np.unique(codes.ravel()[first], return_inverse=True)
    row, left = np.divmod(first, width)
    pixels = np.bincount(which, weights=length).astype(int)
    low = np.full((len(shown), 2), codes.size)
    high = np.zeros((len(shown), 2), dtype=int)
    np.minimum.at(low, which, np.stack([left, row], axis=1))
    np.maximum.at(high, which, np.stack([left + length - 1, row], axis=1))
    boxes = np.concatenate([low, high], axis=1).tolist()
    return {
        int(code): Instance(int(count), (box[0], box[1], box[2], box[3]))
        for code, count, box in zip(shown, pixels, boxes, strict=True)
    }


def _pose(agent: dict[str, Any]) -> AgentPose:
    return AgentPose(
        msgspec.convert(agent["position"], Vector),
        float(agent["rotation"]["y"]),
        float(agent["cameraHorizon"]),
        agent.get("isStanding"),
    )


def _instances(event: Any) -> dict[str, Instance] | None:
    frame = event.instance_segmentation_frame
    if frame is None:
        return None
    pixels = frame.astype(np.uint32)
    found = instances_of(pixels[..., 0] << 16 | pixels[..., 1] << 8 | pixels[..., 2])
    names = {r << 16 | g << 8 | b: name for (r, g, b), name in event.color_to_object_id.items()}
    # A name without "|" is a class of the surroundings (walls, floor), not an object.
    return {names[code]: instance for code, instance in found.items() if code in names and "|" in names[code]}
