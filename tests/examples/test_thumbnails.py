"""The example package is found, checked and evaluated once pip has installed it."""

import json

import pytest

from infthor_eval.errors import UsageError
from model_adapters import adapter_identity, check_adapter, load, names
from model_adapters.registry import build

from ..helpers.command_line import option_words


@pytest.fixture(scope="module")
def target(install):
    """Where pip has installed it."""
    return install("thumbnails")


@pytest.fixture(autouse=True)
def installed(target, monkeypatch):
    monkeypatch.syspath_prepend(target)


def test_its_model_keeps_the_contract_and_refuses_what_cannot_be(run_cli):
    assert "thumbnails" in names()
    check_adapter(build("thumbnails", {"side": "2"}, 0))
    assert run_cli("check", "adapter", "thumbnails", "--model-args", "side=3")[0] == 0
    with pytest.raises(UsageError, match="side=0: a thumbnail has one colour at least"):
        load("thumbnails", {"side": "0"}, 0)
    assert adapter_identity("thumbnails").keys() == {"package", "version", "source"}


def test_its_model_is_evaluated_and_answers_from_the_frames(tmp_path, run_cli):
    words = option_words(
        model="thumbnails", frames="shown,blank", tasks="nieh_mini_gt", out=tmp_path
    )
    code, out, err = run_cli(*words)
    assert (code, "thumbnails" in out) == (0, True), err
    # Question by question: the means can be equal by chance.
    first, second = (path.read_text() for path in tmp_path.rglob("scores.jsonl"))
    assert first != second


def test_its_task_runs_beside_ours(tmp_path, run_cli):
    words = option_words(
        model="thumbnails", tasks="nieh_mini_last,nieh_mini_gt", limit=4, out=tmp_path
    )
    assert run_cli(*words)[0] == 0
    (samples,) = tmp_path.rglob("samples_nieh_mini_last_*.jsonl")
    assert {
        len(json.loads(line)["doc"]["frames"]) for line in samples.read_text().splitlines()
    } == {16}
    assert "nieh_mini_last" in run_cli("ls", "tasks")[1]
