"""Draw docs/needle.png, the picture of the README: frames of a bundled trajectory, a question on
them, two replies.

    python benchmarks/needle_picture.py

The replies are those of `infthor-eval --model qwen2.5-vl-nano,blind --tasks nieh_mini_gt`, strict
scorer.
"""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
from PIL import Image

FRAMES = Path(__file__).parents[1] / "infthor_eval/sets/nieh_mini/metadata/bedroom-1-seed7/img"
SHOWN = (5, 30, 52, 76, 81, 88)
CLUES = (76,)
QUESTION = "Where was the tennis racket before you picked it up?"
LINES = (
    ("gold answer", "desk", "#222222"),
    ("qwen2.5-vl-nano", "desk", "#2a7f3f"),
    ("blind", "cabinet", "#b03030"),
)


def main() -> None:
    """Write the picture into docs/."""
    mpl.rcParams["font.family"] = "DejaVu Sans"
    figure, axes = plt.subplots(1, len(SHOWN), figsize=(10, 2.55), dpi=120)
    figure.subplots_adjust(left=0.01, right=0.99, top=0.9, bottom=0.32, wspace=0.06)
    for axis, at in zip(axes, SHOWN, strict=True):
        axis.imshow(Image.open(FRAMES / f"{at:09d}.png"))
        axis.set_xticks([])
        axis.set_yticks([])
        is_clue = at in CLUES
        axis.set_title(f"frame {at}" + (" (clue)" if is_clue else ""), fontsize=8.5)
        for spine in axis.spines.values():
            spine.set(color="#d08a00" if is_clue else "#bbbbbb", linewidth=3 if is_clue else 1)
    figure.text(0.012, 0.2, QUESTION, fontsize=12, weight="bold")
    for place, (name, reply, colour) in zip((0.012, 0.19, 0.40), LINES, strict=True):
        figure.text(place, 0.06, f"{name}:", fontsize=10.5, color="#555555")
        figure.text(
            place + 0.0087 * len(name) + 0.012,
            0.06,
            reply,
            fontsize=10.5,
            color=colour,
            weight="bold",
        )
    figure.savefig(Path(__file__).parents[1] / "docs" / "needle.png", metadata={"Software": None})


if __name__ == "__main__":
    main()
