"""What `gen_info` says of where a trajectory was made: no clock, no checkout, unless told."""

import importlib.metadata

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.generation import provenance as module
from infthor_eval.generation.provenance import provenance


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
