"""Typed metadata that the simulator reports after an action, and the call back to a pose."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from msgspec import UNSET, UnsetType
from msgspec.structs import asdict
from numpy.typing import NDArray

from infthor_eval.errors import SimulatorError, in_one_line
from infthor_eval.thor.segmentation import Instance, Segmentation


class Vector(msgspec.Struct, frozen=True):
    """Metres along Unity's axes (y up), or degrees about them."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Box(msgspec.Struct, frozen=True):
    """An axis-aligned box, metres."""

    center: Vector
    size: Vector


class ThorObject(msgspec.Struct, rename="camel", frozen=True):
    """One object of `metadata["objects"]`; names and meanings are AI2-THOR's.

    What an agent's action looks at is UNSET, which counts as false, where a simulator does not
    report it: the published script tells it from false.
    """

    object_id: str
    object_type: str
    name: str
    position: Vector
    rotation: Vector = Vector()
    distance: float = 0.0
    visible: bool = False
    receptacle: bool | UnsetType = UNSET
    receptacle_object_ids: list[str] | None = None
    parent_receptacles: list[str] | None = None
    pickupable: bool | UnsetType = UNSET
    moveable: bool = False
    is_picked_up: bool = False
    openable: bool | UnsetType = UNSET
    is_open: bool | UnsetType = UNSET
    openness: float = 0.0
    toggleable: bool | UnsetType = UNSET
    is_toggled: bool = False
    sliceable: bool | UnsetType = UNSET
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


class PackedObjects:
    """The objects of a reply, decoded when they are first asked for.

    Args:
        packed: their list in MessagePack.
    """

    def __init__(self, packed: msgspec.Raw) -> None:
        self._packed: msgspec.Raw | None = packed
        self._objects: dict[str, ThorObject] = {}

    @property
    def by_id(self) -> dict[str, ThorObject]:
        """The objects by id; raises SimulatorError if one is malformed."""
        packed = self._packed  # another thread may decode them at the same time
        if packed is not None:
            try:
                objects = msgspec.msgpack.decode(packed, type=list[ThorObject])
            except ValueError as error:  # msgspec's errors are ValueErrors
                raise _malformed("objects", error) from error
            self._objects = {obj.object_id: obj for obj in objects}
            self._packed = None
        return self._objects


class ReceivedObjects:
    """The objects of a reply, as they came over the wire, and typed.

    Args:
        packed: their list in MessagePack.
    """

    def __init__(self, packed: msgspec.Raw) -> None:
        self._packed = packed
        self.typed = PackedObjects(packed)

    def decode(self) -> None:
        """Decode them before they are asked for, while the simulator is at work."""
        with suppress(SimulatorError):  # who reads them is told
            self.typed.by_id  # noqa: B018

    def whole(self) -> Any:
        """Return them with all their fields, as dicts."""
        return msgspec.msgpack.decode(self._packed)


class AgentPose(msgspec.Struct, frozen=True):
    """The agent's pose.

    Attributes:
        rotation: rotation about the vertical, degrees.
        horizon: angle of the camera below the horizon, degrees.
        standing: False if the agent crouches, None if it cannot crouch.
    """

    position: Vector
    rotation: float
    horizon: float
    standing: bool | None = True


class Camera(msgspec.Struct, frozen=True):
    """The agent's camera.

    Attributes:
        position: in world coordinates, metres.
        rotation, horizon: as of the agent's pose, degrees.
        field_of_view: vertical angle, degrees.
    """

    position: Vector
    rotation: float
    horizon: float
    field_of_view: float


class AxisAngle(msgspec.Struct, frozen=True):
    """A rotation by `w` degrees about the axis (x, y, z), a unit vector."""

    x: float = 1.0
    y: float = 0.0
    z: float = 0.0
    w: float = 0.0


class ArmJoint(msgspec.Struct, rename="camel", frozen=True):
    """One joint of an arm.

    `root_relative_position` and `root_relative_rotation` are in the frame of the arm's base,
    `local_rotation` in that of the joint before. AI2-THOR reports `arm_base_height` and
    `elbow_orientation` only for the first joint.
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
    """`metadata["arm"]`: the arm's joints, what it holds, and what is in the sphere of its hand.

    Attributes:
        joints: joints from the base to the wrist.
        held: ids of the held objects.
        pickupable: ids of the objects that `PickupObject` would pick up now.
        touched: ids of all other objects in the sphere, furniture included.
        sphere_center: centre of the sphere in world coordinates, metres.
        sphere_radius: radius of the sphere, metres.
    """

    joints: list[ArmJoint]
    held: list[str] = msgspec.field(name="heldObjects")
    pickupable: list[str] = msgspec.field(name="pickupableObjects")
    touched: list[str] = msgspec.field(name="touchedNotHeldObjects")
    sphere_center: Vector = msgspec.field(name="handSphereCenter")
    sphere_radius: float = msgspec.field(name="handSphereRadius")

    @property
    def wrist(self) -> Vector:
        """Position of the wrist in world coordinates, metres."""
        return self.joints[-1].position


@dataclass(frozen=True)
class SimulatorView:
    """State of the simulator after one action.

    Attributes:
        frame: RGB, uint8, [height, width, 3], contiguous; None if frames are not rendered.
        depth: metres, float32, [height, width]; None if depth is not rendered.
        received: the objects, see `objects`.
        inventory: ids of the objects that the agent holds, in its hand or with its arm.
        success: True if the action was accepted.
        error: the simulator's message if the action was refused.
        error_code: the simulator's code of this error.
        result: `actionReturn`.
        segmentation: which object each pixel shows; None if that is not rendered.
        arm: arm of the agent; None if it has none.
        camera: the agent's; None where a simulator does not report it.
        third_party: frames of the third-party cameras, like `frame`, by their ids.
        image_digest: what the frame shows, whether it is rendered or not; None where it was not
            asked for.
    """

    frame: NDArray[np.uint8] | None
    depth: NDArray[np.float32] | None
    received: dict[str, ThorObject] | PackedObjects
    agent: AgentPose
    inventory: tuple[str, ...]
    success: bool
    error: str
    error_code: str
    result: Any
    scene: str
    segmentation: Segmentation | None = None
    arm: ArmState | None = None
    camera: Camera | None = None
    third_party: Sequence[NDArray[np.uint8]] = ()
    image_digest: str | None = None

    @property
    def objects(self) -> dict[str, ThorObject]:
        """The objects by id; raises SimulatorError if a simulator's are malformed."""
        received = self.received
        return received.by_id if isinstance(received, PackedObjects) else received

    @property
    def instances(self) -> dict[str, Instance] | None:
        """Objects in the frame by id; None if instance segmentation is not rendered."""
        return None if self.segmentation is None else self.segmentation.instances


class _InHand(msgspec.Struct):
    object_id: str = msgspec.field(name="objectId")


class _Outcome(msgspec.Struct):
    """What an action came to."""

    success: bool = msgspec.field(name="lastActionSuccess")
    error: str | None = msgspec.field(name="errorMessage")
    code: Any = msgspec.field(name="errorCode")
    result: Any = msgspec.field(name="actionReturn")
    scene: str = msgspec.field(name="sceneName")


def view_of(event: Any) -> SimulatorView:
    """Convert an `ai2thor.server.Event` whose objects are `ReceivedObjects`.

    Raises:
        SimulatorError: a field of the metadata is missing or malformed.
    """
    metadata = event.metadata
    try:
        objects = metadata["objects"].typed
        agent = _pose(metadata["agent"])
        camera = _camera(metadata, agent)
        arm = msgspec.convert(metadata.get("arm"), ArmState | None)
        # The inventory of arm agents is always empty; what they hold is in the arm's state.
        in_hand = [
            held.object_id
            for held in msgspec.convert(metadata["inventoryObjects"], list[_InHand] | None) or ()
        ]
        outcome = msgspec.convert(metadata, _Outcome)
    except (ValueError, KeyError, TypeError) as error:  # msgspec's errors are ValueErrors
        raise _malformed(f"metadata of {metadata.get('lastAction')!r:.40}", error) from error
    shown = event.instance_segmentation_frame
    return SimulatorView(
        frame=None if event.frame is None else np.ascontiguousarray(event.frame),
        third_party=[np.ascontiguousarray(frame) for frame in event.third_party_camera_frames],
        depth=None if event.depth_frame is None else np.ascontiguousarray(event.depth_frame),
        received=objects,
        agent=agent,
        inventory=tuple(in_hand if arm is None else arm.held),
        success=outcome.success,
        error=outcome.error or "",
        error_code=str(outcome.code or ""),
        result=outcome.result,
        scene=outcome.scene,
        segmentation=None if shown is None else Segmentation(shown, event.colors),
        arm=arm,
        camera=camera,
        image_digest=metadata.get("imageDigest"),
    )


def _malformed(what: str, error: Exception) -> SimulatorError:
    return SimulatorError(f"{what}: {in_one_line(error)}; use AI2-THOR 5.x")


def _camera(metadata: dict[str, Any], agent: AgentPose) -> Camera | None:
    at, angle = metadata.get("cameraPosition"), metadata.get("fov")
    if at is None or angle is None:
        return None
    return Camera(msgspec.convert(at, Vector), agent.rotation, agent.horizon, float(angle))


def _pose(agent: dict[str, Any]) -> AgentPose:
    return AgentPose(
        msgspec.convert(agent["position"], Vector),
        float(agent["rotation"]["y"]),
        float(agent["cameraHorizon"]),
        agent.get("isStanding"),
    )


def teleport_call(pose: AgentPose, *, force: bool = True) -> dict[str, Any]:
    """Return the 5.x call that teleports the agent to a pose; unforced, a collision refuses it."""
    call: dict[str, Any] = {
        "action": "TeleportFull",
        "position": asdict(pose.position),
        "rotation": {"x": 0.0, "y": pose.rotation, "z": 0.0},
        "horizon": pose.horizon,
        "forceAction": force,
    }
    return call if pose.standing is None else {**call, "standing": pose.standing}
