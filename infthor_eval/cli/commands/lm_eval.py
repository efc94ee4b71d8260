"""`infthor-eval lm-eval`: lm-eval's own command, which knows these models and tasks."""

import sys
from importlib.metadata import version

import click

from infthor_eval.errors import InfthorError, UsageError, describe_exception, in_one_line


@click.command(
    "lm-eval", context_settings={"ignore_unknown_options": True, "help_option_names": []}
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def command(arguments: tuple[str, ...]) -> None:
    """Run lm-eval's own command with ARGUMENTS; it knows `--model infthor` and our tasks.

    lm-eval 0.4.13 reads no entry points, so its own script finds this model only if a task is given
    as a file, and the tasks by `--include_path` (`infthor-eval ls tasks --path`).
    """
    from lm_eval.__main__ import cli_evaluate

    from infthor_eval.harness.registration import add_tasks, register

    register()
    add_tasks()
    sys.argv = ["lm-eval", *arguments]
    try:
        cli_evaluate()
    except InfthorError:
        raise
    except Exception as error:  # lm-eval tells of a misspelt task by a traceback
        reason = in_one_line(error) if isinstance(error, ValueError) else describe_exception(error)
        if isinstance(error, OSError) and error.filename is not None:
            reason = f"{error.filename}: {in_one_line(error)}"
        raise UsageError(f"lm-eval fails ({reason}); {_hint(error)}") from error


def _hint(error: BaseException) -> str:
    if not version("lm_eval").startswith("0.4."):
        return f"lm-eval {version('lm_eval')} is not supported: pip install 'lm_eval>=0.4.13,<0.5'"
    if "Tasks not found" in in_one_line(error):
        return "`infthor-eval ls tasks` lists those of this package; --include_path adds a folder"
    if isinstance(error, FileNotFoundError):
        return (
            "what a task file includes stands beside it, or has its full path (`infthor-eval ls "
            "tasks --path`)"
        )
    return "`infthor-eval lm-eval run --help` lists its options"
