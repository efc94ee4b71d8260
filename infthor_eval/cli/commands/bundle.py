"""`infthor-eval bundle`: make a question set from a manifest of scenes and seeds."""

from pathlib import Path

import click

__all__ = ["command"]


@click.command("bundle")
@click.argument("manifest", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder of the set, new or empty.")
def command(manifest: Path, out: Path) -> int:
    """Make the question set that MANIFEST describes: trajectories, frames, questions.

    Where the manifest has digests (that of a bundled set does), it says whether the same files came out; exit status 1
    where they differ.
    """
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.formats.files import prepare_folder
    from infthor_eval.generation.bundle import build_bundle, differing_files, read_manifest
    from infthor_eval.terminal import error_console, print_line, progress_bar
    from infthor_eval.thor.launch import embedded
    from infthor_eval.thor.simulator import Simulator

    wanted = read_manifest(manifest)
    prepare_folder(out)
    with Simulator(embedded()) as simulator, progress_bar(error_console()) as progress:
        bar = PacedBar(progress, wanted.name, 2 * len(wanted.trajectories))
        finished, made = build_bundle(wanted, simulator, out, bar.advance)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    print_line(f"{len(made.questions)} questions on {made.trajectories} trajectories, {size / 1e6:.1f} MB: {out}")
    print_line(made.summary_text())
    if not wanted.files:
        return 0
    n_files, differing = len(wanted.files.keys() | finished.files.keys()), differing_files(wanted, finished)
    print_line(f"{n_files - len(differing)} of {n_files} files as in the manifest")
    for name in differing[:10]:
        error_console().print(f"differs: {name}")
    return int(bool(differing))
