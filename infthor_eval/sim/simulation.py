"""One running simulator: the scene, the settings, the cameras, and the pictures of the present moment."""

import copy
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.agent import Agent
from infthor_eval.sim.arm.equipment import equip
from infthor_eval.sim.arm.surroundings import Solids, solids
from infthor_eval.sim.geometry import Array, euler_matrix
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.render.arm import ARM, arm_rows
from infthor_eval.sim.render.camera import FAR, NEAR, Camera
from infthor_eval.sim.render.glimpse import Glimpse
from infthor_eval.sim.render.hand import held_rows
from infthor_eval.sim.render.picture import Picture, Rasterizer, cast_picture, choose_rasterizer, colour_picture
from infthor_eval.sim.render.primitives import INSTANCE
from infthor_eval.sim.render.scene import SceneModel
from infthor_eval.sim.scenes.catalogue import Catalogue
from infthor_eval.sim.settings import SimulatorSettings
from infthor_eval.sim.visibility import enclosures, least_pixels, visible_ids
from infthor_eval.sim.world import World

__all__ = ["Simulation", "ThirdPartyCamera"]


_WELL_WITHIN = 0.9  # of half the frame
_LENS_DIGITS = 5  # of the camera's position, metres


@dataclass(frozen=True)
class ThirdPartyCamera:
    """A camera that is not the agent's; an orthographic size makes it a map view from above."""

    position: Array
    rotation: Array
    field_of_view: float = 90.0
    orthographic_size: float | None = None


@dataclass
class Simulation:
    """The state behind the protocol: everything that an action may read or change.

    Attributes:
        width: of the pictures, pixels.
        height: of the pictures, pixels.
        catalogue: makes worlds from scene names.
        antialias: whether edges in the pictures are smoothed; the player's quality decides, and a Reset leaves it.
        map_view: the agent's frame shows the scene from above.
        told: ids of the objects that replies tell of; None for all.
        failed_reset: why the last Reset found no scene; Initialize tells it again, as the client reads only that.
    """

    catalogue: Catalogue
    width: int = 300
    height: int = 300
    settings: SimulatorSettings = field(default_factory=SimulatorSettings)
    cameras: list[ThirdPartyCamera] = field(default_factory=list)
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    rasterizer: Rasterizer = field(default_factory=choose_rasterizer)
    antialias: bool = True
    map_view: bool = False
    told: frozenset[str] | None = None
    failed_reset: str = ""

    def __post_init__(self) -> None:
        self.load(self.catalogue.empty())

    def load(self, world: World) -> None:
        """Make `world` the present scene; settings stay until the next Initialize."""
        self.cameras.clear()
        self.told = None
        self.random = np.random.default_rng(world.seed)
        self._saved: dict[int, tuple[World, np.random.Generator]] = {}
        equip(world, self.settings.agent_mode)
        self._show(world)

    def save(self, slot: int) -> None:
        """Keep a copy of the present state of the scene, in place of an earlier one of this slot."""
        self._saved[slot] = copy.deepcopy((self.world, self.random))

    def restore(self, slot: int) -> bool:
        """Bring the kept state back, which stays kept; False where the slot has none of this scene."""
        if slot not in self._saved:
            return False
        world, self.random = copy.deepcopy(self._saved[slot])
        # Nothing that was made of the abandoned state may pass for the restored one's.
        newest = max((item.version for w in (self.world, world) for item in w.objects.values()), default=0)
        for item in world.objects.values():
            item.version = newest + 1
        world.version = self.world.version + 1
        self._show(world)
        return True

    def _show(self, world: World) -> None:
        self.world = world
        self._model = SceneModel(world)
        self._key: tuple[object, ...] | None = None
        self._full: Picture | None = None
        self._full_version = -1
        self._visible: frozenset[str] | None = None

    def told_objects(self) -> list[SimObject]:
        """The objects that replies tell of, in the order of the metadata."""
        return [o for o in self.world.objects.values() if self.told is None or o.object_id in self.told]

    def view(self) -> Picture:
        """The agent's view without what it holds, cast once per state of the world."""
        self._refresh()
        return self._view

    def full_view(self) -> Picture:
        """The agent's view with the held object, or its arm, in front."""
        self._refresh()
        version = -1 if self.world.arm is None else self.world.arm.version
        if self._full is None or self._full_version != version:
            shown, names = self._in_front()
            if not len(shown):
                return self._view
            self._full = cast_picture(shown, names, self._view.camera, self.rasterizer, self._view)
            self._full_version = version
        return self._full

    def _in_front(self) -> tuple[Array, tuple[str, ...]]:
        """What the agent's frame shows beside its view, and the names of all instances."""
        _, held, names = self._model.primitives()
        if self.world.arm is not None:
            return arm_rows(self.world.arm, self.world.agent, len(names)), (*names, ARM)
        if self.world.held is None:
            return held, names
        return held_rows(held, self.world.objects[self.world.held], self._view.camera), names

    def solids(self) -> Solids:
        """What stops an arm."""
        prims, _, names = self._model.primitives()
        return solids(self.world, prims, names, self.settings.mass_threshold)

    def agent_picture(self) -> Picture:
        """What the agent's frame shows: its view, or the map from above when the map view is on."""
        if not self.map_view:
            return self.full_view()
        return self.third_party(self.map_camera())

    def map_camera(self) -> ThirdPartyCamera:
        """A camera that sees the whole scene from above."""
        low, high = self.world.scene_bounds()
        middle = (low + high) / 2
        size = float(max(high[0] - low[0], high[2] - low[2])) / 2 + 0.1
        eye = np.array([middle[0], high[1] - 0.05, middle[2]])
        return ThirdPartyCamera(eye, np.array([90.0, 0.0, 0.0]), orthographic_size=size)

    def visible(self) -> frozenset[str]:
        """Ids of the objects that the agent sees within its visibility distance."""
        self._refresh()
        if self._visible is None:
            self._visible = visible_ids(self.world, self._view, self.settings.visibility_distance)
        return self._visible

    def glimpse(self, item: SimObject) -> Glimpse:
        """Looks for an object from many poses; good until the next change of the world."""
        prims, _, names = self._model.primitives()
        return Glimpse(prims, names.index(item.object_id), self.rasterizer)

    def sees_from(self, agent: Agent, glimpse: Glimpse) -> bool:
        """Whether the agent would see what `glimpse` looks for, at any distance, if it stood like `agent`."""
        lens = self._agent_camera(agent)
        return glimpse.seen_by(lens, least_pixels(lens))

    def hit(self, x: float, y: float) -> Array | None:
        """The point (3,) that the agent sees at (x, y), shares of the frame from its bottom left; None for the void."""
        lens = self.view().camera
        slope = np.tan(np.radians(lens.field_of_view) / 2)
        ray = np.array([(2 * x - 1) * slope * lens.width / lens.height, (2 * y - 1) * slope, 1.0])
        ahead = lens.matrix @ (ray / np.linalg.norm(ray))
        aside = np.cross(lens.matrix[:, 1], ahead)
        aside /= np.linalg.norm(aside)
        pixel = Camera(lens.position, np.stack([aside, np.cross(ahead, aside), ahead], axis=1), 1.0, 1, 1)
        prims, _, names = self._model.primitives()
        picture = cast_picture(prims, names, pixel, self.rasterizer)
        if picture.instances[0, 0] < 0:
            return None
        point: Array = lens.position + ahead * picture.depth[0, 0]
        return point

    def in_view(self, points: Array) -> NDArray[np.bool_]:
        """Which of some points (n, 3) lie well within the agent's frame, whatever may hide them."""
        camera = self.view().camera
        local = (points - camera.position) @ camera.matrix
        limit = _WELL_WITHIN * np.tan(np.radians(camera.field_of_view) / 2)
        depth = np.maximum(local[:, 2], 1e-6)
        across = np.abs(local[:, 0]) <= depth * limit * camera.width / camera.height
        inside: NDArray[np.bool_] = (local[:, 2] > NEAR) & across & (np.abs(local[:, 1]) <= depth * limit)
        return inside

    def visible_inside(self, item: SimObject) -> bool:
        """Whether the agent would see the object if what contains it were not drawn.

        Only in recorded scenes: their receptacles are boxes, coarser than the real ones, and may hide what the
        agent of the recording saw in them. What is inside something closed stays hidden.
        """
        if not self.world.coarse or self.world.hidden(item):
            return False
        around = enclosures(self.world, item)
        prims, _, names = self._model.primitives()
        kept = prims[~np.isin(prims[:, INSTANCE], [names.index(o.object_id) for o in around])]
        picture = cast_picture(kept, names, self.view().camera, self.rasterizer)
        return item.object_id in visible_ids(self.world, picture, self.settings.visibility_distance)

    def colours(self, picture: Picture) -> NDArray[np.uint8]:
        """RGB (h, w, 3), bottom row first."""
        return colour_picture(picture, self._model.lights(), self.rasterizer, self.antialias)

    def third_party(self, camera: ThirdPartyCamera) -> Picture:
        """What a third-party camera sees."""
        prims, held, names = self._model.primitives()
        lens = self._lens(camera)
        if self.world.arm is not None:
            held, names = self._in_front()
        return cast_picture(np.concatenate([prims, held]), names, lens, self.rasterizer)

    def _agent_camera(self, agent: Agent) -> Camera:
        angle = self.settings.field_of_view
        # The metadata rounds a pose: one that is told and set again must give the same picture.
        position = np.round(agent.camera_position(), _LENS_DIGITS)
        return Camera(position, agent.camera_matrix(), angle, self.width, self.height)

    def _lens(self, camera: ThirdPartyCamera) -> Camera:
        matrix = euler_matrix(camera.rotation)
        if camera.orthographic_size is None:
            return Camera(camera.position, matrix, camera.field_of_view, self.width, self.height)
        away = camera.orthographic_size * 40.0  # a long lens from far away is an orthographic view
        angle = float(np.degrees(2 * np.arctan(camera.orthographic_size / away)))
        eye = camera.position - matrix[:, 2] * away
        return Camera(eye, matrix, angle, self.width, self.height, near=away, far=away + FAR)

    def _refresh(self) -> None:
        agent = self.world.agent
        key = (self.world.version, tuple(agent.position), agent.yaw, agent.horizon, agent.standing, self.width,
               self.height, self.settings.field_of_view, self.settings.visibility_distance)  # fmt: skip
        if key == self._key:
            return
        prims, _, names = self._model.primitives()
        self._view = cast_picture(prims, names, self._agent_camera(agent), self.rasterizer)
        self._full = None
        self._visible = None
        self._key = key

    def configure(self, **changes: object) -> None:
        """Changes some of the settings."""
        self.settings = replace(self.settings, **changes)  # type: ignore[arg-type]
