"""A training run in one process: it learns, and goes on from where it was."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import load_file

from infthor_eval.errors import DataError, ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.training.batches import collate
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.loop import Loop, LoopSettings, Progress
from infthor_eval.training.network import SequenceModel, freeze

from .twins import PAD, loaded, sequence, write_frames

ANSWERS = ("a mug", "a fork and a spoon", "no", "on the counter top", "yes")


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[FrameRef]:
    return write_frames(tmp_path_factory.mktemp("frames"), 5)


@pytest.fixture(scope="module")
def sequences(frames: list[FrameRef]) -> list[TrainingSequence]:
    checkpoint = loaded("qwen2.5-vl")
    return [
        sequence(checkpoint, [frame], answer, answer)
        for frame, answer in zip(frames, ANSWERS, strict=True)
    ]


def make_model() -> SequenceModel:
    network = SequenceModel(loaded("qwen2.5-vl"))
    freeze(network, ["vision", "embeddings"])
    return network


@pytest.fixture
def model() -> SequenceModel:
    return make_model()


Report = Callable[[Progress], None]


def _run(
    model: SequenceModel,
    sequences: list[TrainingSequence],
    folder: Path,
    report: Report | None = None,
    **changed: Any,
) -> None:
    usual = {"learning_rate": 3e-3, "max_steps": 5, "sequences_per_step": 2, "warmup_ratio": 0.2}
    settings = LoopSettings(**usual | changed)
    Loop(model, PAD, sequences, settings, folder, on_step=report).run()


def _dying_after(step: int) -> Report:
    def report(progress: Progress) -> None:
        if progress.step == step:
            raise KeyboardInterrupt

    return report


def test_the_loss_falls(model, sequences, tmp_path):
    steps: list[Progress] = []
    _run(model, sequences, tmp_path, steps.append, max_steps=20, sequences_per_step=5)
    assert [progress.step for progress in steps] == list(range(1, 21))
    assert steps[-1].loss < steps[0].loss / 4
    # The first of four steps of a warm-up has a part already.
    assert steps[0].learning_rate == pytest.approx(3e-3 / 5)
    assert steps[4].learning_rate == pytest.approx(3e-3)
    assert all(progress.tokens_per_second > 0 and progress.gradient_norm > 0 for progress in steps)
    assert not model.training


def test_a_run_that_was_killed_goes_on_to_the_same_weights(model, sequences, tmp_path):
    _run(model, sequences, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        _run(make_model(), sequences, tmp_path / "killed", _dying_after(4), save_every=3)
    again = make_model()
    steps: list[Progress] = []
    _run(again, sequences, tmp_path / "killed", steps.append)
    assert [progress.step for progress in steps] == [4, 5]
    whole, resumed = (
        load_file(tmp_path / name / "step-000005/model.safetensors") for name in ("whole", "killed")
    )
    torch.testing.assert_close(resumed, whole, rtol=0, atol=0)
    torch.testing.assert_close(again.state_dict(), model.state_dict(), rtol=0, atol=0)
    moments = [
        torch.load(tmp_path / name / "step-000005/optimizer.pt", weights_only=True)[0]["state"]
        for name in ("whole", "killed")
    ]
    for number, one in moments[0].items():
        assert torch.equal(one["exp_avg_sq"], moments[1][number]["exp_avg_sq"])


def test_the_last_checkpoint_alone_is_kept(model, sequences, tmp_path):
    _run(model, sequences, tmp_path, save_every=2)
    assert [place.name for place in tmp_path.iterdir()] == ["step-000005"]


def test_a_run_at_its_end_does_nothing(model, sequences, tmp_path):
    _run(model, sequences, tmp_path)
    steps: list[Progress] = []
    _run(model, sequences, tmp_path, steps.append)
    assert steps == []


def test_accumulated_sequences_weigh_by_their_tokens(model, sequences, tmp_path):
    steps: list[Progress] = []
    with torch.no_grad():
        expected = model(**collate(sequences, model.family, PAD))["loss"]
    _run(model, sequences, tmp_path, steps.append, max_steps=1, sequences_per_step=5)
    assert steps[0].loss == pytest.approx(expected.item(), rel=1e-5)


def test_frozen_parts_stay_as_they_are(model, sequences, tmp_path):
    before = {name: one.detach().clone() for name, one in model.named_parameters()}
    _run(model, sequences, tmp_path)
    for name, one in model.named_parameters():
        assert torch.equal(before[name], one) != one.requires_grad, name


def test_another_runs_checkpoint_is_refused(model, sequences, tmp_path):
    _run(model, sequences, tmp_path, max_steps=1)
    with pytest.raises(UsageError, match=r"is of a run with learning_rate=0\.003, not 0\.001"):
        _run(model, sequences, tmp_path, max_steps=1, learning_rate=1e-3)
    with pytest.raises(UsageError, match="is of a run with sequences="):
        _run(model, sequences[:2], tmp_path, max_steps=1)
    freeze(model, ["head"])
    with pytest.raises(UsageError, match="is of a run with n_trained="):
        _run(model, sequences, tmp_path, max_steps=1)


@pytest.mark.parametrize("name", ["model.safetensors", "optimizer.pt", "state.json"])
def test_a_damaged_checkpoint_is_one_line(model, sequences, tmp_path, name):
    _run(model, sequences, tmp_path, max_steps=1)
    (tmp_path / "step-000001" / name).write_bytes(b"broken")
    with pytest.raises(DataError, match="step-000001: cannot be read") as caught:
        _run(model, sequences, tmp_path, max_steps=1)
    assert "\n" not in str(caught.value)


def test_a_gradient_that_is_not_finite_ends_the_run(model, sequences, tmp_path):
    with torch.no_grad():
        model.model.get_output_embeddings().weight.fill_(float("inf"))
    with pytest.raises(ModelError, match="step 1: the gradient is not finite"):
        _run(model, sequences, tmp_path)


def test_a_run_without_sequences_is_refused(model, tmp_path):
    with pytest.raises(UsageError, match="there are no sequences to train on"):
        _run(model, [], tmp_path)
