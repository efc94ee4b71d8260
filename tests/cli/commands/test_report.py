"""The command that writes pages and draws figures."""

import re

import pytest

from ...helpers.command_line import assert_refused, option_words, read_success
from ...helpers.journals import write_run
from ...helpers.plan_runs import make_plan_record, make_planner_run, make_plans_run

PLANS = [
    make_plan_record(name, index, (index, index + 1), 1.0, context=10 * index)
    for name in "ab"
    for index in range(3)
]


@pytest.fixture
def folders(tmp_path):
    runs = (make_plans_run("m", PLANS), make_plans_run("n", PLANS), make_planner_run(PLANS))
    return [write_run(run, tmp_path / "results") for run in runs]


def test_figure_7_is_drawn_and_its_ends_are_printed(folders, tmp_path, run_cli):
    out = tmp_path / "figures"
    code, output, err = run_cli("report", *folders, "--figure", "7", "--out", out)
    assert (code, err) == (0, "")
    assert "reward at the end, mean over 2 trajectories" in output
    assert output.splitlines()[-2:] == [str(out / "figure7.png"), str(out / "figure7.svg")]
    assert all((out / name).stat().st_size > 1000 for name in ("figure7.png", "figure7.svg"))
    rows = [line.split() for line in output.splitlines()]
    assert ["m", "3.00", "[3.00,", "3.00]", "100.0", "3", "20", "6", "0"] in rows


def test_runs_in_no_panel_are_named(folders, tmp_path, run_cli):
    (tmp_path / "panels.yaml").write_text("Ours: [m]\n")
    panels = tmp_path / "panels.yaml"
    _, output, _ = run_cli(
        "report", *folders, "--figure", "7", "--out", tmp_path, "--panels", panels
    )
    assert "in no panel: n" in output.splitlines()


def test_runs_of_one_name_are_told_apart_by_their_folders(tmp_path, run_cli):
    twins = [
        write_run(make_plans_run("m", PLANS), tmp_path, f"infthor_plans-{number}")
        for number in (1, 2)
    ]
    _, output, _ = run_cli("report", *twins, "--figure", "7", "--out", tmp_path / "figures")
    assert "m (infthor_plans-1)" in output
    assert "m (infthor_plans-2)" in output


def test_what_is_no_run_of_plans_is_refused(folders, make_nieh_set, tmp_path, run_cli, evaluate):
    nieh_run = evaluate(data=make_nieh_set(size=56))
    for runs, expected in (
        ([tmp_path], f"{tmp_path}: no journal in it; give the folder of a run"),
        ([folders[0], nieh_run], f"{nieh_run}: is a run of nieh, and figure 7 is of plans"),
    ):
        assert_refused(run_cli("report", *runs, "--figure", "7"), expected)


def test_misuse_is_one_line(folders, tmp_path, run_cli):
    (tmp_path / "file").write_text("")
    first, figure, missing = folders[0], ("--figure", "7"), tmp_path / "missing.yaml"
    for words, expected in (
        ((*folders, "--figure", "5"), "--figure 5: is none that can be drawn; there are 6 (reward"),
        ((*folders, "--task", "a"), "--task: is for a figure; give --figure too, or leave it out"),
        ((*folders, "--out", tmp_path / "page.txt"), "the page is an .html file; name one"),
        (figure, "RUN..."),
        ((first, first, *figure), "given twice"),
        ((first, *figure, "--out", tmp_path / "file"), "cannot be written to"),
        ((first, *figure, "--panels", missing, "--out", tmp_path), f"{missing}: "),
    ):
        assert_refused(run_cli("report", *words), expected)


def test_a_page_is_written_and_its_size_is_told(make_nieh_set, tmp_path, run_cli, evaluate):
    data, place = make_nieh_set(size=56), tmp_path / "pages" / "report.html"
    runs = [evaluate(model, data=data) for model in ("oracle", "blind")]
    code, out, err = run_cli("report", *runs, "--out", place)
    assert (code, err) == (0, "")
    assert out.startswith("5 samples, ")
    assert out.strip().endswith(f"MB: {place}")
    page = place.read_text()
    # How it is done again, and where its frames were.
    assert "infthor-eval run --model oracle --tasks nieh_gt" in page
    assert "no frames are shown" not in page


def test_replays_are_counted_with_the_time_left_also_where_there_is_no_terminal(
    scripted_run, scripted_data, tmp_path, run_cli, monkeypatch
):
    monkeypatch.setattr("infthor_eval.cli.progress.pace._MIN_INTERVAL_S", 0.0)
    words = option_words(data=scripted_data, episodes=3, out=tmp_path / "report.html")
    out, err = read_success(run_cli("report", scripted_run, *words))
    assert "12 samples, " in out
    first, second = err.splitlines()  # the third is the last: the page's size follows
    pattern = r"episodes replayed: {} of 3 \({} %\), .* left, .*; scripted, bedroom-1-seed7"
    assert re.fullmatch(pattern.format(1, 33), first)
    assert re.fullmatch(pattern.format(2, 67), second)


def test_what_is_no_run_is_skipped_and_said(make_nieh_set, tmp_path, run_cli, evaluate):
    run = evaluate(data=make_nieh_set(size=56))
    earlier = tmp_path / "earlier"
    earlier.mkdir()
    (earlier / "report.html").touch()
    page = tmp_path / "page.html"
    code, _, err = run_cli("report", run, earlier, earlier / "report.html", "--out", page)
    assert (code, page.is_file()) == (0, True)
    assert f"skipped: {earlier}: no run" in err
    assert f"skipped: {earlier / 'report.html'}: no run" in err
    assert_refused(run_cli("report", earlier), f"{earlier}: no run, nor is another of the paths")
    assert_refused(
        run_cli("show", tmp_path / "nope"), "nope: no such folder; `infthor-eval ls runs`"
    )
    assert_refused(run_cli("show", run.parents[1]), f"give the folder of a run, such as {run}")


def test_a_folder_of_runs_becomes_an_index_with_a_page_for_each(folders, tmp_path, run_cli):
    broken = tmp_path / "results" / "broken" / "journal"
    broken.mkdir(parents=True)
    (broken / "worker-0.jsonl").write_text("no header\n")
    out = tmp_path / "index"
    output, err = read_success(run_cli("report", tmp_path / "results", "--out", out))
    assert re.fullmatch(r"3 runs, [\d.]+ MB: .*index.html", output.strip().replace("\n", ""))
    assert f"{broken.parent}: not read: " in err
    index = (out / "index.html").read_text()
    links = re.findall(r'<a href="(runs/[^"]+)">', index)
    assert len(links) == 3
    assert "Not read" in index and str(broken.parent) in index
    for link in links:
        page = (out / link).read_text()
        assert "data-packed" in page and "1 run" not in page
    assert "planner" in (out / links[-1]).read_text()


def test_a_folder_of_runs_can_be_one_page(folders, tmp_path, run_cli):
    page = tmp_path / "page.html"
    assert run_cli("report", tmp_path / "results", "--out", page, "--episodes", "0")[0] == 0
    assert "3 runs" in page.read_text() or "m, n" in page.read_text()


def test_the_table_of_runs_is_printed_for_a_paper_and_written_as_a_spreadsheet(
    folders, tmp_path, run_cli
):
    code, output, err = run_cli("report", *folders, "--tables", "latex")
    assert (code, err) == (0, "")
    assert output.startswith(r"\begin{tabular}{lllrrrrrrr}")
    assert output.count(r"plans completed") == 3
    path = tmp_path / "runs.xlsx"
    code, output, err = run_cli("report", *folders, "--xlsx", path)
    assert (code, err, output) == (0, "", f"{path}: 3 rows\n")
    assert path.read_bytes().startswith(b"PK")
    assert_refused(
        run_cli("report", *folders, "--tables", "csv", "--figure", "7"),
        "--tables and --figure: are for different things; leave out all but one",
    )
