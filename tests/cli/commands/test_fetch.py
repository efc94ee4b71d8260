"""`fetch` against a local server that speaks the hub's protocol for one data set."""

import tarfile

import pytest

from infthor_eval.nieh.published.hub_data import NIEH_REPOSITORY

from ...helpers.command_line import assert_refused, read_success
from ...helpers.hub import serve_hub


@pytest.fixture
def hub(make_nieh_set, tmp_path, monkeypatch):
    root = make_nieh_set(size=56, name="published")
    with tarfile.open(tmp_path / "metadata.tar", "w") as tar:
        tar.add(root / "metadata", "metadata")
    csv = (root / "qa_set_test.csv").read_text().splitlines(keepends=True)
    files = {
        "qa_set_nieh_single_clue.csv": "".join(csv[:2]).encode(),
        "qa_set_nieh_multi_clue.csv": "".join([csv[0], *csv[2:]]).encode(),
        "metadata.tar": (tmp_path / "metadata.tar").read_bytes(),
    }
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with serve_hub(f"datasets/{NIEH_REPOSITORY}", files) as served:
        yield served


def test_fetched_data_are_found_by_the_task_and_not_fetched_again(hub, tmp_path, run_cli):
    endpoint, handler = hub
    out, _ = read_success(run_cli("fetch", "nieh", "--endpoint", endpoint))
    assert "nieh: 5 questions" in out
    assert list((tmp_path / "cache").rglob("metadata.tar")) == []
    handler.status = 500
    assert run_cli("fetch", "nieh", "--endpoint", endpoint)[0] == 0
    out, _ = read_success(
        run_cli("--model", "oracle", "--tasks", "nieh_gt", "--out", tmp_path / "out")
    )
    assert "100.00" in out


def test_no_access_and_no_network_are_one_line_with_a_hint(hub, tmp_path, run_cli):
    endpoint, handler = hub
    handler.status = 403
    assert_refused(
        run_cli("fetch", "nieh", "--endpoint", endpoint, "--out", tmp_path / "d"), "hf auth login"
    )
    assert_refused(
        run_cli("fetch", "nieh", "--endpoint", "http://127.0.0.1:9", "--out", tmp_path / "d"),
        "cannot be fetched",
    )


def test_a_long_cause_is_marked_where_it_is_cut(tmp_path, run_cli, monkeypatch):
    def fail(*_args, **_options):
        raise ValueError("no way to the hub " * 30)

    monkeypatch.setattr("huggingface_hub.HfApi.repo_info", fail)
    assert_refused(run_cli("fetch", "nieh", "--out", tmp_path / "d"), "...); go online")


def test_an_archive_that_points_elsewhere_is_refused(hub, tmp_path, run_cli):
    endpoint, handler = hub
    with tarfile.open(tmp_path / "evil.tar", "w") as tar:
        tar.add(tmp_path / "metadata.tar", "../evil")
    handler.files["metadata.tar"] = (tmp_path / "evil.tar").read_bytes()
    ended = run_cli("fetch", "nieh", "--endpoint", endpoint, "--out", tmp_path / "d")
    assert_refused(ended, "points outside", after_notes=True)
    assert not (tmp_path / "d" / "metadata").exists()
