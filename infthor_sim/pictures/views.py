"""Pictures of one world: the agent's view, the client's frame, third-party cameras."""

from collections.abc import Iterator, Set
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.objects import SimObject
from infthor_sim.pictures.appearance import apply_finishes
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
    digest_of_colours,
)
from infthor_sim.render.primitives import CENTER, COLUMNS, HALF, INSTANCE, rows
from infthor_sim.render.shapes import shape
from infthor_sim.render.shell import SHELL_NAMES, shell_rows
from infthor_sim.settings import SimulatorSettings
from infthor_sim.world import World

_DARK = 0.55  # factor of the daylight when every light switch is off


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
        self._model = _SceneModel(world)
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

    def digest_of_colours(self, picture: Picture) -> str:
        """Return a digest that pictures of the same colours share, without drawing them."""
        display = self._display
        lights = self._model.lights()
        return digest_of_colours(picture, lights, display.rasterizer, display.antialias)


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


class _SceneModel:
    """The primitives of one world: the rooms' shell and objects' shapes.

    Each object's rows are kept until its version changes, and those of all that the hand does not
    hold as long as it alone moves.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._rows: dict[str, tuple[int, int, Array]] = {}
        self._shell = shell_rows(world)
        self._state: tuple[object, ...] = ()
        self._state_around: tuple[object, ...] = ()
        self._lit: tuple[int, Lights] | None = None
        self._all: Array = np.zeros((0, COLUMNS))
        self._names: tuple[str, ...] = ()
        self._held: Array = np.zeros((0, COLUMNS))

    def show(self, world: World) -> None:
        """Take another state of the same scene; no two have objects of one id and version."""
        self._world = world
        self._state = self._state_around = ()
        self._lit = None

    def primitives(self) -> tuple[Array, Array, tuple[str, ...]]:
        """Return all primitives but the held object's (n, COLUMNS), its own, instances' names.

        The held object is the active agent's.
        """
        world = self._world
        bodies = bodies_state(world)
        state = (world.version, bodies)
        if self._state != state:
            self._rebuild((world.version_around, world.agent.held, bodies))
            self._state = state
        return self._all, self._held, self._names

    def lights(self) -> Lights:
        """Return the lamps that are on, and the daylight by the state of the light switches."""
        if self._lit is None or self._lit[0] != self._world.version:
            self._lit = self._world.version, self._find_lights()
        return self._lit[1]

    def _find_lights(self) -> Lights:
        lamps = []
        switches = []
        for item in self._world.objects.values():
            if item.type.light and item.state.toggled:
                low, high = item.bounds()
                lamps.append(
                    [
                        (low[0] + high[0]) / 2,
                        high[1] - 0.08,
                        (low[2] + high[2]) / 2,
                        item.type.light,
                    ]
                )
            elif item.object_type == "LightSwitch":
                switches.append(item.state.toggled)
        dark = bool(switches) and not any(switches)
        daylight = (_DARK if dark else 1.0) * self._world.appearance.brightness
        return Lights(np.array(lamps).reshape(-1, 4), daylight)

    def _rebuild(self, around: tuple[object, ...]) -> None:
        world = self._world
        names = (*SHELL_NAMES, *world.objects)
        if len(world.agents) > 1:
            names = (*names, BODY)
        # What the hand holds is drawn apart: it hides nothing from the agent's sight, and the frame
        # shows it smaller.
        in_hand = set()
        if world.agent.held is not None:
            item = world.objects[world.agent.held]
            in_hand = {o.object_id for o in (item, *world.descendants(item))}
        if self._state_around != around:
            self._rows = {key: value for key, value in self._rows.items() if key in world.objects}
            parts = [self._shell, *self._shown_rows(world.objects.keys() - in_hand)]
            if BODY in names:
                parts += [body_rows(a, i, len(names) - 1) for i, a in world.others() if a.drawn]
            self._all = apply_finishes(np.concatenate(parts), names, world.appearance)
            self._state_around = around
        held = [np.zeros((0, COLUMNS)), *self._shown_rows(in_hand)]
        self._held = apply_finishes(np.concatenate(held), names, world.appearance)
        self._names = names

    def _shown_rows(self, ids: Set[str]) -> Iterator[Array]:
        for index, item in enumerate(self._world.objects.values(), start=len(SHELL_NAMES)):
            # nobody sees into a closed fridge, so its contents need not be drawn
            if item.object_id in ids and not self._world.is_hidden(item):
                yield self._object_rows(item, index)

    def _object_rows(self, item: SimObject, index: int) -> Array:
        entry = self._rows.get(item.object_id)
        if entry is None or entry[:2] != (item.version, index):
            entry = (item.version, index, rows(shape(item), item.position, item.matrix, index))
            self._rows[item.object_id] = entry
        return entry[2]
