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

from ..helpers.command_line import assert_refused
from ..infthor_sim.harness import Bench

OBJECTS = "dev/data/objects_metadata_samples/FloorPlan1_physics.json"
CELLS = "gen/layouts/FloorPlan1-layout.npy"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        """Say nothing."""


def array_file(array: np.ndarray) -> bytes:
    content = io.BytesIO()
    np.save(content, array)
    return content.getvalue()


def put(root: Path, end: str, content: bytes) -> None:
    address = published_scenes._OBJECTS if end == OBJECTS else published_scenes._CELLS
    path = root / address.format("FloorPlan1")
    assert path.as_posix().endswith(end)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


@pytest.fixture
def root(tmp_path) -> Path:
    """The files of a kitchen as the two repositories have them."""
    bench = Bench.at("kitchen-1", size=40)
    entries = bench.metadata["objects"]
    put(tmp_path, OBJECTS, json.dumps({o["objectId"]: o for o in entries}).encode())
    put(tmp_path, CELLS, array_file(np.array(list(bench.sim.world.nav))))
    return tmp_path


@pytest.fixture
def host(root) -> Iterator[str]:
    handler = functools.partial(Quiet, directory=str(root))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


@pytest.fixture
def fetch(host, tmp_path, run_cli):
    """Fetches a floor plan; gives the exit code, standard output and standard error."""
    words = ("--out", tmp_path / "scenes", "--endpoint", host)
    return lambda name="FloorPlan1": run_cli("scenes", "fetch", name, *words)


def test_a_fetched_floor_plan_runs(fetch, tmp_path, run_cli):
    folder = tmp_path / "scenes"
    code, out, err = fetch()
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
        pytest.param(CELLS, array_file(np.zeros(3)), "not positions (n, 2)", id="positions"),
    ],
)
def test_what_is_no_floor_plan_is_one_line(root, fetch, end, content, expected):
    put(root, end, content)
    assert_refused(fetch(), expected)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("FloorPlan2", "FloorPlan2_physics.json: cannot be downloaded (HTTP Error 404"),
        ("FloorPlan31", "FloorPlan31: not published; there are FloorPlan1 to 30"),
    ],
)
def test_what_is_not_there_or_not_published_is_named(fetch, name, expected):
    assert_refused(fetch(name), expected)
