"""What `gen_info` says of how a trajectory was made: settings; no clock and no checkout, unless
told."""

import importlib.metadata
import json

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.generation import draft as module
from infthor_eval.generation.draft import provenance

from ..helpers.command_line import option_words


def test_the_clock_is_read_from_the_environment_alone(monkeypatch):
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    assert provenance()["created"] is None
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1785283200")
    assert provenance()["created"] == 1785283200
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(UsageError, match="SOURCE_DATE_EPOCH: 'yesterday' is not a whole number"):
        provenance()


@pytest.mark.parametrize(
    ("written", "commit"),
    [
        (None, None),
        ('{"url": "file:///here", "dir_info": {"editable": true}}', None),
        ('{"url": "https://there", "vcs_info": {"commit_id": "0123456789a"}}', "0123456"),
    ],
)
def test_the_commit_is_the_installed_one(monkeypatch, written, commit):
    class Installed:
        @staticmethod
        def read_text(name):
            assert name == "direct_url.json"
            return written

    monkeypatch.setattr(module, "distribution", lambda name: Installed)
    assert provenance()["git"] == commit
    assert provenance()["ai2thor"] == importlib.metadata.version("ai2thor")


def test_the_filter_of_goals_is_a_setting_by_which_a_run_is_resumed(run_cli, tmp_path):
    words = option_words(scene="bathroom-1", min_steps="1", min_subgoals="1", out=tmp_path)
    assert run_cli("generate", *words, "--no-scene-goal-filter")[0] == 0
    info = json.loads((tmp_path / "bathroom-1-seed0.json").read_text())["gen_info"]
    assert info["scene_goal_filter"] is False and "banked_on_giveup" not in info
    for other in ((), ("--no-scene-goal-filter", "--final-task-memory")):
        code, _, err = run_cli("generate", *words, *other)
        assert code == 1 and "generated with other settings" in err
    assert run_cli("generate", *words, "--no-scene-goal-filter")[0] == 0
