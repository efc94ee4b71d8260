"""What `Initialize` sets: how the agent moves and sees, and which pictures are sent."""

from dataclasses import dataclass

__all__ = ["AGENT_MODES", "SimulatorSettings"]

AGENT_MODES = ("default",)  # the arm agent registers its mode here when it comes


@dataclass(frozen=True)
class SimulatorSettings:
    """Parameters of the agent and of the pictures; names and defaults are those of AI2-THOR 5.

    Lengths in metres, angles in degrees.
    """

    agent_mode: str = "default"
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
    supersample: bool = False
