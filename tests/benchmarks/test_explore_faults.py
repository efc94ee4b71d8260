"""The fault explorer: what it counts, what it makes fail, and that it notices what is lost."""

import importlib
import json
import os
import shutil
import subprocess
import sys
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any

import pytest

from ..helpers.benchmarks import FOLDER

needs_compiler = pytest.mark.skipif(
    shutil.which("cc") is None, reason="no C compiler (cc), which the fault explorer needs"
)
# Writes two files into a folder: one atomically, one in place.
WRITER = """
import os, sys
folder = sys.argv[1]
os.makedirs(f"{folder}/a")
with open(f"{folder}/a/.part", "wb", buffering=0) as file:
    file.write(b"0123456789")
    os.fsync(file.fileno())
os.replace(f"{folder}/a/.part", f"{folder}/a/whole")
os.unlink(f"{folder}/a/whole")
"""
CALLS = ["CREATE", "CREATE", "WRITE", "SYNC", "RENAME", "DELETE"]


@pytest.fixture
def control_module(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    return importlib.import_module("fault_explorer.control")


@pytest.fixture
def write_with(control_module, tmp_path):
    """Runs the writer under the shim with a fault; returns its exit code, its last line, and the
    calls that were counted."""
    library = control_module.compile_shim(tmp_path)
    watched = tmp_path / "watched"
    watched.mkdir()

    def write_with(fault: str | None = None, at: int = 0) -> tuple[int, str, list[str]]:
        path = tmp_path / "control"
        control = control_module.Control(path)
        chosen = None if fault is None else control_module.Fault[fault]
        # The process watches itself from its first line on.
        begin = f"import sys; sys.path.insert(0, {str(FOLDER)!r})\n"
        begin += "from pathlib import Path; from fault_explorer.control import Control, Fault\n"
        begin += f"fault = {'None' if chosen is None else f'Fault({int(chosen)})'}\n"
        begin += f"Control(Path({str(path)!r})).watch(Path({str(watched)!r}), fault, {at})\n"
        ended = subprocess.run(
            [sys.executable, "-c", begin + WRITER, watched],
            env=control_module.Control.environment(library, path),
            capture_output=True,
            text=True,
            check=False,
        )
        line = ended.stderr.strip().splitlines()[-1] if ended.stderr.strip() else ""
        return ended.returncode, line, [call.name for call in control.calls()]

    return write_with


@needs_compiler
def test_all_calls_that_change_files_are_counted_in_their_order(write_with, tmp_path):
    assert write_with() == (0, "", CALLS)
    assert [path.name for path in (tmp_path / "watched").iterdir()] == ["a"]


FAULTS: dict[tuple[str, int], tuple[int, str, dict[str, bytes]]] = {
    ("KILL", 3): (-9, "", {".part": b""}),
    ("TORN", 3): (-9, "", {".part": b"01234"}),
    ("SHORT", 3): (0, "", {}),
    ("ERROR", 4): (1, "OSError: [Errno 5] Input/output error", {".part": b"0123456789"}),
    ("FULL", 3): (1, "OSError: [Errno 28] No space left on device", {".part": b""}),
    ("READ_ONLY", 5): (1, "OSError: [Errno 30] Read-only file system", {".part": b"0123456789"}),
    ("STALE", 5): (1, "OSError: [Errno 116] Stale file handle", {"whole": b"0123456789"}),
}


@needs_compiler
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault[0].lower())
def test_a_fault_comes_at_its_call_and_nowhere_else(write_with, tmp_path, fault):
    code, line, left = FAULTS[fault]
    ended = write_with(*fault)
    assert (ended[0], ended[1].partition(": '")[0]) == (code, line)
    folder = tmp_path / "watched" / "a"
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == left


@needs_compiler
def test_a_kind_cut_at_some_of_its_calls_loses_nothing(tmp_path):
    faults = ("KILL", "TORN", "FULL", "ERROR", "SHORT", "PAUSE")
    words = ("--kinds", "import-replies", "--faults", ",".join(faults).lower(), "--most", "1")
    (row,) = explore(tmp_path, *words)
    assert row["cuts"] == dict.fromkeys(faults, 1)
    assert row["possible"] > row["calls"] > 20
    assert not row["lost"]


def explore(folder: Path, *words: str) -> list[dict[str, Any]]:
    """The rows of an exploration."""
    out = folder / "rows.jsonl"
    ended = subprocess.run(
        [sys.executable, FOLDER / "explore_faults.py", *words, "--out", out],
        env={**os.environ, "PYTHONPATH": str(FOLDER.parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return [json.loads(line) for line in out.read_text().splitlines()]


def test_without_a_compiler_one_line_says_so(control_module, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(control_module.NoCompilerError, match="no C compiler"):
        control_module.compile_shim(tmp_path)


def test_trees_are_equal_but_for_times_and_differ_by_a_byte_a_name_or_half_a_line(
    control_module, tmp_path
):
    trees = importlib.import_module("fault_explorer.trees")

    def write(name: str, seconds: float, text: str = "yes", stamp: str = "2026-01-02") -> Path:
        run = tmp_path / name
        (run / "journal").mkdir(parents=True)
        (run / "lm_eval" / "m").mkdir(parents=True)
        unit = {"type": "unit", "task": "t", "id": "1", "seconds": seconds, "text": text}
        (run / "journal" / "worker-0.jsonl").write_text(json.dumps(unit) + "\n")
        (run / "lm_eval" / "m" / f"results_{stamp}T10-11-12.5.json").write_text('{"date": 1}')
        return run

    one = trees.read_tree(write("one", 1.0))
    assert trees.difference(one, trees.read_tree(write("two", 2.0, stamp="2026-03-04"))) is None
    other = write("three", 1.0, "no")
    assert trees.difference(one, trees.read_tree(other)) == "journal/worker-0.jsonl differs"
    torn = write("four", 1.0)
    with (torn / "journal" / "worker-0.jsonl").open("a") as file:
        file.write('{"type": "un')
    assert trees.difference(one, trees.read_tree(torn)) == "journal/worker-0.jsonl differs"
    more = write("five", 1.0)
    (more / ".left.lock").touch()
    assert trees.difference(one, trees.read_tree(more)) == ".left.lock is too many"
    left = []
    for name in ("abcd1234", "e_fgh567"):
        (write(name, 1.0) / f".infthor-{name}.lock").touch()
        left.append(trees.read_tree(tmp_path / name))
    assert trees.difference(*left) is None
    assert trees.difference(one, left[0]) == ".infthor-NAME.lock is too many"


def test_what_another_program_has_in_shared_memory_is_not_left_behind(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    exploring = importlib.import_module("fault_explorer.exploring")
    before = exploring._shared_memory()
    shared = SharedMemory(create=True, size=1)
    try:
        assert shared.name in exploring._shared_memory() - before
        assert shared.name not in exploring._abandoned({shared.name})
        shared.close()
        assert exploring._abandoned({shared.name}) == [shared.name]
    finally:
        shared.unlink()
    assert exploring._abandoned({shared.name}) == []
