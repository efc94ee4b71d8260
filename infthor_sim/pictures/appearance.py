"""Randomized looks of a scene: materials, colours and light that differ from the usual ones."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from infthor_sim.geometry import Array

__all__ = ["Appearance", "Finish"]


@dataclass(frozen=True)
class Finish:
    """A randomized surface, of one object or of a part of the shell.

    Attributes:
        tint: factors of its colours (3,).
        pattern: pattern in place of the usual one; None keeps that.
    """

    tint: Array
    pattern: int | None = None


@dataclass
class Appearance:
    """The looks that the randomizing actions change; the defaults are the usual looks.

    Attributes:
        finishes: randomized surfaces, by object id or name of a part of the shell.
        brightness: factor of the daylight.
        light: colour of the light, factors (3,).
    """

    finishes: Mapping[str, Finish] = field(default_factory=dict)
    brightness: float = 1.0
    light: Array = field(default_factory=lambda: np.ones(3))
