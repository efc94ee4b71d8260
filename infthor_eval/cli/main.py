"""Entry point: which commands there are, and how errors are shown."""

import contextlib
import importlib
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType

import click

import infthor_eval
from infthor_eval.cli.options.repeated import refuse_repeated
from infthor_eval.errors import InfthorError, in_one_line
from infthor_eval.terminal import print_error

__all__ = ["main"]

# Name, and the one line that the overview shows.
_COMMANDS = {
    "run": "Evaluate a model on tasks (the default command).",
    "plan": "Estimate what a run will take, before it begins.",
    "fetch": "Download the published data.",
    "validate": "Keep the questions of a set that one of several models answers.",
    "train": "Fine-tune a model on trajectories and questions.",
    "import-checkpoint": "Make a checkpoint of the published trainer one that models load.",
    "compare": "Compare two runs on the same data.",
    "check-adapter": "Check that a model of your own keeps the contract of adapters.",
    "check-parity": "Compare a policy's actions with another implementation's.",
    "report": "Write runs as a page with every sample, or as a figure of the paper.",
    "watch": "Show what was done in a run of plans or of arms, as MP4 or GIF.",
    "ls": "List the models, the tasks, the scenes, or the runs in a folder.",
    "show": "Print the results of runs again, or write them as CSV, LaTeX, Markdown or JSON.",
    "doctor": "Look at what this machine has, and tell what to do where something is missing.",
    "scenes": "Look at a scene, or carry it to machines without Unity.",
    "generate": "Make long-horizon trajectories in a scene.",
    "replay": "Replay trajectories in the simulator into frames and metadata.",
    "bundle": "Make a question set from a manifest of scenes and seeds.",
    "questions": "Make NIEH questions from replayed trajectories.",
    "lm-eval": "Run lm-eval's own command, with these models known to it.",
}
_DEFAULT = "run"


class _Commands(click.Group):
    """Commands imported on demand; options without a command are those of `run`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        command = importlib.import_module(f"infthor_eval.cli.commands.{cmd_name.replace('-', '_')}").command
        assert isinstance(command, click.Command)
        return command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0].startswith("-") and args[0] not in ("--help", "-h", "--version"):
            args = [_DEFAULT, *args]
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None:
            refuse_repeated(ctx, command, rest)
        return name, command, rest

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Also those of the default command, which are typed without its name."""
        super().format_options(ctx, formatter)
        run = self.get_command(ctx, _DEFAULT)
        assert run is not None
        with formatter.section("Options of a run"):
            formatter.write_dl([told for option in run.params if (told := option.get_help_record(ctx)) is not None])

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        # Not click's own, which would import every command for its first line of help.
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=True)
@click.version_option(infthor_eval.__version__, prog_name="infthor-eval")
def _infthor_eval() -> None:
    """Evaluate multimodal models on long-horizon embodied tasks (∞-THOR).

    Without a command: infthor-eval --model MODEL --tasks TASKS runs an evaluation.
    """


def main(args: list[str] | None = None) -> None:
    """Run the command line; errors meant for people end in one line on standard error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # whatever the terminal's encoding, a name must not end a run
    try:
        with _stopped_by_sigterm():
            code = _infthor_eval.main(args, prog_name="infthor-eval", standalone_mode=False)
        sys.stdout.flush()  # here, and not where Python ends: a full disk is an error like any other
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        sys.exit(2)
    except (click.MissingParameter, click.NoSuchOption) as error:
        assert error.ctx is not None
        said = error.format_message().rstrip(".")
        _fail(f"{said}; `{error.ctx.command_path} --help` tells what there is", error.exit_code)
    except click.ClickException as error:
        _fail(error.format_message(), error.exit_code)
    except InfthorError as error:
        _fail(str(error), error.exit_code)
    except _Terminated:
        _fail("stopped; run the same command to continue", 143)
    except (click.Abort, KeyboardInterrupt):
        _fail("stopped; run the same command to continue", 130)
    except OSError as error:  # no command's own: a disk that is full, a file that was taken away in mid-work
        _discard_output()
        place = error.filename if error.filename is not None else "standard output or a file"
        _fail(f"{place}: cannot be read or written ({in_one_line(error)}); mend that and run the same command again", 2)
    else:
        sys.exit(code if isinstance(code, int) else 0)


class _Terminated(BaseException):
    """SIGTERM came: everything is to be tidied up, as on Ctrl-C."""


@contextlib.contextmanager
def _stopped_by_sigterm() -> Iterator[None]:
    """SIGTERM as an exception, so that temporary folders and the simulator's processes go with the command."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise _Terminated

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _discard_output() -> None:
    """What standard output cannot take is dropped now; Python would try again, and complain, where it ends."""
    try:
        sys.stdout.flush()
    except OSError:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
        os.close(nothing)


def _fail(message: str, code: int) -> None:
    print_error(message)
    sys.exit(code)
