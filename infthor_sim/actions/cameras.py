# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Pictures: resolution, quality, third-party cameras, the map view."""

from typing import Any

import numpy as np

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, to_array
from infthor_sim.pictures.cameras import ThirdPartyCamera
from infthor_sim.render.camera import FAR, NEAR
from infthor_sim.settings import SMOOTH_QUALITIES
from infthor_sim.simulation import Simulation

_LARGEST = 4096  # pixels
_DEFAULT_SIZE = 5.0  # metres from the middle of an orthographic picture to its upper edge


@action("ChangeResolution")
def change_resolution(sim: Simulation, x: int, y: int) -> None:
    """Change the size of all pictures, pixels."""
    if not (1 <= x <= _LARGEST and 1 <= y <= _LARGEST):
        raise ActionError(f"The resolution must be within 1 to {_LARGEST}, not {x}x{y}")
    sim.display.width, sim.display.height = int(x), int(y)


@action("ChangeQuality")
def change_quality(sim: Simulation, quality: str) -> None:
    """Smooth edges from `High` on; below, pictures are drawn faster without."""
    sim.display.antialias = quality in SMOOTH_QUALITIES


@action("AddThirdPartyCamera")
def add_third_party_camera(
    sim: Simulation,
    position: Vector3 | None = None,
    rotation: Vector3 | None = None,
    fieldOfView: float = 90.0,
    orthographic: bool = False,
    orthographicSize: float = _DEFAULT_SIZE,
    skyboxColor: Any = None,
    nearClippingPlane: float | None = None,
    farClippingPlane: float | None = None,
    antiAliasing: str = "none",
) -> None:
    """Add a camera; its frames come with every reply from now on."""
    camera = ThirdPartyCamera(
        to_array(position or {}),
        to_array(rotation or {}),
        float(fieldOfView),
        orthographicSize if orthographic else None,
        nearClippingPlane,
        farClippingPlane,
    )
    _check(camera)
    sim.cameras.append(camera)


@action("UpdateThirdPartyCamera")
def update_third_party_camera(
    sim: Simulation,
    thirdPartyCameraId: int = 0,
    position: Vector3 | None = None,
    rotation: Vector3 | None = None,
    fieldOfView: float | None = None,
    skyboxColor: Any = None,
    orthographic: bool | None = None,
    orthographicSize: float | None = None,
    nearClippingPlane: float | None = None,
    farClippingPlane: float | None = None,
) -> None:
    """Move a third-party camera or change its lens; each component that is not passed stays."""
    if not 0 <= thirdPartyCameraId < len(sim.cameras):
        raise ActionError(f"There is no third party camera with id {thirdPartyCameraId}")
    old = sim.cameras[thirdPartyCameraId]
    camera = ThirdPartyCamera(
        _update_vector(old.position, position),
        _update_vector(old.rotation, rotation),
        old.field_of_view if fieldOfView is None else float(fieldOfView),
        _update_size(old, orthographic, orthographicSize),
        old.near if nearClippingPlane is None else nearClippingPlane,
        old.far if farClippingPlane is None else farClippingPlane,
    )
    _check(camera)
    sim.cameras[thirdPartyCameraId] = camera


def _update_vector(old: Array, new: Vector3 | None) -> Array:
    return np.array(
        [float((new or Vector3()).get(axis, was)) for axis, was in zip("xyz", old, strict=True)]
    )


def _update_size(
    old: ThirdPartyCamera, orthographic: bool | None, size: float | None
) -> float | None:
    """Return the orthographic size of a changed camera; None for one in perspective."""
    if not (old.orthographic_size is not None if orthographic is None else orthographic):
        return None
    return size if size is not None else old.orthographic_size or _DEFAULT_SIZE


@action("ToggleMapView")
def toggle_map_view(sim: Simulation) -> None:
    """Switch the agent's frame between its camera and a map of the scene from above."""
    sim.display.map_view = not sim.display.map_view


def _check(camera: ThirdPartyCamera) -> None:
    """Refuse a lens that draws nothing."""
    size, angle = camera.orthographic_size, camera.field_of_view
    if size is not None and size <= 0:
        raise ActionError(f"orthographicSize must be positive, not {size}")
    if not 0 < angle < 180:
        raise ActionError(f"fieldOfView must be in (0, 180) noninclusive, not {angle}")
    near = NEAR if camera.near is None else camera.near
    far = FAR if camera.far is None else camera.far
    if not 0 < near < far:
        raise ActionError(
            "clipping planes must be 0 < nearClippingPlane < farClippingPlane, not "
            f"{near} and {far}"
        )
