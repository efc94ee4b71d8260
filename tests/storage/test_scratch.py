import os
import signal
import subprocess
import sys
import tempfile

import pytest

from infthor_eval.storage import scratch
from infthor_eval.storage.scratch import ScratchFolder

_HOLD = (
    "import time\n"
    "from infthor_eval.storage.scratch import ScratchFolder\n"
    "folder = ScratchFolder()\n"
    "{}\n"
)


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    scratch._remove_abandoned.cache_clear()
    return tmp_path


def _folders(place):
    return [path for path in place.iterdir() if path.is_dir()]


def _other_process(place):
    code = _HOLD.format("print(folder.path, flush=True); time.sleep(60)")
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        env=os.environ | {"TMPDIR": str(place)},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline().startswith(str(place))
    return process


def test_it_is_empty_and_goes_with_the_context(place):
    with ScratchFolder() as folder:
        assert list(folder.iterdir()) == []
        (folder / "a").write_text("a")
    assert list(place.iterdir()) == []


def test_cleaning_up_twice_is_safe(place):
    folder = ScratchFolder()
    folder.cleanup()
    folder.cleanup()
    assert list(place.iterdir()) == []


def test_each_command_removes_what_a_killed_process_left(place, run_cli):
    process = _other_process(place)
    assert run_cli("ls", "models")[0] == 0
    assert len(_folders(place)) == 1
    process.kill()
    process.wait()
    scratch._remove_abandoned.cache_clear()  # as a new process begins
    assert run_cli("ls", "models")[0] == 0
    assert list(place.iterdir()) == []


def test_without_a_place_for_temporary_files_commands_that_need_none_work(run_cli, monkeypatch):
    def no_place():
        raise FileNotFoundError("no usable temporary directory")

    with monkeypatch.context() as patched:
        patched.setattr(tempfile, "gettempdir", no_place)
        assert run_cli("ls", "models")[0] == 0


def test_what_a_killed_process_left_is_removed(place):
    process = _other_process(place)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert len(_folders(place)) == 1
    with ScratchFolder():
        assert len(_folders(place)) == 1
    assert list(place.iterdir()) == []


def test_what_a_living_process_uses_stays(place):
    process = _other_process(place)
    try:
        with ScratchFolder():
            assert len(_folders(place)) == 2
    finally:
        process.kill()
        process.wait()


def test_it_may_be_hidden_in_a_folder_and_is_removed_there_too(place):
    code = (
        "import os, signal, sys; from pathlib import Path\n"
        "from infthor_eval.storage.scratch import ScratchFolder\n"
        "folder = ScratchFolder(Path(sys.argv[1])); os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", code, str(place)], check=False)
    (left,) = _folders(place)
    assert left.name.startswith(".infthor-")
    with ScratchFolder(place) as folder:
        assert not left.exists()
        assert folder.is_relative_to(place)
    assert list(place.iterdir()) == []


def test_a_lock_without_a_folder_is_removed(place):
    (place / "infthor-killed-before.lock").write_bytes(b"")
    with ScratchFolder():
        assert len(list(place.iterdir())) == 2
    assert list(place.iterdir()) == []


def test_what_cannot_be_removed_at_first_is_removed_all_the_same(place, monkeypatch):
    remove = scratch.remove
    failures = iter([OSError("Input/output error")])

    def fail_once(path):
        for failure in failures:
            raise failure
        remove(path)

    monkeypatch.setattr(scratch, "remove", fail_once)
    with ScratchFolder() as folder:
        (folder / "a").write_text("a")
    assert list(place.iterdir()) == []


def test_what_cannot_be_removed_keeps_its_lock_and_goes_with_the_next_command(place, monkeypatch):
    def fail(path):
        raise OSError("Input/output error")

    with monkeypatch.context() as patched:
        patched.setattr(scratch, "remove", fail)
        with ScratchFolder():
            pass
    assert len(list(place.iterdir())) == 2
    scratch._remove_abandoned.cache_clear()
    scratch.remove_abandoned()
    assert list(place.iterdir()) == []


def test_a_lock_that_another_process_takes_for_abandoned_is_made_anew(place, monkeypatch):
    flock = scratch.fcntl.flock
    taken = []

    def flock_late(file, operation):
        if not taken:
            (lock,) = place.iterdir()
            taken.append(lock)
            lock.unlink()
        flock(file, operation)

    monkeypatch.setattr(scratch.fcntl, "flock", flock_late)
    with ScratchFolder() as folder:
        assert folder.name != taken[0].stem
        assert folder.with_name(f"{folder.name}.lock").exists()
    assert list(place.iterdir()) == []


def test_folders_of_others_stay(place):
    (place / "infthor-results").mkdir()
    with ScratchFolder():
        pass
    assert [path.name for path in place.iterdir()] == ["infthor-results"]
