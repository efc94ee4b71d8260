"""Colours of the cast pixels, compiled by numba."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render import patterns
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.grouping_numba import group
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
    us, vs = camera.ray_grid()
    rgb = np.zeros((*nearest.shape, 3), dtype=np.uint8)
    table = shading_table(prims, projection, lights)
    levels = np.empty(nearest.size)
    brightness(
        table, len(projection.index), eye_of(camera), lights.daylight, nearest.ravel(), us, vs,
        depth.ravel(), levels,
    )  # fmt: skip
    _colour(table, nearest, levels.reshape(nearest.shape), factors, rgb)
    return rgb


def eye_of(camera: PinholeCamera) -> tuple[float, ...]:
    """Return a camera's position, and its forward, right and up vectors, as plain numbers (12,)."""
    return tuple(np.concatenate([camera.position, camera.matrix[:, [2, 0, 1]].T.ravel()]).tolist())


@njit(cache=True, error_model="numpy")
def _add_lamps(
    table: Array,
    first: int,
    k: int,
    eye: Any,
    us: Array,
    vs: Array,
    ts: Array,
    nx: Array,
    ny: Array,
    nz: Array,
    light: Array,
    lamps: Array,
) -> None:
    """Add the lamps' light where rays hit primitive `k`, on surfaces of unit normals n.

    The normals are given along the axes of the primitive; the lamps are the table's rows from
    `first` on. Their light is summed in `lamps` before it is added.
    """
    # One lamp after the other, so that the compiler computes several rays at once.
    ax, ay, az = table[k, AXES], table[k, AXES + 1], table[k, AXES + 2]
    bx, by, bz = table[k, AXES + 3], table[k, AXES + 4], table[k, AXES + 5]
    cx, cy, cz = table[k, AXES + 6], table[k, AXES + 7], table[k, AXES + 8]
    lamps[:] = 0.0
    for i in range(first, len(table)):
        lamp_x, lamp_y, lamp_z, strength = table[i, 0], table[i, 1], table[i, 2], table[i, 3]
        for j in range(len(us)):
            u, v, t = us[j], vs[j], ts[j]
            mx = ax * nx[j] + bx * ny[j] + cx * nz[j]
            my = ay * nx[j] + by * ny[j] + cy * nz[j]
            mz = az * nx[j] + bz * ny[j] + cz * nz[j]
            lx = lamp_x - (eye[0] + t * ((eye[3] + u * eye[6]) + v * eye[9]))
            ly = lamp_y - (eye[1] + t * ((eye[4] + u * eye[7]) + v * eye[10]))
            lz = lamp_z - (eye[2] + t * ((eye[5] + u * eye[8]) + v * eye[11]))
            square = lx * lx + ly * ly + lz * lz
            cosine = (mx * lx + my * ly + mz * lz) / (math.sqrt(square) + 1e-6)
            reach = LAMP_REACH / (LAMP_REACH + square)
            lamps[j] = lamps[j] + strength * max(cosine, 0.0) * reach
    for j in range(len(us)):
        light[j] = light[j] + lamps[j]


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
    starts, members = group(orders, first)
    work = np.empty((10, len(orders)))
    # taken one by one, as numba does not know of unpacked rows that they are contiguous
    u = work[0]
    v = work[1]
    t = work[2]
    light = work[3]
    a = work[4]
    b = work[5]
    nx = work[6]
    ny = work[7]
    nz = work[8]
    lamps = work[9]
    for j in range(len(members)):
        i = members[j]
        u[j] = us[i]
        v[j] = vs[i]
        t[j] = depths[i]
    for k in range(first):
        start = starts[k]
        end = starts[k + 1]
        if start == end:
            continue
        if table[k, FORM] == _BOX:
            _light_box(
                table, k, daylight, u[start:end], v[start:end], t[start:end], light[start:end],
                a[start:end], b[start:end], nx[start:end], ny[start:end], nz[start:end],
            )  # fmt: skip
        else:
            _light_round(
                table, k, daylight, u[start:end], v[start:end], t[start:end], light[start:end],
                a[start:end], b[start:end], nx[start:end], ny[start:end], nz[start:end],
            )  # fmt: skip
        if first < len(table):
            _add_lamps(
                table, first, k, eye, u[start:end], v[start:end], t[start:end], nx[start:end],
                ny[start:end], nz[start:end], light[start:end], lamps[start:end],
            )  # fmt: skip
        _apply_pattern(table[k, MATERIAL], a[start:end], b[start:end], light[start:end])
        glow = table[k, EMISSION]
        for j in range(start, end):
            light[j] = glow * 1.15 + (1.0 - glow) * light[j]
    for j in range(starts[0], len(members)):
        levels[members[j]] = light[j]


# What can be told in the primitive's own frame is: the ray's direction d and the normal n have the
# product sum(d * n) there whatever the primitive's size, as d is scaled by the inverse of what n is
# scaled by.


@njit(cache=True, error_model="numpy")
def _light_box(
    table: Array,
    k: int,
    daylight: float,
    us: Array,
    vs: Array,
    ts: Array,
    light: Array,
    a: Array,
    b: Array,
    nx: Array,
    ny: Array,
    nz: Array,
) -> None:
    """Write daylight, surface coordinates (a, b) and normals where rays hit box `k`."""
    # No branch depends on a ray, so that the compiler computes several at once. The numbers of the
    # box are taken out of the table first, for the same reason.
    ox, oy, oz = table[k, ORIGIN], table[k, ORIGIN + 1], table[k, ORIGIN + 2]
    ahead_x, ahead_y, ahead_z = table[k, STEPS], table[k, STEPS + 1], table[k, STEPS + 2]
    right_x, right_y, right_z = table[k, STEPS + 3], table[k, STEPS + 4], table[k, STEPS + 5]
    up_x, up_y, up_z = table[k, STEPS + 6], table[k, STEPS + 7], table[k, STEPS + 8]
    hx, hy, hz = table[k, HALF], table[k, HALF + 1], table[k, HALF + 2]
    sun_x, sun_y, sun_z = table[k, SUNWARD], table[k, SUNWARD + 1], table[k, SUNWARD + 2]
    rise_x, rise_y, rise_z = table[k, AXES + 1], table[k, AXES + 4], table[k, AXES + 7]
    for i in range(len(us)):
        u, v, t = us[i], vs[i], ts[i]
        dx = (ahead_x + u * right_x) + v * up_x
        dy = (ahead_y + u * right_y) + v * up_y
        dz = (ahead_z + u * right_z) + v * up_z
        x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
        # The hit is on the face whose coordinate is nearest to 1. At an edge x wins over y over z,
        # as in numpy. The normal is one of the axes, of the sign that faces the camera.
        on_x = (abs(x) >= abs(y)) & (abs(x) >= abs(z))
        on_y = abs(y) >= abs(z)
        facing = dx * hx if on_x else dy * hy if on_y else dz * hz
        sign = -1.0 if facing > 0.0 else 1.0
        sun = sign * (sun_x if on_x else sun_y if on_y else sun_z)
        rise = sign * (rise_x if on_x else rise_y if on_y else rise_z)
        a[i] = z * hz if on_x else x * hx
        b[i] = y * hy if on_x else z * hz if on_y else y * hy
        nx[i] = sign if on_x else 0.0
        ny[i] = 0.0 if on_x else sign if on_y else 0.0
        nz[i] = 0.0 if on_x | on_y else sign
        headlight = HEADLIGHT * abs(facing) / math.sqrt(1.0 + u * u + v * v)
        light[i] = (AMBIENT + SKY * rise + SUN * max(sun, 0.0) + headlight) * daylight


@njit(cache=True, error_model="numpy")
def _light_round(
    table: Array,
    k: int,
    daylight: float,
    us: Array,
    vs: Array,
    ts: Array,
    light: Array,
    a: Array,
    b: Array,
    nx: Array,
    ny: Array,
    nz: Array,
) -> None:
    """Write daylight, surface coordinates (a, b) and normals where rays hit round `k`."""
    form, bottom, top = table[k, FORM], table[k, BOTTOM], table[k, TOP]
    hx, hy, hz = table[k, HALF], table[k, HALF + 1], table[k, HALF + 2]
    for i in range(len(us)):
        u, v, t = us[i], vs[i], ts[i]
        dx = (table[k, STEPS] + u * table[k, STEPS + 3]) + v * table[k, STEPS + 6]
        dy = (table[k, STEPS + 1] + u * table[k, STEPS + 4]) + v * table[k, STEPS + 7]
        dz = (table[k, STEPS + 2] + u * table[k, STEPS + 5]) + v * table[k, STEPS + 8]
        x, y, z = (
            table[k, ORIGIN] + t * dx,
            table[k, ORIGIN + 1] + t * dy,
            table[k, ORIGIN + 2] + t * dz,
        )
        mx, my, mz = _round_normal(form, bottom, top, x, y, z)
        facing = mx * dx + my * dy + mz * dz
        # Normals scale by the inverse of the half extents, unlike points.
        mx, my, mz = mx * table[k, INVERSE], my * table[k, INVERSE + 1], mz * table[k, INVERSE + 2]
        shrink = 1.0 / (math.sqrt(mx * mx + my * my + mz * mz) + 1e-12)
        # turned around if it points away from the camera, as on the inside of a cup
        turn = -shrink if facing > 0.0 else shrink
        mx, my, mz = mx * turn, my * turn, mz * turn
        sun = mx * table[k, SUNWARD] + my * table[k, SUNWARD + 1] + mz * table[k, SUNWARD + 2]
        rise = mx * table[k, AXES + 1] + my * table[k, AXES + 4] + mz * table[k, AXES + 7]
        a[i], b[i] = x * hx + z * hz, y * hy
        nx[i], ny[i], nz[i] = mx, my, mz
        headlight = HEADLIGHT * abs(facing * shrink) / math.sqrt(1.0 + u * u + v * v)
        light[i] = (AMBIENT + SKY * rise + SUN * max(sun, 0.0) + headlight) * daylight


@njit(cache=True, error_model="numpy")
def _apply_pattern(  # noqa: PLR0912 - one branch per material
    material: float, a: Array, b: Array, light: Array
) -> None:
    """Multiply the light on points of one material by its pattern."""
    if material == _WOOD:
        for i in range(len(light)):
            light[i] *= _wood(a[i], b[i])
    elif material == _PLANKS:
        for i in range(len(light)):
            light[i] *= _planks(a[i], b[i])
    elif material == _TILES:
        for i in range(len(light)):
            light[i] *= _tiles(a[i], b[i])
    elif material == _FABRIC:
        for i in range(len(light)):
            light[i] *= _fabric(a[i], b[i])
    elif material == _STONE:
        for i in range(len(light)):
            light[i] *= _stone(a[i], b[i])
    elif material == _METAL:
        for i in range(len(light)):
            light[i] *= _metal(a[i], b[i])
    elif material == _GLASS:
        for i in range(len(light)):
            light[i] *= _glass(a[i], b[i])
    elif material == _PAPER:
        for i in range(len(light)):
            light[i] *= _paper(a[i], b[i])
    elif material == _CARPET:
        for i in range(len(light)):
            light[i] *= _carpet(a[i], b[i])


@njit(cache=True, error_model="numpy")
def _colour(
    table: Array,
    nearest: NDArray[np.int32],
    levels: Array,
    factors: Array,
    rgb: NDArray[np.uint8],
) -> None:
    for y in range(nearest.shape[0]):
        for x in range(nearest.shape[1]):
            order = nearest[y, x]
            if order >= 0:
                level = levels[y, x] * factors[y, x]
                for i in range(3):
                    rgb[y, x, i] = np.uint8(min(table[order, COLOR + i] * level * 255.0, 255.0))
