"""Drawing the frames of bundled sets that come without, before a run asks about them."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from infthor_eval.cli.progress.notes import print_note
from infthor_eval.runs import RunRequest, Suite
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.terminal import error_console, progress_bar


def draw_missing(requests: Sequence[tuple[RunRequest, Suite]]) -> None:
    """Draw the frames of the bundled sets of some runs that are not drawn on this machine yet."""
    from infthor_eval.formats.undrawn import is_drawn, is_undrawn

    tasks = (task for request, _ in requests for task in request.tasks.tasks)
    settings = [task.settings.get("dataset_kwargs") for task in tasks]
    bundled = {str(it.get("bundled")) for it in settings if isinstance(it, Mapping)}
    for folder in sorted(packaged_folder("sets").iterdir()):
        if folder.name in bundled and is_undrawn(folder) and not is_drawn(folder):
            _draw(folder)


def _draw(packed: Path) -> None:
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.formats.twins import read_pairs
    from infthor_eval.formats.undrawn import drawn_folder
    from infthor_eval.generation.twins.undrawn import draw_worlds, expected_digests
    from infthor_eval.storage.files import hold_folder
    from infthor_eval.workers import WorkerSettings

    name, out = packed.name, drawn_folder(packed)
    print_note(f"{name} comes without frames; they are drawn once, which takes minutes: {out}")
    out.mkdir(parents=True, exist_ok=True)
    n_scenes = len({pair.floor_plan for pair in read_pairs(packed)})
    workers = WorkerSettings(min(n_scenes, os.cpu_count() or 1))
    with hold_folder(out), progress_bar(error_console()) as progress:
        bar = PacedBar(progress, f"scenes of {name}", n_scenes)
        differing = draw_worlds(packed, out, workers, bar.advance)
    if differing:
        n_worlds = len(expected_digests(packed))
        print_note(
            f"{name}: {len(differing)} of {n_worlds} trajectories are drawn otherwise on this "
            "machine than where the set was made; figures are of these frames",
            "yellow",
        )
