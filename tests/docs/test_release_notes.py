"""Notes of a release are the section of its version in CHANGELOG.md."""

import importlib.util
import subprocess
import sys

import pytest

from infthor_eval import __version__

from .blocks import ROOT

SCRIPT = ROOT / "docs" / "release_notes.py"
CHANGES = """# Changes

What this file is.

## 0.2.0, 2027-01-01
### Evaluations
- New.

## 0.1.0
- First.
"""


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("release_notes", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_section_is_printed_up_to_the_next(script):
    assert script.notes_of("0.2.0", CHANGES) == "### Evaluations\n- New."
    assert script.notes_of("0.1.0", CHANGES) == "- First."


@pytest.mark.parametrize("version", ["0.2", "0.2.0,", "Changes", ""])
def test_what_has_no_section_has_no_notes(script, version):
    assert script.notes_of(version, CHANGES) is None


def printed(*words):
    command = [sys.executable, SCRIPT, *words]
    return subprocess.run(command, check=False, capture_output=True, text=True)


def test_the_version_of_the_package_has_notes():
    done = printed(__version__)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("### ")
    assert done.stdout in (ROOT / "CHANGELOG.md").read_text()


def test_an_unknown_version_is_one_line_and_exit_code_2():
    done = printed("9.9.9")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "CHANGELOG.md: no section of version 9.9.9\n"
