"""A private set from end to end: asked without answers, scored with the key."""

import json
from pathlib import Path

import pytest

from infthor_board.private_sets import publish, read_secret
from infthor_eval.cli.commands.rescore import read_source
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.run import Run
from tests.helpers.command_line import assert_refused
from tests.helpers.twin_sets import write_twin_set
from tests.infthor_board.material import reply_with, run_model, submit


@pytest.fixture(scope="module")
def held_out(tmp_path_factory) -> Path:
    """Both parts of a private set, and a run on the public one."""
    out = tmp_path_factory.mktemp("held_out")
    (out / "key").mkdir()
    claim_for_simulator(out / "key", "embedded")
    data = NiehSet(write_twin_set(out / "key", range(1, 9)))
    (out / "secret.txt").write_text("5eed" * 16)
    publish(data, read_secret(out / "secret.txt"), out / "public")
    run_model(out / "results", model="random", tasks="nieh_gt", data=out / "public")
    return out


@pytest.fixture
def run(held_out) -> Path:
    (folder,) = (held_out / "results" / "random").iterdir()
    return folder


def test_a_run_says_that_its_scores_mean_nothing(held_out, run, run_cli):
    _, output, _ = run_cli("show", run)
    assert "The answers of this set are withheld" in " ".join(output.split())
    assert read_source(Run.open(run)).header.config.tasks["nieh_gt"].withheld


def test_rescore_needs_the_key_and_counts_pairs_with_it(held_out, run, run_cli, tmp_path):
    code, output, err = run_cli(
        "rescore", run, "--key", held_out / "key", "--out", tmp_path / "scored"
    )
    assert code == 0, err
    (folder,) = (tmp_path / "scored").rglob("results.json")
    results = json.loads(folder.read_text())
    pairs = results["summary"]["tasks"]["nieh_gt"]["pairs"]
    assert pairs["n_pairs"] == 16
    assert "withheld" not in output


def test_the_key_of_another_set_is_refused(held_out, run, run_cli, tmp_path):
    other = tmp_path / "key"
    other.mkdir()
    claim_for_simulator(other, "embedded")
    data = NiehSet(write_twin_set(other))
    publish(data, read_secret(held_out / "secret.txt"), tmp_path / "public")
    ended = run_cli("rescore", run, "--key", other, "--out", tmp_path / "scored")
    assert_refused(ended, "another set than the public part")


def test_submissions_are_checked_with_the_key(held_out, run, run_board, tmp_path):
    source = read_source(Run.open(run))
    folder = submit(tmp_path, "sent", reply_with(source, lambda _: "bowl"))
    public = ("--data", held_out / "public")
    code, output, _ = run_board("check", folder, *public, "--key", held_out / "key")
    assert code == 0, output
    code, output, _ = run_board("check", folder, *public)
    assert code == 1
    assert "give its key with --key" in output
    page = tmp_path / "page.html"
    code, _, err = run_board(
        "page", tmp_path / "sent", "--out", page, *public, "--key", held_out / "key"
    )
    assert code == 0, err
    assert "lab/model" in page.read_text()
