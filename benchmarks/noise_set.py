"""Input of benchmarks: frames of noise, and an NIEH set of one trajectory of them."""

import json
from pathlib import Path

import numpy as np
from PIL import Image

from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question

__all__ = ["question_texts", "write_frames", "write_set"]

_OBJECTS = ("mug", "plate", "apple", "pillow", "laptop", "candle", "bowl", "book")
_SIDE = 300  # pixels, as in the published data


def question_texts(count: int) -> list[str]:
    """Return this many different questions."""
    return [f"Did you see {number} {_OBJECTS[number % len(_OBJECTS)]}s?" for number in range(count)]


def write_frames(folder: Path, count: int, seed: int = 0) -> list[Path]:
    """Write different frames of coarse coloured noise, 300x300, into an existing folder."""
    draw = np.random.default_rng(seed)
    paths = [folder / f"{index:09d}.png" for index in range(count)]
    for path in paths:
        coarse = draw.integers(0, 256, (10, 10, 3), dtype=np.uint8)
        Image.fromarray(coarse).resize((_SIDE, _SIDE), Image.Resampling.BICUBIC).save(path)
    return paths


def write_set(root: Path, n_frames: int, n_questions: int) -> None:
    """Write an NIEH set of one trajectory; each question has one frame as its clue."""
    trajectory = root / "metadata" / "t"
    (trajectory / "img").mkdir(parents=True)
    names = [path.name for path in write_frames(trajectory / "img", n_frames)]
    entries = [
        {"img_idx": i, "img_filename": name, "step": i, "object_log": {}}
        for i, name in enumerate(names)
    ]
    (trajectory / "metadata.json").write_text(json.dumps(entries))
    questions = [
        Question("t", text, (number % n_frames,), ("yes",), "object_presence")
        for number, text in enumerate(question_texts(n_questions))
    ]
    write_questions(root / "qa_set.csv", questions)
