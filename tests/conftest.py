"""Fixtures that several packages' tests share."""

import json
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import hypothesis
import pytest
from PIL import Image

from infthor_eval.cli import main
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.runs import Catalog

from .helpers.browser import browser, open_page  # noqa: F401 - fixtures
from .helpers.command_line import (
    option_words,
    run_cli,  # noqa: F401 - a fixture
)
from .helpers.simulators import simulator  # noqa: F401 - a fixture
from .helpers.trajectories import MUG, cut_trajectory, write_trajectories
from .processor_times import read_slow_tests

# Before torch is imported, here and in processes that tests start: on a busy machine two threads
# that wait for each other take ten times as long as one.
os.environ["OMP_NUM_THREADS"] = "1"

# No property fails because the machine is busy: no deadline for an example, no complaint that
# making one takes long.
hypothesis.settings.register_profile(
    "unhurried", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("unhurried")

QUESTIONS = (
    Question("traj_a", "Is there a mug?", (1,), ("yes",), "object_presence"),
    Question(
        "traj_a",
        "Where was the mug before you put it?",
        (1, 3),
        ("CounterTop",),
        "object_location_tracing",
    ),
    Question("traj_a", "What did you put on the table?", (0, 2, 4), ("Mug", "Plate"), "put_action"),
    Question("traj_b", "Is there a fridge?", (2,), ("no",), "object_presence"),
    Question("traj_b", "Is there a sink?", (0,), ("no",), "object_presence"),
)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests that are slow by measurement."""
    slow = read_slow_tests()
    for item in items:
        if item.nodeid in slow:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(autouse=True)
def no_published_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests find no data set that the machine's user may have fetched."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def make_nieh_set(tmp_path: Path) -> Callable[..., Path]:
    """Writes an NIEH set of plain-coloured frames and returns its folder."""

    def make(
        questions: Sequence[Question] = QUESTIONS,
        n_frames: int = 6,
        size: int = 300,
        name: str = "set",
    ) -> Path:
        root = tmp_path / name
        for number, traj_id in enumerate(sorted({question.traj_id for question in questions})):
            images = root / "metadata" / traj_id / "img"
            images.mkdir(parents=True)
            entries = []
            for index in range(n_frames):
                filename = f"{index:09d}.png"
                shade = (40 * index % 256, 90 * number % 256, (17 * index + 60) % 256)
                Image.new("RGB", (size, size), shade).save(images / filename)
                entries.append(
                    {"img_idx": index, "img_filename": filename, "step": index, "object_log": {}}
                )
            (root / "metadata" / traj_id / "metadata.json").write_text(json.dumps(entries))
        write_questions(root / "qa_set_test.csv", questions)
        return root

    return make


@pytest.fixture(scope="session")
def scripted_data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the trajectory of `scripted_run`, of twelve plans."""
    return write_trajectories(
        tmp_path_factory.mktemp("trajectories") / "data", cut_trajectory(MUG, 12)
    )


@pytest.fixture(scope="session")
def scripted_run(tmp_path_factory: pytest.TempPathFactory, scripted_data: Path) -> Path:
    """The folder of a run of plans: the baseline `scripted` in one trajectory."""
    output = tmp_path_factory.mktemp("scripted")
    words = option_words(model="scripted", tasks="infthor_plans", data=scripted_data, out=output)
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    assert ended.value.code == 0
    (folder,) = (output / "scripted").iterdir()
    return folder


@pytest.fixture
def task_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the packaged task files that commands and runs of this process find instead; its
    folder."""
    folder = tmp_path / "tasks"
    shutil.copytree(Catalog.find_packaged().folder, folder)
    monkeypatch.setattr(Catalog, "find_packaged", classmethod(lambda cls: cls(folder)))
    return folder


@pytest.fixture(scope="session")
def make_clip(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Writes a tiny CLIP checkpoint with random weights and returns its folder."""

    def make(seed: int = 0) -> Path:
        import torch
        from tokenizers.processors import TemplateProcessing
        from transformers import CLIPConfig, CLIPModel
        from transformers.models.clip.image_processing_pil_clip import CLIPImageProcessorPil

        from model_adapters.tiny.tokenizer import train_tokenizer

        folder = tmp_path_factory.mktemp("clip")
        begin, end = "<|startoftext|>", "<|endoftext|>"
        tokenizer = train_tokenizer(
            [begin, end], begin=begin, end=end, pad=end, named={}, n_merged=300
        )
        tokenizer.backend_tokenizer.post_processor = TemplateProcessing(
            single=f"{begin} $A {end}", special_tokens=[(begin, 300), (end, 301)]
        )
        tokenizer.save_pretrained(folder)
        CLIPImageProcessorPil(size={"shortest_edge": 32}, crop_size=32).save_pretrained(folder)
        tower = {
            "hidden_size": 32,
            "intermediate_size": 64,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
        }
        ids = {
            "bos_token_id": 300,
            "eos_token_id": 301,
            "pad_token_id": 301,
            "max_position_embeddings": 77,
        }
        config = CLIPConfig(
            text_config={**tower, **ids, "vocab_size": len(tokenizer)},
            vision_config={**tower, "image_size": 32, "patch_size": 8},
            projection_dim=16,
            initializer_factor=20.0,  # so that similarities of different frames differ
        )
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            CLIPModel(config).save_pretrained(folder)
        return folder

    return make


@pytest.fixture
def write_video() -> Callable[..., None]:
    """Writes an mp4 of plain frames, each of the given grey level (0 to 255)."""

    def write(path: Path, greys: Sequence[int], fps: float = 10.0, size: int = 64) -> None:
        import cv2
        import numpy as np

        video = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), fps, (size, size))
        for grey in greys:
            video.write(np.full((size, size, 3), grey, np.uint8))
        video.release()

    return write
