"""The primitives of an arm: links, joints, palm and fingers."""

import numpy as np

from infthor_sim.agent import Agent
from infthor_sim.arm.arm import Arm
from infthor_sim.arm.kinova import FINGERS
from infthor_sim.geometry import Array, euler_matrix
from infthor_sim.render.primitives import Color, Form, Material, ShapePart, rows

ARM = "Arm"  # its name in segmentation frames
_SHELL: Color = (0.86, 0.87, 0.88)
_JOINT: Color = (0.16, 0.17, 0.19)
_HAND: Color = (0.24, 0.25, 0.27)
_FINGER = (0.006, 0.014, FINGERS / 2)  # half extents, metres
_ALONG = euler_matrix((90.0, 0.0, 0.0))  # turns a cylinder, whose axis is y, along the z of a link


def arm_rows(arm: Arm, agent: Agent, instance: int) -> Array:
    """Return the primitives (n, COLUMNS) of the agent's arm in the world, without its sphere.

    `instance` is the arm's index in the picture's table of instances.
    """
    boxes = arm.rig.boxes([arm.pose]).flat()
    base = arm.base(agent)
    parts = []
    for center, axes, half in zip(boxes.center[:-1], boxes.axes[:-1], boxes.half[:-1], strict=True):
        longest = int(np.argmax(half))
        thick = float(np.min(half))
        turn = axes.T @ (_ALONG if longest == 2 else np.eye(3))
        size = (thick, float(half[longest]), thick)
        parts.append(ShapePart(Form.CYLINDER, center, size, _SHELL, Material.PLAIN, turn, 1.0, 0.9))
        end = center + axes[longest] * half[longest]
        parts.append(ShapePart(Form.ELLIPSOID, end, (thick * 1.25,) * 3, _JOINT))
    hand = boxes.center[-1]
    axes = boxes.axes[-1]
    half = boxes.half[-1]
    parts.append(ShapePart(Form.BOX, hand, half, _HAND, Material.METAL, axes.T))
    tips = hand + axes[2] * (half[2] + _FINGER[2])
    for side in (-1.0, 1.0):
        at = tips + side * axes[0] * (half[0] - _FINGER[0])
        parts.append(ShapePart(Form.BOX, at, _FINGER, _JOINT, Material.METAL, axes.T))
    return rows(parts, base.origin, base.turn, instance)
