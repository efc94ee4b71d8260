"""Outlines from above as rectangles: counters around corners, tops with sinks cut out."""

from collections.abc import Sequence

import numpy as np

Rect = tuple[float, float, float, float]
"""A rectangle seen from above: x0, z0, x1, z1 in metres."""


def subtract(whole: Rect, holes: Sequence[Rect]) -> tuple[Rect, ...]:
    """Return rectangles that together cover `whole` but none of the holes; few and large ones."""
    cutting = [
        h
        for h in holes
        if h[0] < whole[2] and h[2] > whole[0] and h[1] < whole[3] and h[3] > whole[1]
    ]
    if not cutting:
        return (whole,)
    xs = _edges(whole[0], whole[2], [v for h in cutting for v in (h[0], h[2])])
    zs = _edges(whole[1], whole[3], [v for h in cutting for v in (h[1], h[3])])
    mid_x = (xs[1:] + xs[:-1]) / 2
    mid_z = (zs[1:] + zs[:-1]) / 2
    solid = np.ones((len(mid_x), len(mid_z)), dtype=bool)
    for x0, z0, x1, z1 in cutting:
        inside_x = (mid_x > x0) & (mid_x < x1)
        inside_z = (mid_z > z0) & (mid_z < z1)
        solid &= ~(inside_x[:, None] & inside_z[None, :])
    return tuple(_cover(solid, xs, zs))


def polygon_rects(points: Sequence[tuple[float, float]]) -> tuple[Rect, ...]:
    """Return rectangles that cover a polygon (x, z) whose edges are parallel to the axes."""
    outline = np.asarray(points, dtype=float)
    xs = np.unique(np.round(outline[:, 0], 4))
    zs = np.unique(np.round(outline[:, 1], 4))
    mid_x = (xs[1:] + xs[:-1]) / 2
    mid_z = (zs[1:] + zs[:-1]) / 2
    solid = np.zeros((len(mid_x), len(mid_z)), dtype=bool)
    for i, x in enumerate(mid_x):
        solid[i] = [_contains(outline, x, z) for z in mid_z]
    return tuple(_cover(solid, xs, zs))


def _contains(outline: np.ndarray, x: float, z: float) -> bool:
    """Return whether a point is in an outline: a ray along +x crosses its edges an odd number."""
    inside = False
    for (x0, z0), (x1, z1) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if (z0 > z) != (z1 > z) and x < x0 + (z - z0) * (x1 - x0) / (z1 - z0):
            inside = not inside
    return inside


def _edges(low: float, high: float, cuts: list[float]) -> np.ndarray:
    return np.unique(np.round([low, high, *(c for c in cuts if low < c < high)], 4))


def _cover(solid: np.ndarray, xs: np.ndarray, zs: np.ndarray) -> list[Rect]:
    """Return rectangles over the solid cells of an uneven grid, greedily the largest each time."""
    left = solid.copy()
    rects = []
    for i, j in np.argwhere(solid):
        if not left[i, j]:
            continue
        i_end = i + 1
        j_end = j + 1
        while j_end < left.shape[1] and left[i, j_end]:
            j_end += 1
        while i_end < left.shape[0] and left[i_end, j:j_end].all():
            i_end += 1
        left[i:i_end, j:j_end] = False
        rects.append((float(xs[i]), float(zs[j]), float(xs[i_end]), float(zs[j_end])))
    return rects
