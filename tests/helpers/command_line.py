"""The command line, run in this process, and what it is to say."""

import re
from collections.abc import Callable

import pytest

from infthor_eval.cli import main

__all__ = [
    "CliRunner",
    "assert_refused",
    "option_words",
    "read_remarks",
    "read_success",
    "run_cli",
    "runner_of",
]

CliRunner = Callable[..., tuple[int, str, str]]

_PROGRESS = re.compile(r".*: [\d,]+ of [\d,]+ \(\d+ %\)(, .* left, .*)?")


@pytest.fixture
def run_cli(capfd: pytest.CaptureFixture[str]) -> CliRunner:
    """Runs our command in this process; gives its exit code, standard output and standard error."""
    return runner_of(main, capfd)


def runner_of(program: Callable[[list[str]], None], capfd: pytest.CaptureFixture[str]) -> CliRunner:
    """Give what `run_cli` is of a program, by its main function."""

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            program([str(argument) for argument in arguments])
        return ended.value.code, *capfd.readouterr()

    return run


def option_words(**options: object) -> list[str]:
    """The words of options as they are typed: `max_steps=3` is `--max-steps 3`."""
    return [
        word
        for name, value in options.items()
        for word in (f"--{name.replace('_', '-')}", str(value))
    ]


def read_remarks(error_text: str) -> list[str]:
    """What a command writes on standard error on a fast machine and on a slow one alike: its lines
    without those on progress, which come where it takes more than ten seconds."""
    return [
        line for line in error_text.splitlines() if line.strip() and not _PROGRESS.fullmatch(line)
    ]


def assert_refused(
    ended: tuple[int, str, str],
    *expected: str,
    code: int = 2,
    after_notes: bool = False,
    program: str = "infthor-eval",
) -> None:
    """Hold that a command ended with an exit code, without output, and with one line that says
    all that is expected.

    Args:
        ended: the exit code, standard output and standard error.
        expected: parts of the line.
        code: the exit code that it is to have.
        after_notes: whether it may have written other lines before.
        program: the program that was run.
    """
    ended_with, output, error_text = ended
    assert (ended_with, output) == (code, "")
    assert "Traceback" not in error_text
    *notes, line = error_text.splitlines()
    assert after_notes or not notes
    assert line.startswith(f"{program}: ")
    assert not any(note.startswith(f"{program}: ") for note in notes)
    for words in expected:
        assert words in line


def read_success(ended: tuple[int, str, str]) -> tuple[str, str]:
    """The standard output and standard error of a command that has ended well."""
    code, output, error_text = ended
    assert code == 0, error_text
    return output, error_text
