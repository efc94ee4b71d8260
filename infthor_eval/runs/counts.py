"""Counts as journals have them."""

from typing import Annotated

from msgspec import Meta

__all__ = ["Count", "Total"]

_MOST = (
    2**53
)  # what a float holds exactly: means and sums of larger numbers would fail, or be wrong

Count = Annotated[int, Meta(ge=0, le=_MOST)]
Total = Annotated[int, Meta(ge=1, le=_MOST)]  # what a count is a share of
