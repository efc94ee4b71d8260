"""Entry point: the commands, and how errors are printed."""

import difflib
import gc
import io
import os
import re
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Any

import click

import infthor_eval
from infthor_eval.cli.help import ExampleGroup
from infthor_eval.cli.own_code import end_process, noticed
from infthor_eval.cli.progress.stopping import answer_ctrl_c, handle_signal
from infthor_eval.errors import (
    InfthorError,
    OutputClosed,
    Terminated,
    describe_exception,
    in_one_line,
    unknown_name,
)
from infthor_eval.plugins import import_target
from infthor_eval.storage.scratch import remove_abandoned
from infthor_eval.terminal import error_console, print_error

# By group: the name of each command and its line in the overview.
_COMMANDS = {
    "Evaluate": {
        "run": "Evaluate a model on tasks (the default command).",
        "plan": "Estimate time, memory and cost of a run.",
        "ls": "List models, tasks, scenes, or the runs in a folder.",
    },
    "Look at results": {
        "show": "Print the results of runs, also as CSV or LaTeX.",
        "compare": "Compare two runs on the same data.",
        "explain": "Say why two runs of the same questions differ.",
        "report": "Write a page of results and samples, or a figure.",
        "watch-run": "Open a page on a run as it goes.",
        "watch": "Write a video of an agent or an arm.",
        "export": "Write runs in the formats of others.",
        "import-replies": "Store replies that others made as runs.",
        "rescore": "Score replies again, also with a judge.",
        "audit": "Print what a question set gives away without a frame.",
        "table": "Compute a table of the paper from its published files.",
    },
    "Make data": {
        "init-set": "Write an example of a set of your own films, frames and questions.",
        "generate": "Generate long-horizon trajectories in a scene.",
        "look-around": "Level the camera in the long walks of trajectories.",
        "replay": "Replay trajectories into frames and metadata.",
        "questions": "Generate NIEH questions on replayed trajectories.",
        "moments": "Pair moments: the same question with two answers.",
        "twins": "Make twins: the same episode with one thing changed.",
        "validate": "Keep the questions that one of several models answers.",
        "bundle": "Build a question set from a manifest.",
        "pack": "Write a set as few Parquet files.",
        "unpack": "Write a packed set as a folder again.",
        "card": "Write a data set card and a Croissant file of a set.",
        "scenes": "Draw a scene, or export it for machines without Unity.",
    },
    "Own models": {
        "check": "Check a model, a memory or a policy of your own.",
        "train": "Fine-tune a model on trajectories and questions.",
        "import-checkpoint": "Convert a checkpoint of the published trainer.",
    },
    "Tools": {
        "fetch": "Download the published data.",
        "doctor": "Check the installation and suggest fixes.",
        "lm-eval": "Run lm-eval's own command with these models.",
    },
}
# Commands of one group have a folder of infthor_eval.cli.commands, and some share a module of it;
# the others are `command` of their own.
_FOLDERS = {"Make data": "data."}
_SHARED_MODULES = {
    "questions": "data.questions:questions",
    "moments": "data.questions:moments",
    "twins": "data.questions:twins",
    "pack": "data.pack:pack",
    "unpack": "data.pack:unpack",
    "export": "exchange:export",
    "import-replies": "exchange:import_replies",
}
_NAMES = tuple(name for group in _COMMANDS.values() for name in group)
_DEFAULT = "run"
# The options of a run in the overview.
_USUAL = {"models", "tasks", "data", "model_args", "context", "memory", "frames", "limit", "output"}
_INTERRUPTED, _TERMINATED = 130, 143  # exit codes
_STOPPED = "stopped; run the same command to continue"
_COLLECT_AFTER = 50_000  # new objects between two collections of garbage


class Program(ExampleGroup):
    """The commands of a program: an unknown one is named, and no option of one is taken twice."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        settings["context_settings"] = {"help_option_names": ["-h", "--help"]}
        super().__init__(*arguments, no_args_is_help=True, **settings)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """See `click.Group.resolve_command`."""
        names = self.list_commands(ctx)
        # Completion asks for parts of names.
        if args and args[0] not in names and not ctx.resilient_parsing:
            raise unknown_name("command", args[0], names)
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None:
            _refuse_repeated_options(ctx, command, rest)
        return name, command, rest


class _Commands(Program):
    """Commands imported on demand; options without a command are those of `run`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_NAMES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _NAMES:
            return None
        folder = next(
            (prefix for group, prefix in _FOLDERS.items() if cmd_name in _COMMANDS[group]), ""
        )
        own = f"{folder}{cmd_name.replace('-', '_')}:command"
        target = _SHARED_MODULES.get(cmd_name, own)
        command = import_target(f"infthor_eval.cli.commands.{target}")
        assert isinstance(command, click.Command)
        return command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0].startswith("-") and args[0] not in ("--help", "-h", "--version"):
            args = [_DEFAULT, *args]
        return super().parse_args(ctx, args)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands, then the options, with those that most runs are given."""
        for group, commands in _COMMANDS.items():
            with formatter.section(group):  # not click's own list, which would import every command
                formatter.write_dl(list(commands.items()))
        click.Command.format_options(self, ctx, formatter)
        run = self.get_command(ctx, _DEFAULT)
        assert run is not None
        usual = (option.get_help_record(ctx) for option in run.params if option.name in _USUAL)
        with formatter.section("Options of a run (`infthor-eval run --help` has all)"):
            formatter.write_dl([(name, _first_clause(text)) for name, text in filter(None, usual)])


def _first_clause(text: str) -> str:
    return re.split(r"[;,(]| \[|\.(?: |$)", text)[0].strip() + "."


@click.group(
    "infthor-eval",
    cls=_Commands,
    example="infthor-eval --model oracle,blind,qwen2.5-vl-nano --tasks nieh_mini_gt",
)
@click.version_option(infthor_eval.__version__, prog_name="infthor-eval")
def _infthor_eval() -> None:
    """Evaluate multimodal models on long-horizon embodied tasks (∞-THOR).

    Without a command: infthor-eval --model MODEL --tasks TASKS evaluates a model.
    """


def main(args: list[str] | None = None) -> None:
    """Run the command line."""
    run_program(_infthor_eval, args)


@noticed()
def run_program(program: click.Command, args: list[str] | None = None) -> None:
    """Run a program, of one command or several; errors meant for people are printed as one line on
    standard error."""
    name = str(program.name)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # No name in the data may end a run, whatever the encoding.
            stream.reconfigure(errors="backslashreplace")
    output = sys.stdout
    try:
        with (
            handle_signal(signal.SIGTERM, _raise_terminated),
            handle_signal(signal.SIGINT, signal.default_int_handler),
            answer_ctrl_c(partial(_ask_for_patience, name), partial(_end, name)),
            collecting_seldom(),
        ):
            remove_abandoned()
            code = program.main(args, prog_name=name, standalone_mode=False)
        # Here and not at Python's exit, so that a full disk is an error like any other.
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        sys.exit(2)
    except click.NoSuchOption as error:
        _exit(name, _unknown_option(error), error.exit_code)
    except click.MissingParameter as error:
        assert error.ctx is not None
        message = error.format_message().rstrip(".")
        _exit(name, f"{message}; see `{error.ctx.command_path} --help`", error.exit_code)
    except click.ClickException as error:
        _exit(name, error.format_message(), error.exit_code)
    except InfthorError as error:
        _exit(name, str(error), error.exit_code)
    except (click.Abort, KeyboardInterrupt, Terminated) as error:
        code = _TERMINATED if isinstance(error, Terminated) else _INTERRUPTED
        _exit(name, _STOPPED, code)
    except OSError as error:  # that no command expects: a full disk, a file removed during the work
        _discard_output()
        path = error.filename if error.filename is not None else "standard output or a file"
        problem = f"{path}: cannot be read or written ({in_one_line(error)})"
        _exit(name, f"{problem}; fix that and run the same command again", 2)
    except (SystemExit, GeneratorExit) as error:
        # click ends the program, too, if nobody reads its help, and replaces the output.
        if isinstance(error, OutputClosed) or sys.stdout is not output:
            _discard_output()
            sys.exit(1)
        # Of code of others, where no command expects it.
        problem = describe_exception(error)
        _exit(name, f"{problem}; your own code must not end the program: fix it", 2)
    else:
        sys.exit(code if isinstance(code, int) else 0)


@contextmanager
def collecting_seldom() -> Iterator[None]:
    """Collect garbage seldom within the context.

    Importing torch and transformers makes a million objects, and collections look at them again and
    again: a fifth of the time from the command to a small model's first question.
    """
    before = gc.get_threshold()
    gc.set_threshold(_COLLECT_AFTER, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


def _raise_terminated(_number: int, _frame: FrameType | None) -> None:
    """Handle SIGTERM."""
    raise Terminated(_TERMINATED)


def _ask_for_patience(program: str) -> None:
    text = "a calculation has to end first; press Ctrl-C again to end the program now"
    print_error(text, program)


def _end(program: str) -> None:
    """End the process as a kill would; what is finished is on disk."""
    error_console().show_cursor()  # which a progress bar has hidden
    print_error(_STOPPED, program)
    end_process(_INTERRUPTED)


def _discard_output() -> None:
    """Discard what standard output cannot take; Python would try again at its exit."""
    try:
        sys.stdout.flush()
    except OSError:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)


def _unknown_option(error: click.NoSuchOption) -> str:
    assert error.ctx is not None
    options = {
        name for option in error.ctx.command.params for name in option.opts if name.startswith("--")
    }
    near = difflib.get_close_matches(error.option_name, options, n=1)
    hint = f"did you mean {near[0]}?" if near else f"see `{error.ctx.command_path} --help`"
    return f"unknown option {error.option_name}; {hint}"


def _exit(program: str, message: str, code: int) -> None:
    print_error(message, program)
    sys.exit(code)


def _refuse_repeated_options(
    context: click.Context, command: click.Command, arguments: Sequence[str]
) -> None:
    """Refuse an option with one value that is given twice: click would take the last one without
    a word. Of a group, its own command is checked."""
    if isinstance(command, click.Group):
        inner = command.get_command(context, arguments[0]) if arguments else None
        if inner is not None:
            _refuse_repeated_options(context, inner, arguments[1:])
        return
    options = filter(_takes_one_value, command.params)
    with_one_value = {name: option for option in options for name in option.opts}
    seen: set[str] = set()
    rest = iter(arguments)
    for argument in rest:
        name, equals, _ = argument.partition("=")
        if argument == "--":
            return
        if name not in with_one_value:
            continue
        if name in seen:
            is_list = ",..." in str(with_one_value[name].make_metavar(context))
            several = ", with commas between several values" if is_list else ""
            raise click.UsageError(f"{name} is given twice; give it once{several}")
        seen.add(name)
        if not equals:
            next(rest, None)  # its value, which may look like an option


def _takes_one_value(option: click.Parameter) -> bool:
    return isinstance(option, click.Option) and not (
        option.multiple or option.is_flag or option.count
    )
