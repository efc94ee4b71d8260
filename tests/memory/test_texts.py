"""Memories that recall texts."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.formats.step_log import ObjectInFrame, ObjectLog, ObjectState, Step
from infthor_eval.memory import tokens_of
from infthor_eval.memory.texts import Notes, TextLog

LOGS = [
    ObjectLog(visible=["Sink"]),
    ObjectLog(visible=["Sink", "Mug"], recep_objs={"Sink": ["Mug"]}),
    ObjectLog(visible=["Sink", "Mug"], recep_objs={"Sink": ["Mug"]}),
    ObjectLog(visible=["Fridge"], inven_obj=["Mug"], is_open=["Fridge"]),
    ObjectLog(visible=["Fridge"]),
]


def test_the_log_says_what_is_new_at_each_step(observed):
    (text,) = observed(TextLog(), 4, logs=LOGS)()
    assert text.splitlines() == [
        "Step 0: goal: Wash a mug; sees Sink.",
        "Step 1: Action1; sees Mug; Sink has Mug.",
        "Step 2: Action2.",
        "Step 3: goal: Cook an egg; Action3; sees Fridge; open: Fridge; holds Mug.",
        "Step 4: Action4; holds nothing.",
    ]


SEEN = ObjectInFrame(pixels=90, box=(0, 0, 9, 9))
FRIDGE, BREAD, CUP = "Fridge|1|1|1", "Bread|1|1|2", "Cup|1|1|3"
OTHER = "Cup|2|2|2"
SHUT = ObjectState("Fridge", is_open=False)
IN_FRIDGE = ObjectState("Cup", parents=(FRIDGE,), temperature="Cold", is_dirty=True)


def _step(number, action, seen, changes, *objects, **more):
    target, receptacle = [*objects, None, None][:2]
    return Step(
        number,
        f"{number}.png",
        action=action,
        seen=dict.fromkeys(seen, SEEN),
        changes=changes,
        target=target,
        receptacle=receptacle,
        **more,
    )


def test_a_log_with_instances_tells_them_apart_as_they_are_seen(observed):
    everything = {FRIDGE: SHUT, BREAD: ObjectState("Bread"), CUP: IN_FRIDGE, OTHER: IN_FRIDGE}
    held = ObjectState("Cup", held=True)
    steps = [
        _step(0, None, [FRIDGE, BREAD], everything),
        _step(1, "OpenObject Fridge", [FRIDGE], {}, FRIDGE, success=False),
        _step(2, "SliceObject Bread", [FRIDGE], {BREAD: ObjectState("Bread", exists=False)}, BREAD),
        # What happens out of sight is not told before it is seen.
        _step(3, "LookUp", [], {FRIDGE: ObjectState("Fridge", is_open=True), CUP: held}),
        _step(4, "PutObject Cup Fridge", [FRIDGE, OTHER, CUP], {CUP: IN_FRIDGE}, CUP, FRIDGE),
    ]
    (text,) = observed(TextLog(), 4, steps=steps)()
    assert text.splitlines() == [
        "Step 0: goal: Wash a mug; sees Fridge 1 (closed), Bread 1.",
        "Step 1: OpenObject Fridge 1 (refused).",
        "Step 2: SliceObject Bread 1; Bread 1 is gone.",
        "Step 3: goal: Cook an egg; LookUp.",
        "Step 4: PutObject Cup 1 Fridge 1; sees Fridge 1 (open), Cup 2 at Fridge 1 (dirty, cold), "
        "Cup 1 at Fridge 1 (dirty, cold).",
    ]


@given(budget=st.integers(0, 80))
def test_the_last_lines_that_fit_the_budget_are_recalled(observed, budget):
    ask = observed(TextLog(), 4, logs=LOGS)
    lines = ask()[0].splitlines(keepends=True)
    recalled = ask(budget=budget)
    assert tokens_of(recalled, 10) <= budget
    fitting = [
        n
        for n in range(len(lines) + 1)
        if math.ceil(len("".join(lines[len(lines) - n :])) / 4) <= budget
    ]
    assert "".join(recalled) == "".join(lines[len(lines) - fitting[-1] :])


def test_notes_are_written_on_every_window_with_the_current_view_in_the_last(observed):
    requests = []

    def write(parts, max_new_tokens):
        requests.append(([part.path.stem for part in parts[:-1]], parts[-1], max_new_tokens))
        return " a mug\non the  table"

    (text,) = observed(Notes(window=2, tokens=7), 4, write=write)()
    assert text == "".join(
        f"{at}: a mug on the table\n" for at in ("Steps 0-1", "Steps 2-3", "Step 4")
    )
    assert [frames for frames, _, _ in requests] == [["0", "1"], ["2", "3"], ["4"]]
    assert {limit for _, _, limit in requests} == {7}
    assert requests[0][1].startswith("\nSteps 0-1 of an embodied agent's trajectory")


def test_of_notes_beyond_the_budget_the_last_are_recalled(observed):
    ask = observed(Notes(window=2), 4, write=lambda parts, limit: "x" * 10)
    line = len("Steps 2-3: " + "x" * 10 + "\n") + len("Step 4: " + "x" * 10 + "\n")
    (text,) = ask(budget=math.ceil(line / 4))
    assert [row.partition(":")[0] for row in text.splitlines()] == ["Steps 2-3", "Step 4"]
    assert ask(budget=0) == []


@pytest.mark.parametrize("options", [{"window": 0}, {"tokens": 0}])
def test_windows_and_notes_are_not_empty(options):
    with pytest.raises(ValueError, match="whole numbers from 1"):
        Notes(**options)
