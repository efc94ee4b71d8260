"""Fixtures that several packages' tests share."""

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from PIL import Image

from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question

# Before torch is imported, here and in processes that tests start: on a busy machine two threads that wait for each
# other take ten times as long as one.
os.environ["OMP_NUM_THREADS"] = "1"

QUESTIONS = (
    Question("traj_a", "Is there a mug?", (1,), ("yes",), "object_presence"),
    Question("traj_a", "Where was the mug before you put it?", (1, 3), ("CounterTop",), "object_location_tracing"),
    Question("traj_a", "What did you put on the table?", (0, 2, 4), ("Mug", "Plate"), "put_action"),
    Question("traj_b", "Is there a fridge?", (2,), ("no",), "object_presence"),
    Question("traj_b", "Is there a sink?", (0,), ("no",), "object_presence"),
)


@pytest.fixture(autouse=True)
def no_published_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests find no data set that the machine's user may have fetched."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def make_nieh_set(tmp_path: Path) -> Callable[..., Path]:
    """Writes an NIEH set of plain-coloured frames and returns its folder."""

    def make(questions: Sequence[Question] = QUESTIONS, n_frames: int = 6, size: int = 300, name: str = "set") -> Path:
        root = tmp_path / name
        for number, traj_id in enumerate(sorted({question.traj_id for question in questions})):
            images = root / "metadata" / traj_id / "img"
            images.mkdir(parents=True)
            entries = []
            for index in range(n_frames):
                filename = f"{index:09d}.png"
                shade = (40 * index % 256, 90 * number % 256, (17 * index + 60) % 256)
                Image.new("RGB", (size, size), shade).save(images / filename)
                entries.append({"img_idx": index, "img_filename": filename, "step": index, "object_log": {}})
            (root / "metadata" / traj_id / "metadata.json").write_text(json.dumps(entries))
        write_questions(root / "qa_set_test.csv", questions)
        return root

    return make
