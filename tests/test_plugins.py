"""Importing by name: what happens to garbage collection."""

import gc
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from infthor_eval.plugins import import_target

SOURCE = """
import gc
is_collecting = gc.isenabled()
class Loop:
    pass
"""


@pytest.fixture
def own_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A module that notes whether garbage is collected while it is imported."""
    (tmp_path / "noting_module.py").write_text(SOURCE)
    (tmp_path / "failing_module.py").write_text("raise ValueError")
    monkeypatch.syspath_prepend(tmp_path)
    yield "noting_module"
    sys.modules.pop("noting_module", None)


@pytest.fixture
def _thawed() -> Iterator[None]:
    yield
    gc.enable()
    gc.unfreeze()


pytestmark = pytest.mark.usefixtures("_thawed")


def test_nothing_is_collected_during_an_import_and_its_objects_are_passed_over_later(
    own_module: str,
) -> None:
    gc.unfreeze()
    assert import_target(f"{own_module}:is_collecting") is False
    assert gc.isenabled()
    assert gc.get_freeze_count() > 0
    assert all(item is not sys.modules[own_module].Loop for item in gc.get_objects())


def test_what_is_made_after_an_import_is_collected(own_module: str) -> None:
    loop_class = import_target(f"{own_module}:Loop")
    loop = loop_class()
    loop.itself = loop
    del loop
    gc.collect()
    assert not any(type(item) is loop_class for item in gc.get_objects())


def test_a_second_import_freezes_nothing(own_module: str) -> None:
    import_target(f"{own_module}:Loop")
    gc.unfreeze()
    import_target(f"{own_module}:Loop")
    assert gc.get_freeze_count() == 0


def test_collection_goes_on_after_a_failed_import(own_module: str) -> None:
    with pytest.raises(ValueError):
        import_target("failing_module:Loop")
    assert gc.isenabled()


def test_collection_stays_off_where_somebody_turned_it_off(own_module: str) -> None:
    gc.disable()
    import_target(f"{own_module}:Loop")
    assert not gc.isenabled()
