"""The published question files and logs, where they are beside the repository."""

from pathlib import Path

import pytest

__all__ = ["PUBLISHED_SETS", "needs_published_sets"]

PUBLISHED_SETS = Path(__file__).parents[2] / "../shared/data/published_sets"
needs_published_sets = pytest.mark.skipif(
    not PUBLISHED_SETS.is_dir(), reason="the published sets are not at ../shared/data"
)
