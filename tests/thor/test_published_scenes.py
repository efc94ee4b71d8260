"""Floor plans from public repositories, here from a server on this machine."""

import functools
import http.server
import io
import json
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from infthor_eval.thor import published_scenes

from ..infthor_sim.harness import Bench

OBJECTS = "dev/data/objects_metadata_samples/FloorPlan1_physics.json"
CELLS = "gen/layouts/FloorPlan1-layout.npy"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        """Say nothing."""


def put(root: Path, end: str, content: bytes) -> None:
    address = published_scenes._OBJECTS if end == OBJECTS else published_scenes._CELLS
    path = root / address.format("FloorPlan1")
    assert path.as_posix().endswith(end)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


@pytest.fixture
def root(tmp_path) -> Path:
    """The files of a kitchen as the two repositories have them."""
    bench = Bench(size=40)
    entries = bench.reset("kitchen-1")["objects"]
    put(tmp_path, OBJECTS, json.dumps({o["objectId"]: o for o in entries}).encode())
    cells = io.BytesIO()
    np.save(cells, np.array(list(bench.sim.world.nav)))
    put(tmp_path, CELLS, cells.getvalue())
    return tmp_path


@pytest.fixture
def host(root) -> Iterator[str]:
    handler = functools.partial(Quiet, directory=str(root))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


def test_a_fetched_floor_plan_runs(host, tmp_path, run_cli):
    folder = tmp_path / "scenes"
    code, out, err = run_cli("scenes", "fetch", "FloorPlan1", "--out", folder, "--endpoint", host)
    assert code == 0, err
    assert out.startswith("FloorPlan1: ")
    assert run_cli("ls", "scenes", "--data", folder)[1].count("FloorPlan1") >= 1
    picture = tmp_path / "view.png"
    command = ("scenes", "show", "FloorPlan1", "--data", folder, "--out", picture, "--size", 64)
    assert run_cli(*command)[0] == 0


@pytest.mark.parametrize(
    ("end", "content", "expected"),
    [
        (OBJECTS, b"<html>", "not metadata of objects"),
        (OBJECTS, b"[]", "not metadata of objects"),
        (OBJECTS, b'{"a": {"objectId": 1}}', "not metadata of objects"),
        (CELLS, b"no array", "not an array"),
        (CELLS, b"", "not an array"),
    ],
)
def test_what_is_no_floor_plan_is_one_line(root, host, tmp_path, run_cli, end, content, expected):
    put(root, end, content)
    code, _, err = run_cli(
        "scenes", "fetch", "FloorPlan1", "--out", tmp_path / "scenes", "--endpoint", host
    )
    assert code == 2
    assert expected in err
    assert len(err.strip().splitlines()) == 1


def test_positions_of_another_form_are_refused(root, host, tmp_path, run_cli):
    cells = io.BytesIO()
    np.save(cells, np.zeros(3))
    put(root, CELLS, cells.getvalue())
    _, _, err = run_cli(
        "scenes", "fetch", "FloorPlan1", "--out", tmp_path / "s", "--endpoint", host
    )
    assert "not positions (n, 2)" in err


def test_a_file_that_is_not_there_is_named(host, tmp_path, run_cli):
    code, _, err = run_cli(
        "scenes", "fetch", "FloorPlan2", "--out", tmp_path / "scenes", "--endpoint", host
    )
    assert code == 2
    assert "FloorPlan2_physics.json: cannot be downloaded (HTTP Error 404" in err


def test_only_published_floor_plans_are_asked_for(tmp_path, run_cli):
    code, _, err = run_cli("scenes", "fetch", "FloorPlan31", "--out", tmp_path / "scenes")
    assert code == 2
    assert "FloorPlan31: not published; there are FloorPlan1 to 30" in err
