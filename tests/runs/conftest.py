from pathlib import Path

import pytest

from infthor_eval.runs import RunRequest


@pytest.fixture
def make_request(make_nieh_set, tmp_path):
    """A request on a small set of plain frames; keyword arguments override its fields."""
    root: list[Path] = []

    def make(**changes):
        if not root:
            root.append(make_nieh_set(size=56))
        settings = {"model": "oracle", "tasks": ("nieh",), "output": tmp_path / "out", "data": root[0]}
        return RunRequest(**{**settings, **changes})

    return make
