"""The lights of a picture: a sun, the sky's ambient light, one at the camera, and lamps."""

from dataclasses import dataclass

import numpy as np

from infthor_sim.geometry import Array

# brightness; the headlight shows shapes that the sun misses
AMBIENT = 0.46
SKY = 0.12
SUN = 0.3
HEADLIGHT = 0.16
# towards the sun, unit length
SUN_DIRECTION = (0.40824829046386296, 0.8164965809277259, -0.40824829046386313)
LAMP_REACH = 0.35  # squared metres at which a lamp's light has fallen to half


@dataclass(frozen=True)
class Lights:
    """The lights of a picture that vary.

    Attributes:
        lamps: positions and strength of the lamps that are on (n, 4).
        daylight: factor of all other light; 1 with the ceiling light on.
    """

    lamps: Array
    daylight: float = 1.0

    @classmethod
    def none(cls) -> "Lights":
        """Return full daylight without lamps."""
        return cls(np.zeros((0, 4)))
