# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""What the arm agents do with their arm: move it, turn it, pick up and let go."""

from dataclasses import replace

import numpy as np

from infthor_sim.actions.arm_motion import agent_arm, follow, position_text, quaternion_text
from infthor_sim.actions.registry import Vector3, action
from infthor_sim.arm.arm import Arm
from infthor_sim.arm.holding import drop_all, pick_up, touched_objects
from infthor_sim.arm.paths import STEP, path_distances, rotation_steps, shares
from infthor_sim.arm.rig import ArmPose
from infthor_sim.arm.sweep import Stance, stance
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, euler_matrix, to_array, wrap_degrees
from infthor_sim.settings import ARM_MODES
from infthor_sim.simulation import Simulation

_KINOVA = ("arm",)
# radii of the hand's sphere, metres
_SMALLEST = 0.04
_LARGEST = 0.5
# degrees between two collision checks
_TURN_STEP = 3.0
_ELBOW_STEP = 2.0


@action("MoveArm", modes=ARM_MODES)
def move_arm(
    sim: Simulation,
    position: Vector3,
    coordinateSpace: str = "armBase",
    restrictMovement: bool = False,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Bring the wrist to a position, or as near as the arm reaches."""
    agent = sim.world.agent
    arm = agent_arm(sim)
    point = to_array(position)
    if coordinateSpace == "armBase":
        point = arm.base(agent).point(point)
    elif coordinateSpace == "wrist":
        point = arm.wrist(agent).point(point)
    elif coordinateSpace != "world":
        raise ActionError(f"Invalid coordinateSpace: {coordinateSpace}")
    _reach(sim, arm, point, (to_array(position), coordinateSpace), restrictMovement, returnToStart)


@action("MoveArmRelative", modes=ARM_MODES)
def move_arm_relative(
    sim: Simulation,
    offset: Vector3,
    coordinateSpace: str = "armBase",
    restrictMovement: bool = False,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Move the wrist by an offset along the axes of a space."""
    agent = sim.world.agent
    arm = agent_arm(sim)
    turns = {"armBase": arm.base(agent).turn, "wrist": arm.wrist(agent).turn, "world": np.eye(3)}
    if coordinateSpace not in turns:
        raise ActionError(f"Invalid coordinateSpace: {coordinateSpace}")
    point = arm.wrist(agent).origin + turns[coordinateSpace] @ to_array(offset)
    _reach(sim, arm, point, (point, "world"), restrictMovement, returnToStart)


def _reach(
    sim: Simulation,
    arm: Arm,
    point: Array,
    requested: tuple[Array, str],
    restricted: bool,
    return_to_start: bool,
) -> None:
    """Move the wrist straight to a point (3,) of the world; beyond its reach the arm is stretched.

    `requested` is that point as the message names it, and its space; `restricted` refuses points
    that are behind the shoulder or out of reach.
    """
    base = arm.base(sim.world.agent)
    target = base.local(point)
    if restricted and not arm.rig.allows(target):
        position, space = requested
        raise ActionError(
            f"Invalid target: Position '{position_text(position)}' in space '{space}' is behind "
            "shoulder."
        )
    start = arm.pose.wrist
    distance = float(np.linalg.norm(target - start))
    ahead = (target - start) / max(distance, 1e-9)
    # The target itself ends the path, and not start + distance * ahead, which differs from it by
    # rounding.
    targets = np.vstack([start + ahead * path_distances(distance)[:-1, None], target])
    poses = arm.rig.reach([arm.pose] * len(targets), targets)
    _bend(sim, arm, poses, position_text(point), return_to_start)


@action("MoveArmBase", modes=ARM_MODES)
def move_arm_base(
    sim: Simulation,
    y: float,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
    normalizedY: bool = True,
) -> None:
    """Move the arm up or down, to a share of its range or to a height in metres."""
    if normalizedY and not 0 <= y <= 1:
        raise ActionError(f"y={y} value must be in [0, 1] when normalizedY=true.")
    low, high = _heights(sim)
    height = low + y * (high - low) if normalizedY else y
    if not low - 1e-9 <= height <= high + 1e-9:
        raise ActionError(f"height={height} value must be in [{low:.6g}, {high:.6g}].")
    _lift(sim, height, returnToStart)


@action("MoveArmBaseUp", modes=ARM_MODES)
def move_arm_base_up(
    sim: Simulation,
    distance: float,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Move the arm up, metres, as far as it goes."""
    height = sim.world.agent.position[1] + agent_arm(sim).rig.lift(agent_arm(sim).pose) + distance
    _lift(sim, float(np.clip(height, *_heights(sim))), returnToStart)


@action("MoveArmBaseDown", modes=ARM_MODES)
def move_arm_base_down(
    sim: Simulation,
    distance: float,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Move the arm down, metres, as far as it goes."""
    move_arm_base_up(sim, -distance, speed, returnToStart, disableRendering)


def _heights(sim: Simulation) -> tuple[float, float]:
    low, high = agent_arm(sim).rig.lifts
    floor = float(sim.world.agent.position[1])
    return floor + low, floor + high


def _lift(sim: Simulation, height: float, return_to_start: bool) -> None:
    arm = agent_arm(sim)
    start, end = arm.rig.lift(arm.pose), height - float(sim.world.agent.position[1])
    heights = start + shares(abs(end - start), STEP) * (end - start)
    poses = [arm.rig.with_lift(arm.pose, float(h)) for h in heights]
    origin = arm.base(sim.world.agent).origin
    _bend(sim, arm, poses, position_text(np.array([origin[0], height, origin[2]])), return_to_start)


@action("RotateWristRelative", modes=ARM_MODES)
def rotate_wrist_relative(
    sim: Simulation,
    pitch: float = 0.0,
    yaw: float = 0.0,
    roll: float = 0.0,
    speed: float = 10.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Turn the wrist about its own axes, degrees, the shortest way; Stretch's: the vertical."""
    if sim.settings.agent_mode == "stretch" and (pitch or roll):
        raise ActionError("Pitch and roll are not supported for the stretch agent.")
    arm = agent_arm(sim)
    turn = _wrist_turn(pitch, yaw, roll)
    poses = [
        replace(arm.pose, turn=arm.pose.turn @ part) for part in rotation_steps(turn, _TURN_STEP)
    ]
    _bend(sim, arm, poses, quaternion_text(arm.wrist(sim.world.agent).turn @ turn), returnToStart)


@action("RotateWristAroundHeldObject", modes=_KINOVA)
def rotate_wrist_around_held_object(
    sim: Simulation,
    pitch: float = 0.0,
    yaw: float = 0.0,
    roll: float = 0.0,
    speed: float = 10.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Turn the one held object about its origin, moving the wrist around it."""
    held = list(agent_arm(sim).held)
    if len(held) != 1:
        raise ActionError(
            "Cannot RotateWristAroundHeldObject when holding != 1 objects, currently holding "
            f"{len(held)} objects."
        )
    _turn_around(
        sim, sim.world.objects[held[0]].position, _wrist_turn(pitch, yaw, roll), returnToStart
    )


@action("RotateWristAroundPoint", modes=_KINOVA)
def rotate_wrist_around_point(
    sim: Simulation,
    point: Vector3,
    pitch: float = 0.0,
    yaw: float = 0.0,
    roll: float = 0.0,
    speed: float = 10.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Turn the wrist and move it, as if a point of the world were fixed to it."""
    _turn_around(sim, to_array(point), _wrist_turn(pitch, yaw, roll), returnToStart)


def _wrist_turn(pitch: float, yaw: float, roll: float) -> Array:
    """Return the rotation (3, 3) of angles in degrees; Unity's roll is about z, reversed."""
    return euler_matrix((pitch, yaw, -roll))


def _turn_around(sim: Simulation, pivot: Array, turn: Array, return_to_start: bool) -> None:
    arm = agent_arm(sim)
    around = arm.base(sim.world.agent).local(pivot)
    lever = arm.pose.turn.T @ (arm.pose.wrist - around)
    turned = [
        replace(arm.pose, turn=arm.pose.turn @ part) for part in rotation_steps(turn, _TURN_STEP)
    ]
    poses = arm.rig.reach(turned, np.stack([around + pose.turn @ lever for pose in turned]))
    _bend(sim, arm, poses, quaternion_text(arm.wrist(sim.world.agent).turn @ turn), return_to_start)


@action("RotateElbowRelative", modes=_KINOVA)
def rotate_elbow_relative(
    sim: Simulation,
    degrees: float,
    speed: float = 10.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Turn the elbow about the line from shoulder to wrist, the shortest way."""
    arm = agent_arm(sim)
    turn = wrap_degrees(degrees)
    angles = arm.pose.elbow + shares(abs(turn), _ELBOW_STEP) * turn
    poses = [replace(arm.pose, elbow=float(angle) % 360.0) for angle in angles]
    _bend(
        sim,
        arm,
        poses,
        quaternion_text(euler_matrix((0.0, 0.0, arm.pose.elbow + turn))),
        returnToStart,
    )


@action("RotateElbow", modes=_KINOVA)
def rotate_elbow(
    sim: Simulation,
    degrees: float,
    speed: float = 10.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Turn the elbow to an angle."""
    rotate_elbow_relative(
        sim, degrees - agent_arm(sim).pose.elbow, speed, returnToStart, disableRendering
    )


def _bend(
    sim: Simulation, arm: Arm, poses: list[ArmPose], target: str, return_to_start: bool
) -> None:
    """Bend the arm through some poses while the agent stands still."""
    now = stance(sim.world, arm)
    follow(sim, [Stance(now.position, now.yaw, pose) for pose in poses], target, return_to_start)


@action("PickupObject", modes=ARM_MODES)
def pick_up_in_sphere(
    sim: Simulation,
    objectIdCandidates: list[str] | None = None,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
    manualInteract: bool = False,
) -> None:
    """Hold everything in the hand's sphere that can be picked up, or those candidates that are."""
    foreign = ""
    if objectId is not None:
        foreign = "objectId"
    elif x is not None or y is not None:
        foreign = "x, y"
    if foreign:
        raise ActionError(
            f"You are passing in iTHOR PickupObject parameters ({foreign}) to the arm agent!"
        )
    arm = agent_arm(sim)
    objects = touched_objects(sim.world, arm).pickupable
    if objectIdCandidates is not None:
        objects = [o for o in objects if o.object_id in objectIdCandidates]
    if not objects:
        which = "(specified by objectId) " if objectIdCandidates is not None else ""
        raise ActionError(f"No objects {which}were valid to be picked up by the arm")
    pick_up(sim.world, arm, objects)


@action("ReleaseObject", modes=ARM_MODES)
def release_object(sim: Simulation) -> None:
    """Let go of everything held: it falls onto what is below it."""
    drop_all(sim.world, agent_arm(sim))


@action("SetHandSphereRadius", modes=ARM_MODES)
def set_hand_sphere_radius(sim: Simulation, radius: float) -> None:
    """Set the radius of the hand's sphere, metres; the sphere begins at the palm."""
    if not _SMALLEST <= radius <= _LARGEST:
        raise ActionError(
            f"radius={radius} of hand cannot be less than {_SMALLEST}m nor greater than {_LARGEST}m"
        )
    agent_arm(sim).radius = float(radius)


@action("ToggleMagnetVisibility", modes=ARM_MODES)
def toggle_magnet_visibility(sim: Simulation, visible: bool | None = None) -> None:
    """Do nothing: the hand's sphere is never shown."""
