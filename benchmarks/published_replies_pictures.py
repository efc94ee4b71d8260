"""Draw the pictures of docs/paper.md from the published question files and three
imported runs.

    infthor-eval import-replies LOGS/eval_qa_set_*.log --data DATA --out results
    python benchmarks/published_replies_pictures.py DATA results/Qwen2.5-VL-7B-Instruct/*

Scores are those of the strict scorer; bars are 95 % intervals, clustered by trajectory.
"""

import argparse
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from infthor_eval.distances import DISTANCES
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.published import published_tables
from infthor_eval.nieh.guessing.audit import audit
from infthor_eval.nieh.results.cells import Cell
from infthor_eval.nieh.results.evidence_tables import short_name
from infthor_eval.nieh.results.facets import SHOWN_CLUES
from infthor_eval.nieh.results.summary import NiehSummary, TaskSummary
from infthor_eval.report.figures import LEGEND, add_legend, looks_of, save_figure
from infthor_eval.run import Run

DOCS = Path(__file__).parents[1] / "docs"
MODES = {
    "nieh_published_full": "full trajectory",
    "nieh_published_last_32k": "last 32K",
    "nieh_published_clip_20": "CLIP, 20 frames",
}
LOOKS = looks_of((*MODES, "guess", "printed"))


def main() -> None:
    """Write the pictures into docs/."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with the two question files")
    parser.add_argument("runs", type=Path, nargs="+", help="runs of import-replies")
    options = parser.parse_args()
    tasks: dict[str, TaskSummary] = {}
    for folder in options.runs:
        summary = Run.open(folder).own_summary.summary
        assert isinstance(summary, NiehSummary)
        tasks |= summary.tasks
    tasks = {name: tasks[name] for name in MODES}
    data = NiehSet(options.data)
    pictures = {
        "guessing": lambda: draw_guessing(data, tasks),
        "above_blind": lambda: draw_above_blind(tasks),
        "evidence": lambda: draw_evidence(tasks),
        "distance": lambda: draw_distance(tasks),
    }
    for name, draw in pictures.items():
        save(draw, f"published_replies_{name}")


def save(draw: Callable[[], Figure], name: str) -> None:
    """Write a picture as PNG alone."""
    with tempfile.TemporaryDirectory() as folder:
        png = next(path for path in save_figure(draw, Path(folder), name) if path.suffix == ".png")
        (DOCS / png.name).write_bytes(png.read_bytes())


def draw_guessing(data: NiehSet, tasks: Mapping[str, TaskSummary]) -> Figure:
    """Draw what guessers get on each file, above what is published of models that see the
    frames."""
    files = audit(data).groups("file")
    printed = next(table for table in published_tables("nieh") if table.context == "trajectory")
    figure = Figure(figsize=(8.6, 3.6), layout="constrained")
    panels = figure.subplots(1, len(files), sharey=True)
    for axes, file in zip(panels, files, strict=True):
        means = dict(zip(file.guessers, file.means(), strict=True))
        rows = [
            ("no frame: one answer for all", LOOKS["guess"], 100 * means["one answer a file"]),
            ("no frame: blind", LOOKS["guess"], 100 * means["blind"]),
            ("no frame: the best guesser in hindsight", LOOKS["guess"], 100 * max(file.means())),
        ]
        rows += [
            (
                f"{row.name}, README",
                LOOKS["printed"],
                dict(zip(printed.columns, row.values, strict=True))[short_name(file.name)],
            )
            for row in printed.rows
            if "README" in (row.source or "README")
        ]
        at = len(rows) + len(tasks)
        for _, look, value in rows:
            at -= 1
            axes.plot(value, at, "o", ms=5, color=look.colour)
            axes.annotate(
                f"{value:.1f}",
                (value, at),
                (7, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
            )
        for name, task in tasks.items():
            at -= 1
            score = task.by["file"][file.name].scores["strict"]
            axes.hlines(
                at,
                100 * (score.low or 0),
                100 * (score.high or 0),
                color=LOOKS[name].colour,
                lw=1.3,
            )
            axes.plot(100 * score.mean, at, "o", ms=5, color=LOOKS[name].colour)
            words = (f"{100 * score.mean:.1f}", (100 * (score.high or 0), at), (5, 0))
            axes.annotate(*words, textcoords="offset points", va="center", fontsize=8)
        names = [
            *(row[0] for row in rows),
            *(f"Qwen2.5-VL 7B, {MODES[name]}, log" for name in tasks),
        ]
        axes.set_yticks(range(len(names)), names[::-1])
        axes.set_xlim(0, 100)
        axes.set_xlabel("accuracy, %")
        axes.set_title(f"{short_name(file.name)} ({len(file.questions)})", fontsize=9)
        axes.grid(axis="y", visible=False)
    return figure


def draw_above_blind(tasks: Mapping[str, TaskSummary]) -> Figure:
    """Draw the score above blind of each run."""
    figure = Figure(figsize=(6.2, 1.7), layout="constrained")
    axes = figure.subplots()
    axes.axvline(0, color="#444444", lw=0.8)
    for at, (name, task) in enumerate(reversed(tasks.items())):
        score, colour = task.above_blind["strict"], LOOKS[name].colour
        axes.plot(100 * (score.mean or 0), at, "o", ms=5, color=colour)
        axes.hlines(at, 100 * (score.low or 0), 100 * (score.high or 0), color=colour, lw=1.3)
    axes.set_yticks(range(len(tasks)), [MODES[name] for name in reversed(tasks)])
    axes.set_ylim(-0.6, len(tasks) - 0.4)
    axes.set_xlim(-35, 105)
    axes.set_xlabel("above blind, %: 0 is blind, which sees no frame, 100 all right")
    axes.grid(axis="y", visible=False)
    return figure


def draw_evidence(tasks: Mapping[str, TaskSummary]) -> Figure:
    """Draw accuracy by the clue frames that were shown, of the runs that do not show all of
    them."""
    hiding = {name: task for name, task in tasks.items() if name != "nieh_published_full"}
    return _by_file(
        hiding,
        SHOWN_CLUES,
        lambda task, file: task.files[file]["shown_clues"],
        "of the clue frames",
    )


def draw_distance(tasks: Mapping[str, TaskSummary]) -> Figure:
    """Draw accuracy by the distance of the last clue from the end."""
    used = set().union(*(task.by["distance"] for task in tasks.values()))
    names = [name for name in DISTANCES if name in used]
    return _by_file(
        tasks,
        names,
        lambda task, file: task.files[file]["distance"],
        "frames after the last clue",
    )


def _by_file(
    tasks: Mapping[str, TaskSummary],
    names: Sequence[str],
    cells_of: Callable[[TaskSummary, str], Mapping[str, Cell]],
    label: str,
) -> Figure:
    files = list(next(iter(tasks.values())).by["file"])
    figure = Figure(figsize=(7.4 + LEGEND, 2.8), layout="constrained")
    panels: Sequence[Axes] = figure.subplots(1, len(files), sharey=True)
    for axes, file in zip(panels, files, strict=True):
        for number, (name, task) in enumerate(tasks.items()):
            offset = 0.22 * (number - (len(tasks) - 1) / 2)
            for at, cell in (
                (names.index(key), cell) for key, cell in cells_of(task, file).items()
            ):
                score, colour = cell.scores["strict"], LOOKS[name].colour
                axes.plot(at + offset, 100 * score.mean, "o", ms=4.5, color=colour, zorder=3)
                if score.low is not None and score.high is not None:
                    axes.vlines(
                        at + offset, 100 * score.low, 100 * score.high, color=colour, lw=1.3
                    )
        axes.set_xticks(range(len(names)), names, fontsize=8)
        axes.set_ylim(0, 100)
        axes.set_xlabel(label)
        axes.set_title(short_name(file), fontsize=9)
        axes.grid(axis="x", visible=False)
    panels[0].set_ylabel("accuracy, %")
    add_legend(panels[-1], [(MODES[name], LOOKS[name]) for name in tasks])
    return figure


if __name__ == "__main__":
    main()
