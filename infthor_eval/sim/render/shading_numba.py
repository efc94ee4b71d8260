"""Colours of the cast pixels, compiled by numba."""

import math
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render import patterns
from infthor_eval.sim.render.camera import PinholeCamera, Projection
from infthor_eval.sim.render.lighting import AMBIENT, HEADLIGHT, LAMP_REACH, SKY, SUN, SUN_DIRECTION, Lights
from infthor_eval.sim.render.primitives import AXES, BOTTOM, COLOR, EMISSION, FORM, HALF, MATERIAL, TOP, Form, Material

__all__ = ["brightness_at", "shade"]

_RIM = 1.0 - 1e-6  # |y| of hits that count as on a cylinder's flat end, with a margin for rounding
_BANDS = 8  # of rows, shaded in parallel
_BOX, _ELLIPSOID, _CUP, _BOWL = int(Form.BOX), int(Form.ELLIPSOID), int(Form.CUP), int(Form.BOWL)
_SUN_X, _SUN_Y, _SUN_Z = SUN_DIRECTION
_WOOD, _PLANKS, _TILES = int(Material.WOOD), int(Material.PLANKS), int(Material.TILES)
_FABRIC, _STONE, _METAL = int(Material.FABRIC), int(Material.STONE), int(Material.METAL)
_GLASS, _PAPER, _CARPET = int(Material.GLASS), int(Material.PAPER), int(Material.CARPET)
# Compiled here and not in `patterns`, which must work without numba.
_wood, _planks, _tiles = (njit(cache=True)(f) for f in (patterns.wood, patterns.planks, patterns.tiles))
_fabric, _stone, _metal = (njit(cache=True)(f) for f in (patterns.fabric, patterns.stone, patterns.metal))
_glass, _paper, _carpet = (njit(cache=True)(f) for f in (patterns.glass, patterns.paper, patterns.carpet))


def shade(
    prims: Array,
    projection: Projection,
    camera: PinholeCamera,
    depth: Array,
    nearest: NDArray[np.int32],
    factors: Array,
    lights: Lights,
) -> NDArray[np.uint8]:
    """Return RGB (h, w, 3), bottom row first, of the pixels that `cast` hit, each brightness times its factor."""
    us, vs = camera.rays()
    rgb = np.zeros((*nearest.shape, 3), dtype=np.uint8)
    _shade(
        prims[projection.index], projection.origin, projection.steps, camera.position, camera.matrix, us, vs,
        depth, nearest, factors, lights.lamps, lights.daylight, rgb,
    )  # fmt: skip
    return rgb


@njit(cache=True)
def _pattern(material: float, a: float, b: float) -> float:  # noqa: PLR0911 - one line per material
    if material == _WOOD:
        return _wood(a, b)
    if material == _PLANKS:
        return _planks(a, b)
    if material == _TILES:
        return _tiles(a, b)
    if material == _FABRIC:
        return _fabric(a, b)
    if material == _STONE:
        return _stone(a, b)
    if material == _METAL:
        return _metal(a, b)
    if material == _GLASS:
        return _glass(a, b)
    if material == _PAPER:
        return _paper(a, b)
    if material == _CARPET:
        return _carpet(a, b)
    return 1.0


@njit(cache=True, inline="always")
def _surface(prims: Array, order: int, x: float, y: float, z: float) -> Any:
    """Return the world normal and the two surface coordinates in metres of a hit point in the scaled frame."""
    hx, hy, hz = prims[order, HALF], prims[order, HALF + 1], prims[order, HALF + 2]
    ax, ay, az = abs(x), abs(y), abs(z)
    nx, ny, nz = x, y, z  # of the sphere; other forms change it below
    a, b = x * hx + z * hz, y * hy
    if prims[order, FORM] == _BOX:
        # The hit is on the face whose coordinate is nearest to 1. At an edge x wins over y over z, as in numpy.
        if ax >= ay and ax >= az:
            ny, nz, a = 0.0, 0.0, z * hz
        elif ay >= az:
            nx, nz, a, b = 0.0, 0.0, x * hx, z * hz
        else:
            nx, ny, a = 0.0, 0.0, x * hx
    elif prims[order, FORM] == _BOWL:
        ny = (y - 1.0) * 0.25
    elif prims[order, FORM] != _ELLIPSOID:
        if ay >= _RIM and not (y > 0 and prims[order, FORM] == _CUP):
            nx, nz = 0.0, 0.0
        else:
            k = (prims[order, TOP] - prims[order, BOTTOM]) * 0.5  # gradient of x^2 + z^2 - (m + k * y)^2
            m = (prims[order, BOTTOM] + prims[order, TOP]) * 0.5
            ny = -k * (m + k * y)
    # Normals scale by the inverse of the half extents, unlike points.
    nx, ny, nz = nx / hx, ny / hy, nz / hz
    wx = prims[order, AXES] * nx + prims[order, AXES + 3] * ny + prims[order, AXES + 6] * nz
    wy = prims[order, AXES + 1] * nx + prims[order, AXES + 4] * ny + prims[order, AXES + 7] * nz
    wz = prims[order, AXES + 2] * nx + prims[order, AXES + 5] * ny + prims[order, AXES + 8] * nz
    length = math.sqrt(wx * wx + wy * wy + wz * wz) + 1e-12
    return wx / length, wy / length, wz / length, a, b


@njit(cache=True)
def _light(n: Any, r: Any, w: Any, lamps: Array, daylight: float) -> float:
    nx, ny, nz = n
    length = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    facing = (nx * r[0] + ny * r[1] + nz * r[2]) / length
    if facing > 0.0:  # the surface is seen from behind, as the inside of a cup
        nx, ny, nz = -nx, -ny, -nz
    sun = nx * _SUN_X + ny * _SUN_Y + nz * _SUN_Z
    light = (AMBIENT + SKY * ny + SUN * max(sun, 0.0) + HEADLIGHT * abs(facing)) * daylight
    for i in range(len(lamps)):
        lx, ly, lz = lamps[i, 0] - w[0], lamps[i, 1] - w[1], lamps[i, 2] - w[2]
        square = lx * lx + ly * ly + lz * lz
        cosine = (nx * lx + ny * ly + nz * lz) / (math.sqrt(square) + 1e-6)
        light = light + lamps[i, 3] * max(cosine, 0.0) * (LAMP_REACH / (LAMP_REACH + square))
    return light


@njit(cache=True, inline="always")
def brightness_at(
    prims: Array, origin: Array, steps: Array, order: int, ray: Any, eye: Array, view: Array, lamps: Array, day: float
) -> float:
    """Return the brightness of primitive `order` at depth t on the ray (u, v, t)."""
    # Arrays are indexed in full: numba creates a view object for `steps[k]`, which costs more than the arithmetic.
    u, v, t = ray
    k = order
    lx = origin[k, 0] + t * ((steps[k, 0, 0] + u * steps[k, 1, 0]) + v * steps[k, 2, 0])
    ly = origin[k, 1] + t * ((steps[k, 0, 1] + u * steps[k, 1, 1]) + v * steps[k, 2, 1])
    lz = origin[k, 2] + t * ((steps[k, 0, 2] + u * steps[k, 1, 2]) + v * steps[k, 2, 2])
    nx, ny, nz, a, b = _surface(prims, k, lx, ly, lz)
    rx = (view[0, 2] + u * view[0, 0]) + v * view[0, 1]
    ry = (view[1, 2] + u * view[1, 0]) + v * view[1, 1]
    rz = (view[2, 2] + u * view[2, 0]) + v * view[2, 1]
    w = (eye[0] + t * rx, eye[1] + t * ry, eye[2] + t * rz)
    light = _light((nx, ny, nz), (rx, ry, rz), w, lamps, day)
    glow = prims[k, EMISSION]
    return glow * 1.15 + (1.0 - glow) * (light * _pattern(prims[k, MATERIAL], a, b))


@njit(cache=True, parallel=True)
def _shade(
    prims: Array,
    origin: Array,
    steps: Array,
    eye: Array,
    view: Array,
    us: Array,
    vs: Array,
    depth: Array,
    nearest: NDArray[np.int32],
    factors: Array,
    lamps: Array,
    daylight: float,
    rgb: NDArray[np.uint8],
) -> None:
    height = len(vs)
    for band in prange(_BANDS):
        for y in range(band * height // _BANDS, (band + 1) * height // _BANDS):
            for x in range(len(us)):
                order = nearest[y, x]
                if order < 0:
                    continue
                ray = (us[x], vs[y], depth[y, x])
                level = brightness_at(prims, origin, steps, order, ray, eye, view, lamps, daylight) * factors[y, x]
                for i in range(3):
                    rgb[y, x, i] = np.uint8(min(prims[order, COLOR + i] * level * 255.0, 255.0))
