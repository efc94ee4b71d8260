"""Output that nobody reads to its end: `infthor-eval ... | head`."""

import subprocess
import sys

import pytest

MAIN = [sys.executable, "-c", "from infthor_eval.cli.main import main; main()"]


@pytest.mark.parametrize("words", [("ls", "tasks"), ("ls", "models"), ("doctor", "--help")])
def test_nobody_is_told_that_they_closed_it(words):
    process = subprocess.Popen([*MAIN, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.close()
    _, errors = process.communicate()
    assert (process.returncode, errors) == (1, b"")
