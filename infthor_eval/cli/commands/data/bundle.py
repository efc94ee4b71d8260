"""`infthor-eval bundle`: build a question set from a manifest of scenes and seeds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options

if TYPE_CHECKING:
    from infthor_eval.generation.bundle import Manifest, TwinsManifest
    from infthor_eval.workers import WorkerSettings


@example_command(
    "bundle", "infthor-eval bundle infthor_eval/sets/nieh_mini/manifest.json --out build/nieh_mini"
)
@click.argument("manifest", type=PATH)
@click.option(
    "--out",
    type=PATH,
    required=True,
    help="Folder of the set, new, empty, or with a build that was stopped.",
)
@worker_options
def command(manifest: Path, out: Path, **workers: Any) -> int:
    """Build the set that MANIFEST describes: trajectories, frames, questions or twins.

    If the manifest has digests, as that of a bundled set does, the files are compared with them;
    exit code 1 if one differs. Workers share the making of twins.
    """
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.generation.bundle import Manifest, differing_files, read_manifest
    from infthor_eval.storage.files import hold_folder
    from infthor_eval.terminal import error_console, print_line, progress_bar

    expected = read_manifest(manifest)
    worker_settings = parse_worker_settings(**workers)
    with hold_folder(out), progress_bar(error_console()) as progress:
        bar = PacedBar(progress, expected.name, 2 * len(expected.trajectories))
        built: Manifest | TwinsManifest
        if isinstance(expected, Manifest):
            built, lines = _build_questions(expected, out, bar.advance)
        else:
            built, lines = _build_twins(expected, out, worker_settings, bar.advance)
    size = sum(path.stat().st_size for path in out.iterdir() if path.is_file())
    print_line(f"{lines[0]}, {size / 1e6:.1f} MB: {out}")
    print_line(lines[1])
    if not expected.files:
        return 0
    n_files = len(expected.files.keys() | built.files.keys())
    differing = differing_files(expected, built)
    print_line(f"{n_files - len(differing)} of {n_files} files as in the manifest")
    for name in differing[:10]:
        error_console().print(f"differs: {name}")
    return int(bool(differing))


def _build_questions(
    manifest: Manifest, out: Path, advance: Callable[[bool], None]
) -> tuple[Manifest, tuple[str, str]]:
    """Build a set of questions; return its manifest, and what is in it and in which proportions."""
    from infthor_eval.generation.bundle import build_bundle
    from infthor_eval.thor.launch import embedded_launch
    from infthor_eval.thor.simulator import Simulator

    with Simulator(embedded_launch()) as simulator:
        built, generated = build_bundle(manifest, simulator, out, advance)
    content = f"{len(generated.questions)} questions on {generated.trajectories} trajectories"
    return built, (content, generated.summary_text())


def _build_twins(
    manifest: TwinsManifest,
    out: Path,
    worker_settings: WorkerSettings,
    advance: Callable[[bool], None],
) -> tuple[TwinsManifest, tuple[str, str]]:
    """Build a set of twins; return what `_build_questions` does."""
    from infthor_eval.cli.commands.data.questions import drafting_of
    from infthor_eval.generation.bundle import build_twins
    from infthor_eval.thor.launch import embedded_launch

    draft = drafting_of(manifest.twins, embedded_launch())
    built, numbers = build_twins(manifest, draft, out, worker_settings, advance)
    content = (
        f"{numbers.pairs} paired questions of {numbers.found} on {numbers.facts} facts of "
        f"{numbers.trajectories} trajectories"
    )
    by_kind = ", ".join(f"{name} {count}" for name, count in numbers.by_kind.items())
    return built, (content, f"by kind: {by_kind}")
