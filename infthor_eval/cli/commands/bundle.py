"""`infthor-eval bundle`: build a question set from a manifest of scenes and seeds."""

from pathlib import Path

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH

__all__ = ["command"]


@click.command(
    "bundle",
    cls=ExampleCommand,
    example="infthor-eval bundle infthor_eval/sets/nieh_mini/manifest.json --out build/nieh_mini",
)
@click.argument("manifest", type=PATH)
@click.option("--out", type=PATH, required=True, help="Folder of the set, new or empty.")
def command(manifest: Path, out: Path) -> int:
    """Build the question set that MANIFEST describes: trajectories, frames, questions.

    If the manifest has digests, as that of a bundled set does, the files are compared with them;
    exit code 1 if one differs.
    """
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.generation.bundle import build_bundle, differing_files, read_manifest
    from infthor_eval.storage.files import prepare_folder
    from infthor_eval.terminal import error_console, print_line, progress_bar
    from infthor_eval.thor.launch import embedded_launch
    from infthor_eval.thor.simulator import Simulator

    expected = read_manifest(manifest)
    prepare_folder(out)
    with Simulator(embedded_launch()) as simulator, progress_bar(error_console()) as progress:
        bar = PacedBar(progress, expected.name, 2 * len(expected.trajectories))
        built, questions = build_bundle(expected, simulator, out, bar.advance)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    print_line(
        f"{len(questions.questions)} questions on {questions.trajectories} trajectories, "
        f"{size / 1e6:.1f} MB: {out}"
    )
    print_line(questions.summary_text())
    if not expected.files:
        return 0
    n_files = len(expected.files.keys() | built.files.keys())
    differing = differing_files(expected, built)
    print_line(f"{n_files - len(differing)} of {n_files} files as in the manifest")
    for name in differing[:10]:
        error_console().print(f"differs: {name}")
    return int(bool(differing))
