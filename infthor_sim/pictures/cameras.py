"""The cameras of a simulation, and the pinhole camera that each one is drawn with."""

from dataclasses import dataclass

import numpy as np

from infthor_sim.agent import Agent
from infthor_sim.geometry import Array, euler_matrix
from infthor_sim.render.camera import FAR, NEAR, PinholeCamera
from infthor_sim.world import World

_POSITION_DIGITS = 5  # of the agent's camera, metres


@dataclass(frozen=True)
class ThirdPartyCamera:
    """A camera that is not the agent's.

    Attributes:
        position: metres (3,).
        rotation: Unity's Euler angles in degrees (3,).
        field_of_view: vertical, degrees.
        orthographic_size: metres from the middle of an orthographic picture to its upper edge; None
            for perspective.
        near, far: depths of the clipping planes, metres; None for the agent's far one, and the
            agent's near one in perspective or the camera itself.
    """

    position: Array
    rotation: Array
    field_of_view: float = 90.0
    orthographic_size: float | None = None
    near: float | None = None
    far: float | None = None


def map_camera(world: World) -> ThirdPartyCamera:
    """Return a camera that sees the whole scene from above."""
    low, high = world.scene_bounds()
    middle = (low + high) / 2
    size = float(max(high[0] - low[0], high[2] - low[2])) / 2 + 0.1
    # Just below the ceiling, which would hide the room otherwise.
    eye = np.array([middle[0], high[1] - 0.05, middle[2]])
    return ThirdPartyCamera(eye, np.array([90.0, 0.0, 0.0]), orthographic_size=size)


def agent_camera(agent: Agent, field_of_view: float, width: int, height: int) -> PinholeCamera:
    """Return the agent's own camera for pictures of `width` x `height` pixels."""
    # The metadata rounds a pose. A client that reads it and teleports back to it must get the same
    # picture.
    position = np.round(agent.camera_position(), _POSITION_DIGITS)
    return PinholeCamera(position, agent.camera_matrix(), field_of_view, width, height)


def pinhole_camera(camera: ThirdPartyCamera, width: int, height: int) -> PinholeCamera:
    """Return the pinhole camera that draws what a third-party camera sees."""
    matrix = euler_matrix(camera.rotation)
    far = FAR if camera.far is None else camera.far
    if camera.orthographic_size is None:
        near = NEAR if camera.near is None else camera.near
        angle = camera.field_of_view
        return PinholeCamera(camera.position, matrix, angle, width, height, near, far)
    # The ray caster has no parallel rays. A long lens from far away differs from them by less than
    # a pixel.
    away = camera.orthographic_size * 40.0
    angle = float(np.degrees(2 * np.arctan(camera.orthographic_size / away)))
    eye = camera.position - matrix[:, 2] * away
    near = away if camera.near is None else away + camera.near
    return PinholeCamera(eye, matrix, angle, width, height, near, away + far)
