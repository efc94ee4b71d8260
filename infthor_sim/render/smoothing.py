"""Anti-aliasing: which pixels are jagged, and the rays that smooth them; shared by both
implementations.

Only pixels at a jump of brightness are smoothed. Four rays through such a pixel are tested against
the primitives that the pixel and its neighbours show, and no others. That misses what no pixel near
shows, but costs little.
"""

__all__ = ["JUMP", "NEIGHBOURS", "SUBPIXELS"]

JUMP = 48  # of brightness between neighbours, as the sum of three channels (of 765)
# A rotated grid: no two rays share a row or column, so that nearly level and nearly upright edges
# get all four steps.
SUBPIXELS = ((-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375))
"""Points of a pixel that the rays go through, from its middle, as shares of its width and
height."""
NEIGHBOURS = ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))
"""The pixel and its neighbours, as offsets of row and column."""
