"""A short, repeatable part of `python -m tests.fuzz`: some damaged inputs of every reader."""

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from .damage import damaged
from .readers import READERS

_SLOW = {"replay", "film"}  # readers of seconds an input: only in campaigns


@pytest.mark.parametrize("name", sorted(READERS.keys() - _SLOW))
def test_a_damaged_input_is_refused_in_one_line_or_read(tmp_path, monkeypatch, name):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    reader, folder = READERS[name], tmp_path / "input"
    folder.mkdir()
    file = reader.make(folder)
    sound = file.read_bytes()
    reader.read(folder)

    @settings(
        max_examples=8,
        deadline=None,
        derandomize=True,
        database=None,
        phases=(Phase.generate,),
        suppress_health_check=list(HealthCheck),
    )
    @given(damaged(sound, reader.form))
    def attempt(content: bytes) -> None:
        reader.hold(folder, file, content)

    attempt()
