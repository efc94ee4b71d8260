"""Colours of objects and classes in segmentation frames; a name always has the same colour."""

import hashlib
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from infthor_sim.render.picture import Picture
from infthor_sim.render.primitives import INSTANCE
from infthor_sim.world import World


@lru_cache(maxsize=65536)
def instance_color(object_id: str) -> tuple[int, int, int]:
    """Return the colour of one object."""
    return _color("instance", object_id)


@lru_cache(maxsize=4096)
def class_color(name: str) -> tuple[int, int, int]:
    """Return the colour of one object type."""
    return _color("class", name)


def instance_image(picture: Picture) -> NDArray[np.uint8]:
    """Return the instance frame (h, w, 4) RGBA, bottom row first; walls in their class's colour."""
    return _paint(picture, _instance_words(picture.names))


def class_image(picture: Picture, world: World) -> NDArray[np.uint8]:
    """Return the class frame (h, w, 4) RGBA, bottom row first."""
    colors = [
        class_color(world.objects[n].object_type if n in world.objects else n)
        for n in picture.names
    ]
    return _paint(picture, _words(colors))


@lru_cache(maxsize=16)
def _instance_words(names: tuple[str, ...]) -> NDArray[np.uint32]:
    return _words([instance_color(name) if "|" in name else class_color(name) for name in names])


def _words(colors: list[tuple[int, int, int]]) -> NDArray[np.uint32]:
    """Return colours as words of 32 bits, RGBA, and black for the void after them."""
    table = np.array([(*color, 255) for color in [*colors, (0, 0, 0)]], dtype=np.uint8)
    return table.view(np.uint32).ravel()


def _paint(picture: Picture, words: NDArray[np.uint32]) -> NDArray[np.uint8]:
    # The void, -1, takes the last entry. One lookup of words, from primitives to colours, is faster
    # than two or than one of four bytes.
    shown = picture.prims[picture.projection.index, INSTANCE].astype(int)
    by_primitive = words[np.append(shown, -1)]
    pixels: NDArray[np.uint32] = by_primitive[picture.nearest]
    return pixels.view(np.uint8).reshape(*pixels.shape, 4)


def _color(namespace: str, name: str) -> tuple[int, int, int]:
    red, green, blue = hashlib.blake2b(f"{namespace}:{name}".encode(), digest_size=3).digest()
    return red, green, max(blue, 1)  # never black, which is the void
