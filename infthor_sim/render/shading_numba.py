"""Colours of the cast pixels, compiled by numba."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render import patterns
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.lighting import AMBIENT, HEADLIGHT, LAMP_REACH, SKY, SUN, Lights
from infthor_sim.render.primitives import (
    AXES,
    BOTTOM,
    COLOR,
    EMISSION,
    FORM,
    HALF,
    MATERIAL,
    TOP,
    Form,
    Material,
)
from infthor_sim.render.table import INVERSE, ORIGIN, STEPS, SUNWARD, shading_table

__all__ = ["brightness", "eye_of", "shade"]

_RIM = 1.0 - 1e-6  # |y| of hits that count as on a cylinder's flat end, with a margin for rounding
_BOX, _ELLIPSOID, _CUP, _BOWL = int(Form.BOX), int(Form.ELLIPSOID), int(Form.CUP), int(Form.BOWL)
_WOOD, _PLANKS, _TILES = int(Material.WOOD), int(Material.PLANKS), int(Material.TILES)
_FABRIC, _STONE, _METAL = int(Material.FABRIC), int(Material.STONE), int(Material.METAL)
_GLASS, _PAPER, _CARPET = int(Material.GLASS), int(Material.PAPER), int(Material.CARPET)
# Compiled here: the tests' renderer in numpy calls the plain functions with arrays.
_compiled = njit(cache=True, error_model="numpy")
_wood = _compiled(patterns.wood)
_planks = _compiled(patterns.planks)
_tiles = _compiled(patterns.tiles)
_fabric = _compiled(patterns.fabric)
_stone = _compiled(patterns.stone)
_metal = _compiled(patterns.metal)
_glass = _compiled(patterns.glass)
_paper = _compiled(patterns.paper)
_carpet = _compiled(patterns.carpet)


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
    table = shading_table(prims, projection, lights)
    _shade(
        table,
        len(projection.index),
        eye_of(camera),
        us,
        vs,
        depth,
        nearest,
        factors,
        lights.daylight,
        rgb,
    )
    return rgb


def eye_of(camera: PinholeCamera) -> tuple[float, ...]:
    """Return a camera's position, and its forward, right and up vectors, as plain numbers (12,)."""
    return tuple(np.concatenate([camera.position, camera.matrix[:, [2, 0, 1]].T.ravel()]).tolist())


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _lamp_light(
    table: Array,
    first: int,
    k: int,
    nx: float,
    ny: float,
    nz: float,
    u: float,
    v: float,
    t: float,
    eye: Any,
) -> float:
    """Return the lamps' light at depth t on the ray (u, v), on a surface of unit normal n.

    The normal is given along the axes of primitive `k`; the lamps are the table's rows from `first`
    on.
    """
    mx = table[k, AXES] * nx + table[k, AXES + 3] * ny + table[k, AXES + 6] * nz
    my = table[k, AXES + 1] * nx + table[k, AXES + 4] * ny + table[k, AXES + 7] * nz
    mz = table[k, AXES + 2] * nx + table[k, AXES + 5] * ny + table[k, AXES + 8] * nz
    x = eye[0] + t * ((eye[3] + u * eye[6]) + v * eye[9])
    y = eye[1] + t * ((eye[4] + u * eye[7]) + v * eye[10])
    z = eye[2] + t * ((eye[5] + u * eye[8]) + v * eye[11])
    light = 0.0
    for i in range(first, len(table)):
        lx, ly, lz = table[i, 0] - x, table[i, 1] - y, table[i, 2] - z
        square = lx * lx + ly * ly + lz * lz
        cosine = (mx * lx + my * ly + mz * lz) / (math.sqrt(square) + 1e-6)
        light = light + table[i, 3] * max(cosine, 0.0) * (LAMP_REACH / (LAMP_REACH + square))
    return light


@njit(cache=True, error_model="numpy", inline="always")
def _round_normal(form: float, bottom: float, top: float, x: float, y: float, z: float) -> Any:
    """Return the normal of a round primitive at a hit point, in its scaled frame, of any length."""
    if form == _BOWL:
        return x, (y - 1.0) * 0.25, z
    if form == _ELLIPSOID:
        return x, y, z
    if abs(y) >= _RIM and not (y > 0 and form == _CUP):
        return 0.0, y, 0.0
    slope = (top - bottom) * 0.5  # gradient of x^2 + z^2 - (m + slope * y)^2
    m = (bottom + top) * 0.5
    return x, -slope * (m + slope * y), z


@njit(cache=True, error_model="numpy")
def brightness(
    table: Array,
    first: int,
    eye: Any,
    daylight: float,
    orders: NDArray[np.int32],
    us: Array,
    vs: Array,
    depths: Array,
    levels: Array,
) -> None:
    """Write the brightness of primitives where rays hit them to `levels`; lamps: from `first` on.

    Args:
        orders: the primitives (n,); -1 for none, whose level stays as it is.
        us, vs, depths: the rays, and the depth at which they hit (n,).
    """
    # What can be told in the primitive's own frame is: the ray's direction d and the normal n have
    # the product sum(d * n) there whatever the primitive's size, as d is scaled by the inverse of
    # what n is scaled by.
    for i in range(len(orders)):
        k = orders[i]
        if k < 0:
            continue
        u, v, t = us[i], vs[i], depths[i]
        dx = (table[k, STEPS] + u * table[k, STEPS + 3]) + v * table[k, STEPS + 6]
        dy = (table[k, STEPS + 1] + u * table[k, STEPS + 4]) + v * table[k, STEPS + 7]
        dz = (table[k, STEPS + 2] + u * table[k, STEPS + 5]) + v * table[k, STEPS + 8]
        x, y, z = (
            table[k, ORIGIN] + t * dx,
            table[k, ORIGIN + 1] + t * dy,
            table[k, ORIGIN + 2] + t * dz,
        )
        hx, hy, hz = table[k, HALF], table[k, HALF + 1], table[k, HALF + 2]
        nx, ny, nz = 0.0, 0.0, 0.0
        if table[k, FORM] == _BOX:
            # The hit is on the face whose coordinate is nearest to 1. At an edge x wins over y over
            # z, as in numpy. The normal is one of the axes, of the sign that faces the camera.
            ax, ay, az = abs(x), abs(y), abs(z)
            if ax >= ay and ax >= az:
                nx, facing, sun, up, a, b = (
                    1.0,
                    dx * hx,
                    table[k, SUNWARD],
                    table[k, AXES + 1],
                    z * hz,
                    y * hy,
                )
            elif ay >= az:
                ny, facing, sun, up, a, b = (
                    1.0,
                    dy * hy,
                    table[k, SUNWARD + 1],
                    table[k, AXES + 4],
                    x * hx,
                    z * hz,
                )
            else:
                nz, facing, sun, up, a, b = (
                    1.0,
                    dz * hz,
                    table[k, SUNWARD + 2],
                    table[k, AXES + 7],
                    x * hx,
                    y * hy,
                )
        else:
            a, b = x * hx + z * hz, y * hy
            nx, ny, nz = _round_normal(table[k, FORM], table[k, BOTTOM], table[k, TOP], x, y, z)
            facing = nx * dx + ny * dy + nz * dz
            # Normals scale by the inverse of the half extents, unlike points.
            nx, ny, nz = (
                nx * table[k, INVERSE],
                ny * table[k, INVERSE + 1],
                nz * table[k, INVERSE + 2],
            )
            shrink = 1.0 / (math.sqrt(nx * nx + ny * ny + nz * nz) + 1e-12)
            nx, ny, nz, facing = nx * shrink, ny * shrink, nz * shrink, facing * shrink
            sun = nx * table[k, SUNWARD] + ny * table[k, SUNWARD + 1] + nz * table[k, SUNWARD + 2]
            up = nx * table[k, AXES + 1] + ny * table[k, AXES + 4] + nz * table[k, AXES + 7]
        # the normal points away from the camera: another face, or the inside of a cup
        if facing > 0.0:
            nx, ny, nz, sun, up = -nx, -ny, -nz, -sun, -up
        headlight = HEADLIGHT * abs(facing) / math.sqrt(1.0 + u * u + v * v)
        light = (AMBIENT + SKY * up + SUN * max(sun, 0.0) + headlight) * daylight
        if first < len(table):
            light = light + _lamp_light(table, first, k, nx, ny, nz, u, v, t, eye)
        glow = table[k, EMISSION]
        levels[i] = glow * 1.15 + (1.0 - glow) * (light * _pattern(table[k, MATERIAL], a, b))


@njit(cache=True, error_model="numpy")
def _shade(
    table: Array,
    first: int,
    eye: Any,
    us: Array,
    vs: Array,
    depth: Array,
    nearest: NDArray[np.int32],
    factors: Array,
    daylight: float,
    rgb: NDArray[np.uint8],
) -> None:
    row, levels = np.empty(len(us)), np.empty(len(us))
    for y in range(len(vs)):
        row[:] = vs[y]
        brightness(table, first, eye, daylight, nearest[y], us, row, depth[y], levels)
        for x in range(len(us)):
            order = nearest[y, x]
            if order >= 0:
                level = levels[x] * factors[y, x]
                for i in range(3):
                    rgb[y, x, i] = np.uint8(min(table[order, COLOR + i] * level * 255.0, 255.0))
