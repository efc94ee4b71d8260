"""The held object in the agent's frame: whole, low, small, in a gripper from the lower edge.

Only the picture is arranged so. In the world, for the metadata and for collisions, the object is
somewhere else. The gripper is none of AI2-THOR's, but without it the object would seem to lie on
the floor.
"""

import math

import numpy as np

from infthor_sim.geometry import Array, euler_matrix
from infthor_sim.objects import SimObject
from infthor_sim.render import primitives
from infthor_sim.render.camera import PinholeCamera
from infthor_sim.render.primitives import (
    AXES,
    BOTTOM,
    CENTER,
    FORM,
    HALF,
    TOP,
    Color,
    Form,
    Material,
    ShapePart,
)

HAND = "Hand"  # its name in segmentation frames
# metres in front of the camera: nearer than anything that the agent can stand in front of
_AWAY = 0.16
_NEAREST = 0.115  # of the gripper: beyond the camera's clipping plane
# of the object's lowest point below the middle of the picture, as a share of its half height
_FOOT = 0.97
# shares of the picture's height: at least, per metre of size, at most
_SMALLEST = 0.115
_GROWTH = 0.42
_LARGEST = 0.32
# towards the camera, which so sees into bowls and the faces of flat things
_TILT = euler_matrix((-24.0, 0.0, 0.0))
_TURN = 155.0  # degrees: the front, as of screens and clocks, faces the camera and a little aside

# Of the gripper, in shares of the picture's half height.
_JAW = (0.02, 0.075, 0.04)  # half extents
_PAD = (0.012, 0.04, 0.035)
# half of the space between its jaws
_NARROWEST = 0.025
_WIDEST = 0.34
_GRASPED = 0.45  # the jaws close on this share of the object's height, from below
_STEEL: Color = (0.22, 0.23, 0.26)
_RUBBER: Color = (0.95, 0.55, 0.1)


def _outlines() -> Array:
    """Return surface points of each form, scaled by its half extents (forms, points, 3)."""
    angles = np.arange(8) * np.pi / 4
    ring = np.stack([np.cos(angles), np.zeros(8), np.sin(angles)], axis=1)
    up = np.array([0.0, 1.0, 0.0])
    box = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    cylinder = np.concatenate([ring - up, ring + up])
    upright = ring[:, [0, 2, 1]]
    # the lower half of a sphere, from -1 to 1
    bowl = upright * [1.0, 2.0, 1.0] * (upright[:, [1]] < 0) + up
    by_form = {
        Form.BOX: np.concatenate([box, box]), Form.CYLINDER: cylinder, Form.CUP: cylinder,
        Form.ELLIPSOID: np.concatenate([ring, upright]),
        Form.BOWL: np.concatenate([ring + up, bowl]),
    }  # fmt: skip
    return np.stack([by_form[form] for form in Form])


_OUTLINES = _outlines()


def held_rows(rows: Array, item: SimObject, camera: PinholeCamera, hand: int) -> Array:
    """Return the primitives of `item` and contents as the picture shows them, and of the gripper.

    Args:
        rows: the primitives in the world (n, COLUMNS).
        item: the held object.
        camera: the camera of the agent's frame.
        hand: index of the gripper in the picture's table of instances.
    """
    reach = math.tan(math.radians(camera.field_of_view) / 2) * _AWAY  # of half the picture, metres
    size = float(np.max(item.box_size))
    scale = 2 * min(_SMALLEST + _GROWTH * size, _LARGEST) * reach / size
    upright = camera.matrix @ _TILT @ euler_matrix((0.0, _TURN + item.front, 0.0)) @ item.matrix.T
    moved = rows.copy()
    moved[:, HALF : HALF + 3] *= scale
    axes = rows[:, AXES : AXES + 9].reshape(-1, 3, 3) @ upright.T
    moved[:, AXES : AXES + 9] = axes.reshape(-1, 9)
    centers = scale * (rows[:, CENTER : CENTER + 3] - item.center) @ upright.T
    outlines = _OUTLINES[rows[:, FORM].astype(int)].copy()
    outlines[:, :, [0, 2]] *= np.where(outlines[:, :, 1] < 0, rows[:, [BOTTOM]], rows[:, [TOP]])[
        :, :, None
    ]
    surfaces = centers[:, None] + np.einsum(
        "nkj,nj,nji->nki", outlines, moved[:, HALF : HALF + 3], axes
    )
    points = surfaces.reshape(-1, 3) @ camera.matrix  # right, up and forward of the object's middle
    low, high = points.min(axis=0), points.max(axis=0)
    # At `height`, a point is drawn at (height + y) / (away + z): the one that is drawn lowest is to
    # be at the foot.
    height = float(np.max(-_FOOT * reach / _AWAY * (_AWAY + points[:, 2]) - points[:, 1]))
    middle = np.array([0.0, height, _AWAY])
    moved[:, CENTER : CENTER + 3] = camera.position + centers + camera.matrix @ middle
    foot = points[points[:, 1] <= low[1] + _GRASPED * (high[1] - low[1])]
    away = max(_AWAY + float(foot[:, 2].mean()), _NEAREST)
    across = foot[:, 0] / (_AWAY + foot[:, 2]) * _AWAY / reach
    grip = primitives.rows(
        _gripper(float(across.min()), float(across.max())), np.zeros(3), np.eye(3), hand
    )
    return np.concatenate([moved, _in_picture(grip, away, away * reach / _AWAY, camera)])


def _gripper(left: float, right: float) -> list[ShapePart]:
    """Return a bar at the lower edge and two jaws beside what is held, in half heights."""
    middle = (left + right) / 2
    half = min(max((right - left) / 2, _NARROWEST), _WIDEST)
    parts = [
        ShapePart(
            Form.BOX,
            (middle, -1.03, 0.0),
            (half + 2 * _JAW[0] + _PAD[0], 0.05, _JAW[2]),
            _STEEL,
            Material.METAL,
        )
    ]
    for side in (-1, 1):
        inner = middle + side * half
        at = (inner + side * (_JAW[0] + _PAD[0]), -1 + _JAW[1], 0.0)
        parts.append(ShapePart(Form.BOX, at, _JAW, _STEEL, Material.METAL))
        parts.append(ShapePart(Form.BOX, (inner, -1 + 2 * _JAW[1] - _PAD[1], 0.0), _PAD, _RUBBER))
    return parts


def _in_picture(rows: Array, away: float, scale: float, camera: PinholeCamera) -> Array:
    """Return primitives in shares of the picture's half height, `away` metres from the camera."""
    at = camera.position + camera.matrix @ np.array([0.0, 0.0, away])
    rows[:, CENTER : CENTER + 3] = at + scale * rows[:, CENTER : CENTER + 3] @ camera.matrix.T
    rows[:, HALF : HALF + 3] *= scale
    rows[:, AXES : AXES + 9] = (
        rows[:, AXES : AXES + 9].reshape(-1, 3, 3) @ camera.matrix.T
    ).reshape(-1, 9)
    return rows
