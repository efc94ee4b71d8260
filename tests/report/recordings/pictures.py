"""What is in pictures."""

from PIL import Image

__all__ = ["find_colours"]


def find_colours(picture: Image.Image) -> set[tuple[int, ...]]:
    """The colours of a picture."""
    return {colour for _, colour in picture.getcolors(1 << 24)}
