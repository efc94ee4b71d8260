"""The table and the picture of memories."""

from types import SimpleNamespace

import pytest
from msgspec.structs import replace

from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.records import NiehRecall, ShownClues
from infthor_eval.nieh.results.memory_summary import MemorySummary, MemoryTimes, subject_of
from infthor_eval.nieh.results.memory_tables import memory_tables
from infthor_eval.nieh.results.tables import overview, tables
from infthor_eval.runs import Tokens

from ...helpers.nieh_runs import make_config, make_record, make_run, make_twins


def recall(n_frames, build_s=2.0, recall_s=0.5):
    return NiehRecall(recalled=(*range(n_frames), "a mug"), build_s=build_s, recall_s=recall_s)


def config_of(memory, privileged=False):
    config = make_config(context="memory")
    config["tasks"]["nieh_gt"]["sources"] = {
        "memory": {"name": memory, "options": {}, "privileged": privileged}
    }
    return config


def run_of(
    name="nano (budget=1k, memory=last)",
    memory="last",
    privileged=False,
    budget="1k",
    scores=(1, 0, 1, 0),
):
    config = config_of(memory, privileged)
    if budget is not None:
        config["budget"] = budget
    records = [
        make_record(
            number,
            "mug" if score else "no",
            recall=recall(number, build_s=2.0 if number % 4 else 4.0),
            shown_clues=ShownClues(n_shown=number % 3, n_clues=2, n_after=9),
            tokens=Tokens(context=100 * number),
        )
        for number, score in enumerate(scores)
    ]
    return make_run(config, records, name)


def test_a_run_is_summed_up_with_its_memory_and_what_that_took():
    summary = run_of().summary
    assert summary.tasks["nieh_gt"].memory == MemorySummary(
        name="last", privileged=False, budget=1000, n_frames=1.5, n_tokens=150.0
    )
    assert summary.took == {"nieh_gt": MemoryTimes(build_s=2.5, recall_s=0.5)}
    without = make_run(make_config(), [make_record(1, "mug")]).summary
    assert without.took == {}
    assert without.tasks["nieh_gt"].memory is None


def test_the_table_has_what_was_right_recalled_and_spent():
    (table,) = memory_tables([run_of(), run_of("nano (memory=oracle)", "oracle", True, None)])
    heads = [column.name for column in table.columns]
    first, second = (dict(zip(heads, row.cells, strict=True)) for row in table.rows)
    assert (first["model"], first["memory"], first["budget"]) == ("nano", "last", "1,000")
    assert (second["model"], second["memory"], second["budget"]) == ("nano", "oracle*", "-")
    # shown of two clues: 0, 1, 2, 0; right: 1, 0, 1, 0
    right = {"accuracy": "50.0", "all clues": "100.0 (25 %)", "some": "0.0 (25 %)"}
    spent = {"frames": "1.5", "tokens": "150", "build s": "2.500", "recall s": "0.500"}
    assert first.items() >= {**right, "none": "50.0 (50 %)", **spent}.items()


def twins_run(memory, n_right):
    """Three pairs on each of three trajectories, of which so many are right on each."""
    config = config_of(memory)
    records = [
        replace(record, payload=replace(record.payload, recall=recall(1)))
        for base in range(3)
        for at in range(3)
        for record in make_twins(
            3 * base + at, ("bowl", "sofa" if at < n_right[base] else "bowl"), f"t{base}"
        )
    ]
    return make_run(config, records, f"nano (memory={memory})")


def test_pairs_are_compared_with_those_of_no_memory():
    runs = [twins_run("none", (0, 0, 1)), twins_run("uniform", (1, 2, 3))]
    (table,) = memory_tables(runs)
    at = [column.name for column in table.columns].index("pairs above none")
    none, uniform = (row.cells[at] for row in table.rows)
    assert none == "-"
    # by trajectory 1, 2 and 2 of 3 more
    assert uniform.startswith("+55.6 [+")
    (alone,) = memory_tables(runs[1:])
    assert "pairs above none" not in [column.name for column in alone.columns]


def test_it_is_among_all_tables_only_where_there_is_a_memory():
    for of_runs in (overview, tables):
        assert "Memories" in [table.title for table in of_runs([run_of()])]
        plain = make_run(make_config(), [make_record(1, "mug")], "x")
        assert "Memories" not in [table.title for table in of_runs([plain])]


@pytest.mark.parametrize(
    ("label", "subject"),
    [
        ("nano (budget=1k, memory=last)", "nano"),
        ("nano (memory=a/b.py:C, seed=2)", "nano (seed=2)"),
        ("nano (seed=2, memory=last)", "nano (seed=2)"),
        ("nano", "nano"),
        ("nano (memory_args=k=3, memory=clip), blank frames", "nano, blank frames"),
    ],
)
def test_the_memory_is_not_said_twice(label, subject):
    assert subject_of(label) == subject


@pytest.mark.parametrize(
    ("tokens_per_frame", "budget", "said"),
    [
        (9, "27", "27 [3 frames]"),
        (9, "9", "9 [1 frame]"),
        (4, "4k", "4k [1000 frames]"),
        (9, "28", "28"),
        (None, "27", "27"),
        (9, "-9", "-9"),
        (9, "9" * 30, "9" * 30),
    ],
)
def test_a_budget_of_whole_frames_says_so_where_people_read_it(tokens_per_frame, budget, said):
    config = NiehConfig(tasks={}, tokens_per_frame=tokens_per_frame, budget=budget)
    assert config.in_words("budget", budget) == said
    assert config.in_words("seed", budget) == budget
    assert subject_of(f"nano (budget={said}, memory=last)") == "nano"


def test_the_picture_has_a_curve_for_each_memory_over_its_budgets():
    from infthor_eval.report.suites.nieh_charts import memory_charts

    runs = [
        SimpleNamespace(model="nano", summary=run_of("nano", memory, memory == "oracle", budget))
        for memory in ("last", "oracle")
        for budget in ("1k", "2k")
    ]
    (chart,) = memory_charts(runs)
    assert chart.title == "nieh_gt: accuracy by tokens of what a memory recalls"
    assert chart.description == "last 50.0 at 150, 50.0 at 150; oracle* 50.0 at 150, 50.0 at 150"
