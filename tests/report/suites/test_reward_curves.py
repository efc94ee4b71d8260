"""Pictures of curves, and the command that draws them."""

import re
from pathlib import Path

import pytest
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.plans.recorded.curves import plan_curves
from infthor_eval.plans.records import RECORDS
from infthor_eval.report.figures import looks_of, save_figure
from infthor_eval.report.suites.reward_curves import (
    curves_result,
    curves_table,
    embedded_label,
    read_panels,
)
from infthor_eval.runs import read_run

from ...helpers.command_line import option_words, read_success
from ...helpers.journals import write_run
from ...helpers.plan_runs import make_plan_record, make_planner_run, make_plans_run
from ...helpers.trajectories import CANDLE, cut_trajectory, write_trajectories
from .drawings import read_texts

EXAMPLE = Path(__file__).parents[3] / "docs" / "figure7_panels.yaml"


def records(reward: float, *, tokens: bool = True):
    return [
        make_plan_record(
            name,
            index,
            (10 * index, 10 * index + 10),
            reward + number,
            context=100 * index if tokens else None,
        )
        for number, name in enumerate(("a", "b", "c"))
        for index in range(4)
    ]


def runs(**about):
    return [
        make_plans_run("model $x$ & <y>", records(1.0), **about),
        make_plans_run("_random", records(0.5, tokens=False), **about),
        make_planner_run(records(2.0, tokens=False), **about),
    ]


def test_the_picture_is_there_in_both_forms_with_its_words(tmp_path):
    curves = plan_curves(runs())
    png, svg = save_figure(curves_result(curves, None).plot, tmp_path, "figure7")
    with Image.open(png) as picture:
        assert min(picture.size) > 300
        assert len(picture.convert("RGB").getcolors(1 << 20)) > 10
    words_drawn = read_texts(svg)
    for words in (
        "planner",
        "model $x$ &amp; &lt;y&gt;",
        "_random",
        "reward so far (points)",
        "expert's steps up to the end of the plan (low-level actions)",
        "context of the plan's last request (tokens)",
        "Cumulative reward on infthor_plans",
        "mean over 3 trajectories, 95 % intervals shaded",
        "embedded simulator: not comparable with the paper's curves",
        "context tokens are not reported: _random",
        "planner, context of the plan's last request (tokens): its plans are where the first of "
        "the runs has them",
    ):
        assert words in words_drawn
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure7.png", "figure7.svg"]


def test_a_name_in_letters_that_the_font_lacks_is_no_warning(tmp_path, recwarn):
    curves = plan_curves([make_plans_run("模型", records(1.0))])
    _, svg = save_figure(curves_result(curves, None).plot, tmp_path, "figure7")
    assert "模型" in read_texts(svg)
    assert not recwarn.list


def test_the_same_curves_give_the_same_bytes(tmp_path):
    first, second = (
        save_figure(curves_result(curves, None).plot, tmp_path, name)[1].read_bytes()
        for name, curves in (("one", plan_curves(runs())), ("two", plan_curves(runs())))
    )
    assert first == second


def test_a_bound_without_tokens_leaves_one_column(tmp_path):
    curves = plan_curves([make_plans_run("m", records(1.0, tokens=False))])
    _, svg = save_figure(curves_result(curves, None).plot, tmp_path, "figure7")
    assert "at most" in read_texts(svg)
    assert not any("(tokens)" in words for words in read_texts(svg))


def test_the_label_names_the_embedded_runs_where_not_all_are():
    assert embedded_label(plan_curves(runs(simulator="unity"))) is None
    mixed = plan_curves(
        [make_plans_run("m", records(1.0)), make_plans_run("n", records(1.0), simulator="unity")]
    )
    assert embedded_label(mixed) == "embedded simulator (m): not comparable with the paper's curves"


def test_the_table_has_the_ends():
    table = curves_table(plan_curves(runs()))
    # Of the first run, 4 plans in each of three trajectories: 4, 8 and 12 points; 8, 12 and 16 of
    # the planner.
    cells = "model $x$ & <y>|8.00|[-1.94, 17.94]|66.7|40|300|12|0"
    assert "|".join(table.rows[0].cells) == cells
    assert table.rows[-1].cells[:4] == ("planner", "12.00", "[2.06, 21.94]", "100.0")
    assert table.rows[1].cells[5] == "-"
    assert table.rows[-1].cells[5] == "300"


def test_panels_have_their_runs_and_the_bound(tmp_path):
    curves = plan_curves(runs())
    file = tmp_path / "panels.yaml"
    file.write_text("First: ['model $x$ & <y>']\nSecond: [_random]\n")
    _, svg = save_figure(curves_result(curves, file).plot, tmp_path, "figure7")
    words_drawn = read_texts(svg)
    counts = [words_drawn.count(words) for words in ("First", "Second", "planner", "_random")]
    assert counts == [1, 1, 2, 1]
    assert "context tokens are not reported" in words_drawn


BAD_PANELS = {
    "- a": "not a mapping",
    "{}": "not a mapping",
    "A: b": "'A' is not a list of runs",
    "A: []": "'A' is not a list of runs",
    "A: [nobody]": "'A': 'nobody' is none of the runs; there are model",
    "A: [": "not YAML",
    "\n".join(f"P{number}: [_random]" for number in range(13)): "13 panels",
}


@pytest.mark.parametrize("content", BAD_PANELS)
def test_panels_of_another_form_are_refused(tmp_path, content):
    file = tmp_path / "panels.yaml"
    file.write_text(content)
    with pytest.raises(DataError, match=re.escape(BAD_PANELS[content])):
        read_panels(file, plan_curves(runs()))


FT = {length: f"llava-ft{length}k" for length in (32, 64, 130)}  # the checkpoints of Table 5
# Panels of Figure 7 by its caption and section C.1: methods at x4, YaRN's factors, lengths of
# training, both, the best.
FIGURE_7 = {
    "(a)": [FT[32], *(f"{FT[32]}-{method}4" for method in ("dynamic", "longrope", "yarn"))],
    "(b)": [FT[32], *(f"{FT[32]}-yarn{factor}" for factor in (4, 8, 16))],
    "(c)": [*FT.values()],
    "(d)": [f"{FT[64]}@yarn4{extended}" for extended in ("", "-yarn8", "-yarn16")],
    "(e)": [f"{FT[130]}@yarn4{extended}" for extended in ("", "-yarn8", "-yarn16")],
    "(f)": [f"{FT[32]}-yarn4", FT[130], f"{FT[130]}@yarn4"],
}
NAMES = sorted({name for names in FIGURE_7.values() for name in names})


def test_the_example_has_the_six_panels_of_the_papers_figure():
    panels = read_panels(
        EXAMPLE, plan_curves([make_plans_run(name, records(1.0)) for name in NAMES])
    )
    assert {panel.title[:3]: list(panel.labels) for panel in panels} == FIGURE_7


def test_runs_that_share_a_panel_differ_in_colour_and_all_runs_in_their_lines():
    looks = looks_of(NAMES, FIGURE_7.values())
    assert len(set(looks.values())) == len(NAMES)
    for names in FIGURE_7.values():
        assert len({looks[name].colour for name in names}) == len(names)


def test_runs_beyond_the_number_of_lines_take_them_again():
    looks = looks_of(map(str, range(20)))
    assert [looks["18"], looks["19"]] == [looks["0"], looks["1"]]


def long_records(done: float, *, tokens: bool = True):
    """Two trajectories of plans of thirty steps of 700 tokens, up to half a million; a part of them
    is done."""
    return [
        make_plan_record(
            name,
            index,
            (30 * index, 30 * index + 30),
            4.0 * done,
            context=21_000 * (index + 1) if tokens else None,
        )
        for name, n_plans in (("a", 24), ("b", 23))
        for index in range(n_plans)
    ]


def test_the_six_panels_are_drawn_over_thousands_of_tokens_with_the_planner_in_each(
    tmp_path, run_cli
):
    runs = [
        make_plans_run(name, long_records((number + 1) / 16)) for number, name in enumerate(NAMES)
    ]
    folders = [
        write_run(each, tmp_path)
        for each in (*runs, make_planner_run(long_records(1.0, tokens=False)))
    ]
    code, output, err = run_cli(
        "report", *folders, "--figure", "7", "--panels", EXAMPLE, "--out", tmp_path
    )
    assert (code, err) == (0, "")
    assert "in no panel" not in output
    words = read_texts(tmp_path / "figure7.svg")
    assert [words.count(word) for word in ("planner", "500K", FT[130])] == [6, 6, 2]
    assert sum(word.startswith(tuple(FIGURE_7)) for word in words) == 6


def test_the_six_panels_are_drawn_from_runs_of_tiny_models(tmp_path, run_cli, monkeypatch):
    """The whole way of docs/figures.md: a checkpoint trained under YaRN, runs with its names, and
    their figure."""
    monkeypatch.chdir(tmp_path)
    write_trajectories(tmp_path / "data", cut_trajectory(CANDLE, 2))
    task_options = ("--tasks", "infthor_plans", "--data", "data", "--rewards", "published")
    training = option_words(
        recipe="infthor_32k",
        data="set",
        out="trained",
        model="llava-onevision-tiny",
        model_args="dtype=float32,rope=yarn:4",
        set="max_steps=1",
    )
    for words in (
        ("replay", "data", "--out", "set"),
        ("train", *training),
        ("--model", "planner", *task_options),
        *(_options_of_model(name, *task_options) for name in NAMES),
    ):
        read_success(run_cli(*words))
    runs = sorted(Path("results").glob("*/*"))
    output, _ = read_success(run_cli("report", *runs, "--figure", "7", "--panels", EXAMPLE))
    assert "in no panel" not in output
    assert {line.split()[0] for line in output.splitlines() if line.split()} >= {*NAMES, "planner"}
    words = read_texts(Path("results/figures/figure7.svg"))
    assert words.count("planner") == 6
    replies = {
        name: _replies(Path("results", name))
        for name in (FT[32], f"{FT[32]}-longrope4", f"{FT[32]}-yarn4")
    }
    plain, longrope, yarn = replies.values()
    # As the published logs; contexts are within the original length.
    assert plain == longrope != yarn
    assert not any("continuation" in word or "differ" in word for word in words)


def _replies(folder: Path) -> list[list[str | None]]:
    (journal,) = folder.iterdir()
    return [
        [step.reply for step in record.payload.steps] for record in read_run(journal, RECORDS)[1]
    ]


def _options_of_model(name: str, *task_options: str) -> tuple[str, ...]:
    """The command of docs/figures.md that makes the run of this name, with a tiny model in the
    place of the large."""
    _, trained, extended = re.fullmatch(r"(llava-ft\d+k)(@yarn4)?(?:-(.+))?", name).groups(
        default=""
    )
    model = (
        "llava-onevision,pretrained=trained/checkpoint"
        if trained
        else "llava-onevision-tiny,dtype=float32"
    )
    model, _, options = model.partition(",")
    rope = ("--rope", re.sub(r"(\d+)$", r":\1", extended)) if extended else ()
    words = option_words(
        model=model,
        model_args=f"{options},prompt=plain,max_tokens=0",
        history="published",
        name=name,
    )
    return (*words, *rope, *task_options)
