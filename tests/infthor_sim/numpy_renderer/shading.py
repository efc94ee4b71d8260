"""Colours of the cast pixels, and light and shadow at creases, in numpy."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.creases_numba import DARKEST, LIGHTEST, ROWS, STRENGTH
from infthor_sim.render.lighting import (
    AMBIENT,
    HEADLIGHT,
    LAMP_REACH,
    SKY,
    SUN,
    SUN_DIRECTION,
    Lights,
)
from infthor_sim.render.patterns import PATTERNS
from infthor_sim.render.picture import surface
from infthor_sim.render.primitives import COLOR, EMISSION, MATERIAL

__all__ = ["brightness_at", "crease_factors", "shade"]


def crease_factors(depth: Array) -> Array:
    """Return factors of brightness (h, w), see `creases_numba.crease_factors`."""
    step = max(1, depth.shape[0] // ROWS)
    # In place where possible: temporaries of a whole picture cost more than the sums.
    inverse = np.pad(1.0 / depth, step, mode="edge")
    around = inverse[: -2 * step, step:-step] + inverse[2 * step :, step:-step]
    around += inverse[step:-step, : -2 * step]
    around += inverse[step:-step, 2 * step :]
    around *= depth
    around -= 4.0
    around *= -STRENGTH
    around += 1.0
    return np.clip(around, DARKEST, LIGHTEST, out=around)


def shade(
    prims: Array,
    projection: Projection,
    camera: PinholeCamera,
    depth: Array,
    nearest: NDArray[np.int32],
    factors: Array,
    lights: Lights,
) -> NDArray[np.uint8]:
    """Return RGB (h, w, 3), bottom row first, of cast pixels, each brightness times its factor."""
    us, vs = camera.rays()
    rgb = np.zeros((*nearest.shape, 3), dtype=np.uint8)
    ys, xs = np.nonzero(nearest >= 0)
    if not len(ys):
        return rgb
    order = nearest[ys, xs]
    p = prims[projection.index[order]]
    rays = us[xs], vs[ys], depth[ys, xs]
    level = (
        brightness_at(p, projection.origin[order], projection.steps[order], rays, camera, lights)
        * factors[ys, xs]
    )
    for i in range(3):
        rgb[ys, xs, i] = np.minimum(p[:, COLOR + i] * level * 255.0, 255.0).astype(np.uint8)
    return rgb


def brightness_at(
    p: Array,
    o: Array,
    s: Array,
    rays: tuple[Array, Array, Array],
    camera: PinholeCamera,
    lights: Lights,
) -> Array:
    """Return the brightness (n,) of primitives (n, COLUMNS) at depth t on rays (u, v, t)."""
    u, v, t = rays
    local = [o[:, i] + t * ((s[:, 0, i] + u * s[:, 1, i]) + v * s[:, 2, i]) for i in range(3)]
    normal, a, b = surface(p, local)
    ray = [
        (camera.matrix[i, 2] + u * camera.matrix[i, 0]) + v * camera.matrix[i, 1] for i in range(3)
    ]
    world = [camera.position[i] + t * ray[i] for i in range(3)]
    light = _light(normal, ray, world, lights)
    factor = np.ones(len(p))
    for material, pattern in PATTERNS.items():
        at = p[:, MATERIAL] == material
        factor[at] = pattern(a[at], b[at])
    glow = p[:, EMISSION]
    level: Array = glow * 1.15 + (1.0 - glow) * (light * factor)
    return level


def _light(normal: list[Array], ray: list[Array], world: list[Array], lights: Lights) -> Array:
    nx, ny, nz = normal
    length = np.sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2])
    facing = (nx * ray[0] + ny * ray[1] + nz * ray[2]) / length
    flip = np.where(facing > 0.0, -1.0, 1.0)
    nx = nx * flip
    ny = ny * flip
    nz = nz * flip
    facing = np.abs(facing)
    sun = nx * SUN_DIRECTION[0] + ny * SUN_DIRECTION[1] + nz * SUN_DIRECTION[2]
    light = (AMBIENT + SKY * ny + SUN * np.maximum(sun, 0.0) + HEADLIGHT * facing) * lights.daylight
    for lamp in lights.lamps:
        lx = lamp[0] - world[0]
        ly = lamp[1] - world[1]
        lz = lamp[2] - world[2]
        square = lx * lx + ly * ly + lz * lz
        cosine = (nx * lx + ny * ly + nz * lz) / (np.sqrt(square) + 1e-6)
        light = light + lamp[3] * np.maximum(cosine, 0.0) * (LAMP_REACH / (LAMP_REACH + square))
    return light
