import pytest

from infthor_eval.formats.nieh_set import NiehSet

from ....helpers.command_line import assert_refused


def test_the_example_runs_as_it_is(tmp_path, run_cli):
    folder = tmp_path / "my set"
    code, out, err = run_cli("init-set", folder)
    assert code == 0, err
    assert "--model oracle --tasks nieh_gt --data" in out
    data = NiehSet(folder)
    assert not data.skipped and {row.traj_id for row in data.questions} == {"kitchen", "walk"}
    # Each single clue of the film shows the colour that is the answer.
    pixel = data.frames("walk")[3].load().getpixel((90, 90))
    assert min(pixel[:2]) > 200 and pixel[2] < 60, "yellow"

    run = ("--model", "oracle", "--tasks", "nieh_gt,nieh_full", "--data", folder)
    code, out, err = run_cli("run", *run, "--out", tmp_path / "out")
    assert code == 0, err
    lines = [line for line in out.splitlines() if " nieh_" in line]
    assert lines and all("100.00" in line or "100.0 " in line for line in lines)
    assert "skipped" not in out
    (path,) = (tmp_path / "out").rglob("results.json")
    code, out, err = run_cli("report", path.parent, "--tables", "csv")
    assert code == 0 and "nieh_gt" in out, err
    code, _, err = run_cli("report", path.parent, "--out", tmp_path / "page.html")
    assert code == 0, err
    page = (tmp_path / "page.html").read_text()
    assert "by number of clues" in page and "Table 4, clues" not in page, "on other questions"


@pytest.mark.parametrize("is_file", [False, True])
def test_what_is_there_is_not_written_over(tmp_path, run_cli, is_file):
    path = tmp_path / "there"
    if is_file:
        path.write_text("mine")
    else:
        path.mkdir()
        (path / "mine.txt").write_text("mine")
    assert_refused(run_cli("init-set", path), "is no empty folder; give a new one")
