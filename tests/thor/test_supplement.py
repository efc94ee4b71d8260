import json
from pathlib import Path

import pytest

from infthor_eval.formats.trajectory import (
    ApiAction,
    ExpertPlan,
    InitAction,
    LowAction,
    Scene,
    Trajectory,
    iter_trajectories,
)
from infthor_eval.thor.supplement import agent_path, write_supplement

SHARED = Path(__file__).parents[2] / "../shared/data"


def trajectory(*names, objects=()):
    low = [LowAction(ApiAction(name)) for name in names]
    low += [LowAction(ApiAction(action, one, other)) for action, one, other in objects]
    return Trajectory(Scene("FloorPlan1", InitAction(0.5, 0.9, -1.0, 90.0, 0.0)), ExpertPlan(low))


def test_the_path_turns_with_the_agent():
    actions = ("MoveAhead", "RotateLeft", "MoveAhead", "RotateRight", "MoveBack", "MoveRight")
    path = [(0.5, -1.0), (0.75, -1.0), (0.75, -0.75), (0.5, -0.75), (0.5, -1.0)]
    assert agent_path(trajectory(*actions)) == path


def test_the_file_unites_the_trajectories(tmp_path):
    one = trajectory("MoveAhead", objects=[("OpenObject", "Fridge|1|2|3", None)])
    put, pick = ("PutObject", "Mug|1|2|3", "Sink|4|5|6"), ("PickupObject", "Mug|1|2|3", None)
    two = trajectory("MoveBack", objects=[put, pick])
    write_supplement([one, two], tmp_path / "s.json")
    assert json.loads((tmp_path / "s.json").read_text()) == {
        "FloorPlan1": {
            "cells": [[0.25, -1.0], [0.5, -1.0], [0.75, -1.0]],
            "floor_y": 0.9,
            "objects": ["Fridge|1|2|3", "Sink|4|5|6"],
        }
    }


@pytest.mark.skipif(not SHARED.is_dir(), reason="recorded data not at ../shared/data")
def test_recorded_paths_stay_on_the_recorded_grid():
    numpy = pytest.importorskip("numpy")
    on = total = 0
    for index, recorded in enumerate(iter_trajectories(SHARED / "alfred/valid_seen.jsonl.gz")):
        if index == 40:
            break
        layout = numpy.load(SHARED / f"alfred/layouts/{recorded.scene.floor_plan}-layout.npy")
        cells = {(round(float(x) * 4), round(float(z) * 4)) for x, z in layout}
        path = {(round(x * 4), round(z * 4)) for x, z in agent_path(recorded)}
        on, total = on + len(path & cells), total + len(path)
    assert on / total > 0.8
