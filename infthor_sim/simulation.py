"""A running simulator's state: scene, settings, cameras, random numbers, saved states.

Each agent mode has its camera and arm.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from infthor_sim.agent import CAMERA_HEIGHT, CROUCH, MAX_DOWN
from infthor_sim.arm.arm import Arm
from infthor_sim.arm.holding import drop_all
from infthor_sim.arm.kinova import Kinova
from infthor_sim.arm.rig import Rig
from infthor_sim.arm.stretch import Stretch
from infthor_sim.objects import SimObject
from infthor_sim.physics.crowd import set_agent_count
from infthor_sim.physics.falling import let_fall
from infthor_sim.pictures.cameras import ThirdPartyCamera
from infthor_sim.pictures.views import Display, Views
from infthor_sim.pictures.vision import AgentVision
from infthor_sim.saved_state import SavedState
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.settings import LOCOBOT, SimulatorSettings
from infthor_sim.world import World

_RIGS: dict[str, type[Kinova] | type[Stretch]] = {"arm": Kinova, "stretch": Stretch}


@dataclass
class Simulation:
    """The state that actions read and change.

    Attributes:
        catalogue: builds worlds from scene names.
        display: size and quality of the pictures.
        settings: the agent's settings, as the last Initialize left them.
        cameras: third-party cameras, by their ids.
        random: random numbers of the actions that draw some.
        object_filter: ids of the objects that replies list; None for all.
        n_loaded: number of scenes loaded so far. What is kept by object id and version is of one.
        time: simulated seconds since the scene was loaded.
        failed_reset: why the last Reset loaded no scene. Initialize repeats it, as the client reads
            only its reply.
        world: the scene.
    """

    catalogue: Catalogue
    display: Display = field(default_factory=Display)
    settings: SimulatorSettings = field(default_factory=SimulatorSettings)
    cameras: list[ThirdPartyCamera] = field(default_factory=list)
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    object_filter: frozenset[str] | None = None
    n_loaded: int = 0
    time: float = 0.0
    failed_reset: str = ""
    world: World = field(init=False)

    def __post_init__(self) -> None:
        self.load(self.catalogue.empty())

    def load(self, world: World) -> None:
        """Make `world` the present scene; settings stay until the next Initialize."""
        self.n_loaded += 1
        self.time = 0.0
        self.cameras.clear()
        self.object_filter = None
        self.random = np.random.default_rng(world.seed)
        self._saved: dict[int, SavedState[tuple[World, np.random.Generator]]] = {}
        equip(world, self.settings.agent_mode)
        self.world = world
        self._show(world)

    def configure(self, settings: SimulatorSettings) -> None:
        """Give the agents other settings and the arm of their agent mode."""
        self.settings = settings
        equip(self.world, settings.agent_mode)
        self.world.agent.drawn = settings.bodies_drawn
        set_agent_count(self.world, settings.agent_count, settings.grid_size)
        if len(self.world.agents) != len(self._views):
            self._show(self.world)
        for views, vision in zip(self._views, self._visions, strict=True):
            views.settings = vision.settings = settings

    def save(self, slot: int) -> None:
        """Keep a copy of the scene's state and random numbers, in place of what the slot held."""
        self._saved[slot] = SavedState((self.world, self.random))

    def restore(self, slot: int) -> bool:
        """Bring back a slot's state, which stays kept; return False if none is of this scene."""
        if slot not in self._saved:
            return False
        world, self.random = self._saved[slot].copy()
        # Versions go on from the abandoned state's, so that none is ever given to two states of an
        # object. So what is kept of objects (packed metadata, primitives) by their versions holds
        # for those that the restored state has unchanged.
        world.version = self.world.version + 1
        self.world = world
        if len(world.agents) == len(self._views):
            for views in self._views:
                views.show(world)
            self._look()
        else:
            self._show(world)
        return True

    def _show(self, world: World) -> None:
        self._views = [Views(world, self.display, self.settings) for _ in world.agents]
        self._look()

    def _look(self) -> None:
        self._visions = [
            AgentVision(self.world, views, self.display, self.settings) for views in self._views
        ]

    @property
    def views(self) -> Views:
        """Pictures of the scene by the active agent."""
        return self._views[self.world.active]

    @property
    def vision(self) -> AgentVision:
        """Queries about what the active agent sees."""
        return self._visions[self.world.active]

    def each_agent(self) -> Iterator[int]:
        """Make every agent the active one in turn and yield its id; end with the one of before."""
        active = self.world.active
        for number in range(len(self.world.agents)):
            self.world.active = number
            yield number
        self.world.active = active

    def reported_objects(self) -> list[SimObject]:
        """Return the objects that replies list, in the order of the metadata."""
        objects = self.world.objects.values()
        return [
            o for o in objects if self.object_filter is None or o.object_id in self.object_filter
        ]


class _Camera(NamedTuple):
    """The camera of an agent mode, from Unity's sources.

    Attributes:
        eye: position relative to the agent's (right, up, ahead), metres.
        crouch: metres that crouching lowers it.
        max_down: degrees that it tilts below the horizon at most.
    """

    eye: tuple[float, float, float]
    crouch: float
    max_down: float


_USUAL = _Camera((0.0, CAMERA_HEIGHT, 0.0), CROUCH, MAX_DOWN)


_CAMERAS = {
    "stretch": _Camera((0.00192, 0.5447, 0.06788), 0.0, MAX_DOWN),
    LOCOBOT: _Camera((0.0, -0.0312, 0.0), 0.0, 30.0),
}


def equip(world: World, agent_mode: str) -> None:
    """Give an agent the camera and the resting arm of an agent mode; what it held falls."""
    if world.arm is not None:
        drop_all(world, world.arm)
    rig: Rig | None = _RIGS[agent_mode]() if agent_mode in _RIGS else None
    if (rig is not None or agent_mode == LOCOBOT) and world.agent.held is not None:
        held = world.objects[world.agent.held]
        world.let_go(held)
        let_fall(world, held, held.center)
    world.arm = None if rig is None else Arm(rig, rig.rest())
    camera = _CAMERAS.get(agent_mode, _USUAL)
    world.agent.eye, world.agent.crouch, world.agent.max_down = camera
    world.mark_changed()
