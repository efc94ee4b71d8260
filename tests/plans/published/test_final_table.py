"""The table of final tasks from plan logs: made ones, and the published ones, cell by cell."""

from pathlib import Path

import pytest

from infthor_eval.formats.plan_logs import LoggedPlans, PlanCount, PlanLog, read_plan_log
from infthor_eval.formats.published import PublishedRow, PublishedTable
from infthor_eval.plans.published.final_table import count_plans, final_table
from infthor_eval.statistics import clustered_mean

LOGS = sorted((Path(__file__).parents[3] / "../shared/data/published_sets/plans").glob("*.log.gz"))
COLUMNS = ("Go to", "Pick up", "Put", "total")


def log(name, *rows, digest="a"):
    """A log; a row is the done plans of goto, pick and put, of 2, 1 and 1, or None where the set-up
    failed."""
    plans = []
    for line, done in enumerate(rows, 1):
        sizes = (0, 0, 0) if done is None else (2, 1, 1)
        counts = [PlanCount(*pair) for pair in zip(done or (0, 0, 0), sizes, strict=True)]
        total = PlanCount(sum(count.n_done for count in counts), sum(sizes))
        plans.append(LoggedPlans(line, f"t{line}", *counts, total))
    return PlanLog(Path(f"eval_longhrz_checkpoints_{name}.log"), tuple(plans), (), digest)


@pytest.fixture
def printed(monkeypatch):
    """A printed table of a model with a log, and of one without."""
    rows = (
        PublishedRow("theirs", (), None, (25.0, 30.0, 50.0, 25.0), log="model-1"),
        PublishedRow("another", (), None, (1.0, 2.0, 3.0, 4.0)),
    )
    table = PublishedTable(
        "final long-horizon tasks", "here", "plans", "", "success", COLUMNS, rows, ("as it is",)
    )
    monkeypatch.setattr(
        "infthor_eval.plans.published.final_table.published_tables", {"plans": (table,)}.get
    )


def test_a_row_stands_above_the_printed_one_and_what_does_not_follow_is_marked(printed):
    table = final_table([log("model-1", (1, 0, 1), None, (0, 0, 0))])
    ours, theirs, rest = (row.cells for row in table.rows)
    estimate = clustered_mean([1, 1, 0, 0, 0, 0, 0, 0], ["t1"] * 4 + ["t3"] * 4)
    interval = f"{100 * estimate.low:.1f}–{100 * estimate.high:.1f}"
    assert ours == (
        *("model-1", "the log", "25.0 (1 of 4)", "0.0 (0 of 2)", "50.0 (1 of 2)", "25.0 (2 of 8)"),
        *(interval, "1 of 3"),
    )
    assert theirs == ("theirs", "printed", "25.0", "30.0*", "50.0", "25.0")
    assert rest == ("another", "printed", "1.0", "2.0", "3.0", "4.0")
    assert table.notes[:2] == (
        "3 of 4 printed cells follow from these logs.",
        "*: theirs, Pick up: printed 30.0, in the log 0.0 (0 of 2). No counts of this log give "
        "30.0.",
    )
    assert "as it is" in table.notes


def test_counts_that_give_a_cell_in_another_way_are_named(printed):
    table = final_table([log("model-1", (1, 0, 1), (0, 1, 0), (0, 0, 0))])
    # Done: 1 of 6 go-tos, 1 of 3 pick-ups, 1 of 3 puts, 3 of 12 plans in all; the last is 25.0 %.
    assert table.notes[0] == "1 of 4 printed cells follow from these logs."
    (goto,) = [note for note in table.notes if note.startswith("*: theirs, Go to")]
    assert goto == (
        "*: theirs, Go to: printed 25.0, in the log 16.7 (1 of 6). 25.0 is 3 of 12: total done, of "
        "the plans of total."
    )


def test_a_log_of_another_name_stands_alone(printed):
    table = final_table([log("model-2", (1, 0, 0))])
    assert [row.cells[:2] for row in table.rows] == [
        ("model-2", "the log"), ("theirs", "printed"), ("another", "printed"),
    ]  # fmt: skip
    assert not any("printed cells" in note or note.startswith("*") for note in table.notes)


def test_a_log_in_which_every_set_up_failed_has_no_shares(printed):
    table = final_table([log("model-2", None, None)])
    assert table.rows[0].cells[2:] == (*["- (0 of 0)"] * 4, "-", "2 of 2")


def test_two_logs_that_are_one_are_named(printed):
    first, same, other = log("a", (1, 0, 0)), log("b", (1, 0, 0)), log("c", (1, 0, 0), digest="c")
    (note,) = [note for note in final_table([first, same, other]).notes if "byte for byte" in note]
    assert note == f"{same.path.name} is byte for byte {first.path.name}."


@pytest.mark.skipif(not LOGS, reason="the published plan logs are not at ../shared/data")
def test_sixteen_of_twenty_printed_cells_follow_from_the_published_logs():
    table = final_table([read_plan_log(path) for path in LOGS])
    assert table.notes[0] == "16 of 20 printed cells follow from these logs."
    marked = {
        row.cells[0]: row.cells[2:] for row in table.rows if any("*" in cell for cell in row.cells)
    }
    assert marked == {
        "Qwen2.5-VL 7B, interleaved, 128K": ("18.5", "2.3*", "0.0", "9.2"),
        "Qwen2.5-VL 7B, interleaved, 128K, dynamic scaling": ("20.0", "2.3*", "0.0", "9.9"),
        "Qwen2.5-VL 7B, interleaved, 128K, YaRN x4": ("23.1", "2.6*", "0.0", "11.5"),
        "Qwen2.5-VL 7B, memory as text": ("10.8", "1.5*", "0.0", "6.1"),
    }
    assert any(
        "1.5 is 1 of 65: Pick up done, of the plans of Go to" in note for note in table.notes
    )
    assert sum("No counts of this log give" in note for note in table.notes) == 3
    assert {row.cells[7] for row in table.rows if not row.is_published} == {"6 of 39"}
    assert sum("longrope_4.0.log.gz is byte for byte" in note for note in table.notes) == 1
    assert table.rows[-1].cells[:2] == ("Qwen2.5-VL 7B, interleaved, 32K", "printed")


@pytest.mark.skipif(not LOGS, reason="the published plan logs are not at ../shared/data")
@pytest.mark.parametrize(
    ("name", "done"),
    [
        ("hf.log", (12, 0, 0, 12)),
        ("dynamic_4.0.log", (13, 0, 0, 13)),
        ("longrope_4.0.log", (12, 0, 0, 12)),
        ("yarn_4.0.log", (15, 0, 0, 15)),
        ("yarn_8.0.log", (8, 0, 0, 8)),
        ("text-state_step-60000-hf_.log", (7, 1, 0, 8)),
        ("image-state_step-60000-hf_.log", (4, 0, 0, 4)),
    ],
)
def test_the_counts_of_the_published_logs(name, done):
    (path,) = [path for path in LOGS if path.name.endswith(f"{name}.gz")]
    counts = count_plans(read_plan_log(path))
    assert tuple(count.n_done for count in counts.values()) == done
    assert tuple(count.n for count in counts.values()) == (65, 33, 33, 131)
