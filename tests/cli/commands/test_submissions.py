"""`infthor-eval submit-check` and `leaderboard`, as they are typed."""

import json

import pytest

from tests.helpers.command_line import assert_refused
from tests.helpers.submissions import reader, reply_with, run_model, submit, write_home_set


@pytest.fixture(scope="module")
def homes(tmp_path_factory):
    return write_home_set(tmp_path_factory.mktemp("homes") / "set")


@pytest.fixture(scope="module")
def sent(tmp_path_factory, homes):
    """A folder with an honest submission, and one that has the key."""
    from infthor_eval.nieh.rescoring.rescore import read_source

    folder = tmp_path_factory.mktemp("sent")
    (path,) = run_model(folder / "results", model="random", tasks="nieh_gt", data=homes)
    source = read_source(path)
    submit(folder / "all", "honest", reply_with(source, reader(0.5, "honest")))
    key = reply_with(source, lambda record: ", ".join(map(str, record.payload.answers)), "lab/key")
    submit(folder / "all", "key", key)
    return folder / "all"


def test_one_that_passes(run_cli, sent, homes):
    code, output, _ = run_cli("submit-check", sent / "honest", "--data", homes)
    assert code == 0
    assert output.splitlines()[0] == "honest: passes"
    assert "  remark, above other home: nieh_gt: no run on another home" in output


def test_one_that_is_refused(run_cli, sent, homes):
    code, output, _ = run_cli("submit-check", sent, "--data", homes)
    assert code == 1
    assert "key: refused, 3 reasons" in output
    assert "  key words: nieh_gt: 48 of 48 open questions" in output


def test_verdicts_as_json(run_cli, sent, homes):
    code, output, _ = run_cli("submit-check", sent, "--data", homes, "--json")
    verdicts = [json.loads(line) for line in output.splitlines()]
    assert code == 1
    assert {it["submission"]: it["passes"] for it in verdicts} == {"honest": True, "key": False}
    assert verdicts[1]["refusals"][0].keys() == {"check", "reason"}


def test_the_page_has_what_passes_alone(run_cli, sent, homes, tmp_path):
    page = tmp_path / "page.html"
    code, output, err = run_cli("leaderboard", sent, "--data", homes, "--out", page)
    assert (code, output) == (1, "")
    assert "1 rows, " in err and "1 refused" in err
    text = page.read_text()
    assert "lab/model" in text
    assert "lab/key" not in text
    assert "1 submission was refused" in " ".join(text.split())


def test_no_published_rows(run_cli, sent, homes, tmp_path):
    page = tmp_path / "page.html"
    code, _, _ = run_cli(
        "leaderboard", sent / "honest", "--data", homes, "--out", page, "--no-published"
    )
    assert code == 0
    assert 'class="published"' not in page.read_text()


def test_misuse(run_cli, sent, tmp_path):
    assert_refused(run_cli("submit-check", tmp_path / "none"), "no such folder")
    assert_refused(run_cli("submit-check", sent, "--allow", "frame"), "did you mean 'frames'?")
    assert_refused(run_cli("submit-check", sent, "--key", tmp_path), "no key.json")
