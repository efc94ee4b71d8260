"""`show` and `ls runs`: results on the first screen, in full, and for other programs."""

import csv
import io
import json
import math

import pytest

from tests.helpers.command_line import assert_refused, option_words, read_success


@pytest.fixture
def ran(make_nieh_set, tmp_path, run_cli):
    """The folders of runs of the oracle and of the blind on five questions, and what was printed at
    their end."""
    data = make_nieh_set(size=56)
    arguments = option_words(model="oracle,blind", tasks="nieh", data=data, out=tmp_path / "out")

    def ran(*options):
        out, _ = read_success(run_cli(*arguments, *options))
        folders = [next((tmp_path / "out" / model).iterdir()) for model in ("oracle", "blind")]
        return folders, out

    return ran


@pytest.mark.parametrize(
    "options", [(), ("--full",), ("--json",), ("--format", "latex"), ("--format", "csv")]
)
def test_a_run_is_shown_again_as_it_was_shown(ran, run_cli, options):
    folders, printed = ran(*options)
    code, out, err = run_cli("show", *folders, *options)
    assert (code, out, err) == (0, printed, "")


def test_the_first_screen_has_one_number_a_task_and_fits(ran):
    _, printed = ran()
    rows = [line.split() for line in printed.splitlines()]
    assert ["model", "task", "total", "95", "%", "bootstrap", "n"] in rows
    assert ["oracle", "nieh_gt", "100.00", "34.2–100.0", "-", "5"] in rows
    assert "reference" not in printed
    assert max(len(line) for line in printed.splitlines() if "/" not in line) <= 100


def test_quiet_prints_folders_and_nothing_else(ran, capfd, run_cli):
    folders, printed = ran("--quiet")
    assert printed.split() == [str(folder) for folder in folders]


def test_json_alone_is_on_standard_output(ran):
    folders, printed = ran("--json", "--quiet")
    documents = json.loads(printed)
    assert [document["folder"] for document in documents] == list(map(str, folders))
    for document, folder in zip(documents, folders, strict=True):
        del document["folder"]
        assert document == json.loads((folder / "results.json").read_text())
    assert documents[0]["primary_metrics"]["nieh_gt"]["mean"] == 1.0


def test_csv_is_a_table_with_one_number_a_cell(ran):
    _, printed = ran("--format", "csv")
    heading, *rows = csv.reader(io.StringIO(printed))
    assert ",".join(heading) == (
        "model,task,total,95 % low,95 % high,bootstrap low,bootstrap high,n"
    )
    assert rows[0] == ["oracle", "nieh_gt", "100.00", "34.2", "100.0", "", "", "5"]
    assert rows[1][:3] == ["oracle", "nieh_full", "100.00"]


def test_all_tables_of_csv_have_numbers_in_their_columns_of_numbers(ran):
    _, printed = ran("--format", "csv", "--full")
    texts = ("model", "task", "file", "scorer", "not in the form asked for")
    for block in filter(str.strip, printed.split("\n\n")):
        heading, *rows = csv.reader(line for line in block.splitlines() if not line.startswith("#"))
        for name, *cells in zip(heading, *rows, strict=True):
            assert name in texts or all(
                cell == "" or math.isfinite(float(cell)) for cell in cells
            ), (name, cells)


def test_json_with_full_and_a_folder_without_a_run_are_refused(run_cli, tmp_path):
    assert_refused(run_cli("show", tmp_path, "--json", "--full"), "--json holds everything")
    expected = f"{tmp_path}: no journal in it; give the folder of a run"
    assert_refused(run_cli("show", tmp_path), expected)


def test_why_units_failed_is_said_again_and_of_several_runs_with_the_folder(tmp_path, run_cli):
    model = tmp_path / "dead.py"
    model.write_text("def answer(images, text):\n    raise ValueError('is away')\n")
    words = option_words(model=f"{model}:answer,blind", tasks="nieh_mini_gt", limit=2)
    code, _, printed = run_cli(*words, "--out", tmp_path / "out")
    assert code == 1
    dead, blind = (next((tmp_path / "out" / name).iterdir()) for name in ("answer", "blind"))
    _, err = read_success(run_cli("show", dead))
    assert err.startswith("nieh_mini_gt: 2 sample(s) failed, in no score: answer fails")
    assert err in printed
    assert run_cli("show", dead, blind)[2] == f"{dead}: {err}"


# -- ls


def test_runs_are_listed_with_counts_and_primary_metrics(ran, run_cli, tmp_path):
    folders, _ = ran()
    code, out, err = run_cli("ls", "runs", tmp_path / "out")
    assert (code, err) == (0, "")
    (oracle,) = [line for line in out.splitlines() if line.split()[:1] == ["oracle"]]
    assert oracle.split()[1:5] == ["nieh", "10", "0", "0"]
    assert "nieh_gt 100.0, nieh_full 100.0" in oracle
    _, table, _ = run_cli("ls", "runs", tmp_path / "out", "--format", "csv")
    assert table.startswith("run,suite,answered,failed,not asked,")
    assert str(folders[0]) in oracle


def test_a_killed_run_is_listed_without_results_and_a_broken_line_is_named(ran, run_cli, tmp_path):
    (oracle, blind), _ = ran()
    (oracle / "results.json").unlink()
    journal = blind / "journal" / "worker-0.jsonl"
    journal.write_bytes(journal.read_bytes() + b"no record\n")
    out, err = read_success(run_cli("ls", "runs", tmp_path))
    (row,) = [line.split() for line in out.splitlines() if line.split()[:1] == ["oracle"]]
    assert row[1:5] == ["nieh", "10", "0", "0"]  # the journal's header has their number
    assert f"left out: {journal}, line " in err.replace("\n", "")


def test_a_folder_without_runs_says_how_to_make_one(run_cli, tmp_path):
    out, _ = read_success(run_cli("ls", "runs", tmp_path))
    assert "`infthor-eval --model MODEL --tasks TASKS` starts one" in out
    assert_refused(run_cli("ls", "runs", tmp_path / "no"), "no: no such folder")


def test_bare_ls_says_what_can_be_listed(run_cli):
    out, _ = read_success(run_cli("ls"))
    assert all(name in out for name in ("models", "tasks", "scenes", "runs"))
