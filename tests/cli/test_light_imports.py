"""Commands that only tell something import nothing that takes seconds."""

import pkgutil
import subprocess
import sys

import click
import pytest

from infthor_eval import suites
from infthor_eval.cli import commands
from infthor_eval.cli.main import _infthor_eval

HEAVY = {"torch", "transformers", "numpy", "scipy", "ai2thor", "lm_eval", "datasets", "matplotlib"}
PROGRAM = """
import sys
from infthor_eval.cli import main
try:
    main(sys.argv[1:])
except SystemExit as ended:
    assert not ended.code
print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


@pytest.mark.parametrize(
    "typed", ["--help", "run --help", "ls", "ls models", "ls tasks", "ls scenes", "ls runs tests", "--version"]
)
def test_what_is_told_is_told_at_once(typed: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *typed.split()], capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert not HEAVY & set(done.stderr.splitlines()[-1].split())


@pytest.mark.parametrize("name", suites.suite_names())
def test_the_baselines_that_are_listed_are_the_suites_own(name: str) -> None:
    listed = {baseline for baseline, having in suites.baseline_names().items() if name in having.split(", ")}
    assert listed == set(suites.suite_named(name).baselines)


def test_every_command_is_listed_by_name():
    names = {module.name.replace("_", "-") for module in pkgutil.iter_modules(commands.__path__)}
    assert names == set(_infthor_eval.list_commands(click.Context(_infthor_eval)))
