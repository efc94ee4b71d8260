"""The metadata of AI2-THOR 5.x, for one object and for the agent, as plain values."""

import re
from typing import Any

import numpy as np

from infthor_sim.arm.arm import Arm
from infthor_sim.arm.holding import touched_objects
from infthor_sim.geometry import (
    Array,
    axis_angle,
    corners,
    euler_matrix,
    matrix_euler,
    round_vector,
    round_xyz,
)
from infthor_sim.objects import DOOR_SWING, SimObject
from infthor_sim.physics.obstacles import door_leaf
from infthor_sim.pictures.cameras import ThirdPartyCamera, map_camera
from infthor_sim.simulation import Simulation
from infthor_sim.world import World

_ITHOR = re.compile(r"FloorPlan\d+")
_LEGACY: dict[str, Any] = {
    "colorBounds": None, "visibleRange": None, "flatSurfacesOnGrid": [], "distances": [],
    "normals": [],
    "isOpenableGrid": [], "segmentedObjectIds": [], "objectIdsInBox": [], "actionIntReturn": 0,
    "actionFloatReturn": 0.0, "actionFloatsReturn": [], "actionStringsReturn": [],
    "actionVector3sReturn": [],
}  # fmt: skip
_DIGITS = 6


"""Keys of old actions, which Unity sends empty with every reply."""


class Outcome:
    """The outcome of the last action.

    Args:
        action: name of the action.
        error: message of the failure; empty for success.
        code: error code; empty where Unity has none.
        value: what the action returned.
    """

    def __init__(self, action: str, error: str = "", code: str = "", value: Any = None) -> None:
        self.action = action
        self.error = error
        self.code = code
        self.value = value

    def fields(self) -> dict[str, Any]:
        """Return the metadata's fields about the last action."""
        return {
            "lastAction": self.action,
            "lastActionSuccess": not self.error,
            "errorMessage": self.error,
            "errorCode": self.code or None,  # Unity sends null and not an empty text
            "actionReturn": self.value,
        }


def object_metadata(item: SimObject) -> dict[str, Any]:
    """Return an object's fields but `visible`, `isInteractable`, `distance`, the agent's."""
    abilities = item.type
    state = item.state
    movable = abilities.pickupable or abilities.moveable
    return {
        "name": item.name,
        "position": round_xyz(item.position),
        "rotation": round_xyz(item.rotation),
        "receptacle": abilities.receptacle,
        "toggleable": abilities.toggleable,
        "isToggled": abilities.toggleable and state.toggled,
        "breakable": abilities.breakable,
        "isBroken": state.broken,
        "canFillWithLiquid": abilities.fillable,
        "isFilledWithLiquid": state.fill_liquid is not None,
        "fillLiquid": state.fill_liquid,
        "dirtyable": abilities.dirtyable,
        "isDirty": state.dirty,
        "canBeUsedUp": abilities.usable_up,
        "isUsedUp": state.used_up,
        "cookable": abilities.cookable,
        "isCooked": state.cooked,
        "temperature": state.temperature,
        "isHeatSource": abilities.heat_source,
        "isColdSource": abilities.cold_source,
        "sliceable": abilities.sliceable,
        "isSliced": state.sliced,
        "openable": abilities.openable,
        "isOpen": state.openness > 0,
        "openness": state.openness,
        "pickupable": abilities.pickupable,
        "isPickedUp": state.picked_up,
        "moveable": abilities.moveable,
        "mass": abilities.mass,
        "salientMaterials": list(abilities.materials) if movable else None,
        "receptacleObjectIds": list(item.contents) if abilities.receptacle else None,
        "objectType": item.object_type,
        "objectId": item.object_id,
        "assetId": item.asset_id,
        "parentReceptacles": None if item.parent is None else [item.parent],
        "controlledObjects": list(item.controls) or None,
        "isMoving": False,
        "axisAlignedBoundingBox": _axis_aligned(item),
        # Null for fixed things, as in Unity.
        "objectOrientedBoundingBox": {
            "cornerPoints": [round_vector(c) for c in _corners_with_lid(item)]
        }
        if movable
        else None,
    }


def agent_metadata(sim: Simulation, outcome: Outcome) -> dict[str, Any]:
    """Return fields of the active agent, scene and last action: all but `objects` and `colors`."""
    world = sim.world
    agent = world.agent
    held = None if agent.held is None else world.objects[agent.held]
    low, high = world.scene_bounds()
    pose = _hand_pose(world)
    return {
        **_LEGACY,
        **outcome.fields(),
        "isSceneAtRest": True,
        "agent": {
            "name": "agent",
            "position": round_xyz(agent.position),
            "rotation": {"x": 0.0, "y": agent.yaw, "z": 0.0},
            "cameraHorizon": agent.horizon,
            "isStanding": agent.standing,
            "inHighFrictionArea": False,
        },
        "heldObjectPose": pose,
        "hand": pose,
        "arm": None if world.arm is None else _arm_metadata(world, world.arm),
        "fov": sim.settings.field_of_view,
        "cameraPosition": round_xyz(agent.camera_position()),
        "cameraOrthSize": _orthographic_size(sim, outcome),
        "thirdPartyCameras": [
            third_party_metadata(index, camera) for index, camera in enumerate(sim.cameras)
        ],
        "collided": False,
        "collidedObjects": [],
        "inventoryObjects": []
        if held is None
        else [{"objectId": held.object_id, "objectType": held.object_type}],
        # As in Unity, iTHOR's floor plans go by the name of their physics scene.
        "sceneName": f"{world.scene}_physics" if _ITHOR.fullmatch(world.scene) else world.scene,
        "screenWidth": sim.display.width,
        "screenHeight": sim.display.height,
        "agentId": world.active,
        "depthFormat": "Meters",
        "currentTime": round(sim.time, 6),
        "sceneBounds": _box((low + high) / 2, high - low),
    }


def _orthographic_size(sim: Simulation, outcome: Outcome) -> float:
    """Return the agent camera's orthographic size, metres, as AI2-THOR reports it.

    It is told once, in the reply to the action that switches to the map; other replies have -1, and
    those to Reset and Initialize 0.
    """
    if outcome.action == "ToggleMapView" and sim.display.map_view and not outcome.error:
        size = map_camera(sim.world).orthographic_size
        assert size is not None
        return size
    return 0.0 if outcome.action in ("Reset", "Initialize") else -1.0


def third_party_metadata(index: int, camera: ThirdPartyCamera) -> dict[str, Any]:
    """Return the pose of one third-party camera."""
    return {
        "thirdPartyCameraId": index,
        "position": round_xyz(camera.position),
        "rotation": round_xyz(camera.rotation),
        "fieldOfView": camera.field_of_view,
    }


def _hand_pose(world: World) -> dict[str, Any]:
    """Return the hand's pose in the world and the camera's frame; zeros for an arm.

    AI2-THOR calls it the held object's, but it is the hand's. An empty hand is level, as the
    agent's body is, so the camera's frame has it turned back by the horizon. A full one is 0 in the
    camera's frame until it is turned, however the object lies in it.
    """
    if world.arm is not None:
        return dict.fromkeys(
            ("position", "rotation", "localPosition", "localRotation"), round_xyz(np.zeros(3))
        )
    agent = world.agent
    hand = agent.hand
    camera = agent.camera_matrix()
    turn = hand.turn if agent.held is not None else euler_matrix((-agent.horizon, 0.0, 0.0))
    return {
        "position": round_xyz(agent.camera_position() + camera @ hand.offset),
        "rotation": round_xyz(matrix_euler(camera @ turn)),
        "localPosition": round_xyz(hand.offset),
        "localRotation": round_xyz(matrix_euler(turn)),
    }


def _corners_with_lid(item: SimObject) -> Array:
    """Return the corners (8, 3) of an object's turned box, made higher by its open lid.

    Only the metadata has the higher box: the lid's room is above the object's back and keeps
    nothing from its top.
    """
    lid = item.type.lid * float(item.front_size[2])
    rise = np.array([0.0, lid * np.sin(np.radians(DOOR_SWING * item.state.openness)), 0.0])
    return corners(item.center + item.matrix @ rise / 2, item.box_size + rise, item.matrix)


def _axis_aligned(item: SimObject) -> dict[str, Any]:
    """Return the box around an object and its open lid, door or drawer."""
    points = _corners_with_lid(item)
    low, high = points.min(axis=0), points.max(axis=0)
    leaf = door_leaf(item) if item.state.openness > 0 else None
    if leaf is not None:
        low, high = np.minimum(low, leaf[0]), np.maximum(high, leaf[1])
    return _box((low + high) / 2, high - low)


def _box(center: Any, size: Any) -> dict[str, Any]:
    points = [round_vector(point) for point in corners(center, size)]
    return {"cornerPoints": points, "center": round_xyz(center), "size": round_xyz(size)}


def _arm_metadata(world: World, arm: Arm) -> dict[str, Any]:
    """Return the arm as AI2-THOR reports it: metres; rotations as axis and `w`, degrees."""
    near = touched_objects(world, arm)
    return {
        "joints": _joints(world, arm),
        "heldObjects": list(arm.held),
        "pickupableObjects": [o.object_id for o in near.pickupable],
        "touchedNotHeldObjects": [o.object_id for o in near.loose],
        "handSphereCenter": round_xyz(arm.sphere(world.agent)),
        "handSphereRadius": arm.radius,
    }


def _joints(world: World, arm: Arm) -> list[dict[str, Any]]:
    base = arm.base(world.agent)
    joints = arm.rig.joints([arm.pose])
    listed: list[dict[str, Any]] = []
    parent = np.eye(3)
    for name, position, turn in zip(
        arm.rig.joint_names, joints.positions[0], joints.turns[0], strict=True
    ):
        listed.append({
            "name": name,
            "position": round_xyz(base.point(position)),
            "rootRelativePosition": round_xyz(position),
            "rotation": _axis_angle(base.turn @ turn),
            "rootRelativeRotation": _axis_angle(turn),
            "localRotation": _axis_angle(parent.T @ turn),
            "armBaseHeight": None,
            "elbowOrientation": None,
        })  # fmt: skip
        parent = turn
    if arm.rig.has_elbow:  # Unity reports these with the first joint alone
        listed[0] |= {
            "armBaseHeight": round(arm.pose.base, _DIGITS),
            "elbowOrientation": round(arm.pose.elbow, _DIGITS),
        }
    return listed


def _axis_angle(turn: Array) -> dict[str, float]:
    axis, degrees = axis_angle(turn)
    return {**round_xyz(axis), "w": round(degrees, _DIGITS)}
