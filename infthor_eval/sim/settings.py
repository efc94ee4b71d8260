"""What `Initialize` sets (how the agent moves and sees, which pictures are sent), and AI2-THOR's quality levels."""

from dataclasses import dataclass

__all__ = ["AGENT_MODES", "SMOOTH_LEVELS", "SMOOTH_QUALITIES", "SimulatorSettings"]

AGENT_MODES = ("default", "arm", "stretch")
SMOOTH_QUALITIES = {"High": 5, "Very High": 6, "Ultra": 7, "High WebGL": 8}
"""The `quality` values whose pictures are anti-aliased, with the numbers that the Controller passes to the player."""
SMOOTH_LEVELS = frozenset(SMOOTH_QUALITIES.values())


@dataclass(frozen=True)
class SimulatorSettings:
    """Parameters of the agent and of the pictures; names and defaults are those of AI2-THOR 5.

    Lengths in metres, angles in degrees, masses in kilograms.
    """

    agent_mode: str = "default"
    mass_threshold: float | None = None
    grid_size: float = 0.25
    snap_to_grid: bool = True
    rotate_step: float = 90.0
    visibility_distance: float = 1.5
    field_of_view: float = 90.0
    depth: bool = False
    normals: bool = False
    instances: bool = False
    classes: bool = False
    fast_emit: bool = True
