"""Draw docs/memory_curve.png: net pairs of the bundled long twins by the age of their evidence.

    T="--tasks nieh_mini_long --out runs --context memory"
    infthor-eval --model qwen2.5-vl-nano $T --memory oracle,uniform,last,none --budget 72
    infthor-eval --model benchmarks/perfect_reader.py:PerfectReader $T --memory oracle,uniform \\
        --model-args bundled=nieh_mini_long --budget 128 --tokens-per-frame 16
    python benchmarks/memory_curve.py runs

Both budgets are of eight frames.
"""

import argparse
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import msgspec

COLOURS = {"oracle": "#d08a00", "uniform": "#2a6f9f", "last": "#b03030", "none": "#777777"}
READER = "PerfectReader"
LEAST = 20  # pairs of an age that is drawn
PICTURE = Path(__file__).parents[1] / "docs" / "memory_curve.png"


def curves(folder: Path) -> dict[tuple[str, str], dict[str, Any]]:
    """Return the net pairs by age of each model and memory."""
    found = {}
    for path in sorted(folder.rglob("results.json")):
        results = msgspec.json.decode(path.read_bytes())
        pairs = results["summary"]["tasks"]["nieh_mini_long"]["pairs"]
        by_age = sorted(pairs["by_age"].items(), key=lambda item: int(item[0].partition("-")[0]))
        model = READER if READER in str(results["config"]["model"]) else "included model"
        found[model, results["config"]["memory"]] = dict(by_age)
    return found


def draw(found: dict[tuple[str, str], dict[str, Any]]) -> plt.Figure:
    """Return the picture: a curve with intervals for each memory, dashed of the reader."""
    mpl.rcParams["font.family"] = "DejaVu Sans"
    figure, axis = plt.subplots(figsize=(6.4, 3.4), dpi=120)
    for place, ((model, memory), by_age) in enumerate(sorted(found.items())):
        rows = [(age, it) for age, it in by_age.items() if it["n"] >= LEAST]
        ages = [int(age.partition("-")[0]) * 1.03**place for age, _ in rows]
        means, lows, highs = (
            [100 * (it["mean"] if it.get(end) is None else it[end]) for _, it in rows]
            for end in ("mean", "low", "high")
        )
        reach = [
            [mean - low for mean, low in zip(means, lows, strict=True)],
            [high - mean for mean, high in zip(means, highs, strict=True)],
        ]
        is_reader = model == READER
        label = f"{'no mistakes' if is_reader else model}, {memory}"
        axis.errorbar(
            ages, means, reach, marker="o", ms=4, capsize=3, color=COLOURS[memory], label=label,
            ls="--" if is_reader else "-",
        )  # fmt: skip
    axis.set_xscale("log")
    axis.set_xticks([10, 30, 100, 300], ["10", "30", "100", "300"])
    axis.minorticks_off()
    axis.set_xlabel("frames since the newest evidence")
    axis.set_ylabel("net pairs, %")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.tight_layout()
    return figure


def main() -> None:
    """Read the runs of a folder and write the picture into docs/."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the runs")
    draw(curves(parser.parse_args().folder)).savefig(PICTURE, metadata={"Software": None})


if __name__ == "__main__":
    main()
