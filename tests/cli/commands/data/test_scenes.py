import gzip
import json

import numpy as np
import pytest
from PIL import Image

from ....helpers.command_line import read_success


def test_a_dumped_scene_runs_from_the_folder_and_keeps_its_objects(tmp_path, run_cli):
    folder = tmp_path / "data"
    out, _ = read_success(
        run_cli("scenes", "dump", "kitchen-2", "bedroom-1", "--embedded", "--out", folder)
    )
    assert run_cli("scenes", "dump", "kitchen-2", "--embedded", "--out", folder)[0] == 0
    with gzip.open(folder / "thor_scenes" / "objects.jsonl.gz", "rt") as file:
        lines = [json.loads(line) for line in file]
    assert [line["scene"] for line in lines] == ["bedroom-1", "kitchen-2"]
    assert f"kitchen-2: {len(lines[1]['objects'])} objects" in out
    assert all("cornerPoints" not in item["axisAlignedBoundingBox"] for item in lines[1]["objects"])
    cells = np.load(folder / "alfred" / "layouts" / "kitchen-2-layout.npy")
    assert cells.shape[1] == 2
    assert len(cells) > 10
    assert "kitchen-2" in run_cli("ls", "scenes", "--data", folder)[1]


def test_a_scene_is_drawn_from_above_and_from_the_agent(tmp_path, run_cli):
    path = tmp_path / "kitchen.png"
    read_success(run_cli("scenes", "show", "kitchen-1", "--out", path, "--size", 100))
    picture = np.asarray(Image.open(path))
    assert picture.shape == (100, 200, 3)
    for half in (picture[:, :100], picture[:, 100:]):
        assert len(np.unique(half.reshape(-1, 3), axis=0)) > 20
    assert (picture[:, :100] != picture[:, 100:]).any()


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["scenes", "show", "attic-1"], "attic-1"),
        (["scenes", "show", "FloorPlan1"], "FloorPlan1"),
        (
            ["scenes", "dump", "FloorPlan1", "--out", "x", "--unity", "/nowhere/thor"],
            "/nowhere/thor",
        ),
        (["ls", "scenes", "--data", "nowhere"], "does not exist"),
        (["ls", "scenes", "--data", "."], "give a folder of recorded floor plans"),
    ],
)
def test_a_scene_that_is_not_there_is_one_line(arguments, expected, run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = run_cli(*arguments)
    assert code in (1, 2)
    assert expected in err
    assert len(err.strip().splitlines()) == 1
