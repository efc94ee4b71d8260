"""`metadata.arm`: joints, the hand's sphere, and the objects that are held or touched."""

from typing import Any

import numpy as np

from infthor_sim.arm.arm import Arm
from infthor_sim.arm.holding import touched_objects
from infthor_sim.geometry import Array, axis_angle, round_xyz
from infthor_sim.world import World

_DIGITS = 6


def arm_metadata(world: World, arm: Arm) -> dict[str, Any]:
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
