"""The register of the functions that draw objects, by the names that types give."""

from collections.abc import Callable

from infthor_sim.render.shapes.builder import Builder

__all__ = ["SHAPES", "draws"]

Drawing = Callable[[Builder], None]
SHAPES: dict[str, Drawing] = {}


def draws(drawing: Drawing) -> Drawing:
    """Register a drawing under the name of its function."""
    assert drawing.__name__ not in SHAPES, f"two shapes are called {drawing.__name__}"
    SHAPES[drawing.__name__] = drawing
    return drawing
