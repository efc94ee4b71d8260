"""How a scene's colours differ from its usual ones: other materials and colours, and other light."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from infthor_eval.sim.geometry import Array

__all__ = ["Appearance", "Finish"]


@dataclass(frozen=True)
class Finish:
    """The surface of one object or of the walls: factors of its colours (3,), and another pattern where it has one."""

    tint: Array
    pattern: int | None = None


@dataclass
class Appearance:
    """What the randomizing actions change; as it is made, everything looks as usual.

    Attributes:
        finishes: by object id or name of a part of the shell.
        brightness: factor of the daylight.
        light: colour of the light, factors (3,).
    """

    finishes: Mapping[str, Finish] = field(default_factory=dict)
    brightness: float = 1.0
    light: Array = field(default_factory=lambda: np.ones(3))

    @property
    def usual(self) -> bool:
        """Whether no surface looks other than usual."""
        return not self.finishes and bool(np.all(self.light == 1.0))
