"""Draw docs/pairs.png: the small model's net pairs of twins, by the number of frames that a memory
shows it.

    M="--model qwen2.5-vl-nano --tasks nieh_mini_twins --out runs"
    infthor-eval $M --context memory --memory oracle,uniform,random,last --budget 27,72,180,540
    python benchmarks/pairs_by_frames.py runs
"""

import argparse
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import msgspec
import pandas as pd

from infthor_eval import load_run, load_runs

COLOURS = {"oracle": "#d08a00", "uniform": "#2a6f9f", "random": "#2a7f3f", "last": "#b03030"}
PICTURE = Path(__file__).parents[1] / "docs" / "pairs.png"


def read_points(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each run behind one of the memories: frames recalled on average, and net
    pairs with their interval, in %."""
    rows = []
    for run in runs.itertuples():
        results = msgspec.json.decode((Path(run.folder) / "results.json").read_bytes())
        memory = results["config"].get("memory")
        if memory in COLOURS:
            frames = load_run(run.folder).n_recalled.mean()
            rows.append((memory, frames, 100 * run.score, 100 * run.low, 100 * run.high))
    return pd.DataFrame(rows, columns=["memory", "frames", "pairs", "low", "high"])


def draw(points: pd.DataFrame) -> plt.Figure:
    """Return the picture: a curve with intervals for each memory."""
    mpl.rcParams["font.family"] = "DejaVu Sans"
    figure, axis = plt.subplots(figsize=(6.4, 3.4), dpi=120)
    for place, (memory, colour) in enumerate(COLOURS.items()):
        group = points[points.memory == memory].sort_values("frames")
        reach = [group.pairs - group.low, group.high - group.pairs]
        apart = group.frames * (0.97 + 0.02 * place)  # so that no interval hides another
        axis.errorbar(
            apart, group.pairs, reach, marker="o", ms=4, capsize=3, color=colour, label=memory
        )
    axis.set_xscale("log")
    axis.set_xticks([3, 8, 20, 60], ["3", "8", "20", "60"])
    axis.minorticks_off()
    axis.set_ylim(bottom=0)
    axis.set_xlabel("frames recalled (mean)")
    axis.set_ylabel("net pairs, %")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False, fontsize=8.5)
    figure.tight_layout()
    return figure


def main() -> None:
    """Read the runs of a folder and write the picture into docs/."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="folder of the runs")
    runs = load_runs(parser.parse_args().folder)
    points = read_points(runs[(runs.task == "nieh_mini_twins") & (runs.state == "whole")])
    print(points.round(1).to_string(index=False))
    draw(points).savefig(PICTURE, metadata={"Software": None})


if __name__ == "__main__":
    main()
