"""Every reader takes time in proportion to its input."""

import pytest

from .growth import find_growth
from .readers import READERS


@pytest.mark.parametrize("name", sorted(READERS.keys() - {"replay", "film"}))
def test_twice_the_input_takes_twice_the_time(tmp_path, monkeypatch, name):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "input"
    folder.mkdir()
    assert list(find_growth(READERS[name], folder)) == []
