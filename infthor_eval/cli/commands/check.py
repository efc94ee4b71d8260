"""`check adapter`, `check memory` and `check parity`: checks of anybody's models and memories."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import ExampleGroup
from infthor_eval.cli.options.values import PATH, FiniteFloat, default_option, parse_model_args
from infthor_eval.cli.progress.notes import prints_as_notes

if TYPE_CHECKING:
    from model_adapters.check import CheckResult


@click.group(
    "check", cls=ExampleGroup, example="infthor-eval check adapter ./my_adapter.py:MyModel"
)
def command() -> None:
    """Check a model, a memory or a policy of your own."""


@command.command("adapter", example="infthor-eval check adapter ./my_adapter.py:MyModel")
@click.argument("model")
@click.option(
    "--model-args", default="", metavar="K=V,...", help="Options of MODEL (see `ls models MODEL`)."
)
def check_adapter(model: str, model_args: str) -> int:
    """Check MODEL, a name or your own FILE.py:CLASS, against the adapter contract.

    The model gets a few dozen short requests with frames of one colour. Each clause of the contract
    has a line of output; docs/own-models.md explains them. Exit code 1 if a clause is broken.
    """
    from model_adapters import run_checks
    from model_adapters.refusals import wrap_closing
    from model_adapters.registry import build

    with prints_as_notes():
        adapter = build(model, parse_model_args(model_args), seed=0)
    code = _print_checks(model, run_checks(adapter))
    if hasattr(adapter, "close"):  # an adapter without it has been reported as broken
        with prints_as_notes(), wrap_closing(f"model {model}"):
            adapter.close()
    return code


@command.command("memory", example="infthor-eval check memory ./my_memory.py:MyMemory")
@click.argument("memory")
@click.option(
    "--memory-args",
    default="",
    metavar="K=V,...",
    help="Options of MEMORY (see `ls memories MEMORY`).",
)
def check_memory(memory: str, memory_args: str) -> int:
    """Check MEMORY, a name or your own FILE.py:CLASS, against the contract of memories.

    The memory observes short trajectories of plain frames and is asked on them. Each clause of the
    contract has a line of output; docs/memories.md explains them. Exit code 1 if a clause is
    broken.
    """
    from infthor_eval.memory import check, open_memory, parse_options

    options = parse_options(memory_args) or {}
    with prints_as_notes():
        opened = open_memory(memory, tuple(sorted(options.items())))
    return _print_checks(memory, check.check_memory(opened))


@command.command(
    "parity", example="infthor-eval check parity openvla --reference-url http://HOST:8000"
)
@click.argument("model")
@click.option(
    "--reference-url",
    required=True,
    metavar="URL",
    help="Server with the reference policy (/act convention).",
)
@click.option("--frames", type=PATH, help="Folder of images; default: black, white and noise.")
@click.option(
    "--instruction",
    multiple=True,
    help="Instruction to the policy; may be repeated. Default: a few.",
)
@click.option(
    "--model-args",
    default="",
    metavar="K=V,...",
    help="Options of MODEL; unnorm_key is sent to the server too.",
)
@default_option("--tolerance", FiniteFloat(min=0), 1e-6, "Largest difference of equal actions.")
def check_parity(
    model: str,
    reference_url: str,
    frames: Path | None,
    instruction: tuple[str, ...],
    model_args: str,
    tolerance: float,
) -> int:
    """Compare the actions of MODEL (openvla, spatialvla) with a reference server's on equal frames.

    Exit code 1 if one differs.
    """
    from infthor_eval.report.terminal import print_table, table_console
    from model_adapters.policies.parity import (
        INSTRUCTIONS,
        compare_policies,
        frames_in_folder,
        load_policy,
        reference_policy,
        synthetic_frames,
    )

    options = parse_model_args(model_args)
    theirs = reference_policy(reference_url, options.get("unnorm_key"))
    synthetic = nullcontext(frames_in_folder(frames)) if frames else synthetic_frames()
    with synthetic as images, prints_as_notes(), closing(load_policy(model, options)) as ours:
        comparison = compare_policies(ours, theirs, images, instruction or INSTRUCTIONS, tolerance)
    print_table(comparison.table(), table_console())
    return int(not comparison.equal)


def _print_checks(name: str, results: Iterable[CheckResult]) -> int:
    """Print a line a result and one for all; return the exit code, 1 if a clause is broken."""
    from infthor_eval.terminal import print_line

    n_broken = 0
    each = iter(results)
    while True:
        with prints_as_notes():
            result = next(each, None)
        if result is None:
            break
        verdict = "holds" if result.violation is None else "broken"
        print_line(f"{verdict:8}{result.name:16}{result.violation or ''}".rstrip())
        n_broken += result.violation is not None
    print_line(f"{name}: {f'{n_broken} broken' if n_broken else 'keeps the contract'}")
    return int(n_broken > 0)
