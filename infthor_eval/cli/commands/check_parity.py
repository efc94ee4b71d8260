"""`infthor-eval check-parity`: compare a policy with another implementation of it behind a server."""

from contextlib import nullcontext
from pathlib import Path

import click

from infthor_eval.cli.options.values import FiniteFloat, parse_model_args

__all__ = ["command"]


@click.command("check-parity")
@click.argument("model")
@click.option("--reference-url", required=True, metavar="URL", help="Server of the /act convention.")
@click.option("--frames", type=click.Path(path_type=Path), help="Folder of pictures; black, white and noise if none.")
@click.option("--instruction", multiple=True, help="What is to be done; may be repeated. A few if none.")
@click.option(
    "--model-args", default="", metavar="K=V,...", help="Options of MODEL; unnorm_key goes to the server too."
)
@click.option("--tolerance", type=FiniteFloat(min=0), default=1e-6, show_default=True, help="Taken for equal.")
def command(
    model: str,
    reference_url: str,
    frames: Path | None,
    instruction: tuple[str, ...],
    model_args: str,
    tolerance: float,
) -> int:
    """Have MODEL (openvla, spatialvla) and a reference server act on the same frames, and compare their actions.

    Exits with 0 where all agree, with 1 where one does not.
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
    with nullcontext(frames_in_folder(frames)) if frames else synthetic_frames() as shown:
        ours = load_policy(model, options)
        try:
            found = compare_policies(ours, theirs, shown, instruction or INSTRUCTIONS, tolerance)
        finally:
            ours.close()
    print_table(found.table(), table_console())
    return 0 if found.equal else 1
