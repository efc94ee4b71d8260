import errno
import os
import subprocess
import sys
from contextlib import contextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.storage import files
from infthor_eval.storage.digests import digest, digest_of_file
from infthor_eval.storage.files import (
    file_name,
    hold_folder,
    is_written,
    write_atomically,
    writing_hint,
)

_TEXTS = st.text(st.characters(codec=None))  # with lone surrogates

_WRITE = (
    "import sys\n"
    "from pathlib import Path\n"
    "from infthor_eval.storage.files import hold_folder, write_atomically\n"
    "path = Path(sys.argv[1])\n"
    "with hold_folder(path.parent), write_atomically(path) as partial:\n"
    "    partial.write_text('theirs')\n"
    "    print('writing', flush=True)\n"
    "    sys.stdin.read()\n"
)


@contextmanager
def _other_writer(path):
    """Another process that has written a part of a file; it ends when its input is closed."""
    with subprocess.Popen(
        [sys.executable, "-c", _WRITE, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "writing\n"
        yield process


def test_a_file_replaces_the_earlier_one_when_it_is_whole(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with write_atomically(path) as partial:
        partial.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_an_error_leaves_the_earlier_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(OSError, match="full"), write_atomically(path) as partial:
        partial.write_text("ne")
        raise OSError("full")
    assert path.read_text() == "old"
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_a_folder_appears_whole_and_leftovers_of_a_killed_process_are_gone(tmp_path):
    path = tmp_path / "set"
    leftover = tmp_path / ".set.partial"
    leftover.mkdir()
    (leftover / "stale").touch()
    with write_atomically(path) as partial:
        partial.mkdir()
        (partial / "fresh").touch()
    assert [item.name for item in path.iterdir()] == ["fresh"]
    assert not leftover.exists()


def test_leftovers_are_found_by_the_next_writer_whose_name_has_another_time_in_it(tmp_path):
    leftovers = tmp_path / ".results.partial", tmp_path / ".results.lock"
    for leftover in leftovers:
        leftover.touch()
    with write_atomically(tmp_path / "results_12-30.json", "results") as partial:
        partial.touch()
    assert [item.name for item in tmp_path.iterdir()] == ["results_12-30.json"]


def test_leftovers_beside_what_is_written_already_are_removed(tmp_path):
    path = tmp_path / "a.txt"
    assert not is_written(path)
    for name in (path, tmp_path / ".a.txt.lock", tmp_path / ".a.txt.partial"):
        name.touch()
    assert is_written(path)
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]
    (tmp_path / ".a.txt.partial").mkdir()
    (tmp_path / ".a.txt.lock").touch()
    assert is_written(path)
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_what_another_process_writes_again_is_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr("infthor_eval.storage.files._WAIT_S", 0.0)
    path = tmp_path / "a.txt"
    path.touch()
    with write_atomically(path) as partial:
        partial.touch()
        with pytest.raises(UsageError, match="another process is writing it"):
            is_written(path)


def test_a_file_has_the_digest_of_its_content(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"content")
    assert digest_of_file(path) == digest(b"content") == digest("content")
    assert len(digest("content", 4)) == 8


@given(_TEXTS, _TEXTS)
def test_a_name_of_any_text_is_one_part_of_a_path_and_its_own(one, other):
    name = file_name(one)
    assert name.isascii()
    assert not set(name) & set('/\\:*?"<>|\0\n')
    assert name == name.strip(". ")
    assert 0 < len(name) < 200
    assert (name == file_name(other)) == (one == other)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Qwen2.5-VL-3B-Instruct@main", None),
        ("a run", None),
        ("../../evil", "_.._evil-"),
        ("/etc/passwd", "_etc_passwd-"),
        ("..", "-"),
        ("C:\\x", "C_x-"),
        ("nul", "_nul-"),
        ("COM1.txt", "_COM1.txt-"),
        ("a. ", "a-"),
        ("x" * 300, "x" * 150 + "-"),
    ],
)
def test_names_that_are_safe_stay_and_others_say_what_they_were(text, expected):
    name = file_name(text)
    assert name == text if expected is None else name[:-8] == expected


def test_a_file_that_another_process_writes_is_left_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "_WAIT_S", 0.2)
    path = tmp_path / "a.txt"
    with _other_writer(path):
        with pytest.raises(UsageError, match=r"a\.txt: another process is writing it; wait"):
            _write(path)
        assert (tmp_path / ".a.txt.partial").read_text() == "theirs"
    assert path.read_text() == "theirs"


def test_a_writer_waits_for_another_that_ends_soon(tmp_path):
    path = tmp_path / "a.txt"
    with _other_writer(path) as process:
        process.stdin.close()
        _write(path)
        assert path.read_text() == "ours"
    assert process.returncode == 0
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_a_writer_that_was_killed_holds_nothing(tmp_path):
    path = tmp_path / "a.txt"
    with _other_writer(path) as process:
        process.kill()
    with hold_folder(tmp_path):
        _write(path)
    assert path.read_text() == "ours"
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_one_command_at_a_time_writes_into_a_folder(tmp_path):
    with (
        _other_writer(tmp_path / "set" / "a.txt"),
        pytest.raises(UsageError, match="set: another process is writing it"),
        hold_folder(tmp_path / "set"),
    ):
        pytest.fail("it is held")
    with hold_folder(tmp_path / "set"):
        pass
    assert [item.name for item in (tmp_path / "set").iterdir()] == ["a.txt"]


def _write(path):
    with write_atomically(path) as partial:
        partial.write_text("ours")


@pytest.mark.parametrize(
    ("reason", "remedy"),
    [
        (errno.ENOSPC, "make room, or go"),
        (errno.EACCES, "allow writing there, or go"),
        (errno.EROFS, "make it writable, or go"),
        (errno.EIO, "check it, or go"),
    ],
)
def test_what_cannot_be_written_is_told_with_the_remedy_of_its_reason(reason, remedy):
    with (
        pytest.raises(DataError, match=f"; {remedy}$"),
        wrap_errors("a.txt: cannot be written", writing_hint(", or go")),
    ):
        raise OSError(reason, os.strerror(reason))
