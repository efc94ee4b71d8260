"""A run survives a full disk, the loss of its folder, and its own end."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run
from infthor_eval.runs.journals.journal import Journal

from ..helpers.command_line import assert_refused, option_words, read_success
from ..helpers.processes import run_python


def test_a_run_whose_folder_is_deleted_does_not_end_well(
    make_nieh_set, tmp_path, run_cli, monkeypatch
):
    append = Journal.append

    def append_and_delete(self, record):
        shutil.rmtree(tmp_path / "out", ignore_errors=True)
        return append(self, record)

    monkeypatch.setattr(Journal, "append", append_and_delete)
    arguments = ["--model", "oracle", "--tasks", "nieh_gt", "--data", make_nieh_set(size=56)]
    assert_refused(
        run_cli(*arguments, "--out", tmp_path / "out"),
        "was deleted or replaced while the run wrote it",
        after_notes=True,
    )


def test_a_full_disk_in_mid_run_is_one_line_and_the_run_goes_on_later(
    make_nieh_set, tmp_path, run_cli, monkeypatch
):
    arguments = ["--model", "oracle", "--tasks", "nieh_gt", "--data", make_nieh_set(size=56)]
    n_synced = []
    fsync = os.fsync

    def full(descriptor):
        n_synced.append(descriptor)
        if len(n_synced) > 4:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(descriptor)

    with monkeypatch.context() as patched:
        patched.setattr("infthor_eval.runs.journals.journal.os.fsync", full)
        code, out, err = run_cli(*arguments, "--out", tmp_path / "out")
    assert (code, out) == (2, "")
    assert "cannot be written (No space left on device); make room" in err
    assert "Traceback" not in err
    read_success(run_cli(*arguments, "--out", tmp_path / "out"))
    (journal,) = (tmp_path / "out").rglob("journal")
    assert len(read_run(journal.parent, RECORDS)[1]) == 5


@pytest.mark.parametrize("full_at", ["kitchen-1-seed1.json", "task-000.pddl"])
def test_a_disk_that_is_full_while_trajectories_are_made_keeps_those_that_are(
    tmp_path, run_cli, monkeypatch, full_at
):
    arguments = [
        "generate",
        *option_words(scene="kitchen-1", min_steps=1, min_subgoals=1, out=tmp_path),
    ]
    assert run_cli(*arguments)[0] == 0
    first = (tmp_path / "kitchen-1-seed0.json").read_bytes()
    makes_more = [*arguments, "--count", 3]

    def full(written):
        def write(path, content, *args, **kwargs):
            if full_at not in path.name:
                return written(path, content, *args, **kwargs)
            written(path, content[: len(content) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        return write

    with monkeypatch.context() as patched:
        for name in ("write_bytes", "write_text"):
            patched.setattr(f"pathlib.Path.{name}", full(getattr(Path, name)))
        assert_refused(
            run_cli(*makes_more),
            "kitchen-1-seed1.json: cannot be written (No space left on device); make room and run",
        )
    assert [path.name for path in tmp_path.glob("*.json")] == ["kitchen-1-seed0.json"]
    assert [path.name for path in tmp_path.glob(".*partial")] == []
    code, out, err = run_cli(*makes_more)
    assert (code, "3 trajectories (1 generated earlier)" in out) == (0, True), err
    assert (tmp_path / "kitchen-1-seed0.json").read_bytes() == first


def test_sigterm_leaves_no_temporary_folder(tmp_path):
    # A command that waits with a temporary folder open, as a replay does.
    code = (
        "import sys, time\n"
        "from infthor_eval.cli import main\n"
        "from infthor_eval.cli.commands import ls\n"
        "from infthor_eval.storage.scratch import ScratchFolder\n"
        "def wait(**_):\n"
        "    with ScratchFolder():\n"
        "        print('waiting', flush=True)\n"
        "        time.sleep(60)\n"
        "ls.command.commands['tasks'].callback = wait\n"
        "main(['ls', 'tasks'])\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        env=os.environ | {"TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "waiting\n"
    time.sleep(0.1)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=600)
    assert process.returncode == 143
    assert "stopped; run the same command to continue" in err
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_during_the_imports_is_one_line(tmp_path):
    # A module of the same name as one that the command imports, which is interrupted.
    (tmp_path / "click.py").write_text("import os, signal; os.kill(os.getpid(), signal.SIGINT)")
    program = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    program += "from infthor_eval.cli import main; main()"
    root = Path(__file__).parents[2]
    env = os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{root}"}
    done = run_python(program, "--version", env=env)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "infthor-eval: stopped; run the same command to continue\n"
