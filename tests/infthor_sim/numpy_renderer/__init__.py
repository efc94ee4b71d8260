"""A second renderer, in numpy: the compiled one is held to its pictures, bit for bit.

Every formula has the order of operations of its counterpart in `infthor_sim.render`.
"""

from infthor_sim.render.picture import Rasterizer

from .probe import sees
from .projection import project
from .raster import cast, count_pixels
from .shading import crease_factors, shade
from .smoothing import smooth

__all__ = ["NUMPY"]

NUMPY = Rasterizer(project, cast, count_pixels, crease_factors, shade, smooth, sees)
