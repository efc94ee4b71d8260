"""Pictures of one world: the agent's view, the client's frame, third-party cameras."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.pictures.cameras import ThirdPartyCamera, agent_camera, map_camera, pinhole_camera
from infthor_sim.render.arm import ARM, arm_rows
from infthor_sim.render.body import BODY, bodies_state, body_rows
from infthor_sim.render.camera import PinholeCamera
from infthor_sim.render.hand import HAND, held_rows
from infthor_sim.render.lighting import Lights
from infthor_sim.render.picture import (
    Picture,
    Rasterizer,
    cast_picture,
    colour_picture,
    compiled_rasterizer,
)
from infthor_sim.render.primitives import CENTER, HALF, INSTANCE
from infthor_sim.render.scene import SceneModel
from infthor_sim.settings import SimulatorSettings
from infthor_sim.world import World


@dataclass
class Display:
    """How pictures are drawn.

    Attributes:
        width, height: size of all pictures, pixels.
        antialias: smooth edges; the player's quality level sets it, and a Reset keeps it.
        map_view: the agent's frame shows the scene from above.
        rasterizer: implementation of the renderer.
    """

    width: int = 300
    height: int = 300
    antialias: bool = True
    map_view: bool = False
    rasterizer: Rasterizer = field(default_factory=compiled_rasterizer)


class Views:
    """Draws one world; keeps the agent's pictures until the world, the agent or the camera changes.

    The agent is the world's active one. Several agents have views of their own, which are asked
    only while their agent is active.

    Args:
        world: the world.
        display: size and quality of the pictures; may change at any time.
        settings: the agent's, for its field of view.
    """

    def __init__(self, world: World, display: Display, settings: SimulatorSettings) -> None:
        self.settings = settings
        self._display = display
        self._model = SceneModel(world)
        self._coloured: _Coloured | None = None
        self.show(world)

    def show(self, world: World) -> None:
        """Draw another state of the same scene from now on."""
        self._world = world
        self._model.show(world)
        self._view: Picture | None = None
        self._view_key: tuple[object, ...] | None = None
        self._frame: Picture | None = None
        self._frame_arm_version = -1

    def primitives(self) -> tuple[Array, Array, tuple[str, ...]]:
        """Return the scene's primitives, those of what the hand holds, and the instances' names."""
        return self._model.primitives()

    def cast(self, rows: Array, camera: PinholeCamera) -> Picture:
        """Return a picture of some of the scene's primitives (n, COLUMNS)."""
        return cast_picture(rows, self.primitives()[2], camera, self._display.rasterizer)

    def agent_view(self) -> Picture:
        """Return the agent's view without what it holds, which hides nothing, as in AI2-THOR."""
        agent = self._world.agent
        display = self._display
        # Walking changes the agent without a new version of the world, so its pose is part of the
        # key.
        key = (self._world.version, tuple(agent.position), agent.yaw, agent.horizon, agent.standing,
               display.width, display.height, self.settings.field_of_view,
               bodies_state(self._world))  # fmt: skip
        if self._view is None or key != self._view_key:
            rows, _, _ = self.primitives()
            camera = agent_camera(agent, self.settings.field_of_view, display.width, display.height)
            self._view = self.cast(rows, camera)
            self._frame = None
            self._view_key = key
        return self._view

    def agent_frame(self) -> Picture:
        """Return the agent's frame: its view with held object or arm, or the map in map view."""
        return (
            self.third_party(map_camera(self._world))
            if self._display.map_view
            else self._view_with_hand()
        )

    def _view_with_hand(self) -> Picture:
        view = self.agent_view()
        # The arm has a version of its own: bending it changes the frame, but not what the agent
        # sees.
        arm_version = -1 if self._world.arm is None else self._world.arm.version
        if self._frame is None or self._frame_arm_version != arm_version:
            rows, names = self._list_held()
            if not len(rows):
                return view
            held = self._world.agent.held
            if held is not None:
                rows = held_rows(rows, self._world.objects[held], view.camera, len(names) - 1)
            self._frame = cast_picture(rows, names, view.camera, self._display.rasterizer, view)
            self._frame_arm_version = arm_version
        return self._frame

    def _list_held(self) -> tuple[Array, tuple[str, ...]]:
        """Return the primitives of the agent's arm or held object, and all instances' names."""
        _, held, names = self.primitives()
        if self._world.arm is None:
            return held, (*names, HAND)
        return arm_rows(self._world.arm, self._world.agent, len(names)), (*names, ARM)

    def third_party(self, camera: ThirdPartyCamera) -> Picture:
        """Return what a third-party camera sees."""
        held, names = self._list_held()
        if BODY in names and self._world.agent.drawn:
            own = body_rows(self._world.agent, self._world.active, names.index(BODY))
            held = np.concatenate([held, own])
        pinhole = pinhole_camera(camera, self._display.width, self._display.height)
        rows = self.primitives()[0]
        # Unity's ceilings have no upper side, so that a camera above them sees into the rooms.
        lower = rows[:, CENTER + 1] - rows[:, HALF + 1]
        hidden = (rows[:, INSTANCE] == names.index("Ceiling")) & (lower < camera.position[1])
        return cast_picture(
            np.concatenate([rows[~hidden], held]), names, pinhole, self._display.rasterizer
        )

    def colours(self, picture: Picture) -> NDArray[np.uint8]:
        """Return a picture's RGB (h, w, 3), bottom row first; the last picture's is kept."""
        lights = self._model.lights()
        antialias = self._display.antialias
        kept = self._coloured
        if kept is None or not kept.is_of(picture, lights, antialias):
            rgb = colour_picture(picture, lights, self._display.rasterizer, antialias)
            self._coloured = kept = _Coloured(picture, lights, antialias, rgb)
        return kept.rgb


@dataclass(frozen=True)
class _Coloured:
    """A picture's colours, and all that they were made of."""

    picture: Picture
    lights: Lights
    antialias: bool
    rgb: NDArray[np.uint8]

    def is_of(self, picture: Picture, lights: Lights, antialias: bool) -> bool:
        # The picture itself is compared, not its content: an unchanged view is the same object.
        return (
            self.picture is picture
            and self.antialias == antialias
            and self.lights.daylight == lights.daylight
            and np.array_equal(self.lights.lamps, lights.lamps)
        )
