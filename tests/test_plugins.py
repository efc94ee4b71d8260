"""Importing by name, and what happens to garbage collection meanwhile."""

import gc
import inspect
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from infthor_eval.cli import main as command_line
from infthor_eval.plugins import import_target

SOURCE = """
import gc
is_collecting = gc.isenabled()
threshold = gc.get_threshold()
class Loop:
    pass
"""


@pytest.fixture
def own_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A module that notes whether and when garbage is collected while it is imported."""
    (tmp_path / "noting_module.py").write_text(SOURCE)
    (tmp_path / "failing_module.py").write_text("raise ValueError")
    monkeypatch.syspath_prepend(tmp_path)
    yield "noting_module"
    sys.modules.pop("noting_module", None)


@pytest.fixture
def _collecting() -> Iterator[None]:
    before = gc.get_threshold()
    gc.unfreeze()
    yield
    gc.enable()
    gc.set_threshold(*before)


pytestmark = pytest.mark.usefixtures("_collecting")


def test_an_import_leaves_garbage_collection_as_it_is(own_module: str) -> None:
    gc.set_threshold(600, 7, 8)
    assert import_target(f"{own_module}:is_collecting") is True
    assert import_target(f"{own_module}:threshold") == (600, 7, 8)
    assert gc.isenabled()
    assert gc.get_threshold() == (600, 7, 8)
    assert gc.get_freeze_count() == 0


def test_what_is_made_after_an_import_is_collected(own_module: str) -> None:
    loop_class = import_target(f"{own_module}:Loop")
    loop = loop_class()
    loop.itself = loop
    del loop
    gc.collect()
    assert not any(type(item) is loop_class for item in gc.get_objects())


def test_a_command_collects_seldom_while_it_imports_and_then_as_before(
    own_module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    gc.set_threshold(600, 7, 8)
    during: list[tuple[int, int, int]] = []

    def note(target: str) -> object:
        during.append(import_target(f"{own_module}:threshold"))
        return import_target(target)

    monkeypatch.setitem(inspect.unwrap(command_line).__globals__, "import_target", note)
    with pytest.raises(SystemExit):
        command_line(["ls", "--help"])
    assert during
    assert during[0][0] > 10_000
    assert during[0][1:] == (7, 8)
    assert gc.get_threshold() == (600, 7, 8)


def test_collection_goes_on_after_a_failed_import(own_module: str) -> None:
    with pytest.raises(ValueError):
        import_target("failing_module:Loop")
    assert gc.isenabled()


def test_collection_goes_on_as_before_after_a_command_that_fails() -> None:
    gc.set_threshold(600, 7, 8)
    with pytest.raises(SystemExit):
        command_line(["no-such-command"])
    assert gc.get_threshold() == (600, 7, 8)


def test_collection_stays_off_where_somebody_turned_it_off(own_module: str) -> None:
    gc.disable()
    import_target(f"{own_module}:Loop")
    with pytest.raises(SystemExit):
        command_line(["ls", "--help"])
    assert not gc.isenabled()
