"""What the agent sees: which objects, which point at a pixel, and an object from elsewhere."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.agent import Agent
from infthor_sim.geometry import Array
from infthor_sim.objects import SimObject
from infthor_sim.pictures.cameras import agent_camera
from infthor_sim.pictures.views import Display, Views
from infthor_sim.render.camera import NEAR, PinholeCamera
from infthor_sim.render.picture import Picture
from infthor_sim.render.primitives import INSTANCE
from infthor_sim.render.probe import VisibilityProbe
from infthor_sim.settings import SimulatorSettings
from infthor_sim.world import World

# of a picture's pixels that must show an object for it to be visible: 2 pixels at 300x300
_PIXEL_SHARE = 2.5e-5
_INNER_FRAME = 0.9  # of half the frame: what is nearer to its edge may be cut off
# of half the frame; gives the numbers of poses that AI2-THOR's tests state for FloorPlan28's fridge
_POSE_FRAME = 0.8
_TOUCHING = 0.05  # metres around a receptacle's box within which an object still counts as in it


class AgentVision:
    """What the agent of one world sees.

    Args:
        world: the world.
        views: pictures of the world.
        display: size of the pictures and the renderer.
        settings: the agent's, for its field of view and visibility distance.
    """

    def __init__(
        self, world: World, views: Views, display: Display, settings: SimulatorSettings
    ) -> None:
        self.settings = settings
        self._world = world
        self._views = views
        self._display = display
        self._visible: tuple[Picture, float, frozenset[str]] | None = None

    def visible_ids(self) -> frozenset[str]:
        """Return the ids of objects that AI2-THOR would call visible: shown and near enough."""
        view = self._views.agent_view()
        distance = self.settings.visibility_distance
        if self._visible is None or self._visible[0] is not view or self._visible[1] != distance:
            self._visible = (view, distance, self._visible_in(view))
        return self._visible[2]

    def _visible_in(self, picture: Picture) -> frozenset[str]:
        prims = picture.prims[picture.projection.index]
        pixels = self._display.rasterizer.count(picture.nearest, len(prims))
        counts = np.bincount(prims[:, INSTANCE].astype(int), pixels, len(picture.names))
        visible = set()
        for index in np.nonzero(counts >= _least_pixels(picture.camera))[0]:
            item = self._world.objects.get(picture.names[index])
            if item is not None and self._world.reach(item) <= self.settings.visibility_distance:
                visible.add(item.object_id)
        if self._world.agent.held is not None:
            held = self._world.objects[self._world.agent.held]
            visible.add(held.object_id)
            visible.update(
                o.object_id for o in self._world.descendants(held) if not self._world.is_hidden(o)
            )
        return frozenset(visible)

    def visible_in_container(self, item: SimObject) -> bool:
        """Return whether the agent would see the object if what contains it were not drawn.

        Only in recorded scenes: their receptacles are boxes, coarser than the real ones, and may
        hide what the agent of the recording saw in them. What is inside something closed stays
        hidden.
        """
        if not self._world.coarse or self._world.is_hidden(item):
            return False
        rows, _, names = self._views.primitives()
        containers = [names.index(o.object_id) for o in self._containers(item)]
        kept = rows[~np.isin(rows[:, INSTANCE], containers)]
        return item.object_id in self._visible_in(
            self._views.cast(kept, self._views.agent_view().camera)
        )

    def _containers(self, item: SimObject) -> list[SimObject]:
        """Return what contains the object, and the fixed receptacles whose box its middle is in."""
        point = item.center
        containers = list(self._world.ancestors(item))
        for other in self._world.objects.values():
            low, high = other.bounds()
            fixed = other.type.receptacle and not other.type.pickupable and other not in containers
            if fixed and bool(np.all((point > low - _TOUCHING) & (point < high + _TOUCHING))):
                containers.append(other)
        return [o for o in containers if o.object_type != "Floor" and o is not item]

    def probe(self, item: SimObject) -> VisibilityProbe:
        """Return a probe for an object from many poses; valid until the world changes."""
        rows, _, names = self._views.primitives()
        return VisibilityProbe(rows, names.index(item.object_id), self._display.rasterizer)

    def sees_from(self, agent: Agent, matrices: Array, probe: VisibilityProbe) -> NDArray[np.bool_]:
        """Return in which directions (n, 3, 3) of its camera the agent would see an object well.

        At any distance. A sliver at the edge of the frame does not count: AI2-THOR looks for points
        inside an object's outline.
        """
        slope = _POSE_FRAME * np.tan(np.radians(self.settings.field_of_view) / 2)
        field_of_view = float(np.degrees(2 * np.arctan(slope)))
        camera = agent_camera(agent, field_of_view, self._display.width, self._display.height)
        return probe.seen_by(camera, matrices, _least_pixels(camera))

    def point_at(self, x: float, y: float) -> Array | None:
        """Return the point (3,) at (x, y), shares of the frame from its bottom left, or None."""
        camera = self._views.agent_view().camera
        slope = np.tan(np.radians(camera.field_of_view) / 2)
        ray = np.array(
            [(2 * x - 1) * slope * camera.width / camera.height, (2 * y - 1) * slope, 1.0]
        )
        ahead = camera.matrix @ (ray / np.linalg.norm(ray))
        # A camera of one pixel that looks along the ray: the point may lie between the pixels of
        # the frame.
        aside = np.cross(camera.matrix[:, 1], ahead)
        aside /= np.linalg.norm(aside)
        pixel = PinholeCamera(
            camera.position, np.stack([aside, np.cross(ahead, aside), ahead], axis=1), 1.0, 1, 1
        )
        picture = self._views.cast(self._views.primitives()[0], pixel)
        if picture.instances[0, 0] < 0:
            return None
        point: Array = camera.position + ahead * picture.depth[0, 0]
        return point

    def in_frame(self, points: Array) -> NDArray[np.bool_]:
        """Return which points (n, 3) lie well within the agent's frame, hidden or not."""
        camera = self._views.agent_view().camera
        local = (points - camera.position) @ camera.matrix
        limit = _INNER_FRAME * np.tan(np.radians(camera.field_of_view) / 2)
        depth = np.maximum(local[:, 2], 1e-6)
        across = np.abs(local[:, 0]) <= depth * limit * camera.width / camera.height
        inside: NDArray[np.bool_] = (
            (local[:, 2] > NEAR) & across & (np.abs(local[:, 1]) <= depth * limit)
        )
        return inside


def _least_pixels(camera: PinholeCamera) -> int:
    return max(1, round(_PIXEL_SHARE * camera.width * camera.height))
