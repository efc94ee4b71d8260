"""The way from a command to the execution of its runs is short."""

import traceback
from pathlib import Path

import pytest

import infthor_eval
from infthor_eval.cli.main import _infthor_eval

_MAX_FRAMES = 5
_BUNDLED = Path(infthor_eval.__file__).parent / "sets" / "nieh_mini"


class Reached(Exception):
    pass


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "--model", "random", "--tasks", "nieh_mini_gt", "--out"],
        ["validate", str(_BUNDLED), "--model", "random", "--out"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_few_frames_lie_between_a_command_and_execute(arguments, tmp_path, monkeypatch):
    def execute(*_):
        raise Reached

    monkeypatch.setattr("infthor_eval.cli.progress.runs.execute", execute)
    with pytest.raises(Reached) as reached:
        _infthor_eval.main([*arguments, str(tmp_path / "out")], standalone_mode=False)
    frames = [
        frame
        for frame in traceback.extract_tb(reached.value.__traceback__)
        if "click" not in frame.filename
    ]
    names = [frame.name for frame in frames]
    after_click = names[names.index("command") :]
    assert after_click[-1] == "execute"
    assert len(after_click) <= _MAX_FRAMES, after_click
