"""An agent: its position, the direction it looks in, and what its hand holds."""

from dataclasses import dataclass

import numpy as np

from infthor_sim.geometry import Array, euler_matrix, yaw_matrix

AGENT_HEIGHT = 0.9009992  # agent.y of AI2-THOR's default agent on a floor at 0
AGENT_RADIUS = 0.2  # of the agent's capsule, metres
CAMERA_HEIGHT = 0.675  # camera above agent.y, fitted to the boxes recorded in ALFRED
# degrees that the default agent's camera tilts below the horizon, and all agents' above it
MAX_DOWN = 60.0
MAX_UP = 30.0
CROUCH = 0.35  # metres that crouching lowers the camera


@dataclass(frozen=True)
class Grip:
    """Pose of a held object relative to what holds it: the camera, or the wrist of an arm.

    Attributes:
        offset: the object's origin, metres (3,).
        turn: the object's rotation (3, 3).
    """

    offset: Array
    turn: Array


# where AI2-THOR has its agent's hand, in the camera's frame
HAND_AT_REST = Grip(np.array([0.0, -0.16, 0.38]), np.eye(3))


@dataclass
class Agent:
    """One agent.

    Attributes:
        position: metres (3,).
        yaw: direction, degrees clockwise from +z.
        horizon: tilt of the camera below the horizon, degrees.
        standing: not crouching.
        eye: camera relative to the agent's position (right, up, ahead), metres; the stretch robot's
            is off centre.
        crouch: metres that crouching lowers the camera; 0 for a robot that cannot crouch.
        max_down: degrees that the camera tilts below the horizon at most.
        held: id of the object in its hand; None for an empty hand.
        grip: pose of the held object in the camera's frame; None for the usual one after a pick-up.
        hand: pose of the hand in the camera's frame; the held object keeps its place in it.
        drawn: other agents and cameras see it.
    """

    position: Array
    yaw: float = 0.0
    horizon: float = 0.0
    standing: bool = True
    eye: tuple[float, float, float] = (0.0, CAMERA_HEIGHT, 0.0)
    crouch: float = CROUCH
    max_down: float = MAX_DOWN
    held: str | None = None
    grip: Grip | None = None
    hand: Grip = HAND_AT_REST
    drawn: bool = True

    def camera_position(self) -> Array:
        """Return the position of the camera in the world, metres (3,)."""
        lift = self.eye[1] if self.standing else self.eye[1] - self.crouch
        aside = yaw_matrix(self.yaw) @ np.array([self.eye[0], 0.0, self.eye[2]])
        return self.position + aside + np.array([0.0, lift, 0.0])

    def camera_matrix(self) -> Array:
        """Return the rotation matrix (3, 3) of the camera."""
        return euler_matrix((self.horizon, self.yaw, 0.0))

    def empty_hand(self) -> None:
        """Let go of what the hand holds, and bring the hand back to where it rests."""
        self.held = self.grip = None
        self.hand = HAND_AT_REST
