"""`infthor-eval check-parity`: compare a policy with another implementation of it behind a
server."""

from contextlib import nullcontext
from pathlib import Path

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH, FiniteFloat, parse_model_args

__all__ = ["command"]


@click.command(
    "check-parity",
    cls=ExampleCommand,
    example="infthor-eval check-parity openvla --reference-url http://HOST:8000",
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
@click.option(
    "--tolerance",
    type=FiniteFloat(min=0),
    default=1e-6,
    show_default=True,
    help="Largest difference of equal actions.",
)
def command(
    model: str,
    reference_url: str,
    frames: Path | None,
    instruction: tuple[str, ...],
    model_args: str,
    tolerance: float,
) -> int:
    """Compare the actions of MODEL (openvla, spatialvla) with those of a reference server on the
    same frames.

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
    with nullcontext(frames_in_folder(frames)) if frames else synthetic_frames() as images:
        ours = load_policy(model, options)
        try:
            comparison = compare_policies(
                ours, theirs, images, instruction or INSTRUCTIONS, tolerance
            )
        finally:
            ours.close()
    print_table(comparison.table(), table_console())
    return int(not comparison.equal)
