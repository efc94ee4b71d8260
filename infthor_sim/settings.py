"""The settings of `Initialize`, and AI2-THOR's quality levels and agent modes."""

from dataclasses import dataclass

ARM_MODES = ("arm", "stretch")
HAND_MODES = ("default", *ARM_MODES)  # of the agents that can do something to objects
LOCOBOT = "locobot"
AGENT_MODES = (*HAND_MODES, LOCOBOT)
PHYSICS_STEP = 0.02  # seconds of one step of Unity's physics
SMOOTH_QUALITIES = {"High": 5, "Very High": 6, "Ultra": 7, "High WebGL": 8}
"""The `quality` values whose pictures are anti-aliased, with the numbers that the Controller passes
to the player."""
SMOOTH_LEVELS = frozenset(SMOOTH_QUALITIES.values())


@dataclass(frozen=True)
class MotionNoise:
    """Gaussian noise of a robot's movements, as means and standard deviations.

    Attributes:
        step_mean, step_deviation: of the length of a step, metres.
        turn_mean, turn_deviation: of a turn, degrees.
    """

    step_mean: float = 0.0
    step_deviation: float = 0.0
    turn_mean: float = 0.0
    turn_deviation: float = 0.0


@dataclass(frozen=True)
class SimulatorSettings:
    """Settings of agent and pictures, AI2-THOR 5's defaults; metres, degrees, kilograms.

    Attributes:
        agent_mode: one of `AGENT_MODES`.
        agent_count: number of agents.
        bodies_drawn: agents see one another.
        mass_threshold: mass above which a loose object stops an arm; None: none does.
        grid_size: length of a step without `moveMagnitude`.
        snap_to_grid: keep positions free of rounding noise after whole steps.
        rotate_step: degrees of a turn without `degrees`.
        noise: of the movements of the locobot.
        sideways: the locobot may move to its sides.
        visibility_distance: horizontal distance within which objects are visible.
        field_of_view: vertical field of view of the agent's camera.
        depth: replies have depth pictures.
        normals: replies have pictures of surface normals.
        instances: replies have instance segmentation.
        classes: replies have semantic segmentation.
        fast_emit: replies to queries have no new state.
    """

    agent_mode: str = "default"
    agent_count: int = 1
    bodies_drawn: bool = True
    mass_threshold: float | None = None
    grid_size: float = 0.25
    snap_to_grid: bool = True
    rotate_step: float = 90.0
    noise: MotionNoise = MotionNoise()
    sideways: bool = False
    visibility_distance: float = 1.5
    field_of_view: float = 90.0
    depth: bool = False
    normals: bool = False
    instances: bool = False
    classes: bool = False
    fast_emit: bool = True
