"""What is in drawings."""

import re
from pathlib import Path

__all__ = ["read_texts"]


def read_texts(svg: Path) -> list[str]:
    """The texts of a drawing."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg.read_text(encoding="utf-8"))
