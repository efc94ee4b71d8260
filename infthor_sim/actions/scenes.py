"""Starting scenes: Reset, Initialize, CreateHouse."""

from typing import Any

from infthor_sim.actions.registry import action
from infthor_sim.errors import ActionError, DataError, ErrorCode
from infthor_sim.physics.crowd import MOST_AGENTS
from infthor_sim.render.camera import FAR, NEAR
from infthor_sim.settings import AGENT_MODES, ARM_MODES, LOCOBOT, MotionNoise, SimulatorSettings
from infthor_sim.simulation import Simulation

# vertical fields of view without `fieldOfView`, degrees
_VIEW = 90.0
_LOCOBOT_VIEW = 60.0


@action("Reset")
def reset(sim: Simulation, sceneName: str) -> None:
    """Load a scene by name."""
    try:
        world = sim.catalogue.load(sceneName)
    except DataError as error:
        sim.failed_reset = str(error)
        raise ActionError(str(error)) from error
    sim.failed_reset = ""
    sim.settings = SimulatorSettings()
    sim.display.map_view = False
    sim.load(world)


@action("Initialize", lenient=True)
def initialize(
    sim: Simulation,
    agentMode: str = "default",
    gridSize: float = 0.25,
    snapToGrid: bool = True,
    rotateStepDegrees: float = 90.0,
    visibilityDistance: float = 1.5,
    fieldOfView: float | None = None,
    renderDepthImage: bool = False,
    renderNormalsImage: bool = False,
    renderInstanceSegmentation: bool = False,
    renderObjectImage: bool = False,
    renderSemanticSegmentation: bool = False,
    renderClassImage: bool = False,
    fastActionEmit: bool = True,
    agentCount: int = 1,
    makeAgentsVisible: bool = True,
    applyActionNoise: bool = True,
    movementGaussianMu: float = 0.001,
    movementGaussianSigma: float = 0.005,
    rotateGaussianMu: float = 0.0,
    rotateGaussianSigma: float = 0.5,
    allowHorizontalMovement: bool = False,
    massThreshold: float | None = None,
) -> dict[str, float]:
    """Set up the agents; arguments that only Unity knows are ignored, as Unity does here."""
    # The client raises on the reply to Initialize, which follows Reset, and not on Reset's.
    if sim.failed_reset:
        raise ActionError(sim.failed_reset)
    mode = agentMode.lower()
    if mode not in AGENT_MODES:
        raise ActionError(
            f"agentMode {agentMode!r} is not offered by the embedded simulator; use one of "
            f"{', '.join(AGENT_MODES)}"
        )
    _check(
        1 <= agentCount <= MOST_AGENTS,
        f"agentCount must be 1 to {MOST_AGENTS}, not {agentCount}",
    )
    _check(
        agentCount == 1 or mode not in ARM_MODES,
        f"agentCount must be 1 with agentMode {agentMode!r}, not {agentCount}",
    )
    _check(gridSize > 0, f"gridSize must be positive, not {gridSize}")
    _check(rotateStepDegrees > 0, f"rotateStepDegrees must be positive, not {rotateStepDegrees}")
    if fieldOfView is None:
        fieldOfView = _LOCOBOT_VIEW if mode == LOCOBOT else _VIEW
    _check(
        0 < fieldOfView < 180, f"fieldOfView must be in (0, 180) noninclusive, not {fieldOfView}"
    )
    _check(
        visibilityDistance >= 0, f"visibilityDistance must be at least 0, not {visibilityDistance}"
    )
    if massThreshold is not None and massThreshold <= 0:
        raise ActionError(f"massThreshold must have nonzero value - invalid value: {massThreshold}")
    for name, sigma in (("movement", movementGaussianSigma), ("rotate", rotateGaussianSigma)):
        _check(sigma >= 0, f"{name}GaussianSigma must be at least 0, not {sigma}")
    noise = MotionNoise(
        movementGaussianMu, movementGaussianSigma, rotateGaussianMu, rotateGaussianSigma
    )
    settings = SimulatorSettings(
        agent_mode=mode,
        agent_count=int(agentCount),
        bodies_drawn=makeAgentsVisible,
        mass_threshold=massThreshold,
        grid_size=float(gridSize),
        snap_to_grid=snapToGrid and mode != LOCOBOT,
        rotate_step=float(rotateStepDegrees),
        noise=noise if applyActionNoise and mode == LOCOBOT else MotionNoise(),
        sideways=allowHorizontalMovement,
        visibility_distance=float(visibilityDistance),
        field_of_view=float(fieldOfView),
        depth=renderDepthImage,
        normals=renderNormalsImage,
        instances=renderInstanceSegmentation or renderObjectImage,
        classes=renderSemanticSegmentation or renderClassImage,
        fast_emit=fastActionEmit,
    )
    sim.configure(settings)
    return {"cameraNearPlane": NEAR, "cameraFarPlane": FAR}


@action("CreateHouse")
def create_house(sim: Simulation, house: dict[str, Any]) -> None:
    """Build a ProcTHOR house from its JSON."""
    try:
        world = sim.catalogue.house(house)
    except DataError as error:
        raise ActionError(str(error)) from error
    sim.load(world)


def _check(holds: bool, message: str) -> None:
    if not holds:
        raise ActionError(message, ErrorCode.INVALID_ARGUMENT)
