"""Published numbers against the published files that they are from, counted without our readers."""

from collections import Counter
from pathlib import Path

import pytest

from infthor_eval.formats.published import published_tables

from ..helpers.files import read_json_lines

PUBLISHED = Path(__file__).parents[2] / "../shared/data/published_sets"
needs_logs = pytest.mark.skipif(
    not PUBLISHED.is_dir(), reason="the published logs are not at ../shared/data"
)
REPLIES = "eval_qa_set_{}_clue_Qwen2.5-VL-7B-Instruct_full_traj{}.log.gz"


def table(suite, title):
    (matching,) = [table for table in published_tables(suite) if table.title == title]
    return matching


@pytest.mark.parametrize("suite", ["nieh", "plans", "manipulation", "training"])
def test_every_table_has_a_source_and_a_title_of_its_own(suite):
    tables = published_tables(suite)
    assert len({table.title for table in tables}) == len(tables) > 0
    assert all("pearls-lab/infini-thor" in table.source for table in tables)


@needs_logs
@pytest.mark.parametrize(
    ("title", "row", "mode"),
    [
        ("NIEH on full trajectories", 4, ""),
        ("NIEH on the end of trajectories", 0, "_truncate_head_32K"),
        ("NIEH on retrieved frames", 1, "_clip_retrieval_top20"),
    ],
)
def test_means_of_replies_are_those_of_the_logs(title, row, mode):
    published = table("nieh", title)
    means = []
    for file in ("nieh_single", "nsieh_multi"):
        replies = read_json_lines(PUBLISHED / "replies" / REPLIES.format(file, mode))
        means.append(round(100 * sum(reply["score"] for reply in replies) / len(replies), 2))
    assert published.columns == ("nieh_single_clue", "nsieh_multi_clue")
    assert tuple(means) == published.rows[row].values


def test_two_figures_that_disagree_both_stand_and_that_is_said():
    published = table("nieh", "NIEH on full trajectories")
    ours = {row.source: row.values for row in published.rows if row.name == "Qwen2.5-VL 7B"}
    assert list(ours.values()) == [(47.35, 36.6), (55.86, 42.72)]
    assert "do not agree" in published.notes[0]


@needs_logs
def test_rates_of_plans_are_those_of_the_logs():
    logs = sorted((PUBLISHED / "plans").glob("*.log.gz"))
    rows = {row.log: row.values for row in table("plans", "logs on final tasks").rows}
    assert len(logs) == len(rows) == 7
    for log in logs:
        name = log.name.removeprefix("eval_longhrz_checkpoints_").removesuffix(".log.gz")
        counts = Counter()
        for row in read_json_lines(log):
            counts.update(row["metric"])
        kinds = ("goto", "pick", "put")
        rates = [counts[f"{kind}_success"] / counts[f"{kind}_count"] for kind in kinds]
        rates.append(counts["success_count"] / counts["total_count"])
        assert tuple(round(100 * rate, 1) for rate in rates) == rows[name.rstrip("_")], name


def test_the_model_of_the_final_tasks_is_qwen():
    rows = [row for table in published_tables("plans") for row in table.rows]
    assert {row.name.partition(",")[0] for row in rows} == {"Qwen2.5-VL 7B"}
    assert {row.parameters for row in rows} == {8.29}
