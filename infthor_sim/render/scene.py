"""A world as primitives: the rooms' shell and objects' shapes, cached until the object changes."""

import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.objects import SimObject
from infthor_sim.pictures.appearance import apply_finishes
from infthor_sim.render.body import BODY, bodies_state, body_rows
from infthor_sim.render.lighting import Lights
from infthor_sim.render.primitives import COLUMNS, rows
from infthor_sim.render.shapes import shape
from infthor_sim.render.shell import SHELL_NAMES, shell_rows
from infthor_sim.world import World

_DARK = 0.55  # factor of the daylight when every light switch is off


class SceneModel:
    """The primitives of one world; caches each object's rows by the object's version."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._rows: dict[str, tuple[int, int, Array]] = {}
        self._shell = shell_rows(world)
        self._state: tuple[object, ...] = ()
        self._all: Array = np.zeros((0, COLUMNS))
        self._names: tuple[str, ...] = ()
        self._held: Array = np.zeros((0, COLUMNS))

    def show(self, world: World) -> None:
        """Take another state of the same scene; no two have objects of one id and version."""
        self._world = world
        self._version = -1

    def primitives(self) -> tuple[Array, Array, tuple[str, ...]]:
        """Return all primitives but the held object's (n, COLUMNS), its own, instances' names.

        The held object is the active agent's.
        """
        state = (self._world.version, bodies_state(self._world))
        if self._state != state:
            self._rebuild()
            self._state = state
        return self._all, self._held, self._names

    def lights(self) -> Lights:
        """Return the lamps that are on, and the daylight by the state of the light switches."""
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

    def _rebuild(self) -> None:
        world = self._world
        names = [*SHELL_NAMES, *world.objects]
        parts = [self._shell]
        held = [np.zeros((0, COLUMNS))]
        # What the hand holds is drawn apart: it hides nothing from the agent's sight, and the frame
        # shows it smaller.
        in_hand = set()
        if world.agent.held is not None:
            item = world.objects[world.agent.held]
            in_hand = {o.object_id for o in (item, *world.descendants(item))}
        for index, item in enumerate(world.objects.values(), start=len(SHELL_NAMES)):
            # nobody sees into a closed fridge, so its contents need not be drawn
            if world.is_hidden(item):
                continue
            (held if item.object_id in in_hand else parts).append(self._object_rows(item, index))
        if len(world.agents) > 1:
            names.append(BODY)
            parts += [body_rows(a, i, len(names) - 1) for i, a in world.others() if a.drawn]
        self._rows = {key: value for key, value in self._rows.items() if key in world.objects}
        look = world.appearance
        self._all = apply_finishes(np.concatenate(parts), names, look)
        self._held = apply_finishes(np.concatenate(held), names, look)
        self._names = tuple(names)

    def _object_rows(self, item: SimObject, index: int) -> Array:
        entry = self._rows.get(item.object_id)
        if entry is None or entry[:2] != (item.version, index):
            entry = (item.version, index, rows(shape(item), item.position, item.matrix, index))
            self._rows[item.object_id] = entry
        return entry[2]
