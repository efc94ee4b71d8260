"""The table of controls, by hand-made runs."""

import dataclasses

import pytest
from msgspec.structs import replace

from infthor_eval.nieh.results.gains import control_tables
from infthor_eval.nieh.results.tables import overview, tables

from ...helpers.nieh_runs import make_config, make_record, make_run
from .test_pair_summary import pair

# Right of the ten questions of each of four trajectories.
RIGHT = {
    "shown": (8, 8, 6, 6),
    "no-clue": (5, 6, 5, 4),
    "other": (4, 6, 4, 6),
    "blank": (2, 2, 2, 2),
}


def run_with(frames, right=None, **about):
    records = [
        make_record(
            10 * home + number,
            "mug" if number < n_right else "cup",
            cluster=f"t{home}",
        )
        for home, n_right in enumerate(right or RIGHT[frames])
        for number in range(10)
    ]
    return make_run(make_config(frames=frames, **about), records, "nano")


def rows(*runs):
    return [row.cells for table in control_tables(runs) for row in table.rows]


def test_memory_and_knowledge_are_paired_differences_by_trajectory():
    runs = [run_with(frames) for frames in RIGHT]
    # Memory: 3, 2, 1 and 2 of ten questions: mean 20 points, the spread of the means 8.16, of
    # their mean 4.08, and t(3) is 3.182. Knowledge: 2, 4, 2, 4: mean 30, 11.5, 5.77.
    assert rows(*runs) == [
        (
            *("nano", "nieh_gt", "clues"),
            *("70.0", "50.0", "50.0", "20.0"),
            *("+20.0 [+7.0, +33.0]", "+30.0 [+11.6, +48.4]", "40"),
        )
    ]
    assert rows(*reversed(runs)) == rows(*runs)


@pytest.mark.parametrize(
    ("frames", "expected"),
    [
        (("shown",), []),
        (("shown", "blank"), []),
        (("shown", "other"), []),
        (("no-clue", "other"), []),
        (("shown", "no-clue"), [("70.0", "50.0", "-", "-", "+20.0 [+7.0, +33.0]", "-")]),
        (("other", "blank"), [("-", "-", "50.0", "20.0", "-", "+30.0 [+11.6, +48.4]")]),
    ],
)
def test_there_is_a_row_where_a_control_stands_beside_what_it_is_for(frames, expected):
    found = rows(*map(run_with, frames))
    assert [cells[3:-1] for cells in found] == expected


def test_runs_that_differ_in_more_than_frames_are_not_set_beside_each_other():
    shown = run_with("shown")
    assert rows(shown, run_with("no-clue", model="other")) == []
    assert rows(shown, run_with("no-clue", context="trajectory")) == []
    both = [
        *(shown, run_with("no-clue")),
        *(run_with(frames, context="trajectory") for frames in ("shown", "no-clue")),
    ]
    assert [cells[2] for cells in rows(*both)] == ["clues", "trajectory"]


def test_one_trajectory_alone_has_no_interval():
    single = {"shown": 9, "no-clue": 5, "other": 3, "blank": 1}
    ((*_, memory, knowledge, _),) = rows(*(run_with(name, (n,)) for name, n in single.items()))
    assert (memory, knowledge) == ("+40.0", "+20.0")


def test_twins_have_the_accuracy_of_their_pairs_too():
    replies = {"shown": ("bowl", "sofa"), "no-clue": ("bowl", "bowl"), "other": ("bowl", "bowl")}
    runs = []
    for frames, (first, second) in replies.items():
        records = [
            replace(record, task="nieh_gt")
            for number in range(3)
            for record in pair(first, second, f"a/{number}", base=f"t{number}")
        ]
        runs.append(make_run(make_config(frames=frames), records, "nano"))
    (table,) = control_tables(runs)
    cells = dict(zip((column.name for column in table.columns), table.rows[0].cells, strict=True))
    assert [cells[name][:5].strip() for name in ("shown", "no-clue", "other", "blank")] == [
        *("100.0", "50.0", "50.0", "-")
    ]
    assert cells["net pairs, shown"].startswith("100.0")
    assert cells["net pairs, no-clue"].startswith("0.0")
    assert cells["net pairs, blank"] == "-"
    assert cells["of which memory"].startswith("+50.0")


def test_the_table_is_in_both_lists_once():
    runs = [run_with(frames) for frames in RIGHT]
    (table,) = control_tables(runs)
    assert overview(runs).count(table) == tables(runs).count(table) == 1
    assert control_tables([]) == []


def test_an_other_home_of_another_kind_is_named_and_compared_all_the_same():
    other = run_with("other")
    task = replace(other.header.config.tasks["nieh_gt"], without_alike=("bedroom-1",))
    config = replace(other.header.config, tasks={"nieh_gt": task})
    alone = dataclasses.replace(other, header=replace(other.header, config=config))
    assert rows(alone, run_with("blank")) == rows(other, run_with("blank"))
    said = "other: bedroom-1: the set has no other home of this kind of room"
    assert any(said in note for note in overview([alone])[0].notes)
    assert not any(said in note for note in overview([other])[0].notes)
