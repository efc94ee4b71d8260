from infthor_eval.generation.generate_set import GeneratedSet
from infthor_eval.generation.replay_summary import (
    ActionCounts,
    Divergence,
    OverlapStatistics,
    ReplaySummary,
)
from infthor_eval.generation.tables import (
    final_tasks_table,
    overlaps_table,
    refusals_table,
    regular_numbers,
)

EXACT, SHIFTED = OverlapStatistics(4, 1.0, 0.9951), OverlapStatistics(2, 1.0, 0.94)


def summary(actions: dict[str, ActionCounts], by_action: dict, by_type: dict) -> ReplaySummary:
    refused = (
        [Divergence("t", 3, "OpenObject Fridge", "blocked")]
        if any(item.refused for item in actions.values())
        else []
    )
    return ReplaySummary(
        1, 0, 0, 1 - len(refused), 1, actions, by_type, by_action, 1.5, refused, []
    )


def test_a_replay_as_recorded_is_one_line():
    replay = summary(
        {"MoveAhead": ActionCounts(20, 0), "OpenObject": ActionCounts(4, 0)},
        {"OpenObject": EXACT},
        {"Fridge": EXACT},
    )
    assert refusals_table(replay) is None and overlaps_table(replay) is None
    assert regular_numbers(replay).startswith(
        "all 24 actions accepted, all 4 boxes as recorded (IoU 1.00) (--json "
    )


def test_what_was_refused_or_differs_has_a_row_and_the_rest_one_line():
    replay = summary(
        {"MoveAhead": ActionCounts(20, 0), "OpenObject": ActionCounts(3, 1)},
        {"OpenObject": EXACT, "PickupObject": SHIFTED},
        {"Fridge": EXACT, "Mug": SHIFTED},
    )
    assert [row.cells for row in refusals_table(replay).rows] == [("OpenObject", "3", "1", "75.0%")]
    assert [row.cells for row in overlaps_table(replay).rows] == [
        ("PickupObject", "2", "1.00", "0.94"),
        ("Mug", "2", "1.00", "0.94"),
    ]
    assert regular_numbers(replay).startswith(
        "other 20 actions accepted, other 4 boxes as recorded (IoU 1.00)"
    )


def test_recordings_without_boxes_or_with_nothing_as_recorded():
    assert regular_numbers(summary({"MoveAhead": ActionCounts(1, 0)}, {}, {})).startswith(
        "all 1 actions accepted ("
    )
    none = summary({"OpenObject": ActionCounts(0, 1)}, {"OpenObject": SHIFTED}, {"Fridge": SHIFTED})
    assert regular_numbers(none).startswith("nothing as recorded")


def test_each_final_task_is_said_to_need_a_memory_or_not():
    made = GeneratedSet(final_tasks={"kitchen-1-seed0": False, "house-1-seed0": True}).summary()
    assert [row.cells for row in final_tasks_table(made).rows] == [
        ("kitchen-1-seed0", "elsewhere, too"),
        ("house-1-seed0", "one in the first fifth alone, one in the last alone"),
    ]
