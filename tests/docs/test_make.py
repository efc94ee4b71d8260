"""The Makefile's targets for people: a shell with the environment, and how to activate it."""

import re
import subprocess

import pytest

from .blocks import ROOT


@pytest.fixture
def venv(tmp_path):
    """A folder that looks like an environment that is set up already."""
    program = tmp_path / "bin" / "infthor-eval"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\necho this one\n")
    program.chmod(0o755)
    (tmp_path / "bin" / "activate").write_text(f'PATH="{program.parent}:$PATH"\nexport PATH\n')
    (tmp_path / ".installed").touch()
    return tmp_path


def test_the_shell_has_the_environment(venv):
    words = ["make", "--silent", "--no-print-directory", "shell", f"VENV={venv}", "SHELL=/bin/sh"]
    done = subprocess.run(
        words, cwd=ROOT, input="infthor-eval\n", capture_output=True, text=True, check=True
    )
    assert done.stdout == "this one\n"


def test_the_demo_ends_with_how_to_activate_the_environment(venv):
    words = ["make", "--dry-run", "--no-print-directory", "demo", f"VENV={venv}"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    assert f". {venv}/bin/activate" in done.stdout.splitlines()[-1]
    assert "make shell" in done.stdout.splitlines()[-1]


def test_the_demo_installs_the_packages_alone_and_the_tests_add_the_rest(tmp_path):
    def installs(target, *has):
        venv = tmp_path / "-".join((target, *has))
        venv.mkdir()
        for name in has:
            (venv / name).touch()
        words = ["make", "--dry-run", "--no-print-directory", target, f"VENV={venv}"]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
        lines = [line for line in done.stdout.splitlines() if "pip install" in line]
        return [place for line in lines for place in re.findall(r" -e '?([^' ]+)", line)]

    assert installs("demo") == [".", "./infthor_board"]
    assert installs("shell") == [".", "./infthor_board"]
    for target in ("test", "lint", "docs", "vitals", "fuzz"):
        assert installs(target) == [".", "./infthor_board", ".[dev,docs]"]
    assert installs("test", ".installed") == [".[dev,docs]"]
