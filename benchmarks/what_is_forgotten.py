"""What sparse attention and memories in the cache forget: net pairs of twins, and clues kept.

    python -m benchmarks.what_is_forgotten --out DIR [--budget 27,90,270] [--picture PNG]
    python -m benchmarks.what_is_forgotten --out DIR --moments SET/moments.csv

Runs `infthor-eval` with the included model on the bundled twins or on moments: dense attention,
sparse shapes, memories in the cache and memories of frames at equal tokens. Finished runs are not
run again. It prints a table in Markdown, and draws it (`--picture PNG`).
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

FRAMES = ("last", "uniform", "random", "oracle")
CACHES: tuple[str, ...] = ("kv-window", "kv-sinks", "kv-uniform", "kv-random", "kv-oracle")
CACHES += ("kv-question", "kv-norm", "kv-merge")
SHAPES = ("sinks:4+window:{}", "block-sparse:2", "vertical-slash:.2")
ENDS = ("low", "high")


def commands(budgets: str, asked: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield the name of each group of runs, and its arguments, of which some say what is asked."""
    yield "dense", [*asked, "--context", "trajectory"]
    for shape in SHAPES:
        for budget in budgets.split(",") if "{}" in shape else [""]:
            attention = shape.format(budget)
            given = ["--model-args", f"attention={attention},chunk_tokens=128"]
            yield attention, [*asked, "--context", "trajectory", *given]
    memory = [*asked, "--context", "memory", "--budget", budgets, "--memory"]
    yield "frames", [*memory, ",".join(FRAMES)]
    yield "caches", [*memory, ",".join(CACHES)]
    yield "8bit", [*asked, "--context", "memory", "--memory", "kv-8bit"]


def rows(out: Path) -> list[dict[str, Any]]:
    """Return what each finished run is, and its net pairs, as they are in `results.json`."""
    found = []
    for file in sorted(out.glob("*/*/*/results.json")):
        results = json.loads(file.read_text(encoding="utf-8"))
        (task,) = results["summary"]["tasks"].values()
        memory = task["memory"]
        name = file.relative_to(out).parts[0] if memory is None else memory["name"]
        found.append(
            {
                "name": name,
                "budget": memory and memory["budget"],
                "kept": memory and memory.get("kept"),
                "pairs": task["pairs"]["net_pairs"],
                "ages": task["pairs"]["by_age"],
            }
        )
    return sorted(found, key=lambda row: (row["budget"] or 0, row["name"]))


def print_table(found: Sequence[Mapping[str, Any]]) -> None:
    """Print a row for each run."""
    print(
        "| | budget | net pairs | clue 0 to 9, 10 to 29, 30 or more frames ago | clues kept | MB |"
    )
    print("|---|---|---|---|---|---|")
    for row in found:
        means = ", ".join(f"{100 * row['ages'][age]['mean']:.1f}" for age in sorted(row["ages"]))
        kept = row["kept"] or {}
        clues = "-" if kept.get("clues") is None else f"{100 * kept['clues']:.0f} %"
        size = f"{kept['bytes'] / 1e6:.2f}" if kept else "-"
        print(
            f"| `{row['name']}` | {row['budget'] or '-'} | {_interval(row['pairs'])} | {means} "
            f"| {clues} | {size} |"
        )


def _interval(cell: Mapping[str, Any]) -> str:
    mean = f"{100 * cell['mean']:.1f}"
    if cell["low"] is None:
        return mean
    return f"{mean} [{100 * cell['low']:.1f}, {100 * cell['high']:.1f}]"


def draw(found: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draw net pairs of each run with their intervals, by budget."""
    figure = Figure(figsize=(7, 0.28 * len(found) + 0.8), layout="constrained")
    axes = figure.subplots()
    for at, row in enumerate(reversed(found)):
        pairs = row["pairs"]
        low, high = (pairs[end] if pairs[end] is not None else pairs["mean"] for end in ENDS)
        color = "C1" if row["name"].startswith("kv-") else "C0" if row["budget"] else "0.4"
        axes.plot([100 * low, 100 * high], [at, at], color=color, linewidth=1)
        axes.plot(100 * pairs["mean"], at, "o", color=color, markersize=4)
    names = [f"{row['name']} {row['budget'] or ''}" for row in reversed(found)]
    axes.set_yticks(range(len(found)), names, fontsize=7)
    axes.axvline(0, color="0.8", linewidth=0.8)
    axes.set_xlabel("net pairs of twins, %, with 95 % intervals")
    figure.savefig(path, dpi=150)


def main() -> None:
    """Run what is missing, print the table, and draw it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--budget", default="27,90,270")
    parser.add_argument("--moments", help="questions of `infthor-eval moments`, in place of twins")
    parser.add_argument("--limit", help="most questions")
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    asked = ["--model", "qwen2.5-vl-nano", "--quiet", "--tasks"]
    if arguments.moments is None:
        asked += ["nieh_mini_twins"]
    else:
        asked += ["nieh_moments", "--data", arguments.moments]
    if arguments.limit is not None:
        asked += ["--limit", arguments.limit]
    for name, words in commands(arguments.budget, asked):
        command = [str(Path(sys.executable).with_name("infthor-eval")), *words]
        subprocess.run([*command, "--out", str(arguments.out / name)], check=True)
    found = rows(arguments.out)
    print_table(found)
    if arguments.picture is not None:
        draw(found, arguments.picture)


if __name__ == "__main__":
    main()
